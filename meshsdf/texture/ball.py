"""Give all texels within a ball one colour."""

import numpy as np

from ..arrays import Number, Vector3
from ..errors import TextureError
from ..kernels.texture_lookup import ABSENT
from .layer import Layer
from .mip import update_mips
from .octree import Entries
from .refine import refine
from .volume_texture import Color, VolumeTexture


def paint_ball_on(
    texture: VolumeTexture,
    layer: Layer,
    center: list[Number] | tuple[Number, ...] | np.ndarray,
    radius: Number,
    color: Color,
    *,
    level: int = 0,
) -> None:
    """Give all texels of a layer within a ball one linear colour.

    Parameters
    ----------
    texture, layer : VolumeTexture, Layer
        The layer is one of the texture's.
    center : (3,) floats
        In the texture's space.
    radius : float
        At least 0; texels at this distance are within.
    color : 3 or 4 floats
        Linear RGB, and alpha (1 if left out).
    level : int
        The finest level that gets texels where there are none yet.

    Raises
    ------
    TextureError
        The ball is none, or there is no such level.
    """
    place = np.asarray(center, np.float64)
    where = "paint_ball_on(center=..., radius=...)"
    if place.shape != (3,) or not np.isfinite(place).all() or not 0 <= radius < np.inf:
        what = f"a ball of radius {radius} around {center} makes no sense"
        raise TextureError(what, where, "give three finite numbers and a radius of 0 or more")
    if not 0 <= level < texture.octree.n_levels:
        what = f"there is no level {level}"
        raise TextureError(what, where, f"use 0 ... {texture.octree.n_levels - 1}")
    texel = texture.encoded_color(color)
    near = _near(texture, place, float(radius))
    levels = texture.octree.tables.levels[near]
    refine(texture, layer, near[levels == level])
    stored = (levels <= level) & (layer.slots[near] != ABSENT)
    _color_within(texture, layer, near[stored], place, float(radius), texel)
    texture.collapse_uniform(layer, near[stored])
    update_mips(texture, layer, near[stored])


def _near(texture: VolumeTexture, center: Vector3, radius: float) -> Entries:
    """Entries of all levels with texels within a ball."""
    tables = texture.octree.tables
    spacing = tables.texel * 2.0 ** tables.levels[:, None]
    low = 8 * tables.bricks * spacing
    beyond = np.maximum(np.maximum(low - center, center - low - 7 * spacing), 0)
    near = (beyond**2).sum(axis=1) <= radius**2 * (1 + 1e-9)
    entries = np.flatnonzero(near).astype(np.int32)
    row, _, inside = _texels_within(texture, entries, center, radius)
    return entries[np.bincount(row[inside], minlength=len(entries)) > 0]


def _color_within(texture, layer: Layer, entries: Entries, center, radius, texel) -> None:
    row, bit, inside = _texels_within(texture, entries, center, radius)
    slots = texture.writable(layer, entries)
    texture.pool.use("base")[slots[row[inside]], bit[inside]] = texel


def _texels_within(texture, entries: Entries, center, radius) -> tuple[np.ndarray, ...]:
    """For every texel of the entries: which entry, which texel, and whether it is in the ball."""
    points, _ = texture.places(entries)
    inside = ((points - center) ** 2).sum(axis=1) <= radius**2
    masks = texture.octree.tables.masks[entries].view(np.uint8)
    row, bit = np.nonzero(np.unpackbits(masks, axis=1, bitorder="little"))
    return row, bit, inside
