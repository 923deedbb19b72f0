"""The nearest hit of rays on a mesh, watertight, and whether anything blocks a ray.

Prepare once, ask often: ``RayHits(mesh)(origins, directions)``. The work is in `kernels.mesh_rays`.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int32

from ..arrays import Barycentrics, Indices, Number, Points, Values, writable_alias
from ..box import Box
from ..errors import SpatialError
from ..kernels.bvh import EMPTY, PAD, build_tree, triangle_boxes
from ..kernels.mesh_rays import blocked_rays, nearest_hits
from ..kernels.parallel import even_ranges, run_pieces
from ..mesh import Mesh
from ..progress import Progress, silent

Directions = Float64[np.ndarray, "d 3"]
Lengths = Float64[np.ndarray, " lengths"]
Parents = Int32[np.ndarray, " nodes"]

RAYS_PER_PIECE = 16384  # some 10 ms: often enough for progress and Ctrl-C
LARGEST = 1e30  # of a coordinate, world units


@dataclass(frozen=True, eq=False)
class Hits:
    """For every ray the first place on the mesh.

    Attributes
    ----------
    distance : (n,) float64
        From the origin to the place, world units; infinite where the ray hits nothing.
    face_index : (n,) int32
        The face; the lowest of several at the same computed distance; -1 for none.
    barycentric : (n, 3) float64
        The place is ``barycentric @ corners of the face``; zero where nothing is hit.
    """

    distance: Values
    face_index: Indices
    barycentric: Barycentrics


class RayHits:
    """Hits of rays on one mesh.

    Parameters
    ----------
    mesh : Mesh
        At least one face. Any soup will do. Faces are hit from both sides; a face without area,
        or seen exactly edge-on, is not hit, but its neighbours' edges are.

    Raises
    ------
    SpatialError
        The mesh has no faces, or coordinates above 1e30.

    Notes
    -----
    Accuracy: every answer is exact for a mesh whose corners moved by at most ``16 u (|p - c| + r)``
    (u = 2**-53, p the ray's origin, c the centre of the mesh's box, r half its diagonal): 12 u in
    the kernel, the rest for moving both to the centre. How far the hit itself moves is that
    divided by the sine of the angle between ray and face.
    Watertight: no ray passes between two faces that share an edge or a corner's position.
    Determinism: the result does not depend on the order of the rays or on threads.
    Cost: O(m log m) to build, about O(log m) per ray; 150 bytes per face.
    Limits: lengths between 1e-30 and 1e30, for the boxes of the tree are float32.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> cast = RayHits(box_mesh())
    >>> hits = cast(np.array([[0.25, 0.125, 3.0]]), np.array([[0.0, 0.0, -2.0]]))
    >>> hits.distance, hits.face_index, cast.mesh.faces[hits.face_index]
    (array([2.5]), array([10], dtype=int32), array([[1, 5, 7]], dtype=int32))
    """

    def __init__(self, mesh: Mesh) -> None:
        if mesh.n_faces == 0:
            what = "the mesh has no faces, so nothing can be hit"
            fix = "pass a mesh with at least one face"
            raise SpatialError(what, "RayHits(mesh)", fix)
        self.mesh = mesh
        m = mesh.n_faces
        corners = mesh.triangles
        box = Box.around(corners.reshape(-1, 3))
        farthest = float(np.abs([box.lower, box.upper]).max())
        if farthest > LARGEST:
            fix = f"scale the mesh so that they stay below {LARGEST:g}"
            raise SpatialError(f"coordinates reach {farthest:g}", "RayHits(mesh)", fix)
        self.center, self.radius = box.center, 0.5 * box.diagonal
        corners -= self.center
        boxes = np.empty((m, 6), np.float32)
        triangle_boxes(corners, PAD * box.longest_side, boxes)
        self.face_of_slot = np.empty(m, np.int32)
        children, child_boxes = np.empty((m + 1, 2), np.int32), np.empty((m + 1, 12), np.float32)
        n_nodes = build_tree(boxes, self.face_of_slot, children, child_boxes)
        self.tree = (children[:n_nodes].copy(), child_boxes[:n_nodes].copy())
        self.corners = corners[self.face_of_slot]  # by slot, relative to the centre

    def __call__(
        self, origins: Points, directions: Directions, *, progress: Progress = silent
    ) -> Hits:
        """Find the nearest hit of every ray.

        Parameters
        ----------
        origins : (n, 3) float64
            World units, finite. A hit at the origin itself counts.
        directions : (n, 3) float64
            Finite, not zero, of any length.
        progress : Progress
            Called between pieces of work.

        Raises
        ------
        SpatialError
            An origin or a direction is not finite, a direction is zero, or there are more of
            one than of the other.
        """
        origins, directions = _rays(origins, directions, "RayHits(...)(origins, directions)")
        n = len(origins)
        hits = Hits(np.empty(n), np.empty(n, np.int32), np.empty((n, 3)))
        pieces = even_ranges(n, n // RAYS_PER_PIECE + 1)

        def work(piece: int) -> None:
            self._search(origins, directions, *pieces[piece], hits)

        run_pieces(work, len(pieces), stage="rays", progress=progress)
        return hits

    def search(self, origins: Points, directions: Directions) -> Hits:
        """As calling the object, but unchecked and on the caller's thread alone.

        The arrays have to be contiguous and writable, or a kernel is compiled anew.
        """
        n = len(origins)
        hits = Hits(np.empty(n), np.empty(n, np.int32), np.empty((n, 3)))
        self._search(origins, directions, 0, n, hits)
        return hits

    def is_blocked(
        self, origins: Points, directions: Directions, longest: Number | Lengths = np.inf
    ) -> Bool[np.ndarray, " n"]:
        """Tell of every ray whether it hits anything within ``longest`` world units.

        Parameters
        ----------
        origins, directions : (n, 3) float64
            As for calling the object.
        longest : float or (n,) float64
            World units, not negative; the end itself counts.

        Returns
        -------
        blocked : (n,) bool

        Raises
        ------
        SpatialError
            As for calling the object; or a length is negative or NaN, or there are not n of them.
        """
        where = "RayHits(...).is_blocked(origins, directions, longest)"
        origins, directions = _rays(origins, directions, where)
        n = len(origins)
        lengths = np.array(longest, np.float64)
        if lengths.shape not in ((), (n,)):
            fix = "pass one length, or one per ray"
            raise SpatialError(f"{lengths.size} lengths for {n} rays", where, fix)
        if not (lengths >= 0).all():
            what = f"{int((~(lengths >= 0)).sum())} lengths are negative or NaN"
            raise SpatialError(what, where, "pass lengths of at least 0")
        lengths = np.broadcast_to(lengths, n).copy()
        blocked = np.empty(n, bool)
        pieces = even_ranges(n, n // RAYS_PER_PIECE + 1)

        def work(piece: int) -> None:
            blocked_rays(
                *(origins, directions, lengths, *pieces[piece]),
                *(self.center, self.corners, *self.tree, blocked),
            )

        run_pieces(work, len(pieces))
        return blocked

    def homes_and_parents(self) -> tuple[Indices, Parents]:
        """Return which child, 2 * node + side, holds each face, and which one each node is."""
        codes = self.tree[0].ravel()
        places = np.arange(len(codes), dtype=np.int32)
        parents = np.full(len(codes) // 2, -1, np.int32)
        parents[codes[codes >= 0]] = places[codes >= 0]
        leaves = places[codes < EMPTY]
        firsts, counts = np.divmod(-2 - codes[leaves], 8)
        by_slot = np.argsort(firsts)
        homes = np.empty(self.mesh.n_faces, np.int32)
        homes[self.face_of_slot] = np.repeat(leaves[by_slot], counts[by_slot] + 1)
        return homes, parents

    def _search(
        self, origins: Points, directions: Directions, begin: int, end: int, hits: Hits
    ) -> None:
        nearest_hits(
            *(origins, directions, begin, end),
            *(self.center, self.corners, self.face_of_slot, *self.tree),
            *(hits.distance, hits.face_index, hits.barycentric),
        )


def _rays(origins: Points, directions: Directions, where: str) -> tuple[Points, Directions]:
    """The arrays as kernels want them; SpatialError if they are no rays."""
    if len(origins) != len(directions):
        what = f"{len(origins)} origins and {len(directions)} directions"
        raise SpatialError(what, where, "pass one direction per origin")
    fix = "leave those rays out"
    for name, values in (("origins", origins), ("directions", directions)):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            what = f"{len(bad)} of {len(values)} {name} are NaN or infinite (first: ray {bad[0]})"
            raise SpatialError(what, where, fix)
    zero = np.flatnonzero((directions == 0).all(axis=1))
    if len(zero):
        what = f"{len(zero)} of {len(directions)} directions are zero (first: ray {zero[0]})"
        raise SpatialError(what, where, fix)
    contiguous = (np.ascontiguousarray(array) for array in (origins, directions))
    return tuple(writable_alias(array) for array in contiguous)
