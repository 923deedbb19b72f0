"""meshsdf.kernels.blosc_pack: frames that C-Blosc opens, never longer than what they hold."""

import struct

import numpy as np
import pytest

from meshsdf.kernels.blosc_frames import GOOD, open_frames
from meshsdf.kernels.blosc_pack import LARGEST_BLOCK, TABLE, pack_frames

WIDTHS = (1, 2, 4, 6, 8, 12, 16, 24)


def packed(parts: list[bytes], width: int) -> list[tuple[int, bytes]]:
    """Size as told, and bytes, for each part; with a margin behind that must stay."""
    data = np.frombuffer(bytearray().join(parts), np.uint8)
    ends = np.cumsum([len(part) for part in parts])
    out, sizes = np.full(len(data) + 64, 77, np.uint8), np.empty(len(parts), np.int64)
    scratch, table = np.empty(LARGEST_BLOCK, np.uint8), np.empty(TABLE, np.int32)
    last = pack_frames(data, ends, width, scratch, table, out[: len(data)], sizes)
    assert (out[len(data) :] == 77).all()
    stops = np.cumsum(np.abs(sizes))
    assert last == (stops[-1] if parts else 0)
    pieces = np.split(out[:last], stops[:-1])
    return [(int(size), piece.tobytes()) for size, piece in zip(sizes, pieces, strict=True)]


def examples(width: int):
    """Data of many lengths: noise, runs, waves, constants, and what repeats after a while."""
    random = np.random.default_rng(width)
    for n in (0, 1, 2, 5, 12, 13, 31, 127, 128, 129, 200, 512, 4096, 70000 // width + 3):
        yield random.bytes(n * width)
        yield (
            np.repeat(random.integers(0, 256, n // 9 + 1), 9 * width)[: n * width]
            .astype(np.uint8)
            .tobytes()
        )
        yield (np.sin(np.arange(n * width) / 40) * 99).astype(np.int8).tobytes()
        yield bytes(n * width)
        yield (random.bytes(70 * width) * (n // 70 + 1))[: n * width]


def opened(frame: bytes, size: int) -> tuple[int, bytes]:
    """State of one frame and what it gives."""
    target, states = np.empty(size, np.uint8), np.empty(1, np.uint8)
    spans = np.array([[0, len(frame)]]), np.array([[0, size]])
    source = np.frombuffer(bytearray(frame), np.uint8)
    open_frames(source, spans[0], target, spans[1], np.empty(size, np.uint8), states)
    return int(states[0]), target.tobytes()


@pytest.mark.parametrize("width", WIDTHS)
def test_what_is_packed_comes_back_and_is_shorter_or_a_copy(width):
    parts = list(examples(width))
    found = packed(parts, width)
    n_frames = 0
    for part, (size, piece) in zip(parts, found, strict=True):
        if size > 0:
            n_frames += 1
            assert len(piece) == size < len(part)
            assert opened(piece, len(part)) == (GOOD, part)
        else:
            assert (size, piece) == (-len(part), part)
    assert len(parts) / 4 < n_frames < len(parts)
    # A part is packed alike whatever stands before it
    assert [packed([part], width)[0] for part in parts] == found


@pytest.mark.parametrize("width", WIDTHS)
def test_c_blosc_opens_the_frames_and_packs_hardly_better(width):
    codec = pytest.importorskip("numcodecs.blosc")
    ours = theirs = 0
    for part in examples(width):
        ((size, piece),) = packed([part], width)
        if size > 0:
            assert codec.decompress(piece) == part
        frame = codec.compress(np.frombuffer(part, f"V{width}") if part else part, b"lz4", 9, 1)
        ours, theirs = ours + len(piece), theirs + min(len(frame), len(part))
    assert ours < 1.05 * theirs


def sequences(stream: bytes) -> list[tuple[int, int]]:
    """Literals and repeated bytes of every sequence of LZ4, read plainly."""
    at, found = 0, []
    while at < len(stream):
        token, at = stream[at], at + 1
        lengths = []
        for part in (token >> 4, token & 15):
            length, more = part, 255 if part == 15 else 0
            while more == 255:
                more, at = stream[at], at + 1
                length += more
            lengths.append(length)
            if len(lengths) == 1:
                at += length
                if at == len(stream):
                    return [*found, (length, 0)]
                at += 2
        found.append((lengths[0], lengths[1] + 4))
    raise AssertionError("the last sequence has no end")


def test_streams_keep_the_end_that_quick_readers_of_lz4_rely_on():
    n_streams = 0
    for part in examples(1):
        if not 128 <= len(part) <= LARGEST_BLOCK:
            continue
        ((size, piece),) = packed([part], 1)
        if size <= 0:
            continue
        begin, length = struct.unpack_from("<ii", piece, 16)
        found = sequences(piece[begin + 4 : begin + 4 + length])
        assert sum(map(sum, found)) == len(part)
        assert found[-1][0] >= 5
        last_begins = len(part) - sum(found[-1]) - (found[-2][1] if len(found) > 1 else 0)
        assert len(found) == 1 or last_begins <= len(part) - 12
        n_streams += 1
    assert n_streams > 10
