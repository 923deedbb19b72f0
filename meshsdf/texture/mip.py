"""Keep the coarser levels of a texture what the finer ones make them.

A coarser texel is the mean of the finer ones around it with the weights [1 2 1]^3 (full weighting),
in linear light and premultiplied, over the texels that exist; where sheets part, over those that
look its way. It keeps its value where some of these are not stored: there the finer level shows
what the coarser one does, and no mean of it may change it.
"""

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import TextureError
from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.texture_lookup import ABSENT
from ..kernels.texture_mip import CHANGED, mip_texels, most_sheets, parents_of
from ..progress import Progress, silent
from .channels import Numbers
from .layer import Layer
from .octree import Entries
from .refine import check_entries, level_range, refine_to, texel_mask
from .volume_texture import VolumeTexture

ENTRIES_PER_PIECE = 256
ENTRIES_AT_ONCE = 8192
ENTRIES_PER_CALL = 1024  # of the caller's function: about 200 000 points
WHERE = "bake(function=...)"


def update_mips(texture: VolumeTexture, layer: Layer, entries: Entries) -> Entries:
    """Bring the levels above changed entries up to date, in all channels.

    Parameters
    ----------
    texture, layer : VolumeTexture, Layer
        What was changed.
    entries : (n,) int32
        Stored entries that were written, of any levels, in any order.

    Returns
    -------
    entries : (k,) int32
        The coarser entries that changed, in rising order.

    Notes
    -----
    Cost: O(n) of the entries given and of those that change. Bricks that come to hold one number
    become tiles.
    """
    check_entries(texture, entries, "update_mips(entries=...)")
    return _remade(texture, layer, np.unique(entries), entries[:0])


def remake_means(texture: VolumeTexture, layer: Layer, entries: Entries) -> Entries:
    """As `update_mips`, for entries in rising order whose own texels may be means, too."""
    return _remade(texture, layer, entries, entries)


def _remade(texture: VolumeTexture, layer: Layer, entries: Entries, due: Entries) -> Entries:
    """Make the entries that are due, and those above written ones, of the level below each."""
    octree = texture.octree
    below, all_changed = entries[:0], [np.empty(0, np.int32)]
    for level in range(octree.n_levels - 1):
        first, last, end = octree.level_first[level : level + 3]
        below = np.union1d(below, entries[slice(*np.searchsorted(entries, (first, last)))])
        own = due[slice(*np.searchsorted(due, (last, end)))]
        if len(below) or len(own):
            above = np.union1d(parents(texture, below.astype(np.int32)), own).astype(np.int32)
            below = _updated(texture, layer, above[layer.slots[above] != ABSENT])
            all_changed.append(below)
    return np.concatenate(all_changed)


def parents(texture: VolumeTexture, entries: Entries) -> Entries:
    """The entries one level up that hold means of texels of others, not sorted, some repeatedly."""
    tables = texture.octree.tables
    found = np.empty((len(entries), 8 * most_sheets(tables.groups)), np.int32)
    parents_of(tables, entries, found)
    return found[found >= 0]


def bake(
    texture: VolumeTexture,
    layer: Layer,
    function: Callable[..., Any],
    *,
    level: int = 0,
    channel: str = "base",
    progress: Progress = silent,
) -> None:
    """Fill a layer with what a function says, at all texels of a level and, by means, above it.

    Parameters
    ----------
    texture, layer : VolumeTexture, Layer
        What to fill. Levels finer than ``level`` are no longer stored; other channels stay.
    function : callable
        ``f(points)`` or ``f(points, normals)``, with or without arguments ``footprint`` (the
        spacing of texels), ``faces`` and ``feet``; gives (n, 4): linear colours with alpha, or the
        channel's values. The last two are what `VolumeTexture.feet` says: where sheets that look
        the same way need the same texels, they alone tell which a texel is of; ``feet`` is None
        where that is nowhere so.
    level : int
        0 is the finest.
    channel : str
        "base", "normal", "height", "orm" or "mask".

    Raises
    ------
    TextureError
        There is no such level or channel, or the function gives something else.
    """
    first, last = level_range(texture, level, "bake(level=...)")
    texture.pool.use(channel)
    refine_to(texture, layer, level)
    texture.pool.drop(layer.slots[:first])
    layer.slots[:first] = ABSENT
    entries = np.arange(first, last, dtype=np.int32)
    evaluate(texture, layer, entries, function, channel, progress)
    update_mips(texture, layer, entries)


