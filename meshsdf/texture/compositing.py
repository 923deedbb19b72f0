"""Several layers as one picture: what lies where, in every channel.

Base colours lie over one another with their blend modes, in linear light (`kernels.blending`).
Heights add up. Normals, and occlusion, roughness and metal, cover what is below. Each counts with
its alpha or coverage, times the layer's opacity, times its mask.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32

from ..errors import TextureError
from ..kernels.blending import MODES, NORMAL
from ..kernels.composite import add_up, lay_over
from ..kernels.node_values import known_slots, layer_values
from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.texel_places import put_texels
from ..kernels.texture_lookup import FIRST_TILE
from .channels import Numbers
from .layer import Layer
from .mip import used_channels
from .octree import Entries
from .volume_texture import VolumeTexture

BLEND_MODES = MODES
"""The names that `Layer.mode` may have."""

Masks = Float32[np.ndarray, "n 4"]

ENTRIES_PER_PIECE = 128  # of texels for two or three arrays that stay in the cache
FEWEST_FOR_THREADS = 48  # below, starting them costs more than it saves
WHOLE = np.ones((1, 4), np.float32)


def check_layers(layers: Sequence[Layer]) -> None:
    """TextureError unless every layer has a known blend mode and an opacity from 0 to 1."""
    for layer in layers:
        if layer.mode not in BLEND_MODES:
            what = f"layer {layer.name!r} has the unknown blend mode {layer.mode!r}"
            raise TextureError(what, "layer.mode", f"use one of {', '.join(BLEND_MODES)}")
        if not 0 <= layer.opacity <= 1:
            what = f"layer {layer.name!r} has the opacity {layer.opacity}"
            raise TextureError(what, "layer.opacity", "use a number from 0 to 1")


def compose(
    texture: VolumeTexture, layers: Sequence[Layer], entries: Entries, target: Layer
) -> None:
    """Store in entries of ``target`` what layers show together, bottom first, on nothing.

    Coarser levels are not brought up to date: see `mip.update_mips`.
    """
    own = np.empty((len(layers), len(entries)), np.int32)
    for layer, row in zip(layers, own, strict=True):
        known_slots(texture.octree.tables, layer.slots, entries, row)
    tiles = (own <= FIRST_TILE).all(axis=0)
    if tiles.any():
        _compose_tiles(texture, layers, own[:, tiles], entries[tiles], target)
    if not tiles.all():
        _compose_bricks(texture, layers, own[:, ~tiles], entries[~tiles], target)


def shown_texels(texture: VolumeTexture, slots, entries: Entries, name: str):
    """What a layer of these slots shows in a channel at the texels of entries, (t, 4), and where in
    it each entry's begin."""
    tables = texture.octree.tables
    first = texture.octree.texel_rows(entries)
    own, out = np.empty(len(entries), np.int32), np.empty((first[-1], 4), np.float32)
    known_slots(tables, slots, entries, own)
    pool, tiles = texture.pool.use(name), texture.tiles.arrays[name]
    layer_values(tables, slots, own, pool, tiles, texture.channels[name].kind, entries, first, out)
    return out, first


def _compose_tiles(texture, layers, codes, entries: Entries, target: Layer) -> None:
    """Where every layer shows a tile, the picture is one."""
    kinds, which = np.unique(codes.T, axis=0, return_inverse=True)
    tiles, names = texture.tiles, used_channels(texture)
    values = {
        name: [texture.channels[name].decoded(tiles.arrays[name][FIRST_TILE - column])
               for column in kinds.T]
        for name in names
    }  # fmt: skip
    masks = values.get("mask", [WHOLE] * len(layers))
    texels = {
        name: texture.channels[name].encoded(_laid(layers, name, values[name], masks, len(kinds)))
        for name in names
        if name != "mask"
    }
    made = [tiles.code({name: column[i] for name, column in texels.items()})
            for i in range(len(kinds))]  # fmt: skip
    texture.pool.drop(target.slots[entries])
    target.slots[entries] = np.array(made, np.int32)[which.ravel()]


def _compose_bricks(texture, layers, own, entries: Entries, target: Layer) -> None:
    """Texel by texel, piece by piece."""
    slots = texture.writable(target, entries)
    names = used_channels(texture)
    pools = {name: texture.pool.use(name) for name in names}
    tables = texture.octree.tables
    n_pieces = max(-(-len(entries) // ENTRIES_PER_PIECE), len(entries) >= FEWEST_FOR_THREADS and 2)
    ranges = even_ranges(len(entries), n_pieces)

    def shown(name: str, number: int, begin: int, end: int, first: np.ndarray) -> Numbers:
        out = np.empty((first[-1], 4), np.float32)
        tiles, kind = texture.tiles.arrays[name], texture.channels[name].kind
        layer_values(
            tables, layers[number].slots, own[number, begin:end], pools[name], tiles, kind,
            entries[begin:end], first, out,
        )  # fmt: skip
        return out

    def work(piece: int) -> None:
        begin, end = ranges[piece]
        part = entries[begin:end]
        first = texture.octree.texel_rows(part)
        masks = [WHOLE] * len(layers)
        if "mask" in names:
            masks = [shown("mask", i, begin, end, first) for i in range(len(layers))]
        for name in names:
            if name != "mask":
                values = (shown(name, i, begin, end, first) for i in range(len(layers)))
                whole = _laid(layers, name, values, masks, int(first[-1]))
                kind = texture.channels[name].kind
                put_texels(
                    tables, part, slots[begin:end], first, 0, end - begin, kind, whole, pools[name]
                )

    run_pieces(work, len(ranges))


def _laid(layers: Sequence[Layer], name: str, values, masks, n: int) -> Numbers:
    """(n, 4) of a channel, all layers together."""
    below = np.zeros((n, 4), np.float32)
    for layer, above, mask in zip(layers, values, masks, strict=True):
        opacity = np.float32(layer.opacity)
        if name == "height":
            add_up(above, mask, opacity, below)
        else:
            mode = MODES.index(layer.mode) if name == "base" else NORMAL
            lay_over(mode, above, mask, opacity, below)
    return below
