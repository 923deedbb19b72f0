"""Painting of whole regions at once: filling connected texels, and gradients."""

import numpy as np
from jaxtyping import UInt64

from ..arrays import Points, Vector3
from ..errors import TextureError
from ..kernels.blending import MODES
from ..kernels.brush import COPY, PAINT, lay, same_texels
from ..kernels.flood_fill import flood, nearest_texel
from ..kernels.texture_lookup import ABSENT
from ..srgb import srgb_rgba
from .brush import Brush
from .channels import Numbers
from .layer import Layer
from .lookup import look_up
from .octree import Entries
from .refine import refine, texel_mask
from .stroke_cover import run_ranges
from .volume_texture import VolumeTexture

Bits = UInt64[np.ndarray, "n 8"]

ENTRIES_AT_ONCE = 2048
STEPS_OF_GRADIENT = 64  # a gradient's texels, along its length
NO_SOURCE = np.zeros((1, 1, 4), np.float32)


def fill(
    texture: VolumeTexture, layer: Layer, brush: Brush, points: Points, normals: Points
) -> Entries:
    """Paint all texels that are connected with those at points, and of like colour.

    Texels are those of the finest level that the layer stores anywhere, or that ``brush.detail``
    asks for. The entries whose texels changed come back, in rising order.
    """
    octree, level = texture.octree, _finest(texture, layer, brush)
    first, last = (int(n) for n in octree.level_first[level : level + 2])
    entries = np.arange(first, last, dtype=np.int32)
    colors = _seen(texture, layer, brush, entries, level)
    bits = np.zeros((len(entries), 8), np.uint64)
    queue = np.empty(len(colors), np.int64)
    for point, normal in zip(points / octree.spacing(level), normals, strict=True):
        entry, texel = nearest_texel(octree.tables, first, last, *point, *normal)
        selected = np.zeros_like(bits)
        tolerance = np.float32(brush.tolerance)
        flood(octree.tables, first, entry, texel, colors, tolerance, selected, queue)
        bits |= selected
    hit = bits.any(axis=1)
    refine(texture, layer, entries[hit])
    return _laid(texture, layer, brush, entries[hit], bits[hit])


def gradient(
    texture: VolumeTexture, layer: Layer, brush: Brush, start: Vector3, end: Vector3
) -> Entries:
    """Paint all of the surface from one colour at ``start`` to another at ``end``.

    Raises
    ------
    TextureError
        The two are one point.
    """
    length = float(np.linalg.norm(end - start))
    if not length > 0:
        what = f"the gradient begins and ends at {start}"
        raise TextureError(what, "gradient(start, end)", "give two points apart")
    octree, level = texture.octree, 0
    wanted = min(length / STEPS_OF_GRADIENT, float(brush.detail or np.inf))
    while level + 1 < octree.n_levels and octree.spacing(level + 1) <= wanted:
        level += 1
    first, last = octree.level_first[level : level + 2]
    stored = np.flatnonzero(layer.slots[:first] != ABSENT)
    entries = np.concatenate([stored, np.arange(first, last)]).astype(np.int32)
    refine(texture, layer, entries)

    def color_at(points: Points) -> Numbers:
        away = points - start
        if brush.shape == "linear":
            share = away @ (end - start) / length**2
        else:
            share = np.sqrt(np.einsum("ni,ni->n", away, away)) / length
        return _ramp(brush, np.clip(share, 0, 1))

    return _laid(texture, layer, brush, entries, octree.tables.masks[entries], color_at)


def _finest(texture: VolumeTexture, layer: Layer, brush: Brush) -> int:
    """The finest level that is stored, or asked for."""
    octree = texture.octree
    level = int(octree.tables.levels[np.flatnonzero(layer.slots != ABSENT)[0]])
    while brush.detail is not None and level > 0 and octree.spacing(level) > brush.detail:
        level -= 1
    return level


def _seen(texture, layer, brush: Brush, entries: Entries, level: int) -> Numbers:
    """Colours at the texels of entries as they are compared: in sRGB, times alpha."""
    points, normals = texture.places(entries)
    name = brush.channel
    colors = look_up(
        texture.octree, layer.slots, texture.pool.use(name), texture.tiles.arrays[name],
        texture.channels[name].kind, points, normals, texture.octree.spacing(level),
        parts=texture.texel_parts(entries),
    )  # fmt: skip
    if name == "base":
        colors = srgb_rgba(colors)
    colors[:, :3] *= colors[:, 3:]
    return np.ascontiguousarray(colors, np.float32)


def _ramp(brush: Brush, share: np.ndarray) -> Numbers:
    """Colours between the brush's two, in linear light, by alpha."""
    if brush.channel in ("height", "mask"):
        first, last = (brush.value, 0, 0, 1), (brush.end_color[0], 0, 0, 1)
    else:
        first, last = brush.color, brush.end_color
    ends = np.array([first, last], np.float64)
    ends[:, :3] *= ends[:, 3:]
    mixture = ends[0] + share[:, None] * (ends[1] - ends[0])
    alpha = mixture[:, 3:]
    np.divide(mixture[:, :3], alpha, out=mixture[:, :3], where=alpha > 0)
    return mixture.astype(np.float32)


def _laid(texture, layer, brush: Brush, entries: Entries, bits: Bits, color_at=None) -> Entries:
    """Lay a colour, or colours by place, on the marked texels of stored entries."""
    changed = [np.empty(0, np.int32)]
    name = brush.channel
    channel = texture.channels[name]
    texture.pool.use(name)
    color = (brush.value, 0, 0, 1) if name in ("height", "mask") else brush.color
    paint = np.array(color, np.float32)
    for begin in range(0, len(entries), ENTRIES_AT_ONCE):
        part = entries[begin : begin + ENTRIES_AT_ONCE]
        marked = np.ascontiguousarray(bits[begin : begin + ENTRIES_AT_ONCE])
        rows, cover = np.arange(len(part), dtype=np.int32), np.ones((len(part), 512), np.float32)
        source = NO_SOURCE
        if color_at is not None:
            source = np.zeros((len(part), 512, 4), np.float32)
            source[texel_mask(texture, part)] = color_at(texture.places(part)[0])
        base = layer.slots[part]
        texture.pool.hold(base)
        texture.writable(layer, part)
        pool, tiles = texture.pool.use(name), texture.tiles.arrays[name]

        where = (rows, marked, base, layer.slots, cover, source)
        what = (PAINT if color_at is None else COPY, channel.kind, MODES.index(brush.blend))
        rest = (paint, np.float32(brush.opacity), channel.dtype.type(channel.nothing), pool, tiles)
        run_ranges(
            lambda first, last, part=part, how=(*where, *what, *rest): lay(part, first, last, *how),
            len(part),
            50,
        )
        changed.append(_settled(texture, layer, part, base, name))
    return np.concatenate(changed)


def _settled(texture, layer, entries: Entries, base: np.ndarray, name: str) -> Entries:
    """Let go of what was there before; the entries whose texels changed."""
    same = np.empty(len(entries), np.bool_)
    same_texels(
        texture.octree.tables.masks, entries, base, layer.slots[entries], texture.pool.use(name),
        texture.tiles.arrays[name], same,
    )  # fmt: skip
    texture.pool.drop(layer.slots[entries[same]])
    layer.slots[entries[same]] = base[same]
    texture.pool.drop(base[~same])
    texture.collapse_uniform(layer, entries[~same])
    return entries[~same]
