"""What the layers of a texture hold, in pieces that a file can keep, whatever slots they are in.

A chunk is `CHUNK` entries beside each other. Its bytes in one channel are a mask of 16 bits that
says which of its bricks were written, and the texels of those that exist. Entries that are not
bricks are told by the layer's codes.
"""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..kernels.brick_packing import count_written, pack_bricks
from ..kernels.texture_lookup import ABSENT, FIRST_TILE
from .change import LayerState
from .layer import Layer
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


class Content:
    """Follows what a texture holds, so that only what changed is packed and hashed again.

    It knows bricks by their slots, so edits must be recorded, see `change.recording`.
    """

    def __init__(self, texture: VolumeTexture) -> None:
        self.texture = texture
        self._known: dict[int, _Known] = {}
        self._generation = -1

    def update(self) -> Iterator[tuple[ChunkKey, bytes]]:
        """Yield every chunk that changed since the last update, and its bytes.

        The digest is that of now once all have been taken.
        """
        texture = self.texture
        known = {}
        for layer in texture.layers:
            old = self._known.get(layer.number) or _Known(np.full_like(layer.slots, ABSENT))
            known[layer.number] = now = _Known(layer.slots.copy(), dict(old.digests))
            for key, data in self._changed(layer, old):
                if len(data) > 2:
                    now.digests[key.channel, key.chunk] = hashlib.sha256(data).digest()
                elif now.digests.pop((key.channel, key.chunk), None) is None:
                    continue
                yield key, data
        self._known = known
        self._generation = texture.pool.generation

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
            (layer_codes(self.texture, layer), self._known[layer.number].digests)
            for layer in layers
        ]
        return combined_digest(layer_list(self.texture), parts)

    def state(self) -> tuple[dict[int, _Known], int]:
        """What is known, for `restore_state` if an update came to nothing."""
        return self._known, self._generation

    def restore_state(self, state: tuple[dict[int, _Known], int]) -> None:
        """Forget the updates since `state`."""
        self._known, self._generation = state

    def _changed(self, layer: Layer, old: _Known) -> Iterator[tuple[ChunkKey, bytes]]:
        pool = self.texture.pool
        touched = layer.slots != old.slots
        bricks = layer.slots >= 0
        touched[bricks] |= pool.born[layer.slots[bricks]] > self._generation
        chunks = np.unique(np.flatnonzero(touched) // CHUNK)
        for channel in pool.arrays:
            for first in range(0, len(chunks), CHUNKS_AT_ONCE):
                part = chunks[first : first + CHUNKS_AT_ONCE]
                packed = pack_chunks(self.texture, layer, channel, part)
                for chunk, data in zip(part, packed, strict=True):
                    yield ChunkKey(layer.number, channel, int(chunk)), data


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


def layer_codes(texture: VolumeTexture, layer: Layer) -> bytes:
    """What is stored of every entry: ABSENT, BRICK, or a tile, numbered in order of appearance."""
    slots = layer.slots
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
    texture: VolumeTexture, layer: Layer, channel: str, chunks: np.ndarray
) -> list[bytes]:
    """The bytes of chunks; just an empty mask where nothing was written."""
    masks = texture.octree.tables.masks
    pool, nothing = texture.pool.arrays[channel], texture.channels[channel].nothing
    entries = (CHUNK * chunks[:, None] + np.arange(CHUNK)).ravel()
    entries = entries[entries < len(layer.slots)].astype(np.int32)
    entries = entries[layer.slots[entries] >= 0]
    counts = np.zeros(len(entries), np.int64)
    count_written(masks, entries, layer.slots[entries], pool, pool.dtype.type(nothing), counts)
    entries, counts = entries[counts > 0], counts[counts > 0]
    packed = np.empty(counts.sum(), pool.dtype)
    pack_bricks(masks, entries, layer.slots[entries], pool, packed)
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
