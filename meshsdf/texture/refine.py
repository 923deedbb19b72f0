"""Store finer bricks where detail is wanted, and drop those that show no more than coarser ones.

Refining fills bricks with what the coarser levels show there (trilinear, an identity on every cell
of half the side), so it changes nothing that can be seen. Detail where it is painted, and only
there, is the idea of DeBry et al. 2002 (doi:10.1145/566654.566649). Bricks of all levels stay in
2:1 balance: around the parent of a stored brick all 27 bricks are stored.
"""

import numpy as np
from jaxtyping import Int32

from ..arrays import Number
from ..errors import TextureError
from ..kernels.node_values import layer_values
from ..kernels.octree_tables import NO_ENTRY
from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.texel_places import texel_bits, texel_places
from ..kernels.texture_lookup import ABSENT, FIRST_TILE
from ..kernels.texture_mip import most_sheets
from ..kernels.texture_refine import FAMILY, constant_families, parents_around
from ..kernels.texture_sample import sample
from ..progress import Progress, silent
from ..srgb import srgb_rgba
from .channels import Numbers
from .layer import Layer
from .octree import Entries
from .volume_texture import VolumeTexture

Family = Int32[np.ndarray, "n _"]

ENTRIES_PER_PIECE = 1024
ENTRIES_AT_ONCE = 8192  # so that places and colours take 150 MB at most


def refine(texture: VolumeTexture, layer: Layer, entries: Entries) -> Entries:
    """Store entries of a layer, with what is seen there, and first all that 2:1 balance asks for.

    Parameters
    ----------
    texture : VolumeTexture
        Whose octree numbers the entries.
    layer : Layer
        One of its layers.
    entries : (n,) int32
        Of any levels, in any order; those already stored stay as they are.

    Returns
    -------
    entries : (k,) int32
        Those that became stored, in rising order.

    Notes
    -----
    Accuracy: what is seen changes by the rounding of texels alone: at most half a step of 8 bits
    in sRGB, or 2^-11 of a half-precision number, once per call, however many levels become stored.
    Cost: O(n) in time and memory; nothing is evaluated where all around is of one colour.
    """
    check_entries(texture, entries, "refine(entries=...)")
    new = with_balance(texture, layer, entries)
    by_level = _split(texture, new)
    # Coarse first: a tile whose parents are one tile shows what they do
    for level in reversed(range(texture.octree.n_levels - 1)):
        if len(by_level[level]):
            codes = np.empty(len(by_level[level]), np.int32)
            constant_families(family_of(texture, by_level[level]), layer.slots, codes)
            tiles = codes <= FIRST_TILE
            layer.slots[by_level[level][tiles]] = codes[tiles]
            by_level[level] = by_level[level][~tiles]
    # All is evaluated before the first brick is stored: levels do not add up their rounding
    found = [_filled(texture, layer, part) for part in by_level]
    for part, texels in zip(by_level, found, strict=True):
        if len(part):
            slots = texture.writable(layer, part)
            for name, values in texels.items():
                texture.pool.arrays[name][slots] = values
            texture.collapse_uniform(layer, part)
    return new


def refine_to(texture: VolumeTexture, layer: Layer, level: int) -> Entries:
    """Store all entries of a level, and of all coarser ones, as `refine` does.

    Raises
    ------
    TextureError
        There is no such level.
    """
    first, last = level_range(texture, level, "refine_to(level=...)")
    return refine(texture, layer, np.arange(first, last, dtype=np.int32))


def coarsen(
    texture: VolumeTexture,
    layer: Layer,
    tolerance: Number = 0.0,
    *,
    progress: Progress = silent,
) -> Entries:
    """Drop stored entries that show no more than the level above them does.

    Parameters
    ----------
    texture, layer : VolumeTexture, Layer
        What to make smaller.
    tolerance : float
        By how much texels may differ from what the level above shows: colours in sRGB times
        alpha, from 0 to 1; other channels in their own units. 0 for areas of one colour alone.

    Returns
    -------
    entries : (k,) int32
        Those that are no longer stored, in rising order.

    Raises
    ------
    TextureError
        The tolerance is negative or not a number.

    Notes
    -----
    Accuracy: with 0 every lookup gives the same bits as before. Else, what is seen changes by at
    most the tolerance for each level that goes; at places without texels of their own, and
    between texels of very different alpha, no bound is claimed.
    Method: levels are taken finest first, one pass: an entry may go if no stored one needs it for
    its balance, so that none that remains is touched by what goes.
    """
    if not tolerance >= 0:
        what = f"a tolerance of {tolerance} makes no sense"
        raise TextureError(what, "coarsen(tolerance=...)", "give a number of 0 or more")
    texture.collapse_uniform(layer, layer.stored)
    gone = [np.empty(0, np.int32)]
    needed_above = np.zeros(texture.octree.n_entries, bool)
    for level in range(texture.octree.n_levels - 1):
        first, last = level_range(texture, level, "coarsen")
        stored = (first + np.flatnonzero(layer.slots[first:last] != ABSENT)).astype(np.int32)
        free = stored[~needed_above[stored]]
        codes = np.empty(len(free), np.int32)
        constant_families(family_of(texture, free), layer.slots, codes)
        goes = (codes <= FIRST_TILE) & (codes == layer.slots[free])
        if tolerance > 0:
            rest = np.flatnonzero(~goes)
            goes[rest] = _close(texture, layer, free[rest], float(tolerance))
        texture.pool.drop(layer.slots[free[goes]])
        layer.slots[free[goes]] = ABSENT
        gone.append(free[goes])
        stays = np.setdiff1d(stored, free[goes], assume_unique=True)
        needed_above[family_of(texture, stays)] = True  # NO_ENTRY marks the last, at the top
        progress("coarsen", (level + 1) / (texture.octree.n_levels - 1))
    return np.concatenate(gone)