def evaluate(
    texture: VolumeTexture,
    layer: Layer,
    entries: Entries,
    function: Callable[..., Any],
    channel: str = "base",
    progress: Progress = silent,
) -> None:
    """Put what a function says of them into stored entries of one level; no means are made."""
    for begin in range(0, len(entries), ENTRIES_PER_CALL):
        part = entries[begin : begin + ENTRIES_PER_CALL]
        texture.put(layer, part, evaluated(function, texture, part), channel=channel)
        texture.collapse_uniform(layer, part)
        progress("bake", min(1.0, (begin + ENTRIES_PER_CALL) / len(entries)))


def evaluated(function: Callable[..., Any], texture: VolumeTexture, entries: Entries) -> Numbers:
    """The function's values at the texels of entries of one level, checked: (n, 4) float32."""
    points, normals = texture.places(entries)
    try:
        arguments = inspect.signature(function).parameters
    except ValueError:
        arguments = {}
    given = _asked(arguments, texture, entries)
    positional = [points]
    if "normals" in arguments:
        given["normals"] = normals
    elif len(arguments) > 1 and not given:
        second = list(arguments.values())[1]
        if second.default is second.empty and second.kind is second.POSITIONAL_OR_KEYWORD:
            positional.append(normals)
    values = np.asarray(function(*positional, **given))
    if values.shape != (len(points), 4) or values.dtype.kind not in "fiu":
        what = f"gave {values.dtype} of the shape {values.shape} for {len(points)} points"
        raise TextureError(f"the function {what}", WHERE, "return (n, 4) numbers")
    return values.astype(np.float32)


def _asked(arguments, texture: VolumeTexture, entries: Entries) -> dict[str, Any]:
    """What a function asks for by name, besides normals."""
    given: dict[str, Any] = {}
    if "footprint" in arguments:
        given["footprint"] = texture.octree.spacing(int(texture.octree.tables.levels[entries[0]]))
    is_told = texture.knows_parts
    if "faces" in arguments or ("feet" in arguments and is_told):
        found = dict(zip(("feet", "faces"), texture.feet(entries), strict=True))
        given |= {name: value for name, value in found.items() if name in arguments}
    if "feet" in arguments and not is_told:
        given["feet"] = None
    return given


def _updated(texture: VolumeTexture, layer: Layer, entries: Entries) -> Entries:
    """Those of stored entries of one level that changed when made from the level below."""
    changed = [np.empty(0, np.int32)]
    for begin in range(0, len(entries), ENTRIES_AT_ONCE):
        part = entries[begin : begin + ENTRIES_AT_ONCE]
        texels, state = {}, np.zeros(len(part), np.uint8)
        for name in used_channels(texture):
            texels[name] = _made(texture, layer, part, name, state)
        hit = state == CHANGED
        if hit.any():
            _store(texture, layer, part[hit], {n: array[hit] for n, array in texels.items()})
        changed.append(part[hit])
    return np.concatenate(changed)


def used_channels(texture: VolumeTexture) -> list[str]:
    """The channels that bricks or tiles say anything in."""
    n = len(texture.tiles)
    return [
        name
        for name, channel in texture.channels.items()
        if name in texture.pool.arrays or (texture.tiles.arrays[name][:n] != channel.nothing).any()
    ]


def _made(texture, layer, entries, name: str, state: np.ndarray) -> np.ndarray:
    """(n, 512) texels of a channel; marks in ``state`` the entries where they are new."""
    channel = texture.channels[name]
    texels = np.full((len(entries), 512), channel.nothing, channel.dtype)
    pool = texture.pool.use(name)
    own = np.empty(len(entries), np.uint8)
    ranges = even_ranges(len(entries), -(-len(entries) // ENTRIES_PER_PIECE))

    def work(piece: int) -> None:
        mip_texels(
            texture.octree.tables, entries, layer.slots, pool, texture.tiles.arrays[name],
            channel.kind, *ranges[piece], texels, own,
        )  # fmt: skip

    run_pieces(work, len(ranges))
    state[own == CHANGED] = CHANGED
    return texels


def _store(texture, layer, entries, texels: dict[str, np.ndarray]) -> None:
    """Texels into entries: into bricks, or as tiles where they are all one number."""
    exists = texel_mask(texture, entries)
    uniform = np.ones(len(entries), bool)
    first = exists.argmax(axis=1)
    rows = np.arange(len(entries))
    for array in texels.values():
        uniform &= ((array == array[rows, first][:, None]) | ~exists).all(axis=1)
    slots = texture.writable(layer, entries[~uniform])
    for name, array in texels.items():
        texture.pool.arrays[name][slots] = array[~uniform]
    texture.pool.drop(layer.slots[entries[uniform]])
    for row in np.flatnonzero(uniform):
        texel = {name: array[row, first[row]] for name, array in texels.items()}
        layer.slots[entries[row]] = texture.tiles.code(texel)
