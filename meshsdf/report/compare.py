"""How far apart are two meshes, and what else changed: sizes, pieces, holes."""

from dataclasses import asdict, dataclass, replace

from ..arrays import Number
from ..errors import ReportError
from ..mesh import Mesh
from ..mesh.measures import (
    area,
    euler_number,
    genus,
    is_watertight,
    n_boundary_loops,
    n_components,
    volume,
    welded,
)
from ..mesh.topology import Topology, topology
from ..progress import Progress, silent
from .enclosure import Enclosure, ceil_digits, floor_digits
from .hausdorff import OneSided, hausdorff
from .statistics import Statistics, one_sided_statistics
from .tolerance import Tolerance


@dataclass(frozen=True)
class Measures:
    """Sizes and counts of one mesh; counts of pieces and edges go by position, equal ones joined.

    Attributes
    ----------
    area : float
        Square world units.
    volume : float or None
        Cubic world units; None unless the mesh is watertight once equal positions are joined.
    genus : int or None
        Handles of all components together; None unless watertight likewise.
    n_boundary_loops : int
        Connected pieces of edges with one face.
    topology : Topology or None
        What it is by index, too, and in words.
    """

    n_vertices: int
    n_faces: int
    area: float
    volume: float | None
    euler_number: int
    n_components: int
    is_watertight: bool
    genus: int | None
    n_boundary_loops: int
    topology: Topology | None = None


@dataclass(frozen=True, eq=False)
class Comparison:
    """Mesh A against mesh B.

    Attributes
    ----------
    distance : Enclosure
        The symmetric Hausdorff distance, world units.
    forward, backward : OneSided
        From A to B, and from B to A; with statistics, ``mean`` and ``rms`` are the middles of
        their intervals.
    before, after : Measures
        Of A and of B.
    diagonal : float
        Of A's box, world units.
    voxel_size : float or None
        World units, if the caller gave one.
    forward_statistics, backward_statistics : Statistics or None
        Certified means and percentiles, and lost parts if there is a voxel size; None if they were
        not asked for, or the source has no area.
    """

    distance: Enclosure
    forward: OneSided
    backward: OneSided
    before: Measures
    after: Measures
    diagonal: float
    voxel_size: float | None = None
    forward_statistics: Statistics | None = None
    backward_statistics: Statistics | None = None

    def in_voxels(self, length: float) -> float | None:
        """A length in voxels, or None where no voxel size is known."""
        return None if self.voxel_size is None else length / self.voxel_size

    def in_percent(self, length: float) -> float | None:
        """A length in percent of the diagonal of A's box, or None where A is one point."""
        return 100.0 * length / self.diagonal if self.diagonal > 0 else None

    def with_statistics(
        self, forward: Statistics | None, backward: Statistics | None
    ) -> "Comparison":
        """Return the same with certified means in place of estimates, where there are some."""
        return replace(
            self,
            forward=_with_means(self.forward, forward),
            backward=_with_means(self.backward, backward),
            forward_statistics=forward,
            backward_statistics=backward,
        )

    def to_json(self) -> dict:
        """Return plain types: distances in world units, and the largest also in other units."""
        answer = {
            "hausdorff": asdict(self.distance),
            "forward": _side(self.forward, self.forward_statistics),
            "backward": _side(self.backward, self.backward_statistics),
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
            *_side_rows("A to B", self.forward, self.forward_statistics),
            *_side_rows("B to A", self.backward, self.backward_statistics),
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
            "genus": "genus",
            "n_boundary_loops": "boundary loops",
        }
        before, after = asdict(self.before), asdict(self.after)
        rows = [(label, before[name], after[name]) for name, label in names.items()]
        lines = [_row(n, _number(a), _number(b)) for n, a, b in rows]
        for name, measures in (("A", self.before), ("B", self.after)):
            if measures.topology is not None:
                lines.append(f"{name}: {measures.topology.describe()}")
        return [_row("mesh", "A", "B"), *lines]


def _with_means(side: OneSided, found: Statistics | None) -> OneSided:
    """Certified middles in place of estimates."""
    if found is None:
        return side
    return replace(side, mean=found.mean.middle, rms=found.rms.middle)


def compare(
    a: Mesh,
    b: Mesh,
    *,
    voxel_size: float | None = None,
    tolerance: Number | Tolerance | None = None,
    time_budget: Number | None = None,
    statistics: bool = True,
    progress: Progress = silent,
) -> Comparison:
    """Measure how far two meshes are apart, with proof, and what else differs.

    Parameters
    ----------
    a, b : Mesh
        At least one face each.
    voxel_size : float, optional
        Express lengths in voxels of this size too, world units.
    tolerance : float or Tolerance, optional
        Width asked of the enclosures, world units; see `one_sided_hausdorff` for the default.
    time_budget : float, optional
        Seconds after which the enclosures of the largest distance stay as wide as they are.
    statistics : bool
        Enclose means and percentiles as well (`one_sided_statistics`, to its own tolerance), and
        look for lost parts if there is a voxel size; otherwise mean and rms are estimates.
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
    limits = {"tolerance": tolerance, "time_budget": time_budget, "progress": progress}
    is_flat = area(a) == 0 or area(b) == 0
    found = hausdorff(a, b, means=is_flat or not statistics, **limits)
    forward = backward = None
    if statistics:
        forward = _statistics(a, b, found.forward, voxel_size, progress)
        backward = _statistics(b, a, found.backward, voxel_size, progress)
    measures = _measures(a), _measures(b)
    known = Comparison(
        found.distance, found.forward, found.backward, *measures, a.box.diagonal, voxel_size
    )
    return known.with_statistics(forward, backward)


def _statistics(
    source: Mesh, target: Mesh, side: OneSided, voxel_size: float | None, progress: Progress
) -> Statistics | None:
    if area(source) == 0:
        return None
    return one_sided_statistics(
        source, target, at_most=side.distance.upper, voxel_size=voxel_size, progress=progress
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
        genus=genus(joined),
        n_boundary_loops=n_boundary_loops(joined),
        topology=topology(mesh),
    )


def _side_rows(way: str, side: OneSided, found: Statistics | None) -> list[tuple]:
    """(label, length, how to write it) of one direction."""
    rows = []
    for name in ("mean", "rms"):
        if found is None:
            rows.append((f"{way}, {name}", getattr(side, name), _estimate))
        else:
            rows += _interval_rows(f"{way}, {name}", getattr(found, name))
    percentiles = {} if found is None else found.percentiles
    for percent, enclosure in sorted(percentiles.items()):
        rows += _interval_rows(f"{way}, {percent:g} %", enclosure)
    return [*rows, (f"{way}, at most", side.distance.upper, ceil_digits)]


def _interval_rows(label: str, found: Enclosure) -> list[tuple]:
    return [(f"{label} >=", found.lower, floor_digits), (f"{label} <=", found.upper, ceil_digits)]


def _side(side: OneSided, statistics: Statistics | None) -> dict:
    more = {} if statistics is None else statistics.to_json()
    return more | {
        "lower": side.distance.lower,
        "upper": side.distance.upper,
        "mean": side.mean,
        "rms": side.rms,
        "mean_is_estimate": statistics is None,
        "witness": side.witness.tolist(),
        "nearest": side.nearest.tolist(),
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


def _estimate(value: float) -> str:
    return f"≈ {value:.3g}"


def _row(name: str, *cells: str) -> str:
    return f"{name:<20}" + "".join(f"{cell:>16}" for cell in cells)
