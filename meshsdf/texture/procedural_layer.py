"""Layers that a function of space fills, brick by brick, when they are first looked at.

A brick of level l is evaluated with the spacing of level l as footprint, so a layer refines for
free wherever somebody looks closer, and every level is as free of aliasing as the function is.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Points
from ..kernels.octree_tables import ANY_PART, FIRST_GROUP
from ..kernels.texture_lookup import ABSENT
from .change import same_texels
from .layer import Layer
from .lookup import Footprint
from .mip import evaluated
from .octree import Entries, Parts
from .refine import refine
from .volume_texture import Normals, VolumeTexture

FARTHEST = 2.0**50  # texels from the origin
ENTRIES_PER_CALL = 1024  # of the function: about 200 000 points
CORNERS = np.indices((2, 2, 2)).reshape(3, 8).T
SELF, STEPS = 13, np.array([9, 3, 1])  # how `OctreeTables.neighbors` numbers the bricks beside


@dataclass(eq=False)
class ProceduralLayer(Layer):
    """A layer whose bricks come from a function.

    Attributes
    ----------
    function : callable
        As `mip.bake` takes it. It must give the same for the same points at any time.
    """

    function: Callable[..., Any] | None = None


def add_procedural(
    texture: VolumeTexture, name: str, function: Callable[..., Any]
) -> ProceduralLayer:
    """Put a layer on top that shows what a function says of every point.

    Parameters
    ----------
    texture : VolumeTexture
        Gets the layer.
    name : str
        Of the layer.
    function : callable
        ``f(points)`` or ``f(points, normals)``, with or without an argument ``footprint`` (the
        spacing of texels); gives (n, 4): linear colours with alpha. All of `procedural` will do.

    Raises
    ------
    TextureError
        The function gives something else.

    Notes
    -----
    Cost: of adding it, the coarsest level alone. `VolumeTexture.colors` evaluates the bricks around
    the points that are asked for; later they are looked up.
    Limits: what is painted onto the layer stays, but a brick that was not evaluated before the
    paint reached it shows what coarser levels do.

    Examples
    --------
    >>> from meshsdf.mesh import icosphere
    >>> from meshsdf.texture.procedural import procedural
    >>> texture = VolumeTexture.around(icosphere(subdivisions=2), resolution=64)
    >>> layer = add_procedural(texture, "stone", procedural("marble"))
    >>> color = texture.colors(np.array([[0.0, 0.0, 1.0]]))
    """
    layer = texture.add_layer(name)
    texture.layers.remove(layer)
    filled = ProceduralLayer(layer.number, layer.name, layer.slots, function=function)
    restart(texture, filled)
    texture.layers.append(filled)
    return filled


def restart(texture: VolumeTexture, layer: ProceduralLayer) -> None:
    """Store the coarsest level of a layer that stores nothing yet."""
    _evaluate(texture, layer, np.arange(*texture.octree.level_first[-2:], dtype=np.int32))


def fill(texture: VolumeTexture, layer: ProceduralLayer, entries: Entries) -> None:
    """Evaluate those of the entries that are not stored, and all that they need above them."""
    missing = entries[layer.slots[entries] == ABSENT]
    if len(missing):
        _evaluate(texture, layer, refine(texture, layer, missing))


def is_painted(texture: VolumeTexture, layer: ProceduralLayer, entries: Entries) -> np.ndarray:
    """(n,) bool: whether stored entries hold something else than what the function says."""
    twin = replace(layer, slots=np.full_like(layer.slots, ABSENT))
    _evaluate(texture, twin, entries)
    same = same_texels(texture, entries, layer.slots[entries], twin.slots[entries])
    texture.pool.drop(twin.slots[entries])
    return ~same


def fill_seen(
    texture: VolumeTexture,
    layer: ProceduralLayer,
    points: Points,
    normals: Normals | None,
    footprint: Footprint = 0.0,
    parts: Parts | None = None,
) -> None:
    """Evaluate what `VolumeTexture.colors` needs to show points."""
    spacing, top = texture.octree.texel, texture.octree.n_levels - 1
    known = (np.abs(points) < FARTHEST * spacing).all(axis=1)
    levels = np.floor(np.log2(np.fmax(np.broadcast_to(footprint, len(points)) / spacing, 1.0)))
    levels = np.where(known, np.minimum(levels, top), -1).astype(np.int64)
    directions = np.zeros_like(points) if normals is None else normals
    bits = np.full(len(points), ANY_PART, np.int64) if parts is None else parts
    wanted = [np.empty(0, np.int32)]
    for level in range(top + 1):
        here = np.flatnonzero(levels == level)
        if len(here):
            cells = np.floor(points[here] / texture.octree.spacing(level)).astype(np.int64)
            found = _around(texture, level, cells, directions[here], bits[here])
            wanted.append(np.unique(found))
            # Where no brick is, the next level shows
            levels[here[(found < 0).all(axis=1)]] += 1
    entries = np.unique(np.concatenate(wanted)).astype(np.int32)
    fill(texture, layer, entries[entries >= 0])


def _around(
    texture: VolumeTexture, level: int, cells: np.ndarray, directions: Normals, parts: Parts
):
    """(n, 8) int32 entries of the corners of cells (n, 3), -1 where there are none."""
    bricks = cells >> 3
    own = texture.octree.find(level, bricks, directions, parts)
    found = np.empty((len(cells), 8), np.int32)
    for n, corner in enumerate(CORNERS):
        step = ((cells + corner) >> 3) - bricks
        beside = texture.octree.tables.neighbors[own, SELF + step @ STEPS]
        # A brick of which the table says several sheets is looked up where these may be divided
        alone = (own < 0) | (texture.octree.is_divided & (beside <= FIRST_GROUP))
        beside[alone] = texture.octree.find(
            level, bricks[alone] + step[alone], directions[alone], parts[alone]
        )
        found[:, n] = beside
    return found


def _evaluate(texture: VolumeTexture, layer: ProceduralLayer, entries: Entries) -> None:
    levels = texture.octree.tables.levels[entries]
    for level in np.unique(levels):
        own = entries[levels == level]
        for begin in range(0, len(own), ENTRIES_PER_CALL):
            part = own[begin : begin + ENTRIES_PER_CALL]
            texture.put(layer, part, evaluated(layer.function, texture, part))
            texture.collapse_uniform(layer, part)
