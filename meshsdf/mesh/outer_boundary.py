"""The faces, and parts of faces, that bound the union of overlapping closed bodies.

A closed oriented mesh gives every point off it a whole winding number w; inside is where w is not
0. Where bodies overlap, or one overlaps itself, some faces have w other than 0 on both sides: they
bound nothing, and no distance may be measured to them.

Faces that meet no other face but at common corners and edges are whole: w is constant along each
side of one, and goes on across every edge that two of them share alone. One winding number on each
side of one face therefore decides a whole patch. Faces that are met by others are cut into convex
pieces which nothing crosses (`kernels.sheet_cuts`), and every piece is decided by itself.

Pairs that meet are found without doubt (`kernels.sheet_pairs`): rounding can only add pairs, and
a pair too many costs time alone.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int32

from ..arrays import FaceLabels, FaceMask, Faces, Points
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..progress import Progress, silent
from .edge_chain import residual_edge_lines
from .edge_table import EdgeTable, edge_table
from .face_pieces import FacePieces, cut_met_faces
from .face_tree import FaceTree
from .meetings import PIECES_PER_THREAD, find_meetings
from .pieces import connected_labels

# Lengths in units between half the longest side of the box and all of it. Corners of
# pieces and samples are off by less than 40 u (u = 2**-53), and positions that were turned or
# scaled in float64 by a few u more.
NEAR = 2.0**-44
SAME_HEIGHT = 2.0 * NEAR  # a sheet so near to a sample is crossed together with it

CornerWeights = Float64[np.ndarray, "k 3 3"]
EdgeLines = tuple[Int32[np.ndarray, "l 3"], Int32[np.ndarray, "g 2"]]


@dataclass(frozen=True, eq=False)
class OuterBoundary:
    """Triangles that bound a union: whole faces of a mesh, and parts of faces.

    Attributes
    ----------
    face_ids : (k,) int32
        The face that each triangle is a part of, ascending.
    corners : (k, 3) int32
        Its corners: 0, 1 and 2 are those of its face, and ``3 + i`` is cut corner i.
    cut_face : (c,) int32
        The face that each cut corner lies on.
    cut_weights : (c, 3) float64
        Its barycentrics there.
    n_inner : int
        Faces of the mesh that are missing, wholly or in part.
    """

    face_ids: FaceLabels
    corners: Faces
    cut_face: Int32[np.ndarray, " c"]
    cut_weights: Float64[np.ndarray, "c 3"]
    n_inner: int

    def place(
        self, points: Points, faces: Faces
    ) -> tuple[Float64[np.ndarray, "p 3"], Int32[np.ndarray, "k 3"]]:
        """Return the triangles as points and faces, for a mesh with this or a moved geometry.

        The mesh's own points come first, the cut corners follow.
        """
        cuts = np.einsum("cij,ci->cj", points[faces[self.cut_face]], self.cut_weights)
        own = np.take_along_axis(faces[self.face_ids], np.minimum(self.corners, 2), axis=1)
        cut = len(points) - 3 + self.corners
        return np.concatenate([points, cuts]), np.where(self.corners < 3, own, cut).astype(np.int32)

    @property
    def weights(self) -> CornerWeights:
        """Barycentrics of each corner of each triangle on its face."""
        return np.concatenate([np.eye(3), self.cut_weights])[self.corners]


def outer_boundary(
    points: Points,
    faces: Faces,
    *,
    table: EdgeTable | None = None,
    lines: EdgeLines | None = None,
    progress: Progress = silent,
) -> OuterBoundary | None:
    """Find the boundary of the set of points with a winding number other than 0.

    Parameters
    ----------
    points : (u, 3) float64
        Welded positions.
    faces : (m, 3) int32
        Faces with area whose oriented edges cancel, by index or on their lines, so that winding
        numbers are whole.
    table, lines : optional
        Edges of the faces, and what `residual_edge_lines` makes of them.
    progress : Progress
        Called between pieces of the work.

    Returns
    -------
    boundary : OuterBoundary or None
        None where every face bounds the union and none comes twice: nothing to leave out. Of
        coincident sheets one is kept, turned as their sum is.

    Notes
    -----
    Accuracy: up to ``16 NEAR`` = 9e-13 of the longest side of the box, in all. Faces in one plane
    to within NEAR, and sheets nearer than twice that where they are compared, count as one: bodies
    that touch are joined, wider gaps stay open, and what is between may go either way. Lines of
    cuts are off by NEAR at most, and pieces narrower than 4 NEAR are left out.
    Cost: O(m log m), and one winding number per patch of uncut faces and per piece of cut ones.
    """
    if table is None:
        table = edge_table(faces, len(points))
    if lines is None:
        lines = residual_edge_lines(faces, points, table=table)
    tree = FaceTree.of(points, faces)
    meetings = find_meetings(tree, NEAR, progress)
    judge = _Judge(tree, faces, lines, meetings.coplanar(), progress)
    is_met = meetings.is_met
    seeds, patch = _seeds(tree.points[faces], _patches(table, is_met), np.flatnonzero(~is_met))
    pieces = cut_met_faces(tree, faces, meetings, NEAR, progress)
    owners = np.concatenate([seeds, pieces.face])
    thirds = np.full((len(seeds), 3), 1.0 / 3.0)
    bounds = judge.bounds(owners, np.concatenate([thirds, pieces.center]))
    if bounds.all():
        return None
    kept = bounds[len(seeds) :]
    whole = np.zeros(len(faces), np.bool_)
    whole[~is_met] = bounds[: len(seeds)][patch]
    whole[pieces.face] = True
    whole[pieces.face[~kept]] = False
    return _assemble(tree.points, faces, whole, pieces.among(kept & ~whole[pieces.face]))


def _patches(table: EdgeTable, is_met: FaceMask) -> FaceLabels:
    """Labels of all faces; those that meet no other share one where plain edges connect them."""
    first = np.cumsum(table.n_uses) - table.n_uses
    plain = first[(table.n_uses == 2) & (table.net_uses == 0)]
    links = np.stack([table.half_edges[plain], table.half_edges[plain + 1]], axis=1) // 3
    return connected_labels(len(is_met), links[~is_met[links].any(axis=1)])


def _seeds(
    triangles: np.ndarray, label: FaceLabels, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The widest face of every patch of the faces ``free``, and the patch of each of those."""
    corners = triangles[free]
    p, q = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    pp, qq, pq = (np.einsum("ij,ij->i", u, v) for u, v in ((p, p), (q, q), (p, q)))
    around = np.sqrt(pp) + np.sqrt(qq) + np.sqrt(np.maximum(pp + qq - 2.0 * pq, 0.0))
    width = np.sqrt(np.maximum(pp * qq - pq * pq, 0.0)) / around
    _, patch = np.unique(label[free], return_inverse=True)
    order = np.lexsort((-width, patch))
    is_first = np.diff(patch[order], prepend=-1) != 0
    return free[order[is_first]].astype(np.int32), patch


