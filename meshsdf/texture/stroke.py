"""Painting a stroke on a layer, as a pointer draws it."""

from typing import Any

import numpy as np

from ..arrays import Points, Values
from ..errors import TextureError
from ..kernels.blending import MODES
from ..kernels.brush import COPY, ERASE, PAINT, lay
from ..kernels.brush_filters import blurred, replace, smudged
from .brush import Brush
from .clone_source import CloneSource
from .layer import Layer
from .mip import update_mips
from .octree import Entries
from .region import fill, gradient
from .stroke_cover import Cover, Touched, run_ranges
from .stroke_path import WHERE, Normals, StrokePath, TooManyDabs
from .stroke_record import StrokeRecord
from .volume_texture import VolumeTexture

NO_SOURCE = np.zeros((1, 1, 4), np.float32)
REGIONS = ("fill", "gradient")


class Stroke:
    """One stroke of a brush on a layer; it paints right away, batch by batch.

    Parameters
    ----------
    texture, layer : VolumeTexture, Layer
        What is painted on. Edit nothing else of the layer until the stroke has ended.
    brush : Brush

    Notes
    -----
    In a ``with`` statement the stroke ends with the body, or is cancelled if that raises. The
    same samples give the same texels however they are split into batches, with any number of
    threads.

    Examples
    --------
    >>> from meshsdf.mesh import icosphere
    >>> texture = VolumeTexture.around(icosphere(subdivisions=3), resolution=32)
    >>> layer = texture.add_layer("paint")
    >>> pole = np.array([[0.0, 0.0, 1.0]])
    >>> with Stroke(texture, layer, Brush(0.3, color=(1.0, 0.0, 0.0, 1.0))) as stroke:
    ...     stroke.add(pole, pole)
    >>> texture.colors(pole, pole).round(2)
    array([[1., 0., 0., 1.]], dtype=float32)
    """

    def __init__(self, texture: VolumeTexture, layer: Layer, brush: Brush) -> None:
        self.texture, self.layer, self.brush = texture, layer, brush
        self._path = StrokePath(brush, texture.octree.texel)
        self._color = paint_of(brush)
        self._ended = False
        texture.pool.use(brush.channel)
        if brush.kind not in REGIONS:
            self._cover = Cover(texture, layer, brush)
        self._clone = CloneSource(texture, layer, brush) if brush.kind == "clone" else None

    def __enter__(self) -> "Stroke":
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if not self._ended:
            self.cancel() if kind else self.end()

    @property
    def record(self) -> StrokeRecord:
        """All that was added so far, so that it can be painted again."""
        return StrokeRecord(self.brush, *self._path.samples(), self.layer.number)

    def add(self, points: Points, normals: Normals, pressures: Values | None = None) -> None:
        """Go on to more points, and paint on the way there; regions are painted at the end.

        Parameters
        ----------
        points : (n, 3) float64
            On the surface, in the order in which the pointer passed them.
        normals : (n, 3) float64
            Which way the surface looks there, of any length but 0.
        pressures : (n,) float64, optional
            In [0, 1]; 1 if not given.

        Raises
        ------
        TextureError
            Numbers are not finite or out of range, or the way is absurdly long; nothing of the
            batch is painted, and the stroke may go on. Or the stroke has ended.
        """
        if self._ended:
            raise TextureError("the stroke has ended", WHERE, "begin another stroke")
        dabs = self._path.follow(points, normals, pressures)
        if self.brush.kind in ("blur", "smudge"):
            self._filter(dabs)
        elif len(dabs) and self.brush.kind not in REGIONS:
            self._lay(self._cover.add(dabs, self._path.copies))

    def end(self) -> Entries:
        """End the stroke, and bring coarser levels up to date.

        Returns
        -------
        entries : (k,) int32
            All that changed, of all levels, in rising order; none if the stroke changed nothing.

        Raises
        ------
        TextureError
            A gradient's two points are one.
        """
        self._ended = True
        if self.brush.kind in REGIONS:
            changed = self._paint_region()
        else:
            changed = self._cover.finish(self.brush.channel)
        above = update_mips(self.texture, self.layer, changed)
        return np.union1d(changed, above).astype(np.int32)

    def cancel(self) -> None:
        """End the stroke as if it had never painted."""
        self._ended = True
        if self.brush.kind not in REGIONS:
            self._cover.cancel()

    def _paint_region(self) -> Entries:
        """Fill from the first point and its copies, or paint from the first point to the last."""
        record, texel = self.record, self.texture.octree.texel
        if len(record.points) == 0:
            return np.empty(0, np.int32)
        if self.brush.kind == "gradient":
            ends = record.points[0], record.points[-1]
            return gradient(self.texture, self.layer, self.brush, *ends)
        start = StrokePath(self.brush, texel)
        seeds = start.follow(record.points[:1], record.normals[:1], np.ones(1))
        points, normals = seeds[:, :3] * texel, np.ascontiguousarray(seeds[:, 10:13])
        return fill(self.texture, self.layer, self.brush, points, normals)

    def _lay(self, touched: Touched) -> None:
        """Lay the paint on texels whose coverage changed."""
        texture, brush, cover = self.texture, self.brush, self._cover
        channel = texture.channels[brush.channel]
        action = {"erase": ERASE, "clone": COPY}.get(brush.kind, PAINT)
        pool, tiles = texture.pool.use(channel.name), texture.tiles.arrays[channel.name]
        mode = MODES.index(brush.blend)
        opacity, nothing = np.float32(brush.opacity), channel.dtype.type(channel.nothing)
        source = self._clone.of(touched) if self._clone else NO_SOURCE

        def work(begin: int, end: int) -> None:
            lay(
                touched.entries, begin, end, touched.rows, touched.changed, cover.base,
                self.layer.slots, cover.coverage, source, action, channel.kind, mode, self._color,
                opacity, nothing, pool, tiles,
            )  # fmt: skip

        run_ranges(work, len(touched.entries), 50)

    def _filter(self, dabs: np.ndarray) -> None:
        """Blur or smudge with dabs, one after another: each works on what the last one left."""
        brush, cover, tables = self.brush, self._cover, self.texture.octree.tables
        channel = self.texture.channels[brush.channel]
        opacity = np.float32(brush.opacity)
        for dab in dabs[:, None]:
            touched = cover.add(dab, 1)
            pool = self.texture.pool.use(channel.name)
            values = np.empty((len(touched.entries), 512), channel.dtype)
            rest = (channel.kind, pool, self.texture.tiles.arrays[channel.name], values)

            def work(begin: int, end: int, touched=touched, way=dab[0, 16:], rest=rest) -> None:
                what = (touched.rows, touched.changed, self.layer.slots, cover.coverage, opacity)
                if brush.kind == "blur":
                    blurred(tables, touched.entries, begin, end, *what, *rest)
                else:
                    smudged(tables, touched.entries, begin, end, *what, way, *rest)

            run_ranges(work, len(touched.entries), 50)
            replace(
                touched.entries, touched.rows, touched.changed, self.layer.slots, values, pool,
                cover.coverage,
            )  # fmt: skip


