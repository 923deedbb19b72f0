"""A round trip as a table for people."""

from .color_difference import ColorDifference
from .compare import Comparison
from .enclosure import Enclosure
from .notation import interval, place, written
from .roundtrip import RoundTrip, RoundTripRow

HEADS = (
    "resolution",
    "method",
    "voxel",
    "largest (world)",
    "in voxels",
    "% diagonal",
    "mean vox",
    "rms vox",
    "volume",
    "Euler",
    "parts",
    "seconds",
)
GAP = "  "  # between two columns


def roundtrip_table(trip: RoundTrip) -> str:
    """Return one line per resolution, the order of the error if there are several, and colours."""
    table = [HEADS, *(_cells(row) for row in trip.rows)]
    widths = [0] * len(HEADS)
    for cells in table:
        if len(cells) == len(HEADS):
            widths = [max(pair) for pair in zip(widths, map(len, cells), strict=True)]
    lines = [
        GAP.join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=False))
        for cells in table
    ]
    orders = [(method, trip.order(method)) for method in trip.methods]
    if found := [f"{method} {order:.2f}" for method, order in orders if order is not None]:
        lines.append(f"observed order of the largest distance: {', '.join(found)}")
    return "\n".join(lines + topology_lines(trip) + color_lines(trip))


def topology_lines(trip: RoundTrip) -> list[str]:
    """What came back is by index, where that differs from the table's counts by position."""
    lines = []
    for row in trip.rows:
        known = None if row.comparison is None else row.comparison.after.topology
        if known is not None and known.differs:
            lines.append(f"{_name(row, trip)}: {known.describe()}")
    return lines


def _name(row: RoundTripRow, trip: RoundTrip) -> str:
    by = f" by {row.method}" if len(trip.methods) > 1 else ""
    return f"{row.resolution:g}{by}"


def color_lines(trip: RoundTrip) -> list[str]:
    """One line per resolution of what became of the colours, if that was asked."""
    lines = []
    for row in trip.rows if trip.has_colors else ():
        name = f"colours at {_name(row, trip)}"
        if row.colors is None:
            lines.append(f"{name}: nothing came back")
            continue
        sharp, filtered = row.colors.sharp, row.colors.filtered
        where = f"{sharp.expected} became {sharp.found} at {place(sharp.where.tolist())}"
        lines.append(f"{name}: {_differences(sharp)} ({where})")
        lines.append(f"  apart from the blur of a voxel: {_differences(filtered)}")
    return lines


def _differences(found: ColorDifference) -> str:
    numbers = found.mean, found.percentile_95, found.largest
    mean, most, largest = (written(number, digits=3) for number in numbers)
    return f"ΔE {mean} on average, 95 % below {most}, at most {largest} seen"


def _cells(row: RoundTripRow) -> tuple[str, ...]:
    found = row.comparison
    if found is None:
        return f"{row.resolution:g}", row.method, f"{row.voxel_size:.4g}", "nothing came back"
    lower, upper = found.distance.lower, found.distance.upper
    before, after = found.before, found.after
    volume = "-"
    if before.volume and after.volume is not None:
        volume = f"{100 * (after.volume / before.volume - 1):+.2f}%"
    return (
        f"{row.resolution:g}",
        row.method,
        f"{row.voxel_size:.4g}",
        f"[{lower:.5g}, {upper:.5g}]",
        f"[{found.in_voxels(lower):.3f}, {found.in_voxels(upper):.3f}]",
        f"[{found.in_percent(lower):.4f}, {found.in_percent(upper):.4f}]",
        *(_average(name, found) for name in ("mean", "rms")),
        volume,
        f"{before.euler_number}>{after.euler_number}",
        f"{before.n_components}>{after.n_components}",
        f"{row.trip_seconds:.2f}",
    )


def _average(name: str, found: Comparison) -> str:
    """Mean or rms over the mesh in voxels: the interval that is proved, or ≈ an estimate."""
    proved = found.forward_statistics
    if proved is None:
        return interval({"estimate": found.in_voxels(getattr(found.forward, name))}, digits=3)
    span: Enclosure = getattr(proved, name)
    return interval({end: found.in_voxels(getattr(span, end)) for end in ("lower", "upper")}, 3)
