"""What the two-set check found; `check` fills it, `two_set_words` puts it into words."""

from dataclasses import dataclass
from typing import Literal

from ..arrays import Vector3
from .components import Component
from .crack_repair import CrackRepair
from .holes import Hole
from .self_intersections import SelfIntersections

Sign = Literal["winding", "parity", "unsigned"]
FLAT = "all faces lie in one plane: the mesh has no thickness, so nothing is inside"


@dataclass(frozen=True, eq=False)
class TwoSetReport:
    """What `check` found; every verdict with its evidence.

    Attributes
    ----------
    two_set : bool
        The faces separate space into two sets.
    two_set_by_index : bool
        The mesh's own indices already show it: every edge has an even number of faces.
    two_set_by_welding : bool
        They show it once equal positions share an index. Where only ``two_set`` holds, it is by
        edges that cancel on common lines.
    oriented : bool
        Neighbouring faces agree, so winding numbers are integers. Implies ``two_set``.
    oriented_by_index : bool
        The mesh's own indices already show that.
    strict : bool
        No two faces with the same corners, or always an odd number: every face separates.
        Overlaps of faces with different corners are not looked for.
    n_vertices, n_welded_vertices, n_faces : int
        As stored; different positions; as stored.
    n_open_edges : int
        Straight segments of boundary that survive: the edges of all holes.
    n_tjunction_edges : int
        Edges with an odd number of faces after welding that cancel on their lines.
    open_edge_share : float
        Edges with an odd number of faces that do not cancel, over all edges.
    holes : tuple of Hole
        The longest first.
    certain_beyond : float
        World units. Fill every hole in any way inside the convex hull of its rim: no point further
        than this from all rims changes sides (see `holes`). 0 for a two-set mesh.
    repair : CrackRepair or None
        A weld of nearby vertices that closes a mesh which is open only by cracks; None if it is
        closed, or if its holes are wider than cracks.
    components : tuple of Component
        In order of their first faces.
    n_degenerate_faces : int
        Of exactly zero area.
    n_duplicate_faces : int
        Faces whose corners an earlier face has.
    n_opposed_duplicates : int
        Of these, pairs that face opposite ways.
    n_nonmanifold_edges : int
        With more than two faces, after welding.
    n_nonmanifold_vertices : int
        Whose faces form neither one cycle nor one fan, after welding.
    n_orientation_conflicts : int
        Edges with an even number of faces that use it unequally often each way.
    flat : bool
        All faces lie in one plane, within rounding (see `is_flat`): nothing is inside.
    self_intersections : SelfIntersections or None
        Information only; None when not asked for.
    recommended_sign : "winding", "parity" or "unsigned"
        How to tell inside from outside.
    recommended_sign_reason : str
        Why.
    """

    two_set: bool
    two_set_by_index: bool
    two_set_by_welding: bool
    oriented: bool
    oriented_by_index: bool
    strict: bool
    n_vertices: int
    n_welded_vertices: int
    n_faces: int
    n_open_edges: int
    n_tjunction_edges: int
    open_edge_share: float
    holes: tuple[Hole, ...]
    certain_beyond: float
    repair: CrackRepair | None
    components: tuple[Component, ...]
    n_degenerate_faces: int
    n_duplicate_faces: int
    n_opposed_duplicates: int
    n_nonmanifold_edges: int
    n_nonmanifold_vertices: int
    n_orientation_conflicts: int
    flat: bool
    self_intersections: SelfIntersections | None
    recommended_sign: Sign
    recommended_sign_reason: str

    @property
    def crack_width(self) -> float | None:
        """How far vertices must move to close a mesh open only by cracks, world units."""
        return None if self.repair is None else self.repair.width

    @property
    def n_components(self) -> int:
        """Number of connected parts."""
        return len(self.components)

    @property
    def n_self_intersections(self) -> int | None:
        """Number of pairs of faces that cross; None when not asked for."""
        return None if self.self_intersections is None else self.self_intersections.n_pairs

    @property
    def first_self_intersection(self) -> Vector3 | None:
        """Where the first such pair crosses."""
        return None if self.self_intersections is None else self.self_intersections.first_place

    def to_json(self) -> dict:
        """Plain Python types, ready for ``json.dumps``; rims are given without their points."""
        from .two_set_words import report_to_json  # the words know the report

        return report_to_json(self)

    def describe(self) -> str:
        """Say it in words: what, where, how large, what follows."""
        from .two_set_words import describe_report

        return describe_report(self)
