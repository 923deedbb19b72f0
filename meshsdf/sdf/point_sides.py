"""Inside or outside, for any points."""

import numpy as np
from jaxtyping import Bool, Int32

from ..arrays import FaceLabels, Points, Values
from ..kernels.parallel import run_pieces
from ..kernels.point_crossings import count_above
from ..mesh import Mesh, outer_boundary, residual_edge_lines
from ..mesh.edge_table import edge_table
from ..mesh.two_set import TwoSetReport
from ..mesh.welded import Welded, weld_mesh
from ..progress import Progress, silent
from ..spatial.closest_point import ClosestPoint, morton_order, point_ranges
from ..spatial.winding_number import winding_number
from .placed_mesh import bounding_faces
from .sign import SignChoice
from .union import MeshParts, aside, beside_faces, parts_of_union, require_faces

Sides = Bool[np.ndarray, " n"]

DOUBTFUL = 0.05  # of the winding number from 1/2: ten times the error seen of the fast sum


class PointSides:
    """Tells which points a mesh has inside, as `choose_sign` decided.

    Parameters
    ----------
    mesh : Mesh
        Any mesh with faces.
    query : ClosestPoint
        Of the faces that distances are measured to.
    choice : SignChoice
        "parity" or "winding" by crossings; else generalised winding numbers.
    report : TwoSetReport
        What `check` said of the mesh.

    Notes
    -----
    Accuracy: by crossings the answer is exact for every point farther from the faces than
    ``query.rounding_bound`` (see `kernels.point_crossings`), and farther than the width of the
    cracks where these were zipped. Generalised winding numbers are libigl's, summed exactly
    where the fast sum is within 0.05 of 1/2.
    """

    def __init__(
        self, mesh: Mesh, query: ClosestPoint, choice: SignChoice, report: TwoSetReport
    ) -> None:
        self.mesh, self.query, self.choice = mesh, query, choice
        if not choice.by_crossings:
            return
        closed = mesh.welded
        if report.repair is not None:
            closed = weld_mesh(closed.points, report.repair.labels[closed.faces])
            report = None
        self._prepare(closed, report)

    def _prepare(self, closed: Welded, report: TwoSetReport | None) -> None:
        keep = bounding_faces(closed, cancel=self.choice.method, report=report)
        self._ids, faces = np.flatnonzero(keep).astype(np.int32), closed.faces[keep]
        tree = self.query
        if report is None:
            tree = ClosestPoint(Mesh(closed.points, faces))
        table = edge_table(faces, len(closed.points))
        lines, self._line_ends = residual_edge_lines(faces, closed.points, table=table)
        self._closed = closed.points, faces, table, (lines, self._line_ends)
        self._points = closed.points - tree.center
        self._center, self._tree = tree.center, tree.tree
        self._faces = faces[tree.face_of_slot]
        self._lines = lines[tree.face_of_slot] if len(lines) else lines

    def find_union(self, placed_ids: FaceLabels, *, search: bool) -> MeshParts | None:
        """Find the parts of the mesh that bound the union of its bodies, if some do not.

        Where they do not, the side of a point will be told a hair's breadth beside it.

        Parameters
        ----------
        placed_ids : (p,) int32
            The faces that distances are measured to otherwise.
        search : bool
            Whether overlaps are likely; if not, a sample of the faces is looked at first.
        """
        points, faces, table, lines = self._closed
        if not search and np.abs(self.crossings(beside_faces(points, faces))).max() <= 1:
            return None
        found = outer_boundary(points, faces, table=table, lines=lines)
        if found is None:
            return None
        require_faces(found)
        self._center = self._center - aside(self.mesh.welded.points)
        welded = self.mesh.welded
        return parts_of_union(found, placed_ids, self._ids, welded.points, welded.faces)

    def __call__(self, points: Points, progress: Progress = silent) -> tuple[Sides, Sides | None]:
        """Return which of (n, 3) finite points lie inside, and of which that is not certain.

        The second is None unless generalised winding numbers decide; then it tells which of them
        are within 0.05 of 1/2.
        """
        if self.choice.method == "unsigned":
            return np.zeros(len(points), np.bool_), None
        if not self.choice.by_crossings:
            number = self._wound(points)
            return number > 0.5, np.abs(number - 0.5) < DOUBTFUL
        counts = self.crossings(points, progress)
        return (counts % 2 != 0 if self.choice.method == "parity" else counts != 0), None

    def crossings(self, points: Points, progress: Progress = silent) -> Int32[np.ndarray, " n"]:
        """Return the winding number of a closed oriented mesh around each point."""
        centered = points - self._center
        sequence = morton_order(centered)
        counts = np.empty(len(points), np.int32)
        pieces = point_ranges(len(points))

        def work(piece: int) -> None:
            count_above(
                *(centered, sequence, *pieces[piece], self._points, self._faces),
                *(self._lines, self._line_ends, *self._tree, counts),
            )

        run_pieces(work, len(pieces), stage="sign", progress=progress)
        return counts

    def _wound(self, points: Points) -> Values:
        number = np.abs(winding_number(self.mesh, points))
        doubtful = np.abs(number - 0.5) < DOUBTFUL
        number[doubtful] = np.abs(winding_number(self.mesh, points[doubtful], exact=True))
        return number