def check_entries(texture: VolumeTexture, entries: Entries, where: str) -> None:
    """TextureError unless the entries are of the texture's octree."""
    n = texture.octree.n_entries
    if len(entries) and not (entries.min() >= 0 and entries.max() < n):
        what = f"entries {entries.min()} to {entries.max()}, where 0 to {n - 1} are known"
        raise TextureError(what, where, "take them from octree.find or layer.stored")


def level_range(texture: VolumeTexture, level: int, where: str) -> tuple[int, int]:
    """First entry of a level, and the first of the next; TextureError if there is none."""
    if not 0 <= level < texture.octree.n_levels:
        what = f"there is no level {level}"
        raise TextureError(what, where, f"use 0 to {texture.octree.n_levels - 1}, 0 is the finest")
    first, last = texture.octree.level_first[level : level + 2]
    return int(first), int(last)


def family_of(texture: VolumeTexture, entries: Entries) -> Family:
    """All sheets of the 27 bricks around the parents of entries; -1 fills the rows."""
    tables = texture.octree.tables
    width = 27 * most_sheets(tables.groups)
    if width > FAMILY:
        widest = 0
        for begin in range(0, len(entries), ENTRIES_AT_ONCE):
            part = entries[begin : begin + ENTRIES_AT_ONCE]
            rows = np.empty((len(part), width), np.int32)
            parents_around(tables, part, 0, len(part), rows)
            widest = max(widest, int((rows != NO_ENTRY).sum(axis=1).max()))
        width = max(widest, 1)
    family = np.empty((len(entries), width), np.int32)
    ranges = even_ranges(len(entries), -(-len(entries) // ENTRIES_PER_PIECE))
    run_pieces(
        lambda piece: parents_around(tables, entries, *ranges[piece], family),
        len(ranges) if len(entries) else 0,
    )
    return family


def seen_above(texture: VolumeTexture, layer: Layer, entries: Entries, name: str) -> Numbers:
    """What a channel shows at the texels of entries of one level by those above it.

    Accuracy: that of `seen_from` the next level, but for the rounding of float32 sums of eight
    products: 5e-7 of the largest number.
    """
    tables, pool = texture.octree.tables, texture.pool.arrays[name]
    tiles, kind = texture.tiles.arrays[name], texture.channels[name].kind
    first, ranges, seen = _texel_rows(texture, entries)

    def work(piece: int) -> None:
        begin, end = ranges[piece]
        unstored = np.full(end - begin, ABSENT, np.int32)
        layer_values(
            tables, layer.slots, unstored, pool, tiles, kind, entries[begin:end],
            first[begin : end + 1] - first[begin], seen[first[begin] : first[end]],
        )  # fmt: skip

    run_pieces(work, len(ranges))
    return seen


def seen_from(
    texture: VolumeTexture, layer: Layer, entries: Entries, name: str, level: int
) -> Numbers:
    """What a channel shows at the texels of entries of one level by ``level`` and those above."""
    tables = texture.octree.tables._replace(texel=1.0)  # places are then free of rounding
    pool, tiles = texture.pool.arrays[name], texture.tiles.arrays[name]
    first, ranges, seen = _texel_rows(texture, entries)
    points, normals = np.empty((len(seen), 3)), np.empty((len(seen), 3))
    parts = np.empty(len(seen), np.int64)
    texel_bits(tables, entries, first, parts)

    def work(piece: int) -> None:
        begin, end = ranges[piece]
        texel_places(tables, entries, first, begin, end, points, normals)
        sample(
            tables, layer.slots, pool, tiles, texture.channels[name].kind, points, normals, parts,
            np.array([2.0**level]), first[begin], first[end], seen,
        )  # fmt: skip

    run_pieces(work, len(ranges))
    return seen


def _texel_rows(texture: VolumeTexture, entries: Entries):
    """The first row of every entry's texels, ranges of entries for threads, and (rows, 4)."""
    first = texture.octree.texel_rows(entries)
    ranges = even_ranges(len(entries), -(-len(entries) // (ENTRIES_PER_PIECE // 8)))
    return first, ranges, np.empty((first[-1], 4), np.float32)


def with_balance(texture: VolumeTexture, layer: Layer, entries: Entries) -> Entries:
    """Entries that are to be stored, so that these are in balance; those that are not yet."""
    by_level = _split(texture, np.unique(entries[layer.slots[entries] == ABSENT]))
    for level in range(texture.octree.n_levels - 1):
        if len(by_level[level]):
            above = np.unique(family_of(texture, by_level[level]))
            above = above[above >= 0]
            wanted = above[layer.slots[above] == ABSENT]
            by_level[level + 1] = np.union1d(by_level[level + 1], wanted).astype(np.int32)
    return np.concatenate(by_level)


def _split(texture: VolumeTexture, entries: Entries) -> list[Entries]:
    """Entries in rising order, level by level."""
    cuts = np.searchsorted(entries, texture.octree.level_first[1:-1])
    return np.split(entries.astype(np.int32), cuts)


def _filled(texture: VolumeTexture, layer: Layer, entries: Entries) -> dict[str, np.ndarray]:
    """(n, 512) texels of every channel in use for entries of one level, as seen from above."""
    out = {}
    for name in texture.pool.arrays if len(entries) else ():
        channel = texture.channels[name]
        out[name] = np.full((len(entries), 512), channel.nothing, channel.dtype)
        for begin in range(0, len(entries), ENTRIES_AT_ONCE):
            part = entries[begin : begin + ENTRIES_AT_ONCE]
            exists = texel_mask(texture, part)
            texels = channel.encoded(seen_above(texture, layer, part, name))
            out[name][begin : begin + ENTRIES_AT_ONCE][exists] = texels
    return out


def texel_mask(texture: VolumeTexture, entries: Entries) -> np.ndarray:
    """(n, 512) bool: which texels of entries exist."""
    words = texture.octree.tables.masks[entries].astype("<u8")
    return np.unpackbits(words.view(np.uint8), axis=1, bitorder="little").astype(bool)


def _close(texture: VolumeTexture, layer: Layer, entries: Entries, tolerance: float) -> np.ndarray:
    """(n,) bool: entries of one level whose texels are within the tolerance of the level above."""
    close = np.ones(len(entries), bool)
    for name in texture.pool.arrays:
        close &= unlike_above(texture, layer, entries, layer.slots[entries], name) <= tolerance
    return close


def unlike_above(
    texture: VolumeTexture,
    layer: Layer,
    entries: Entries,
    slots: np.ndarray,
    name: str,
    level: int | None = None,
) -> np.ndarray:
    """By how much, at most, texels in slots differ from what `seen_above` or `seen_from` says.

    One number for each of the entries, which are of one level, in one channel: colours in sRGB
    times alpha, from 0 to 1; other channels in their own units.
    """
    apart = np.zeros(len(entries), np.float32)
    channel, pool = texture.channels[name], texture.pool.use(name)
    for begin in range(0, len(entries), ENTRIES_AT_ONCE):
        part, own = entries[begin : begin + ENTRIES_AT_ONCE], slots[begin : begin + ENTRIES_AT_ONCE]
        exists = texel_mask(texture, part)
        tiles = texture.tiles.arrays[name][np.maximum(FIRST_TILE - own, 0)]
        texels = np.where((own >= 0)[:, None], pool[own], tiles[:, None])[exists]
        if level is None:
            seen = seen_above(texture, layer, part, name)
        else:
            seen = seen_from(texture, layer, part, name, level)
        difference = _difference(name, channel.decoded(texels), seen)
        first = np.concatenate([[0], np.cumsum(exists.sum(axis=1))])[:-1]
        apart[begin : begin + ENTRIES_AT_ONCE] = np.maximum.reduceat(difference, first)
    return apart


def _difference(name: str, a: Numbers, b: Numbers) -> np.ndarray:
    """(n,) largest difference of values times alpha, and of alpha; colours in sRGB."""
    if name == "base":
        a, b = srgb_rgba(a), srgb_rgba(b)
    apart = np.abs(a[:, 3] - b[:, 3])
    return np.maximum(apart, np.abs(a[:, :3] * a[:, 3:] - b[:, :3] * b[:, 3:]).max(axis=1))
