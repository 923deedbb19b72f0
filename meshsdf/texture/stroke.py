"""Painting a stroke on a layer, as a pointer draws it."""

from typing import Any

import numpy as np
from jaxtyping import Float64

from ..arrays import Points, Values
from ..errors import TextureError
from ..kernels.brush import COPY, ERASE, PAINT, lay
from ..kernels.blending import MODES
from ..kernels.stroke_path import SAMPLE, STATE, make_dabs
from .brush import Brush
from .layer import Layer
from .mip import update_mips
from .octree import Entries
from .stroke_cover import Cover, Touched, run_ranges
from .volume_texture import VolumeTexture

Normals = Float64[np.ndarray, "n 3"]

MOST_DABS = 100_000  # of one batch of samples, copies included
FARTHEST = 2.0**40  # finest texels from the origin
SHARP_CORNER = np.sqrt(2.0)  # a stamp's corners are so many half sides from its middle
WHERE = "Stroke.add(points, normals, pressures)"


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
        self._matrices = brush.symmetry.matrices()
        self._center = np.array(brush.symmetry.center, np.float64) / texture.octree.texel
        self._cover = Cover(texture, layer, brush)
        self._state = np.zeros(STATE)
        self._color, self._source = _paint_of(brush), np.zeros((1, 1, 4), np.float32)
        self._ended = False
        texture.pool.use(brush.channel)

    def __enter__(self) -> "Stroke":
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if not self._ended:
            self.cancel() if kind else self.end()

    def add(self, points: Points, normals: Normals, pressures: Values | None = None) -> None:
        """Go on to more points, and paint on the way there.

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
            batch is painted. The stroke has ended.
        """
        if self._ended:
            raise TextureError("the stroke has ended", WHERE, "begin another stroke")
        dabs = self._dabs(self._samples(points, normals, pressures))
        if len(dabs):
            self._paint(self._cover.add(dabs, len(self._matrices)))

    def end(self) -> Entries:
        """End the stroke, and bring coarser levels up to date.

        Returns
        -------
        entries : (k,) int32
            All that changed, of all levels, in rising order; none if the stroke changed nothing.
        """
        self._ended = True
        changed = self._cover.finish(self.brush.channel)
        above = update_mips(self.texture, self.layer, changed)
        return np.union1d(changed, above).astype(np.int32)

    def cancel(self) -> None:
        """End the stroke as if it had never painted."""
        self._ended = True
        self._cover.cancel()

    def _samples(self, points: Points, normals: Normals, pressures: Values | None) -> np.ndarray:
        """(n, 8) checked samples, as `kernels.stroke_path` takes them."""
        pressures = np.ones(len(points)) if pressures is None else pressures
        if not len(points) == len(normals) == len(pressures):
            what = f"{len(points)} points, {len(normals)} normals, {len(pressures)} pressures"
            raise TextureError(what, WHERE, "give as many of each")
        texel, brush = self.texture.octree.texel, self.brush
        samples = np.empty((len(points), SAMPLE))
        np.divide(points, texel, out=samples[:, :3])
        length = np.sqrt(np.einsum("ni,ni->n", normals, normals))
        with np.errstate(divide="ignore", invalid="ignore"):
            np.divide(normals, length[:, None], out=samples[:, 3:6])
        if not (np.abs(samples[:, :6]) <= FARTHEST).all():
            row = int(np.flatnonzero(~(np.abs(samples[:, :6]) <= FARTHEST).all(axis=1))[0])
            what = f"sample {row} at {points[row]} with the normal {normals[row]} makes no sense"
            raise TextureError(what, WHERE, "give finite points near the surface, and normals")
        if not ((pressures >= 0) & (pressures <= 1)).all():
            what = f"a pressure of {pressures[~((pressures >= 0) & (pressures <= 1))][0]}"
            raise TextureError(what, WHERE, "give numbers from 0 to 1")
        radius = float(brush.radius) / texel * (1.0 if brush.stamp is None else SHARP_CORNER)
        samples[:, 6] = radius * np.interp(pressures, *zip(*brush.pressure_radius, strict=True))
        samples[:, 7] = float(brush.flow) * np.interp(
            pressures, *zip(*brush.pressure_flow, strict=True)
        )
        return samples

    def _dabs(self, samples: np.ndarray) -> np.ndarray:
        """The next dabs, (steps times copies, 19)."""
        brush, copies = self.brush, len(self._matrices)
        radius = float(brush.radius) / self.texture.octree.texel
        most = MOST_DABS // copies
        how = (brush.discrete, float(brush.spacing), radius, self._matrices, self._center, most)
        n = len(samples)
        if brush.discrete:
            n = make_dabs(samples, self._state, *how, np.empty((0, 19)))
        if n >= most:
            what = f"the samples are so far apart that more than {MOST_DABS} dabs lie between them"
            raise TextureError(what, WHERE, "use a larger radius or spacing, or paint in parts")
        dabs = np.empty((n * copies, 19))
        make_dabs(samples, self._state, *how, dabs)
        return dabs

    def _paint(self, touched: Touched) -> None:
        """Lay the paint on texels whose coverage changed."""
        texture, brush, cover = self.texture, self.brush, self._cover
        channel = texture.channels[brush.channel]
        action = {"erase": ERASE, "clone": COPY}.get(brush.kind, PAINT)
        pool, tiles = texture.pool.use(channel.name), texture.tiles.arrays[channel.name]
        mode = MODES.index(brush.blend)
        opacity, nothing = np.float32(brush.opacity), channel.dtype.type(channel.nothing)

        def work(begin: int, end: int) -> None:
            lay(
                touched.entries, begin, end, touched.rows, touched.changed, cover.base,
                self.layer.slots, cover.coverage, self._source, action, channel.kind, mode,
                self._color, opacity, nothing, pool, tiles,
            )  # fmt: skip

        run_ranges(work, len(touched.entries), 50)


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
        stroke.add(points, normals, pressures)
    except BaseException:
        stroke.cancel()
        raise
    return stroke.end()


def _paint_of(brush: Brush) -> np.ndarray:
    """The four numbers that a brush lays on."""
    color = (brush.value, 0.0, 0.0, 1.0) if brush.channel in ("height", "mask") else brush.color
    return np.array(color, np.float32)
