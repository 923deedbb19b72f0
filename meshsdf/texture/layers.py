"""Layers of a texture seen as one: shown together, flattened, or merged."""

from collections.abc import Sequence

import numpy as np

from ..errors import TextureError
from .compositing import BLEND_MODES, check_layers, compose
from .flattened import Flattened, empty_layer, visible_layers
from .layer import Layer
from .mip import update_mips
from .procedural_layer import ProceduralLayer, fill
from .volume_texture import VolumeTexture

__all__ = ["BLEND_MODES", "Flattened", "flatten", "merge_down", "shown"]


def shown(texture: VolumeTexture) -> Layer:
    """What is seen of a texture: its only visible layer, or a picture of several.

    A layer that is alone, opaque and without a mask is used as it is, without copying.

    Raises
    ------
    TextureError
        A visible layer's blend mode or opacity makes no sense.
    """
    layers = visible_layers(texture)
    kept = texture.flattened
    if len(layers) == 1 and layers[0].opacity == 1 and not _has_masks(texture):
        if kept is not None:
            kept.release()
            texture.flattened = None
        return layers[0]
    if kept is None:
        kept = texture.flattened = Flattened(texture)
    return kept.up_to_date()


def flatten(texture: VolumeTexture) -> Layer:
    """Put one layer in the place of all: what is seen. Hidden layers are gone."""
    _evaluate_all(texture, visible_layers(texture))
    picture = shown(texture)
    slots = picture.slots.copy()
    texture.pool.hold(slots)
    layer = texture.add_layer("flattened")
    texture.pool.drop(layer.slots)
    layer.slots[:] = slots
    for other in texture.layers[:-1]:
        texture.drop_layer(other)
    return layer


def merge_down(texture: VolumeTexture, layer: Layer) -> Layer:
    """Lay a layer over the one below it and keep the two as one, which keeps the lower one's mode.

    The picture stays the same, to the rounding of texels, if both modes are normal; else the upper
    one no longer sees what lies below the two.

    Raises
    ------
    TextureError
        There is none below, or one of the two is hidden.
    """
    place = texture.layers.index(layer)
    if place == 0:
        what = f"{layer.name!r} is the lowest layer"
        raise TextureError(what, "merge_down(layer)", "move it up first")
    below = texture.layers[place - 1]
    for one in (below, layer):
        if not one.visible:
            what = f"layer {one.name!r} is hidden"
            raise TextureError(what, "merge_down(layer)", "show it, or drop it")
    check_layers([below, layer])
    _evaluate_all(texture, [below, layer])
    merged = empty_layer(texture)
    entries = np.union1d(below.stored, layer.stored).astype(np.int32)
    compose(texture, [below, layer], entries, merged)
    update_mips(texture, merged, entries)
    texture.pool.drop(below.slots)
    below.slots[:] = merged.slots
    below.opacity = 1.0
    if isinstance(below, ProceduralLayer):
        below.function = None
    texture.drop_layer(layer)
    return below


def _evaluate_all(texture: VolumeTexture, layers: Sequence[Layer]) -> None:
    everything = np.arange(texture.octree.n_entries, dtype=np.int32)
    for layer in layers:
        if isinstance(layer, ProceduralLayer) and layer.function is not None:
            fill(texture, layer, everything)


def _has_masks(texture: VolumeTexture) -> bool:
    whole = texture.channels["mask"].nothing
    tiles = texture.tiles.arrays["mask"][: len(texture.tiles)]
    return "mask" in texture.pool.arrays or bool((tiles != whole).any())
