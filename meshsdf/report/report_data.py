"""A round trip as one plain dict: the JSON of the report, from which every page is written.

Lengths stand in three units side by side: ``{"world": span, "voxels": span, "percent": span}``,
percent of the diagonal of the mesh's box. A span is ``{"lower": ..., "upper": ...}`` and holds the
truth, or ``{"estimate": x}`` where nothing is proved. What could not be measured is null.
"""

import math
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from typing import Any

from ..arrays import Number
from ..box import Box
from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport
from ..sdf import SignChoice
from .compare import Comparison, Measures
from .conditioning import Conditioning
from .enclosure import Enclosure
from .error_budget import ErrorBudget
from .hausdorff import OneSided
from .lost_parts import LostPart
from .percentiles import Shares
from .roundtrip import RoundTrip, RoundTripRow
from .sharp_edges import SharpEdges
from .statistics import Statistics
from .verdict import add_verdicts

SCHEMA = "meshsdf.roundtrip_report/1"
LIBRARIES = ("meshsdf", "numpy", "numba", "scipy", "matplotlib")
MOST_LISTED = 20  # of holes, parts and lost places that a report lists one by one


@dataclass(frozen=True, eq=False)
class Asked:
    """What the user asked for, as far as the report repeats it.

    Attributes
    ----------
    name : str
        Of the mesh's file.
    command : str
        That gives these numbers.
    max_error, until : str or None
        The limits, as written.
    missed : tuple of str
        A sentence for each limit that is not certainly kept.
    warnings : tuple of str
        What was said while reading and converting.
    seconds : dict or None
        Times of the stages beside those of the rows; None leaves all times out.
    """

    name: str
    command: str = ""
    max_error: str | None = None
    until: str | None = None
    missed: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: dict[str, float] | None = field(default=None)


def report_data(
    trip: RoundTrip, mesh: Mesh, check: TwoSetReport, choice: SignChoice, asked: Asked
) -> dict:
    """Gather everything a report tells, as bool, int, float, str, list, dict and None."""
    rows = [_row(row, with_seconds=asked.seconds is not None) for row in trip.rows]
    data = {
        "schema": SCHEMA,
        "input": _input(mesh, asked.name),
        "command": asked.command,
        "limits": {
            "max_error": asked.max_error,
            "until": asked.until,
            "missed": list(asked.missed),
            "passed": not asked.missed,
        },
        "warnings": list(asked.warnings),
        "sign": {
            "method": choice.method,
            "is_exact": choice.by_crossings,
            "reason": choice.reason,
            "warnings": list(choice.warnings),
        },
        "two_set": _two_set(check),
        "methods": list(trip.methods),
        "last_rows": [trip.rows.index(trip.last(method)) for method in trip.methods],
        "orders": [{"method": method, "order": trip.order(method)} for method in trip.methods],
        "rows": rows,
        "versions": _versions(),
        "seconds": asked.seconds,
    }
    return add_verdicts(_plain(data))


def _input(mesh: Mesh, name: str) -> dict:
    used = Box.around(mesh.vertices[mesh.faces].reshape(-1, 3))
    return {
        "name": name,
        "n_vertices": mesh.n_vertices,
        "n_faces": mesh.n_faces,
        "lower": used.lower.tolist(),
        "upper": used.upper.tolist(),
        "size": used.size.tolist(),
        "diagonal": used.diagonal,
    }


def _two_set(check: TwoSetReport) -> dict:
    """The whole report but for the tails of long lists, and its words."""
    plain = check.to_json()
    for name in ("holes", "components"):
        plain[name] = plain[name][:MOST_LISTED]
    words = check.describe().splitlines()[
        :-1
    ]  # the last is about the sign, which has its own place
    return plain | {"n_holes": len(check.holes), "words": words}


def _versions() -> dict:
    found = {name: version(name) for name in LIBRARIES}
    system = f"{platform.system()} {platform.machine()}"
    return found | {"python": platform.python_version(), "platform": system}


def _row(row: RoundTripRow, *, with_seconds: bool) -> dict:
    head = {
        "resolution": row.resolution,
        "voxel_size": row.voxel_size,
        "method": row.method,
        "sign": row.sign,
        "warnings": list(row.warnings),
        "seconds": row.seconds if with_seconds else None,
    }
    found = row.comparison
    if found is None:
        return head | {"is_empty": True}
    details = row.details
    return head | {
        "is_empty": False,
        "largest": in_units(found.distance, found),
        "worst": "forward" if _is_forward(found) else "backward",
        "forward": _direction(found.forward, details and details.forward_statistics, found),
        "backward": _direction(found.backward, details and details.backward_statistics, found),
        "measures": _measures(found.before, found.after, row.surface),
        "sharp_edges": details and _sharp_edges(details.sharp_edges, found),
        "budget": details and _budget(details.budget, found),
        "conditioning": details and _conditioning(details.conditioning, found),
    }


def in_units(length: Enclosure | Number, found: Comparison) -> dict:
    """A length, known to lie in an interval or estimated, in world units, voxels and percent."""
    units = {"world": 1.0, "voxels": None, "percent": None}
    if found.voxel_size is not None:
        units["voxels"] = 1.0 / found.voxel_size
    if found.diagonal > 0:
        units["percent"] = 100.0 / found.diagonal
    return {
        unit: None if factor is None else _span(length, factor) for unit, factor in units.items()
    }


