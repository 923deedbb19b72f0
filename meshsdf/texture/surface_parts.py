"""Which part of a divided surface a place is on, and the places next to texels on their own part.

`Octree.face_parts` gives faces numbers, so that sheets that lie close over one another and look the
same way can be told apart. What knows no more than a point and a normal finds the number here.
"""

import numpy as np
from jaxtyping import Int64

from ..arrays import Indices, Points, Values
from ..kernels.near_divided import divided_levels, near_divided
from ..kernels.octree_tables import ANY_PART
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..mesh import Mesh
from ..spatial import ClosestPoint
from .octree import Octree, Parts

POINTS_PER_PIECE = 16384
STEPS = (1.0, 2.0, 4.0)  # how far to look past a sheet of the other side, in texels


def parts_at(
    octree: Octree, closest: ClosestPoint, slots: np.ndarray, points: Points, widths: np.ndarray
) -> Parts:
    """(n,) parts, as bits, that points next to the surface are on where sheets are divided.

    ANY_PART elsewhere. ``slots`` is what is looked up, over ``widths`` (n,) or (1,), world units.
    """
    tables = octree.tables
    is_near = np.empty(len(points), bool)
    levels = np.zeros(octree.n_levels, bool)
    divided_levels(tables, levels)
    points = np.ascontiguousarray(points)
    ranges = even_ranges(len(points), max(n_threads(), len(points) // POINTS_PER_PIECE))
    run_pieces(
        lambda piece: near_divided(
            tables, levels, slots, points, widths, *ranges[piece], is_near
        ),
        len(ranges) if len(points) else 0,
    )  # fmt: skip
    parts = np.full(len(points), ANY_PART, np.int64)
    some = np.flatnonzero(is_near)
    if len(some):
        parts[some] = octree.parts_of(closest(points[some]).face_index)
    return parts


class Feet:
    """The places of a surface next to texels, each on the texel's own part.

    Parameters
    ----------
    mesh : Mesh
        What the octree was made around.
    octree : Octree
    """

    def __init__(self, mesh: Mesh, octree: Octree) -> None:
        self.mesh, self.octree = mesh, octree
        self._of_number: dict[int, tuple[ClosestPoint, np.ndarray]] = {}
        corners = mesh.triangles
        self._cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])

    def __call__(
        self, points: Points, normals: Points, parts: Int64[np.ndarray, " n"], spacing: Values
    ) -> tuple[Points, Indices]:
        """Places (n, 3) and faces (n,) nearest to texels, of those with a texel's number.

        Where that face looks away from the texel's normal, the texel is of the other side of
        something thin: it is moved along its normal by a few ``spacing`` (n,), until one looks
        along it.
        """
        feet, faces = np.empty((len(points), 3)), np.empty(len(points), np.int32)
        for part in np.unique(parts):
            own = np.flatnonzero(parts == part)
            closest, number = self._closest(int(part))
            feet[own], faces[own] = self._nearest(closest, number, points[own])
            wrong = own[self._looks_away(faces[own], normals[own])]
            for step in STEPS:
                moved = points[wrong] + step * spacing[wrong, None] * normals[wrong]
                place, face = self._nearest(closest, number, moved)
                right = ~self._looks_away(face, normals[wrong])
                feet[wrong[right]], faces[wrong[right]] = place[right], face[right]
                wrong = wrong[~right]
        return feet, faces

    @staticmethod
    def _nearest(closest: ClosestPoint, number: np.ndarray, points: Points):
        found = closest(points)
        return found.point, number[found.face_index].astype(np.int32)

    def _looks_away(self, faces: np.ndarray, normals: Points) -> np.ndarray:
        return np.einsum("nk,nk->n", self._cross[faces], normals) < 0

    def _closest(self, part: int) -> tuple[ClosestPoint, np.ndarray]:
        """Closest points on the faces of a part, and which these are."""
        if part not in self._of_number:
            faces = np.arange(self.mesh.n_faces)
            if part != ANY_PART:
                faces = np.flatnonzero(self.octree.parts_of(faces) == part)
            own = Mesh(self.mesh.vertices, self.mesh.faces[faces])
            self._of_number[part] = ClosestPoint(own), faces
        return self._of_number[part]
