"""What the layers of a texture hold, in pieces that a file can keep, whatever slots they are in.

A chunk is `CHUNK` entries beside each other. Its bytes in one channel are a mask of 16 bits that
says which of its bricks were written, and the texels of those that exist. Entries that are not
bricks are told by the layer's codes.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..kernels.brick_packing import count_written, pack_bricks
from ..kernels.texture_lookup import ABSENT, FIRST_TILE
from .change import LayerState
from .pool import Slots
from .volume_texture import VolumeTexture

CHUNK = 16
CHUNKS_AT_ONCE = 256  # packed in one go
BRICK = 0  # among a layer's codes


@dataclass(frozen=True)
class ChunkKey:
    """Which chunk of which channel of which layer."""

    layer: int
    channel: str
    chunk: int


@dataclass
class _Known:
    """What a layer was like at the last `update`."""

    slots: np.ndarray
    digests: dict[tuple[str, int], bytes] = field(default_factory=dict)


class Frozen:
    """What the layers hold at one moment, whatever is done to them later.

    The owner of the texture makes it and lets go of it; in between, any thread may read it.

    Attributes
    ----------
    listed : str
        The layers without their slots, see `layer_list`.
    known : dict of int to _Known
        By the layers' numbers; the digests are those of the moment once all of `chunks` were taken.
    new : list of int
        Layers that were not there when the one before was taken.
    generation : int
        Of the pool; slots that are taken later are of later ones.
    """

    def __init__(
        self, texture: VolumeTexture, before: dict[int, _Known], since: int, slots_of: Mapping
    ) -> None:
        self.texture, self.listed = texture, layer_list(texture)
        pool = texture.pool
        self.generation = pool.generation
        pool.begin_recording()
        pool.end_recording()
        self._channels = list(pool.arrays)
        self._touched: dict[int, np.ndarray] = {}
        self._held: list[Slots] = []
        self.known: dict[int, _Known] = {}
        self.new = [layer.number for layer in texture.layers if layer.number not in before]
        for layer in texture.layers:
            slots = slots_of.get(layer.number, layer.slots).copy()
            old = before.get(layer.number) or _Known(np.full_like(slots, ABSENT))
            touched, bricks = slots != old.slots, slots >= 0
            touched[bricks] |= pool.born[slots[bricks]] > since
            chunks = np.unique(np.flatnonzero(touched) // CHUNK)
            self.known[layer.number] = _Known(slots, dict(old.digests))
            self._touched[layer.number] = chunks
            # What is held is never written
            self._held.append(slots[_entries_of(chunks, len(slots))])
            pool.hold(self._held[-1])

    def chunks(self) -> Iterator[tuple[ChunkKey, bytes]]:
        """Every chunk that is not as it was when the one before was taken, and its bytes."""
        for number, now in self.known.items():
            for key, data in self._packed(number, now.slots):
                if len(data) > 2:
                    now.digests[key.channel, key.chunk] = hashlib.sha256(data).digest()
                elif now.digests.pop((key.channel, key.chunk), None) is None:
                    continue
                yield key, data

    def codes(self) -> dict[int, bytes]:
        """What is stored of every layer's entries, see `layer_codes`."""
        return {number: layer_codes(self.texture, one.slots) for number, one in self.known.items()}

    def digest(self, codes: dict[int, bytes]) -> str:
        """SHA-256 of all of it, once all of `chunks` were taken."""
        parts = [(codes[number], one.digests) for number, one in self.known.items()]
        return combined_digest(self.listed, parts)

    def release(self) -> None:
        """Let go of it."""
        for slots in self._held:
            self.texture.pool.drop(slots)
        self._held = []

    def _packed(self, number: int, slots: Slots) -> Iterator[tuple[ChunkKey, bytes]]:
        chunks = self._touched[number]
        for channel in self._channels:
            for first in range(0, len(chunks), CHUNKS_AT_ONCE):
                part = chunks[first : first + CHUNKS_AT_ONCE]
                packed = pack_chunks(self.texture, slots, channel, part)
                for chunk, data in zip(part, packed, strict=True):
                    yield ChunkKey(number, channel, int(chunk)), data


