"""Bricks that nothing shows, put by: the texels that exist side by side, and compressed.

A brick of the pool has room for 512 texels, of which about a third exist. What only the history
needs is packed, compressed (zlib, level 1) and given to a `Spill`. Every piece stands alone: it
becomes the same bricks again whatever has happened to the layers since.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int32

from ..kernels.brick_packing import count_written, pack_bricks, unpack_bricks
from ..kernels.parallel import run_pieces
from .blobs import Damaged, pack, unpack
from .octree import Entries
from .spill import Spill
from .volume_texture import VolumeTexture

Slots = Int32[np.ndarray, " n"]

PIECE = 256  # entries; 80 KB of texels, about 10 KB when they are compressed
PIECES_AT_ONCE = 64
FEWEST_FOR_THREADS = 8  # pieces; below, starting them costs more than it saves
BRICK = 0  # among the codes of a piece; the others are as in `Layer.slots`
HEAD = np.dtype(np.int32)


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """Entries of one layer and what they stored, in a `Spill`."""

    spill: Spill
    number: int
    codec: int
    crc: int
    n_bytes: int
    n_entries: int
    n_bricks: int

    def free(self) -> None:
        """Forget it."""
        self.spill.free(self.number)


def put_by(texture: VolumeTexture, entries: Entries, slots: Slots, spill: Spill) -> list[Piece]:
    """Keep what entries store in slots of the texture's pool, or as tiles, or not at all.

    Notes
    -----
    Cost: about 15 ns a texel on one core; all cores are used where there are several pieces.
    """
    found: list[Piece] = []
    for begin in range(0, len(entries), PIECE * PIECES_AT_ONCE):
        end = min(begin + PIECE * PIECES_AT_ONCE, len(entries))
        parts = [slice(at, min(at + PIECE, end)) for at in range(begin, end, PIECE)]
        blobs: list = [None] * len(parts)

        def work(piece: int, parts: list[slice] = parts, blobs: list = blobs) -> None:
            part = parts[piece]
            blobs[piece] = pack(_packed(texture, entries[part], slots[part]))

        _run(work, len(parts))
        for part, (codec, crc, data) in zip(parts, blobs, strict=True):
            n_bricks = int(np.count_nonzero(slots[part] >= 0))
            number = spill.put(data)
            n = part.stop - part.start
            found.append(Piece(spill, number, codec, crc, len(data), n, n_bricks))
    return found


def bring_back(texture: VolumeTexture, pieces: Sequence[Piece]) -> tuple[Entries, Slots]:
    """The entries of pieces, and what they stored: bricks in new slots that are held once.

    Raises
    ------
    Damaged
        What the file gives back is not what was put there; then no slot was taken.
    """
    nothing = np.empty(0, np.int32)
    if not pieces:
        return nothing, nothing
    data: list[bytes] = [b""] * len(pieces)
    try:
        stored = [piece.spill.get(piece.number) for piece in pieces]
    except OSError as error:
        raise Damaged(f"bricks that were put by cannot be read: {error}") from None

    def work(number: int) -> None:
        piece = pieces[number]
        data[number] = unpack((piece.codec, piece.crc, stored[number]), "a piece that was put by")

    _run(work, len(pieces))
    pool = texture.pool
    pool.reserve(sum(piece.n_bricks for piece in pieces))
    # Whoever follows slots knows by their generation that those hold something new
    pool.begin_recording()
    pool.end_recording()
    found = [_unpacked(texture, one) for one in data]
    entries = np.concatenate([entries for entries, _ in found])
    return entries, np.concatenate([slots for _, slots in found])


def _run(work: Callable[[int], None], n_pieces: int) -> None:
    if n_pieces >= FEWEST_FOR_THREADS:
        run_pieces(work, n_pieces)
        return
    for piece in range(n_pieces):
        work(piece)


def _packed(texture: VolumeTexture, entries: Entries, slots: Slots) -> bytes:
    """Number of entries, entries, codes; of every channel its number, number of texels, a bit for
    every brick that was written, and the texels of these."""
    codes = np.where(slots >= 0, BRICK, slots).astype(HEAD)
    parts = [np.array([len(entries)], HEAD), entries.astype(HEAD), codes]
    bricks = slots >= 0
    entries, slots = entries[bricks], slots[bricks]
    masks, counts = texture.octree.tables.masks, np.empty(len(entries), np.int64)
    for number, (name, channel) in enumerate(texture.channels.items()):
        array = texture.pool.arrays.get(name)
        if array is None:
            continue
        count_written(masks, entries, slots, array, channel.dtype.type(channel.nothing), counts)
        written = counts > 0
        if written.any():
            texels = np.empty(counts.sum(), array.dtype)
            pack_bricks(masks, entries[written], slots[written], array, texels)
            head = np.array([number, len(texels)], HEAD)
            parts += [head, np.packbits(written), texels]
    return b"".join(part.tobytes() for part in parts)


def _unpacked(texture: VolumeTexture, data: bytes) -> tuple[Entries, Slots]:
    masks, channels = texture.octree.tables.masks, list(texture.channels.values())
    n = int(np.frombuffer(data, HEAD, 1)[0])
    entries = np.frombuffer(data, HEAD, n, 4).astype(np.int32)
    slots = np.frombuffer(data, HEAD, n, 4 + 4 * n).astype(np.int32)
    bricks = np.flatnonzero(slots == BRICK)
    slots[bricks] = texture.pool.take(len(bricks))
    at = 4 + 8 * n
    while at < len(data):
        number, n_texels = np.frombuffer(data, HEAD, 2, at).tolist()
        bits = np.frombuffer(data, np.uint8, -(-len(bricks) // 8), at + 8)
        written = bricks[np.unpackbits(bits, count=len(bricks)).astype(bool)]
        at += 8 + len(bits)
        channel = channels[number]
        # Writable, so that the kernel is not compiled anew
        texels = np.frombuffer(data, channel.dtype, n_texels, at).copy()
        at += texels.nbytes
        pool = texture.pool.use(channel.name)
        unpack_bricks(masks, entries[written], slots[written], texels, pool)
    return entries, slots