def _span(length: Enclosure | Number, factor: float) -> dict | None:
    if not math.isfinite(length.upper if isinstance(length, Enclosure) else length):
        return None
    if not isinstance(length, Enclosure):
        return {"estimate": float(length) * factor}
    if factor == 1.0:
        return {"lower": length.lower, "upper": length.upper}
    # A factor and a product are off by half a unit in the last place each
    lower, upper = length.lower * factor, length.upper * factor
    return {"lower": _beyond(lower, -math.inf), "upper": _beyond(upper, math.inf)}


def _beyond(value: float, direction: float) -> float:
    """Two floats further; zero stays what it is, as a product with it is exact."""
    return math.nextafter(math.nextafter(value, direction), direction) if value else value


def _direction(side: OneSided, statistics: Statistics | None, found: Comparison) -> dict:
    """One direction: the largest distance and where, and how distances are spread."""
    answer = {
        "maximum": in_units(side.distance, found),
        "mean": in_units(side.mean if statistics is None else statistics.mean, found),
        "rms": in_units(side.rms if statistics is None else statistics.rms, found),
        "percentiles": [],
        "signed_mean": None,
        "normal_deviation": None,
        "shares": None,
        "lost_parts": [],
        "n_lost_parts": None if statistics is None else len(statistics.lost_parts),
        "witness": side.witness.tolist(),
        "nearest": side.nearest.tolist(),
        "source_face": side.source_face,
        "target_face": side.target_face,
        "is_within_tolerance": side.is_within_tolerance,
    }
    if statistics is not None:
        answer["percentiles"] = [
            {"percent": float(percent), "distance": in_units(span, found)}
            for percent, span in sorted(statistics.percentiles.items())
        ]
        answer["shares"] = _shares(statistics.shares)
        if statistics.signed_mean is not None:
            answer["signed_mean"] = in_units(statistics.signed_mean, found)
        answer["normal_deviation"] = {
            "mean": statistics.normal_deviation,
            "largest": statistics.largest_normal_deviation,
        }
        answer["lost_parts"] = [
            _lost_part(part, found) for part in statistics.lost_parts[:MOST_LISTED]
        ]
    return answer


def _shares(shares: Shares) -> dict:
    """The share of the area that is within each threshold, world units."""
    names = ("thresholds", "lower", "upper")
    return {name: getattr(shares, name).tolist() for name in names}


def _lost_part(part: LostPart, found: Comparison) -> dict:
    return {
        "n_faces": part.n_faces,
        "area": part.area,
        "center": part.center.tolist(),
        "largest": in_units(part.largest, found),
    }


def _measures(before: Measures, after: Measures, surface: Mesh) -> dict:
    both = {"before": asdict(before), "after": asdict(after)}
    both["n_repeated_places"] = surface.n_vertices - len(surface.welded.points)
    change = {}
    for name in ("area", "volume"):
        old, new = both["before"][name], both["after"][name]
        known = old is not None and new is not None and old != 0
        change[f"{name}_percent"] = 100.0 * (new - old) / abs(old) if known else None
    return both | {"change": change}


def _sharp_edges(edges: SharpEdges | None, found: Comparison) -> dict | None:
    if edges is None:
        return None
    # They are part of the mesh, so what holds for all of it holds for them
    farthest = found.forward.distance.upper
    distance = Enclosure(edges.distance.lower, min(edges.distance.upper, farthest))
    return {
        "angle": edges.angle,
        "n_edges": edges.n_edges,
        "length": edges.length,
        "largest": in_units(distance, found),
        "witness": edges.witness.tolist(),
        "kept_percent": {end: 100.0 * share for end, share in asdict(edges.kept).items()},
    }


BUDGET_INTERVALS = (
    "zero_set_to_mesh",
    "mesh_to_zero_set",
    "surface_to_zero_set",
    "zero_set_to_surface",
)
CHANGE = 0.01  # of a voxel: what the samples are thought to change by, to see what that moves


def _budget(budget: ErrorBudget | None, found: Comparison) -> dict | None:
    if budget is None:
        return None
    known = {name: in_units(getattr(budget, name), found) for name in BUDGET_INTERVALS}
    return known | {
        "sampling": in_units(_at_most(budget.sampling), found),
        "sample_error": in_units(_at_most(budget.sample_error), found),
        "is_within_tolerance": budget.is_within_tolerance,
        "words": budget.describe(),
    }


def _conditioning(known: Conditioning | None, found: Comparison) -> dict | None:
    if known is None:
        return None
    moved = known.displacement(CHANGE * found.voxel_size)
    return {
        "least_gradient": asdict(known.least_gradient),
        "where": known.where.tolist(),
        "is_flat": known.is_flat,
        "change_voxels": CHANGE,
        "displacement": in_units(_at_most(moved), found),
        "words": known.describe(),
    }


def _at_most(length: float) -> Enclosure:
    return Enclosure(0.0, length)


def _is_forward(found: Comparison) -> bool:
    return found.forward.distance.lower >= found.backward.distance.lower


def _plain(value: Any) -> Any:
    """The same with floats beyond all range as None, so that any reader takes the JSON."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
