"""A round trip as a table for people."""

from .color_difference import ColorDifference
from .notation import place, written
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
WIDTHS = (10, 17, 11, 25, 15, 17, 9, 9, 9, 9, 7, 8)


def roundtrip_table(trip: RoundTrip) -> str:
    """Return one line per resolution, the order of the error if there are several, and colours."""
    lines = ["".join(f"{head:>{width}}" for head, width in zip(HEADS, WIDTHS, strict=True))]
    lines += [
        "".join(f"{cell:>{width}}" for cell, width in zip(_cells(row), WIDTHS, strict=False))
        for row in trip.rows
    ]
    orders = [(method, trip.order(method)) for method in trip.methods]
    if found := [f"{method} {order:.2f}" for method, order in orders if order is not None]:
        lines.append(f"observed order of the largest distance: {', '.join(found)}")
    return "\n".join(lines + color_lines(trip))


def color_lines(trip: RoundTrip) -> list[str]:
    """One line per resolution of what became of the colours, if that was asked."""
    lines = []
    for row in trip.rows if trip.has_colors else ():
        name = f"colours at {row.resolution:g}"
        name += f" by {row.method}" if len(trip.methods) > 1 else ""
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
        f"{found.in_voxels(found.forward.mean):.4f}",
        f"{found.in_voxels(found.forward.rms):.4f}",
        volume,
        f"{before.euler_number}>{after.euler_number}",
        f"{before.n_components}>{after.n_components}",
        f"{sum(row.seconds.values()):.2f}",
    )
