"""Gzip frames of chunks that are constant but for a band: five times as fast as zlib's quickest.

Exact distances do not repeat, so searching for matches is lost work; all there is to gain are runs
of one value, and shorter codes for frequent bytes. One prefix code, made from a few chunks, serves
all of them. (Frames: Deutsch 1996, doi:10.17487/RFC1952. Codes: Huffman 1952,
doi:10.1109/JRPROC.1952.273898.)
"""

import heapq
import struct
import zlib
from collections.abc import Iterable

import numpy as np

from ..kernels.run_deflate import LONGEST, count_symbols, deflate_runs

_HEAD = bytes([0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 4, 255])  # no date, and quickly made
_N_SYMBOLS = 285  # literals, the end, and lengths of up to 257 bytes
_LEAST_SHARE = 1024  # of all symbols; a code is then no longer than 1.44 * log2(1024) < 15 bits
_LENGTH_CODES = 19


class RunPacker:
    """Packs chunks whose bytes are a multiple of 4.

    Parameters
    ----------
    samples : iterable of array
        Chunks like those to be packed.
    """

    def __init__(self, samples: Iterable[np.ndarray]) -> None:
        literals, matches = np.zeros(256, np.int64), np.zeros(LONGEST + 1, np.int64)
        for chunk in samples:
            count_symbols(_words(chunk), literals, matches)
        counts = np.zeros(_N_SYMBOLS, np.int64)
        counts[:256] = literals
        bases = [_length_symbol(4 * run) for run in range(1, LONGEST + 1)]
        for run, (symbol, _, _) in enumerate(bases, start=1):
            counts[symbol] += matches[run]
        lengths = _code_lengths(counts)
        codes = _codes(lengths)
        self._codes, self._lengths = codes[:257].copy(), lengths[:257].astype(np.uint64)
        # A match is its length, what that leaves open, and the only distance, one bit 0
        self._matches = np.zeros((2, LONGEST + 1), np.uint64)
        for run, (symbol, n_extra, extra) in enumerate(bases, start=1):
            self._matches[0, run] = int(codes[symbol]) | extra << int(lengths[symbol])
            self._matches[1, run] = lengths[symbol] + n_extra + 1
        bits, n_bits = _block_head(lengths)
        self._head = _HEAD + (bits & ((1 << n_bits // 8 * 8) - 1)).to_bytes(n_bits // 8, "little")
        self._held, self._n_held = bits >> n_bits // 8 * 8, n_bits % 8

    def pack(self, chunk: np.ndarray) -> bytes:
        """The gzip frame of a chunk."""
        words = _words(chunk)
        out = np.empty(8 * len(words) + 8, np.uint8)
        size = deflate_runs(
            *(words, self._codes, self._lengths, *self._matches, self._held, self._n_held, out)
        )
        check = struct.pack("<II", zlib.crc32(words.data.cast("B")), words.nbytes & 0xFFFFFFFF)
        return b"".join([self._head, out[:size].tobytes(), check])


def _words(chunk: np.ndarray) -> np.ndarray:
    data = np.ascontiguousarray(chunk, chunk.dtype.newbyteorder("<"))
    return data.reshape(-1).view(np.uint32)


def _length_symbol(n_bytes: int) -> tuple[int, int, int]:
    """Symbol of a match's length, how many bits tell the rest of it, and these bits."""
    symbol, base = 257, 3
    for n_extra in range(6):
        for _ in range(8 if n_extra == 0 else 4):
            if base <= n_bytes < base + (1 << n_extra):
                return symbol, n_extra, n_bytes - base
            symbol, base = symbol + 1, base + (1 << n_extra)
    raise ValueError(f"no match is {n_bytes} bytes long")


def _code_lengths(counts: np.ndarray) -> np.ndarray:
    """Bits of each symbol in a prefix code that is short where symbols are frequent."""
    counts = np.maximum(counts, max(1, int(counts.sum()) // _LEAST_SHARE))
    heap = [(int(count), number, [number]) for number, count in enumerate(counts)]
    heapq.heapify(heap)
    lengths = np.zeros(len(counts), np.int64)
    while len(heap) > 1:
        one, two = heapq.heappop(heap), heapq.heappop(heap)
        both = one[2] + two[2]
        lengths[both] += 1
        heapq.heappush(heap, (one[0] + two[0], min(one[1], two[1]), both))
    return lengths


def _codes(lengths: np.ndarray) -> np.ndarray:
    """The codes that deflate gives symbols of these lengths, first bit lowest."""
    codes, code = np.zeros(len(lengths), np.uint64), 0
    for length in range(1, int(lengths.max()) + 1):
        code <<= 1
        for symbol in np.flatnonzero(lengths == length):
            codes[symbol] = int(f"{code:0{length}b}"[::-1], 2)
            code += 1
    return codes


def _block_head(lengths: np.ndarray) -> tuple[int, int]:
    """Bits, and how many, that begin the last block and tell its code.

    The lengths of codes, 0 to 15, are told in 4 bits each, which is a prefix code as well; of the
    first four distances the last, 4, has a code.
    """
    fields = [(1, 1), (2, 2), (len(lengths) - 257, 5), (3, 5), (_LENGTH_CODES - 4, 4)]
    fields += [(0, 3)] * 3 + [(4, 3)] * 16  # 16 to 18, which tell repeats, are not used
    told = [*lengths.tolist(), 0, 0, 0, 1]
    fields += [(int(f"{length:04b}"[::-1], 2), 4) for length in told]
    bits = n_bits = 0
    for value, width in fields:
        bits |= value << n_bits
        n_bits += width
    return bits, n_bits
