"""The signed distance of a mesh for textures that see it: exact, or sampled once where they look.

A texture asks for distances at tens of places around every texel. Sampled in a narrow band, with
voxels that are a small share of the length the texture measures over, each costs the reading of
eight numbers that lie together.
"""

from collections import OrderedDict
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from ..arrays import Number, Points, Values
from ..errors import TextureError
from ..grid import NarrowBand
from ..grid.brick_index import BRICK
from ..kernels.band_sample import sample_band
from ..kernels.parallel import even_ranges, run_pieces
from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport, check
from ..progress import Progress, silent
from ..sdf.memory import estimate_bricks
from ..sdf.mesh_distance import MeshDistance
from ..sdf.narrow_band import MAX_HALF_WIDTH, MIN_HALF_WIDTH, mesh_to_band

SignedDistance = Callable[[Points], Any]

MOST_BRICKS = 100_000  # of a band: 200 MB
COARSER = 1.25  # how much larger voxels are tried if there would be more
COARSEST = 2.0  # times the voxel asked for; beyond that distances are not sampled
BANDS_KEPT = 2
POINTS_PER_PIECE = 16384
FARTHEST = 2.0**50  # voxels from the band's origin: what is further off is as far as the band tells


class ShapeDistance:
    """The signed distance to a mesh, exact when called, and sampled by `sampled`.

    Parameters
    ----------
    mesh : Mesh
        Any triangles with area; signs are those of `MeshDistance`.
    progress : callable
        Called while bands are made.

    Examples
    --------
    >>> from meshsdf.mesh import box_mesh
    >>> shape = ShapeDistance(box_mesh())
    >>> shape(np.array([[2.0, 0.0, 0.0]]))
    array([1.5])
    >>> near = shape.sampled(voxel_size=0.05, reach=0.2)
    >>> near(np.array([[0.42, 0.0, 0.0], [2.0, 0.0, 0.0]])).round(3)
    array([-0.08,  0.2 ])
    """

    def __init__(self, mesh: Mesh, *, progress: Progress = silent) -> None:
        self.mesh = mesh
        self.progress = progress
        self._bands: OrderedDict[tuple[float, float], SampledDistance | None] = OrderedDict()

    def __call__(self, points: Points) -> Values:
        """Return the exact signed distances, (n,), world units."""
        return self._exact(points).distance

    @cached_property
    def _report(self) -> TwoSetReport:
        return check(self.mesh, self_intersections=False)

    @cached_property
    def _exact(self) -> MeshDistance:
        return MeshDistance(self.mesh, report=self._report)

    def sampled(self, *, voxel_size: Number, reach: Number) -> SignedDistance:
        """Return a function that reads distances from a band, or the exact one.

        Parameters
        ----------
        voxel_size : float
            World units. Voxels are up to twice as large where the band would be too, and
            distances are exact where that does not help.
        reach : float
            World units; distances beyond it may be told as ``reach``.

        Notes
        -----
        Accuracy: within the reach the error is at most ``sqrt(3) / 2`` of a voxel, as of any
        function that changes no faster than its argument; where the surface's curvature over the
        place is at most 1/r, and no other part of it is as near, at most
        ``voxel_size**2 / (4 r)`` for a voxel that is small against r.
        Determinism: a band depends on the mesh and these two numbers alone.
        """
        key = float(voxel_size), float(reach)
        if key in self._bands:
            self._bands.move_to_end(key)
        else:
            self._bands[key] = self._sample(*key)
            if len(self._bands) > BANDS_KEPT:
                self._bands.popitem(last=False)
        return self._bands[key] or self

    def _sample(self, voxel_size: float, reach: float) -> "SampledDistance | None":
        size = voxel_size
        while size <= COARSEST * voxel_size:
            half_width = max(MIN_HALF_WIDTH, float(np.ceil(reach / size)))
            fits = half_width <= MAX_HALF_WIDTH
            if fits and estimate_bricks(self.mesh, size, half_width) <= MOST_BRICKS:
                band = mesh_to_band(
                    self.mesh,
                    voxel_size=size,
                    half_width=half_width,
                    report=self._report,
                    progress=self.progress,
                )
                return SampledDistance(band)
            size *= COARSER
        return None


class SampledDistance:
    """A narrow band as a function of points: the trilinear interpolant, +-background beyond it."""

    def __init__(self, band: NarrowBand) -> None:
        self.band = band
        self._first = band.to_world(band.index.origin[None] * BRICK)[0]

    def __call__(self, points: Points) -> Values:
        """Return the distances as the band tells them, (n,), world units."""
        band, first = self.band, self._first
        limit = FARTHEST * band.voxel_size
        points = np.clip(points, first - limit, first + limit)
        points = np.ascontiguousarray(points)
        out = np.empty(len(points))
        ranges = even_ranges(len(points), -(-len(points) // POINTS_PER_PIECE))

        def work(piece: int) -> None:
            sample_band(
                band.index.root, band.index.pages, band.values, band.background, first,
                band.voxel_size, points, *ranges[piece], out,
            )  # fmt: skip

        run_pieces(work, len(ranges))
        return out


def sampled(distance: SignedDistance, voxel_size: Number, reach: Number) -> SignedDistance:
    """The function to ask for distances: sampled, if it is that of a mesh and can be."""
    if isinstance(distance, ShapeDistance):
        return distance.sampled(voxel_size=voxel_size, reach=reach)
    return distance


def values_of(distance: SignedDistance, points: Points) -> Values:
    """What a signed distance says of points, checked; TextureError."""
    values = np.asarray(distance(points), np.float64)
    if values.shape != (len(points),):
        raise TextureError(
            f"the signed distance gave an array of shape {values.shape} for {len(points)} points",
            "distance(points)",
            "return (n,) values",
        )
    return values
