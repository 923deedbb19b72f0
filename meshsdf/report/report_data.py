"""A round trip as one plain dict: the JSON of the report, from which every page is written.

Lengths stand as `comparison_data` writes them. What could not be measured is null.
"""

from dataclasses import asdict, dataclass, field

from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport
from ..sdf import SignChoice
from .compare import Comparison
from .comparison_data import comparison_data, in_units, mesh_data, plain, two_set_data, versions
from .conditioning import Conditioning
from .enclosure import Enclosure
from .error_budget import ErrorBudget
from .roundtrip import RoundTrip, RoundTripRow
from .verdict import add_verdicts

SCHEMA = "meshsdf.roundtrip_report/1"


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
    if trip.has_colors:
        for row, told in zip(trip.rows, rows, strict=True):
            told["colors"] = row.colors and row.colors.to_json()
    data = {
        "schema": SCHEMA,
        "input": mesh_data(mesh, asked.name),
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
        "two_set": two_set_data(check),
        "methods": list(trip.methods),
        "last_rows": [trip.rows.index(trip.last(method)) for method in trip.methods],
        "orders": [{"method": method, "order": trip.order(method)} for method in trip.methods],
        "rows": rows,
        "versions": versions(),
        "seconds": asked.seconds,
    }
    return add_verdicts(plain(data))


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
    spread = details and (details.forward_statistics, details.backward_statistics)
    told = comparison_data(found, row.surface, spread, details and details.sharp_edges)
    return head | {
        "is_empty": False,
        **told,
        "budget": details and _budget(details.budget, found),
        "conditioning": details and _conditioning(details.conditioning, found),
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
