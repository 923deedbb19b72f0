"""The closest point of a mesh to any points, exact to rounding.

Prepare once, ask often: ``ClosestPoint(mesh)(points)``. The work is in `kernels.bvh` (tree and
search) and `kernels.point_triangle` (one triangle, with its error bound).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int32

from ..arrays import Barycentrics, Indices, Points, Values
from ..box import Box
from ..errors import SpatialError
from ..kernels.bvh import (
    PAD,
    build_tree,
    closest_details,
    closest_slots,
    morton_codes,
    triangle_boxes,
)
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..kernels.point_triangle import FRAME_SIZE, build_frames
from ..mesh import Mesh
from ..progress import Progress, silent

Seeds = Int32[np.ndarray, " seeds"]  # one per point, or none at all

UNIT_ROUNDOFF = 2.0**-53
ROUNDING = 160 * UNIT_ROUNDOFF  # times (|p - center| + radius of the mesh); see ClosestPoint
POINTS_PER_PIECE = 16384  # about 10 ms: often enough for progress and Ctrl-C
FEWEST_PER_PIECE = 512  # fewer are not worth a thread
LARGEST = 1e30  # of a coordinate, world units
MORTON_FROM = 256  # fewer points are asked in the order they come


@dataclass(frozen=True, eq=False)
class ClosestPoints:
    """For every query the nearest place on the mesh.

    Attributes
    ----------
    distance : (n,) float64
        Euclidean distance, world units, never negative.
    point : (n, 3) float64
        The closest point, world units.
    face_index : (n,) int32
        The face it lies on; of several, the lowest among those whose computed distance is least.
    barycentric : (n, 3) float64
        ``point = barycentric @ corners of the face``; each in [0, 1], together 1.
    """

    distance: Values
    point: Points
    face_index: Indices
    barycentric: Barycentrics


@dataclass(frozen=True, eq=False)
class Distances:
    """Distance (n,) float64 to the mesh and face (n,) int32 it is attained on."""

    distance: Values
    face_index: Indices


class ClosestPoint:
    """Closest points of one mesh, for any points: near or far, in any order.

    Parameters
    ----------
    mesh : Mesh
        At least one face. Any soup will do: open, overlapping, degenerate (a face without area
        counts as the segment or point it is).

    Raises
    ------
    SpatialError
        The mesh has no faces.

    Notes
    -----
    Accuracy: ``|distance - truth| <= rounding_bound(points)``, which is
    ``160 u (|p - c| + r)``, u = 2**-53, c the centre of the mesh's box and r half its
    diagonal: 50 u for the kernel (`kernels.point_triangle`) on ``|p - a| + L``, where
    ``|p - a| <= |p - c| + r`` and ``L <= 2 r``, 4 u for moving both to the centre, rounded up. Far
    from the origin nothing else is lost.
    Determinism: the result does not depend on the order of the points, on seeds or on threads.
    Cost: O(m log m) to build, O(log m) per point near the surface; 240 bytes per face.
    Limits: lengths between 1e-30 and 1e30, for the boxes of the tree are float32.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> found = ClosestPoint(box_mesh())(np.array([[2.0, 0.25, 0.0]]))
    >>> found.distance, found.point
    (array([1.5]), array([[0.5 , 0.25, 0.  ]]))
    """

    def __init__(self, mesh: Mesh) -> None:
        if mesh.n_faces == 0:
            raise SpatialError(
                "the mesh has no faces, so nothing is closest",
                "ClosestPoint(mesh)",
                "pass a mesh with at least one face",
            )
        self.mesh = mesh
        m = mesh.n_faces
        self.corners = mesh.triangles
        box = Box.around(self.corners.reshape(-1, 3))
        _check_size(box)
        self.center, self.radius = box.center, 0.5 * box.diagonal
        self.corners -= self.center
        boxes = np.empty((m, 6), np.float32)
        triangle_boxes(self.corners, PAD * box.longest_side, boxes)
        self.face_of_slot = np.empty(m, np.int32)
        children, child_boxes = np.empty((m + 1, 2), np.int32), np.empty((m + 1, 12), np.float32)
        n_nodes = build_tree(boxes, self.face_of_slot, children, child_boxes)
        self.tree = (children[:n_nodes].copy(), child_boxes[:n_nodes].copy())
        self.slot_of_face = np.empty(m, np.int32)
        self.slot_of_face[self.face_of_slot] = np.arange(m, dtype=np.int32)
        self.frames = np.empty((m, FRAME_SIZE))
        pieces = point_ranges(m)
        run_pieces(lambda piece: self._build_frames(*pieces[piece]), len(pieces))

    def __call__(
        self,
        points: Points,
        *,
        seed_faces: Seeds | None = None,
        progress: Progress = silent,
    ) -> ClosestPoints:
        """Find the closest point to each of (n, 3) points, world units.

        Parameters
        ----------
        points : (n, 3) float64
            World units, finite.
        seed_faces : (n,) int32, optional
            A face to start from, per point: a near one makes the search faster, none changes
            the answer.
        progress : Progress
            Called between pieces of work.

        Raises
        ------
        SpatialError
            A point is not finite, or the seeds are not faces, one per point.
        """
        _check_points(points)
        centered = points - self.center
        squares, slots = self.search(centered, self._seeds(len(points), seed_faces), progress)
        n = len(points)
        faces, weights, feet = np.empty(n, np.int32), np.empty((n, 3)), np.empty((n, 3))
        pieces = point_ranges(n)

        def work(piece: int) -> None:
            begin, end = pieces[piece]
            closest_details(
                *(centered, begin, end, slots, self.frames, self.face_of_slot, self.corners),
                *(faces, weights, feet),
            )

        run_pieces(work, len(pieces))
        return ClosestPoints(np.sqrt(squares), feet + self.center, faces, weights)

    def distances(
        self,
        points: Points,
        *,
        seed_faces: Seeds | None = None,
        progress: Progress = silent,
    ) -> Distances:
        """Return distance and face only; otherwise as calling the object."""
        _check_points(points)
        seeds = self._seeds(len(points), seed_faces)
        squares, slots = self.search(points - self.center, seeds, progress)
        return Distances(np.sqrt(squares), self.face_of_slot[slots])

    def rounding_bound(self, points: Points) -> Values:
        """(n,) proven bound on ``|distance - true distance|``, world units."""
        return ROUNDING * (np.linalg.norm(points - self.center, axis=1) + self.radius)

    def _build_frames(self, begin: int, end: int) -> None:
        build_frames(self.corners, self.face_of_slot, begin, end, self.frames)

    def search(
        self, centered: Points, seeds: Seeds, progress: Progress = silent
    ) -> tuple[Values, Indices]:
        """Squared distances and slots of (n, 3) points relative to ``center``, unchecked.

        ``seeds`` is empty or holds a slot per point. A slot is a place in ``frames``, and
        ``face_of_slot[slot]`` is its face.
        """
        sequence = morton_order(centered)
        n = len(centered)
        squares, slots = np.empty(n), np.empty(n, np.int32)
        pieces = point_ranges(n)

        def work(piece: int) -> None:
            begin, end = pieces[piece]
            closest_slots(
                *(centered, sequence, begin, end, seeds),
                *(self.frames, self.face_of_slot, *self.tree, squares, slots),
            )

        run_pieces(work, len(pieces), stage="closest points", progress=progress)
        return squares, slots

    def _seeds(self, n: int, seed_faces: Seeds | None) -> Seeds:
        if seed_faces is None:
            return np.empty(0, np.int32)
        m = self.mesh.n_faces
        if len(seed_faces) != n:
            what = f"{len(seed_faces)} seed faces for {n} points"
        elif n > 0 and (seed_faces.min() < 0 or seed_faces.max() >= m):
            what = f"seed faces from {seed_faces.min()} to {seed_faces.max()} of a mesh with {m}"
        else:
            return self.slot_of_face[seed_faces]
        fix = "pass one face index per point, from 0 to n_faces - 1"
        raise SpatialError(what, "ClosestPoint(...)(seed_faces=...)", fix)


def _check_size(box: Box) -> None:
    """The search squares lengths and keeps boxes in float32."""
    farthest = float(np.abs([box.lower, box.upper]).max())
    if farthest > LARGEST:
        raise SpatialError(
            f"coordinates reach {farthest:g}",
            "ClosestPoint(mesh)",
            f"scale the mesh so that they stay below {LARGEST:g}",
        )


def _check_points(points: Points) -> None:
    if np.isfinite(points).all():
        return
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    raise SpatialError(
        f"{len(bad)} of {len(points)} points are NaN or infinite (first: point {bad[0]})",
        "ClosestPoint(...)(points)",
        "leave those points out",
    )


def point_ranges(n: int) -> list[tuple[int, int]]:
    """Split ``range(n)`` into pieces of work: at least one per core, unless these were tiny."""
    few = min(n_threads(), n // FEWEST_PER_PIECE)
    return even_ranges(n, max(few, n // POINTS_PER_PIECE + 1))


def morton_order(points: Points) -> Indices:
    """Order of the points along a Z-curve through the cube around them."""
    if len(points) < MORTON_FROM:
        return np.arange(len(points), dtype=np.int32)
    lower = points.min(axis=0)
    side = float((points.max(axis=0) - lower).max())
    codes = np.empty(len(points), np.uint32)
    morton_codes(points, lower, 1024.0 / side if side > 0 else 0.0, codes)
    return np.argsort(codes).astype(np.int32)
