"""Read what a texture's layers held from a project's file; `checkpoint_write` writes it.

A checkpoint is made of the latest row of every chunk up to its own operation.
"""

import hashlib
import json
import sqlite3
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..kernels.brick_packing import unpack_bricks
from ..kernels.parallel import run_pieces
from ..kernels.texture_lookup import ABSENT, FIRST_TILE
from .blobs import Damaged, unpack
from .content import BRICK, CHUNK, combined_digest
from .layer import Layer
from .volume_texture import VolumeTexture

PIECES = 16

CHUNKS = """
SELECT layer, channel, chunk, MAX(seq), codec, crc32, data FROM brick
WHERE seq <= ? GROUP BY layer, channel, chunk
"""


@dataclass
class LoadedLayer:
    """A layer as a checkpoint has it, its bricks in the pool."""

    attributes: dict[str, Any]
    slots: np.ndarray
    codes: bytes
    digests: dict[tuple[str, int], bytes] = field(default_factory=dict)


@dataclass
class Loaded:
    """What a checkpoint says; `install` puts it into the texture."""

    seq: int
    tip: int
    layers: list[LoadedLayer]
    next_number: int


def load_checkpoint(connection: sqlite3.Connection, texture: VolumeTexture, seq: int) -> Loaded:
    """Read a checkpoint and check it; its bricks take slots of the texture's pool.

    Raises
    ------
    Damaged
        It does not hold what was written.
    """
    found = connection.execute("SELECT tip, sha256, layers FROM checkpoint WHERE seq = ?", (seq,))
    tip, sha256, listed = found.fetchone()
    layers: dict[int, LoadedLayer] = {}
    try:
        plain = json.loads(listed)
        codes = {one["number"]: _codes(connection, seq, one["number"]) for one in plain["layers"]}
        n_bricks = sum(_is_brick(texture, data).sum() for data in codes.values())
        texture.pool.reserve(int(n_bricks))
        for attributes in plain["layers"]:
            number = attributes["number"]
            layers[number] = _empty_layer(texture, attributes, codes[number])
        loaded = Loaded(seq, tip, list(layers.values()), int(plain["next"]))
        _load_bricks(texture, layers, connection.execute(CHUNKS, (seq,)).fetchall())
        parts = [(one.codes, one.digests) for one in loaded.layers]
        if combined_digest(listed, parts) != sha256:
            raise Damaged("its SHA-256 differs from what was written")
    except (Damaged, KeyError, TypeError, ValueError, sqlite3.Error) as error:
        for one in layers.values():
            texture.pool.drop(one.slots)
        raise Damaged(f"checkpoint {seq}: {error}") from None
    return loaded


def install(texture: VolumeTexture, loaded: Loaded | None) -> None:
    """Let the texture's layers be those of a checkpoint; none if None."""
    for layer in list(texture.layers):
        texture.drop_layer(layer)
    texture._next_number = loaded.next_number if loaded else 0
    for one in loaded.layers if loaded else []:
        texture.layers.append(texture.revived(Layer(slots=one.slots, **one.attributes)))


def _codes(connection: sqlite3.Connection, seq: int, number: int) -> bytes:
    row = connection.execute(
        "SELECT codec, crc32, data FROM layer WHERE seq = ? AND number = ?", (seq, number)
    ).fetchone()
    if row is None:
        raise Damaged(f"layer {number} is missing")
    return unpack(row, f"layer {number}")


def _is_brick(texture: VolumeTexture, data: bytes) -> np.ndarray:
    return np.frombuffer(data, "<i4", texture.octree.n_entries, 4) == BRICK


def _empty_layer(texture: VolumeTexture, attributes: dict, data: bytes) -> LoadedLayer:
    """The layer with its tiles, and slots for its bricks."""
    n_tiles = int(np.frombuffer(data, "<i4", 1)[0])
    codes = np.frombuffer(data, "<i4", texture.octree.n_entries, 4)
    at = 4 + codes.nbytes
    texels: dict[str, np.ndarray] = {}
    for name, array in texture.tiles.arrays.items():
        texels[name] = np.frombuffer(data, array.dtype.newbyteorder("<"), n_tiles, at)
        at += texels[name].nbytes
    tiles = [
        texture.tiles.code({name: array[row] for name, array in texels.items()})
        for row in range(n_tiles)
    ]
    slots = codes.astype(np.int32)
    is_tile = codes <= FIRST_TILE
    slots[is_tile] = np.array([ABSENT, *tiles], np.int32)[FIRST_TILE - codes[is_tile] + 1]
    is_brick = _is_brick(texture, data)
    slots[is_brick] = texture.pool.take(int(is_brick.sum()))
    return LoadedLayer(attributes, slots, data)


def _load_bricks(texture: VolumeTexture, layers: dict[int, LoadedLayer], rows: list) -> None:
    """Unpack chunks into the slots of their bricks, on all cores."""
    rows = [row for row in rows if row[0] in layers]
    for channel in {row[1] for row in rows}:
        texture.pool.use(channel)
    digests: list[bytes | None] = [None] * len(rows)

    def work(piece: int) -> None:
        for i in range(piece, len(rows), PIECES):
            digests[i] = _load_chunk(texture, layers[rows[i][0]], rows[i])

    run_pieces(work, PIECES)
    for row, digest in zip(rows, digests, strict=True):
        if digest is not None:
            layers[row[0]].digests[row[1], row[2]] = digest


def _load_chunk(texture: VolumeTexture, layer: LoadedLayer, row: tuple) -> bytes | None:
    """Unpack one chunk and return its digest; None if it was not needed."""
    _, channel, chunk, _, *blob = row
    what = f"chunk {chunk} of {channel}"
    slots = layer.slots[CHUNK * chunk : CHUNK * (chunk + 1)]
    data = unpack(tuple(blob), what)
    mask = int.from_bytes(data[:2], "little")
    entries = np.array([i for i in range(CHUNK) if mask >> i & 1], np.int32)
    if not len(entries) or entries[-1] >= len(slots) or (slots[entries] < 0).all():
        return None
    pool, masks = texture.pool.arrays[channel], texture.octree.tables.masks
    # Writable, so that the kernel is not compiled anew
    packed = np.frombuffer(data, pool.dtype.newbyteorder("<"), offset=2).astype(pool.dtype)
    slots, entries = slots[entries], entries + np.int32(CHUNK * chunk)
    first = texture.octree.tables.texel_first
    n_texels = int((first[entries + 1] - first[entries]).sum())
    if (slots < 0).any() or len(packed) != n_texels:
        raise Damaged(f"{what} does not fit its bricks")
    unpack_bricks(masks, entries, slots, packed, pool)
    return hashlib.sha256(data).digest()