class Content:
    """Follows what a texture holds, so that only what changed is packed and hashed again.

    It knows bricks by their slots, so edits must be recorded, see `change.recording`.
    """

    def __init__(self, texture: VolumeTexture) -> None:
        self.texture = texture
        self._known: dict[int, _Known] = {}
        self._generation = -1

    def freeze(self, slots_of: Mapping[int, Slots] | None = None) -> Frozen:
        """What the layers hold now, beside what is known.

        Parameters
        ----------
        slots_of : mapping of int to (e,) int32, optional
            What stands for the slots of some layers; somebody holds them.
        """
        return Frozen(self.texture, self._known, self._generation, slots_of or {})

    def know_frozen(self, frozen: Frozen) -> None:
        """Take what was frozen, whose chunks were all taken, as known."""
        self._known, self._generation = frozen.known, frozen.generation

    def update(self) -> Iterator[tuple[ChunkKey, bytes]]:
        """Yield every chunk that changed since the last update, and its bytes.

        The digest is that of now once all have been taken.
        """
        frozen = self.freeze()
        try:
            yield from frozen.chunks()
            self.know_frozen(frozen)
        finally:
            frozen.release()

    def know(self, digests: dict[int, dict[tuple[str, int], bytes]]) -> None:
        """Take what the layers hold now as known, with the digests of their chunks."""
        self._known = {
            layer.number: _Known(layer.slots.copy(), digests[layer.number])
            for layer in self.texture.layers
        }
        self._generation = self.texture.pool.generation

    def digest(self) -> str:
        """SHA-256 of all that the layers hold, as of the last update."""
        layers = self.texture.layers
        parts = [
            (layer_codes(self.texture, layer.slots), self._known[layer.number].digests)
            for layer in layers
        ]
        return combined_digest(layer_list(self.texture), parts)


def digest(texture: VolumeTexture) -> str:
    """SHA-256 of all that a texture's layers hold: texels, names, order and attributes.

    It does not depend on where in memory bricks are, nor on how they came about.
    """
    content = Content(texture)
    for _ in content.update():
        pass
    return content.digest()


def combined_digest(listed: str, layers: list[tuple[bytes, dict[tuple[str, int], bytes]]]) -> str:
    """SHA-256 of the list of layers, and of every one's codes and digests of chunks."""
    whole = hashlib.sha256(listed.encode())
    for codes, digests in layers:
        whole.update(codes)
        for (channel, chunk), one in sorted(digests.items()):
            whole.update(f"{channel} {chunk} ".encode() + one)
    return whole.hexdigest()


def layer_list(texture: VolumeTexture) -> str:
    """The layers without their slots, as JSON, bottom first, and the number of the next one."""
    layers = [LayerState.of(layer).attributes for layer in texture.layers]
    return json.dumps({"layers": layers, "next": texture._next_number}, sort_keys=True)


def layer_codes(texture: VolumeTexture, slots: Slots) -> bytes:
    """What is stored of every entry: ABSENT, BRICK, or a tile, numbered in order of appearance."""
    is_tile = slots <= FIRST_TILE
    tiles, first, number = np.unique(slots[is_tile], return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    codes = np.where(slots == ABSENT, ABSENT, BRICK).astype("<i4")
    codes[is_tile] = FIRST_TILE - rank[number]
    rows = FIRST_TILE - tiles[order]
    texels = [
        array[rows].astype(array.dtype.newbyteorder("<")).tobytes()
        for array in texture.tiles.arrays.values()
    ]
    return b"".join([np.array(len(rows), "<i4").tobytes(), codes.tobytes(), *texels])


def pack_chunks(
    texture: VolumeTexture, slots: Slots, channel: str, chunks: np.ndarray
) -> list[bytes]:
    """The bytes of chunks; just an empty mask where nothing was written."""
    masks = texture.octree.tables.masks
    pool, nothing = texture.pool.arrays[channel], texture.channels[channel].nothing
    entries = _entries_of(chunks, len(slots))
    entries = entries[slots[entries] >= 0]
    counts = np.zeros(len(entries), np.int64)
    count_written(masks, entries, slots[entries], pool, pool.dtype.type(nothing), counts)
    entries, counts = entries[counts > 0], counts[counts > 0]
    packed = np.empty(counts.sum(), pool.dtype)
    pack_bricks(masks, entries, slots[entries], pool, packed)
    data = packed.astype(pool.dtype.newbyteorder("<"), copy=False).tobytes()
    ends = np.concatenate([[0], np.cumsum(counts)]) * pool.itemsize
    place = np.searchsorted(entries, CHUNK * chunks)
    place = np.concatenate([place, [len(entries)]])
    out = []
    for i in range(len(chunks)):
        begin, end = place[i], place[i + 1]
        mask = int((1 << (entries[begin:end] % CHUNK)).sum())
        out.append(mask.to_bytes(2, "little") + data[ends[begin] : ends[end]])
    return out


def _entries_of(chunks: np.ndarray, n_entries: int) -> np.ndarray:
    """The entries of some chunks."""
    entries = (CHUNK * chunks[:, None] + np.arange(CHUNK)).ravel()
    return entries[entries < n_entries].astype(np.int32)
