"""Fill a layer with a function, and store fine bricks only where it has detail.

What is refined follows what is written: the frequency of a procedural, the edges of an image. No
band of frequencies is trusted to be absent: a function is evaluated at all of the finest texels,
and then bricks go, finest first, that the coarser ones show as well. So no detail is ever missed,
as it would be by refining only where a coarser look finds some.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Number
from ..errors import TextureError
from ..kernels.texture_lookup import ABSENT
from ..progress import Progress, silent
from .layer import Layer
from .mip import bake, evaluate, update_mips, used_channels
from .octree import Entries
from .refine import family_of, level_range, refine_to, unlike_above, with_balance
from .volume_texture import VolumeTexture

Level = int | float | str  # "auto", or a number; anything else is refused with words

STEP = 1 / 255
"""How far from all detail a layer may be that is filled with level="auto"."""


def bake_level(
    texture: VolumeTexture,
    layer: Layer,
    function: Callable[..., Any],
    *,
    level: Level = 0,
    progress: Progress = silent,
) -> None:
    """Fill a layer's colours at one level, as `mip.bake` does, or where detail is if "auto".

    Raises
    ------
    TextureError
        There is no such level, or the function gives something else.
    """
    if level == "auto":
        bake_detail(texture, layer, function, progress=progress)
    elif isinstance(level, int) and not isinstance(level, bool):
        bake(texture, layer, function, level=level, progress=progress)
    else:
        what = f"there is no level {level!r}"
        fix = f'use 0 to {texture.octree.n_levels - 1}, 0 is the finest, or "auto"'
        raise TextureError(what, "level=...", fix)


def bake_detail(
    texture: VolumeTexture,
    layer: Layer,
    function: Callable[..., Any],
    *,
    tolerance: Number = STEP,
    channel: str = "base",
    progress: Progress = silent,
) -> None:
    """Fill a layer with what a function says, stored no finer than a bound asks for.

    Parameters
    ----------
    texture, layer, function, channel
        As `mip.bake` takes them; other channels show what they did.
    tolerance : float
        How far texels may be from all detail: colours in sRGB times alpha, from 0 to 1, other
        channels in their own units.

    Raises
    ------
    TextureError
        The tolerance is negative or not a number; errors as `mip.bake`.

    Notes
    -----
    Accuracy: at every texel of the finest level what is seen differs from what `mip.bake` would
    store there by at most the tolerance, without exception. In between, for opaque colours, what is
    seen is a mean of places that keep the bound.
    Cost: that of `mip.bake` at the finest level and a third more, in time and, until it ends, in
    memory; and a lookup at every one of the finest texels for each level, at most.
    Method: every level is filled with what the function says, filtered to its spacing. A brick goes
    if all finest texels in it are within the tolerance of what the levels above it show, and so are
    its own. Coarser bricks then become means where all finer ones are stored; and where what went
    shows at the rim of a brick that stayed, and beyond the tolerance, it comes back.

    Examples
    --------
    >>> from meshsdf.mesh import icosphere
    >>> texture = VolumeTexture.around(icosphere(subdivisions=2), resolution=64)
    >>> layer = texture.add_layer("grey")
    >>> bake_detail(texture, layer, lambda points: np.full((len(points), 4), 0.5))
    >>> len(layer.stored) < 0.1 * texture.octree.n_entries
    True
    """
    if not tolerance >= 0:
        what = f"a tolerance of {tolerance} makes no sense"
        raise TextureError(what, "bake_detail(tolerance=...)", "give a number of 0 or more")
    texture.pool.use(channel)
    refine_to(texture, layer, 0)
    # The finest last: they tell how far the work is
    for level in reversed(range(texture.octree.n_levels)):
        entries = np.arange(*level_range(texture, level, "bake_detail"), dtype=np.int32)
        evaluate(texture, layer, entries, function, channel, silent if level else progress)
    whole = layer.slots.copy()
    texture.pool.hold(whole)
    try:
        _thin_out(texture, layer, whole, float(tolerance), channel)
        update_mips(texture, layer, layer.stored)
        while len(bad := _beyond(texture, layer, whole, float(tolerance), channel)):
            entries = with_balance(texture, layer, bad)
            texture.pool.hold(whole[entries])
            layer.slots[entries] = whole[entries]
            update_mips(texture, layer, entries)
    finally:
        texture.pool.drop(whole)


def _thin_out(texture: VolumeTexture, layer: Layer, whole, tolerance: float, channel: str) -> None:
    """Drop entries, finest first, whose finest texels are seen within the tolerance above them."""
    octree = texture.octree
    needed = np.zeros(octree.n_entries + 1, bool)  # for the balance; the last is for no entry
    finest = np.arange(octree.level_first[1], dtype=np.int32)
    over = finest.copy()  # the entry of the level that each of the finest lies in
    others = [name for name in used_channels(texture) if name != channel]
    for level in range(octree.n_levels - 1):
        first, last = level_range(texture, level, "bake_detail")
        stored = (first + np.flatnonzero(layer.slots[first:last] != ABSENT)).astype(np.int32)
        free = stored[~needed[stored]]
        worst = np.zeros(octree.n_entries, np.float32)
        worst[free] = unlike_above(texture, layer, free, layer.slots[free], channel)
        within = np.zeros(octree.n_entries, bool)
        within[free[worst[free] <= tolerance]] = True
        below = finest[within[over] & (level > 0)]
        apart = unlike_above(texture, layer, below, whole[below], channel, level + 1)
        np.maximum.at(worst, over[below], apart)
        goes = free[worst[free] <= tolerance]
        for name in others:
            goes = goes[unlike_above(texture, layer, goes, layer.slots[goes], name) == 0]
        texture.pool.drop(layer.slots[goes])
        layer.slots[goes] = ABSENT
        needed[family_of(texture, np.setdiff1d(stored, goes))] = True
        over = octree.tables.parents[over]


def _beyond(texture, layer: Layer, whole, tolerance: float, channel: str) -> Entries:
    """Entries of the finest level, not stored, whose texels differ by more from what is seen."""
    first, last = level_range(texture, 0, "bake_detail")
    entries = (first + np.flatnonzero(layer.slots[first:last] == ABSENT)).astype(np.int32)
    apart = unlike_above(texture, layer, entries, whole[entries], channel)
    return entries[apart > tolerance]