@dataclass(frozen=True, eq=False)
class _Judge:
    """Tells which places on faces lie on the boundary of the union."""

    tree: FaceTree
    faces: Faces
    lines: EdgeLines
    coplanar: tuple[np.ndarray, np.ndarray]
    progress: Progress

    def bounds(
        self, owners: Int32[np.ndarray, " n"], weights: Float64[np.ndarray, "n 3"]
    ) -> Bool[np.ndarray, " n"]:
        """Judge the places with barycentrics ``weights`` on the faces ``owners``."""
        corners = self.tree.points[self.faces[owners]]
        places = np.einsum("nij,ni->nj", corners, weights)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        steepest = np.abs(normal).argmax(axis=1)
        bounds = np.empty(len(owners), np.bool_)
        for axis in range(3):
            some = np.flatnonzero(steepest == axis)
            if len(some):
                bounds[some] = self._along(axis, owners[some], places[some])
        return bounds

    def _along(self, axis: int, owners: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Judge by the lines along an axis."""
        from ..kernels.sheet_sides import wind_sheets  # most meshes never come here

        tree = self.tree.turned(axis)
        edge_line, line_ends = self.lines
        edge_line = edge_line[tree.order] if len(edge_line) else edge_line
        places = np.ascontiguousarray(places[:, [(axis + 1) % 3, (axis + 2) % 3, axis]])
        n = len(owners)
        above, below, leaders = np.empty((3, n), np.int32)
        pieces = even_ranges(n, PIECES_PER_THREAD * n_threads())

        def wind(piece: int) -> None:
            wind_sheets(
                *(places, owners, *pieces[piece], tree.points, tree.faces),
                *(edge_line, line_ends),
                *(tree.order, tree.children, tree.child_boxes),
                *(*self.coplanar, SAME_HEIGHT, above, below, leaders),
            )

        run_pieces(wind, len(pieces), stage="union", progress=self.progress)
        return ((above != 0) != (below != 0)) & (leaders == owners)


def _assemble(points: Points, faces: Faces, whole: FaceMask, pieces: FacePieces) -> OuterBoundary:
    """Whole faces, and the triangles of pieces of others; ``points`` are normalised."""
    # Corners of pieces: the face's own, and others, each of these once per face
    face = np.repeat(pieces.face, pieces.n_corners)
    corner = pieces.corners.argmax(axis=1)
    own = (pieces.corners == 1.0).any(axis=1)
    rows = np.column_stack([face[~own], pieces.corners[~own]])
    cuts, place = np.unique(rows, axis=0, return_inverse=True)
    corner[~own] = 3 + place.ravel()
    # Triangles without width bound nothing
    fans, piece = pieces.fans()
    places = np.einsum("cij,ci->cj", points[faces[face]], pieces.corners)
    a, b, c = (places[fans[:, i]] for i in range(3))
    double = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.sqrt(np.max([((q - p) ** 2).sum(1) for p, q in ((a, b), (b, c), (c, a))], axis=0))
    wide = double > NEAR * longest
    n_whole = np.count_nonzero(whole)
    ids = np.concatenate([np.flatnonzero(whole), pieces.face[piece[wide]]])
    corners = np.concatenate([np.tile(np.arange(3), (n_whole, 1)), corner[fans[wide]]])
    order = np.argsort(ids, kind="stable")
    return OuterBoundary(
        ids[order].astype(np.int32),
        corners[order].astype(np.int32),
        cuts[:, 0].astype(np.int32),
        np.ascontiguousarray(cuts[:, 1:]),
        len(faces) - int(n_whole),
    )