def paint(
    texture: VolumeTexture,
    layer: Layer,
    brush: Brush,
    points: Points,
    normals: Normals,
    pressures: Values | None = None,
) -> Entries:
    """Paint a whole stroke; the entries that changed, as `Stroke.end` gives them."""
    stroke = Stroke(texture, layer, brush)
    try:
        add_all(stroke, points, normals, pressures)
    except BaseException:
        stroke.cancel()
        raise
    return stroke.end()


def add_all(
    stroke: Stroke, points: Points, normals: Normals, pressures: Values | None = None
) -> None:
    """Add the samples of several batches; in parts, if their dabs are too many for one."""
    try:
        stroke.add(points, normals, pressures)
    except TooManyDabs:
        half = len(points) // 2
        if half == 0:
            raise
        for part in (slice(None, half), slice(half, None)):
            of_part = None if pressures is None else pressures[part]
            add_all(stroke, points[part], normals[part], of_part)


def replay(texture: VolumeTexture, record: StrokeRecord) -> Entries:
    """Paint a recorded stroke again, on this or another texture of the same or a like shape.

    Brushes are in world units, so a finer texture shows the same stroke in more detail.

    Raises
    ------
    TextureError
        The texture has no layer of that number.
    """
    layers = [layer for layer in texture.layers if layer.number == record.layer]
    if not layers:
        numbers = ", ".join(str(layer.number) for layer in texture.layers) or "none"
        what = f"there is no layer {record.layer}; layers: {numbers}"
        raise TextureError(what, "replay(record)", "add the layer first")
    samples = record.points, record.normals, record.pressures
    return paint(texture, layers[0], record.brush, *samples)


def paint_of(brush: Brush) -> np.ndarray:
    """The four numbers that a brush lays on."""
    color = (brush.value, 0.0, 0.0, 1.0) if brush.channel in ("height", "mask") else brush.color
    return np.array(color, np.float32)
