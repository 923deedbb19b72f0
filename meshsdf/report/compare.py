"""How far apart are two meshes, and what else changed: sizes, pieces, holes."""

from dataclasses import asdict, dataclass

from ..errors import ReportError
from ..mesh import Mesh
from ..mesh.measures import (
    area,
    euler_number,
    is_watertight,
    n_components,
    volume,
    welded,
)
from ..progress import Progress, silent
from .enclosure import Enclosure, ceil_digits, floor_digits
from .hausdorff import OneSided, hausdorff


@dataclass(frozen=True)
class Measures:
    """Sizes and counts of one mesh; counts of pieces and edges go by position, equal ones joined.

    Attributes
    ----------
    area : float
        Square world units.
    volume : float or None
        Cubic world units; None unless the mesh is watertight once equal positions are joined.
    """

    n_vertices: int
    n_faces: int
    area: float
    volume: float | None
    euler_number: int
    n_components: int
    is_watertight: bool


@dataclass(frozen=True, eq=False)
class Comparison:
    """Mesh A against mesh B.

    Attributes
    ----------
    distance : Enclosure
        The symmetric Hausdorff distance, world units.
    forward, backward : OneSided
        From A to B, and from B to A.
    before, after : Measures
        Of A and of B.
    diagonal : float
        Of A's box, world units.
    voxel_size : float or None
        World units, if the caller gave one.
    """

    distance: Enclosure
    forward: OneSided
    backward: OneSided
    before: Measures
    after: Measures
    diagonal: float
    voxel_size: float | None = None

    def in_voxels(self, length: float) -> float | None:
        """A length in voxels, or None where no voxel size is known."""
        return None if self.voxel_size is None else length / self.voxel_size

    def in_percent(self, length: float) -> float | None:
        """A length in percent of the diagonal of A's box, or None where A is one point."""
        return 100.0 * length / self.diagonal if self.diagonal > 0 else None

    def to_json(self) -> dict:
        """Return plain types: distances in world units, and the largest also in other units."""
        answer = {
            "hausdorff": asdict(self.distance),
            "forward": _side(self.forward),
            "backward": _side(self.backward),
            "diagonal": self.diagonal,
            "hausdorff_percent_of_diagonal": self._in_unit(self.in_percent),
            "measures": {"a": asdict(self.before), "b": asdict(self.after)},
        }
        if self.voxel_size is not None:
            answer["voxel_size"] = self.voxel_size
            answer["hausdorff_voxels"] = self._in_unit(self.in_voxels)
        return answer

    def describe(self) -> str:
        """Return the comparison in words, as a table for people."""
        return "\n".join([*self._distance_lines(), "", *self._measure_lines()])

    def _in_unit(self, convert) -> dict | None:
        lower, upper = convert(self.distance.lower), convert(self.distance.upper)
        return None if lower is None else {"lower": lower, "upper": upper}

    def _distance_lines(self) -> list[str]:
        units = [("world units", lambda length: length), ("% of diagonal", self.in_percent)]
        if self.voxel_size is not None:
            units.append(("voxels", self.in_voxels))
        rows = [
            ("largest, at least", self.distance.lower, floor_digits),
            ("largest, at most", self.distance.upper, ceil_digits),
            ("A to B, mean", self.forward.mean, _number),
            ("A to B, rms", self.forward.rms, _number),
            ("A to B, at most", self.forward.distance.upper, ceil_digits),
            ("B to A, mean", self.backward.mean, _number),
            ("B to A, rms", self.backward.rms, _number),
            ("B to A, at most", self.backward.distance.upper, ceil_digits),
        ]
        lines = [_row("distance", *(name for name, _ in units))]
        for name, length, write in rows:
            cells = [convert(length) for _, convert in units]
            lines.append(_row(name, *("-" if x is None else write(x) for x in cells)))
        worst = max(self.forward, self.backward, key=lambda side: side.distance.lower)
        place = ", ".join(f"{x:.6g}" for x in worst.witness)
        side = "A" if worst is self.forward else "B"
        lines.append(f"the largest is seen at ({place}), on face {worst.source_face} of {side}")
        for side, name in ((self.forward, "A to B"), (self.backward, "B to A")):
            if not side.is_within_tolerance:
                lines.append(
                    f"{name}: the search met its limit after {side.n_evaluations} closest points; "
                    "the interval is true, but wider than asked"
                )
        return lines

    def _measure_lines(self) -> list[str]:
        names = {
            "n_faces": "faces",
            "area": "area",
            "volume": "volume",
            "euler_number": "Euler number",
            "n_components": "components",
            "is_watertight": "watertight",
        }
        before, after = asdict(self.before), asdict(self.after)
        rows = [(label, before[name], after[name]) for name, label in names.items()]
        return [_row("mesh", "A", "B"), *(_row(n, _number(a), _number(b)) for n, a, b in rows)]


def compare(
    a: Mesh,
    b: Mesh,
    *,
    voxel_size: float | None = None,
    tolerance: float | None = None,
    progress: Progress = silent,
) -> Comparison:
    """Measure how far two meshes are apart, with proof, and what else differs.

    Parameters
    ----------
    a, b : Mesh
        At least one face each.
    voxel_size : float, optional
        Express lengths in voxels of this size too, world units.
    tolerance : float, optional
        Width asked of the enclosures, world units; see `one_sided_hausdorff` for the default.
    progress : Progress
        Called between pieces of work.

    Raises
    ------
    ReportError
        A mesh has no faces, or a length is not positive.
    """
    for mesh, name in ((a, "A"), (b, "B")):
        if mesh.n_faces == 0:
            what = f"mesh {name} has no faces, so nothing can be close to it"
            raise ReportError(what, "compare(a, b)", "pass meshes with at least one face")
    if voxel_size is not None and not voxel_size > 0:
        what = f"the voxel size is {voxel_size:g}"
        raise ReportError(what, "compare(voxel_size=...)", "pass a positive length")
    found = hausdorff(a, b, tolerance=tolerance, progress=progress)
    return Comparison(
        found.distance,
        found.forward,
        found.backward,
        _measures(a),
        _measures(b),
        a.box.diagonal,
        voxel_size,
    )


def _measures(mesh: Mesh) -> Measures:
    joined = welded(mesh)
    closed = is_watertight(joined)
    return Measures(
        n_vertices=mesh.n_vertices,
        n_faces=mesh.n_faces,
        area=area(mesh),
        volume=volume(mesh) if closed else None,
        euler_number=euler_number(joined),
        n_components=n_components(joined),
        is_watertight=closed,
    )


def _side(side: OneSided) -> dict:
    return {
        "lower": side.distance.lower,
        "upper": side.distance.upper,
        "mean": side.mean,
        "rms": side.rms,
        "witness": side.witness.tolist(),
        "source_face": side.source_face,
        "target_face": side.target_face,
        "n_evaluations": side.n_evaluations,
        "is_within_tolerance": side.is_within_tolerance,
    }


def _number(value: float | int | bool | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}"


def _row(name: str, *cells: str) -> str:
    return f"{name:<18}" + "".join(f"{cell:>16}" for cell in cells)
