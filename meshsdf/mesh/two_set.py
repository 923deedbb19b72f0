"""The two-set property: do the faces of a mesh separate space into an inside and an outside?

A mesh has it when every closed path crosses the faces an even number of times, so that every
point off the surface can be called inside or outside without contradiction. It holds if and only
if the boundary of the mesh vanishes modulo 2 in space: almost every point of an edge lies on an
even number of face boundaries. A small circle around an edge shows that this is necessary; it is
sufficient as every cycle of faces bounds a solid (the homology of space, H2(R³; Z/2) = 0).

Faces that pass through each other, touch, or coincide therefore do no harm, and vertices need not
be manifold. An even number of faces at every edge of the index mesh suffices, whatever the
positions; where it fails, the boundary may still cancel in space: at vertices repeated at equal
positions, and at T-junctions. Three steps decide it, each only for what the one before left:
edges by index, edges after welding equal positions, edges on their supporting lines (`edge_chain`).
All three are exact for the floats of the mesh; there is no tolerance.

With orientations and integers in place of parities the same three steps tell whether the winding
number is the same whole number everywhere on each side (`oriented`).
"""

import numpy as np

from ..errors import MeshError
from ..progress import Progress, silent
from .components import describe_components
from .crack_repair import CrackRepair, close_cracks
from .edge_chain import residual_lines
from .edge_table import EdgeTable, edge_table
from .faces import degenerate_faces, face_sheets
from .flatness import is_flat
from .holes import trace_holes
from .mesh import Mesh
from .self_intersections import find_self_intersections
from .two_set_report import FLAT, Sign, TwoSetReport

SOUP = 0.5  # a mesh with more than this share of its edges open bounds nothing worth a sign


def check(
    mesh: Mesh, *, self_intersections: bool = True, progress: Progress = silent
) -> TwoSetReport:
    """Decide exactly whether a mesh separates inside from outside, and say what stands against it.

    Parameters
    ----------
    mesh : Mesh
        Any triangles; nothing is repaired and nothing refused but a mesh without faces.
    self_intersections : bool
        Also count the pairs of faces that cross, which takes longer than all the rest.
    progress : Progress
        Called between the steps.

    Raises
    ------
    MeshError
        The mesh has no faces.

    Notes
    -----
    Accuracy: exact for the given floats, except ``self_intersections`` (see there) and the
    lengths, areas and volumes, which are rounded.
    Cost: O(n + m) while edges cancel by index, O(r log r) more for r edges that do not.
    """
    if mesh.n_faces == 0:
        raise MeshError("the mesh has no faces", "check(mesh)", "pass a mesh with faces")
    progress("edges", 0.0)
    points, faces, table = mesh.welded.points, mesh.welded.faces, mesh.welded.table
    is_welded = len(points) < mesh.n_vertices
    by_index = edge_table(mesh.faces, mesh.n_vertices) if is_welded else table
    lines = None if table.is_balanced else residual_lines(table, points)
    segments = np.empty((0, 2), dtype=np.int32) if lines is None else lines.survivors(points)
    holes = trace_holes(points, segments)
    open_edges = segments if lines is None else lines.open_edges()
    n_open = len(open_edges)
    repair = close_cracks(points, faces, open_edges) if n_open else None
    progress("edges", 1.0)
    facts = {
        "two_set": len(segments) == 0,
        "oriented": lines is None or lines.is_balanced(),
        "open_edge_share": n_open / max(1, table.n_edges),
        "n_orientation_conflicts": table.n_conflicts,
        "flat": is_flat(points, faces, closed=len(segments) == 0),
    }
    sign, reason = _recommend(**facts, repair=repair)
    components = describe_components(points, faces, table, lines)
    crossings = None
    if self_intersections:
        crossings = find_self_intersections(points, faces, progress=progress)
    return TwoSetReport(
        **facts,
        **_face_facts(points, faces, table),
        two_set_by_index=by_index.is_even,
        two_set_by_welding=table.is_even,
        oriented_by_index=by_index.is_balanced,
        n_vertices=mesh.n_vertices,
        n_welded_vertices=len(points),
        n_faces=mesh.n_faces,
        n_open_edges=len(segments),
        n_tjunction_edges=table.n_odd - n_open,
        holes=holes,
        certain_beyond=max((hole.reach for hole in holes), default=0.0),
        repair=repair,
        components=components,
        self_intersections=crossings,
        recommended_sign=sign,
        recommended_sign_reason=reason,
    )


def _face_facts(points: np.ndarray, faces: np.ndarray, table: EdgeTable) -> dict:
    """What faces and vertices tell apart from the chain of edges."""
    degenerate = degenerate_faces(points, faces)
    facts = {
        "strict": True,
        "n_degenerate_faces": int(degenerate.sum()),
        "n_duplicate_faces": 0,
        "n_opposed_duplicates": 0,
        "n_nonmanifold_edges": table.n_nonmanifold,
        "n_nonmanifold_vertices": int(table.is_branching.sum()),
    }
    if len(table.half_edges) == faces.size and not table.may_have_twins:
        return facts
    sheets = face_sheets(faces)
    is_even_sheet = sheets.n_copies % 2 == 0
    is_even_sheet[sheets.sheet_of_face[degenerate]] = False
    return facts | {
        "strict": not is_even_sheet.any(),
        "n_duplicate_faces": int((sheets.n_copies - 1).sum()),
        "n_opposed_duplicates": int((sheets.n_copies - np.abs(sheets.net_copies)).sum() // 2),
    }


def _recommend(
    *,
    two_set: bool,
    oriented: bool,
    open_edge_share: float,
    n_orientation_conflicts: int,
    flat: bool,
    repair: CrackRepair | None,
) -> tuple[Sign, str]:
    """Choose the sign method that the facts allow, and say why."""
    if flat and open_edge_share <= SOUP:
        return "unsigned", FLAT
    if oriented:
        return "winding", "closed and consistently oriented: winding numbers are whole numbers"
    if two_set:
        return "parity", (
            "closed, but neighbouring faces disagree about their front: "
            "counting crossings does not ask for it"
        )
    if repair is not None:
        return "winding" if repair.oriented else "parity", "closed once its cracks are zipped"
    if open_edge_share > SOUP:
        return "unsigned", (
            f"{open_edge_share:.0%} of the edges are open: the faces enclose nothing that a sign "
            "could tell"
        )
    reason = "not closed: generalised winding numbers close the holes softly"
    if n_orientation_conflicts:
        reason += (
            f"; they rely on orientation, and neighbours disagree at "
            f"{n_orientation_conflicts} edges"
        )
    return "winding", reason
