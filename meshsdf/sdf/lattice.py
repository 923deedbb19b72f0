"""The lattice a volume lives on, and a mesh placed on it without loss.

Node (i, j, k) lies at ``voxel_size * (i, j, k) + translation``. Kernels work in local index
coordinates: voxels from a node near the mesh, so that numbers stay small however far the mesh is
from the origin. That node's world position is one rounded float64 triple; subtracting it from
vertices beside it is exact to the spacing of floats there.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Ijk1, Number, Points, Vector3
from ..errors import SdfError
from ..grid.brick_index import BRICK, PAGE
from ..mesh import Mesh

PAGE_NODES = BRICK * PAGE
FINEST_VOXEL, LARGEST_VOXEL = 1e-30, 1e30  # so that a band's distances are normal float32 numbers
SMALLEST_MESH = 1e-4  # voxels; anything smaller is one point to its volume
COARSEST = 0.01  # voxels; coordinates stored more coarsely than this have lost their shape


@dataclass(frozen=True, eq=False)
class Lattice:
    """Where the nodes lie, and which pages of bricks hold the mesh and its band.

    Attributes
    ----------
    voxel_size : float
        World units.
    translation : (3,) float64
        World position of node (0, 0, 0).
    page_origin, n_pages : (3,) int64
        First page and number of pages along each axis.
    """

    voxel_size: float
    translation: Vector3
    page_origin: Ijk1
    n_pages: Ijk1

    @classmethod
    def around(
        cls, points: Points, voxel_size: Number, translation: Vector3, reach: Number
    ) -> "Lattice":
        """Return the pages that hold every node within ``reach`` voxels of the points' box.

        Raises
        ------
        SdfError
            The points are so far from the origin that floats there are no finer than a voxel.
        """
        low, high = points.min(axis=0), points.max(axis=0)
        spacing = float(np.spacing(np.maximum(np.abs(low), np.abs(high)).max())) / voxel_size
        if spacing > COARSEST:
            raise SdfError(
                f"coordinates near {np.abs(points).max():g} are stored to {spacing:.2g} voxels",
                f"mesh_to_band(voxel_size={voxel_size:g})",
                "move the mesh nearer to the origin, or use larger voxels",
            )
        first = np.floor((low - translation) / voxel_size - reach - 1).astype(np.int64)
        last = np.ceil((high - translation) / voxel_size + reach + 1).astype(np.int64)
        page_origin = first // PAGE_NODES
        return cls(voxel_size, translation, page_origin, last // PAGE_NODES - page_origin + 1)

    @property
    def origin_ijk(self) -> Ijk1:
        """(3,) index coordinates of the local origin."""
        return self.page_origin * PAGE_NODES

    def to_local(self, points: Points) -> Points:
        """World units -> voxels from the local origin."""
        return (points - self._origin()) / self.voxel_size

    def to_world(self, local: Points) -> Points:
        """Voxels from the local origin -> world units."""
        return self.voxel_size * local + self._origin()

    def _origin(self) -> Vector3:
        return self.voxel_size * self.origin_ijk + self.translation


def resolve_voxel_size(mesh: Mesh, resolution: Number | None, voxel_size: Number | None) -> float:
    """Return the voxel size asked for, directly or as the box's longest side / resolution.

    Raises
    ------
    SdfError
        Both or neither are given, one is not a positive finite number, or the mesh is a point.
    """
    where = f"mesh_to_band(resolution={resolution}, voxel_size={voxel_size})"
    if (resolution is None) == (voxel_size is None):
        seen = "both" if resolution is not None else "neither"
        raise SdfError(f"{seen} of resolution and voxel_size given", where, "give exactly one")
    name, value = ("resolution", resolution) if voxel_size is None else ("voxel_size", voxel_size)
    if not (np.isfinite(value) and value > 0):
        raise SdfError(f"{name} is {value:g}", where, f"give a {name} above 0")
    longest = np.float64(mesh.box.longest_side)
    if voxel_size is not None:
        return _checked_size(float(voxel_size), longest, where)
    if longest == 0:
        raise SdfError("the mesh is a single point", where, "check the units of the mesh")
    with np.errstate(over="ignore", under="ignore"):
        return _checked_size(float(longest / float(resolution)), longest, where)


def _checked_size(size: float, longest: Number, where: str) -> float:
    if longest < SMALLEST_MESH * size:
        what = f"voxels would be {size:g} wide, the mesh is {longest:g} long"
        raise SdfError(what, where, "use smaller voxels, or check the units of the mesh")
    if not FINEST_VOXEL <= size <= LARGEST_VOXEL:
        span = f"{FINEST_VOXEL:g} to {LARGEST_VOXEL:g}"
        what = f"voxels would be {size:g} wide; float32 distances want {span}"
        raise SdfError(what, where, "choose another resolution, or other units for the mesh")
    return size
