"""The plots of a report, as SVG that lives inside its page.

Everything drawn comes from the report's dict. Colours are the page's own custom properties, so one
plot suits paper and a dark screen; letters stay letters, in the page's fonts. The same dict gives
the same bytes: matplotlib's identifiers hang on a fixed salt, and no date is written.
"""

import io
import re

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from ..arrays import Values
from .notation import written
from .verdict import METHOD_WORDS

# Stand-ins that matplotlib writes as they are; the page knows them by name
INK, MUTED, RULE = "#010203", "#040506", "#070809"
FIRST, SECOND, THIRD = "#0a0b0c", "#0d0e0f", "#101112"
NAMES = {INK: "ink", MUTED: "muted", RULE: "rule", FIRST: "first", SECOND: "second", THIRD: "third"}

PER_BAR = 4  # thresholds of a distribution that make a bar of its histogram
SIZE = 5.4, 3.7  # inches; letters of 10 points are then readable on a telephone as well
STYLE = {
    "svg.fonttype": "none",
    "font.size": 10,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "grid.color": RULE,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}


def errors_svg(data: dict) -> str:
    """Draw distances in voxels and the fitted order against resolution, log-log.

    An empty text if fewer than two resolutions brought something back.
    """
    rows = [row for row in data["rows"] if not row["is_empty"]]
    resolutions = sorted({row["resolution"] for row in rows})
    if len(resolutions) < 2:
        return ""

    def draw(axes) -> None:
        for method, color in zip(data["methods"], (FIRST, SECOND, THIRD), strict=False):
            name = f"{METHOD_WORDS[method]}, " if len(data["methods"]) > 1 else ""
            _method_lines(axes, [row for row in rows if row["method"] == method], color, name)
        _one_voxel(axes, rows)
        axes.set_xticks(resolutions, [written(n, digits=6) for n in resolutions])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("resolution, voxels along the longest side")
        axes.set_ylabel("distance, world units")
        n_columns = 2 if len(data["methods"]) > 1 else 4
        axes.figure.legend(
            loc="outside lower center", ncols=n_columns, fontsize=9, columnspacing=1.2
        )

    return _svg(draw, "errors", "Distances against resolution, both axes logarithmic")


def distribution_svg(data: dict, index: int) -> str:
    """Draw which share of the area is within which distance, both directions of one row.

    An empty text if it was not measured.
    """
    row = data["rows"][index]
    if row["is_empty"]:
        return ""
    ways = "mesh → round trip", "round trip → mesh"
    return shares_svg(row, f"shares-{index}", ways, row["voxel_size"])


def shares_svg(told: dict, name: str, ways: tuple[str, str], voxel_size: float | None) -> str:
    """Draw the same for two surfaces, in voxels or, without a voxel size, in world units.

    Below it stands the histogram, with the same distances. Curves and steps are bands: the share
    lies between their edges. An empty text if it was not measured.
    """
    if told["forward"]["shares"] is None and told["backward"]["shares"] is None:
        return ""

    def draw(axes, below) -> None:
        sides = zip(("forward", "backward"), ways, (FIRST, SECOND), strict=True)
        for side, label, color in sides:
            shares = told[side]["shares"]
            if shares is None:
                continue
            lengths = np.array(shares["thresholds"]) / (voxel_size or 1.0)
            lower, upper = 100 * np.array(shares["lower"]), 100 * np.array(shares["upper"])
            axes.fill_between(lengths, lower, upper, color=color, alpha=0.25, linewidth=0)
            axes.plot(lengths, lower, color=color, label=label, linewidth=1.4)
            axes.plot(lengths, upper, color=color, linewidth=0.7)
            _histogram(below, lengths, lower, upper, color)
        axes.set_ylim(0, 101)
        below.set_ylim(bottom=0)
        below.set_xlabel("distance, voxels" if voxel_size else "distance, world units")
        axes.set_ylabel("share of the area within, %")
        below.set_ylabel("at about, %")
        axes.legend(loc="lower right", fontsize=9)

    title = "Share of the area within each distance, and its histogram"
    return _svg(draw, name, title, log="x", heights=(2, 1))


def _histogram(axes, lengths: Values, lower: Values, upper: Values, color: str) -> None:
    """The bars between the least and the most they can be, and their middles."""
    edges, least, most = bars(lengths, lower, upper)
    axes.stairs(most, edges, baseline=least, fill=True, color=color, alpha=0.25, linewidth=0)
    axes.stairs(0.5 * (least + most), edges, color=color, linewidth=1.2)


def bars(lengths: Values, lower: Values, upper: Values) -> tuple[np.ndarray, ...]:
    """Edges of bars, and what each holds at least and at most, from a cumulative distribution.

    Between lengths a and b lies at least lower(b) - upper(a), at most upper(b) - lower(a). The
    first bar has all that is nearer than its end, wherever it begins.
    """
    ends = np.unique(np.append(np.arange(0, len(lengths), PER_BAR), len(lengths) - 1))
    before = ends[:-1]
    most = np.append(upper[ends[0]], upper[ends[1:]] - lower[before])
    least = np.maximum(np.append(lower[ends[0]], lower[ends[1:]] - upper[before]), 0.0)
    start = lengths[0] ** 2 / lengths[min(PER_BAR, len(lengths) - 1)]
    return np.append(start, lengths[ends]), least, most


def _method_lines(axes, rows: list[dict], color: str, name: str) -> None:
    """The interval of the largest distance as a band, the mean dashed, the fit thin."""
    if not rows:
        return
    rows = sorted(rows, key=lambda row: row["resolution"])
    n = np.array([row["resolution"] for row in rows])
    spans = [row["largest"]["world"] for row in rows]
    lower = np.array([span["lower"] for span in spans])
    upper = np.array([span["upper"] for span in spans])
    mean = np.array([_middle(row["forward"]["mean"]["world"]) for row in rows])
    axes.fill_between(n, lower, upper, color=color, alpha=0.3, linewidth=0)
    axes.plot(n, upper, "o-", color=color, label=f"{name}largest", linewidth=1.4, markersize=4)
    axes.plot(n, mean, "s--", color=color, label=f"{name}mean", linewidth=1, markersize=3)
    if len(set(n)) > 1 and (lower > 0).all():
        slope, height = np.polyfit(np.log(n), np.log(lower), 1)
        label = f"{name}order {written(-float(slope), digits=3)}"
        axes.plot(n, np.exp(height) * n**slope, color=color, linewidth=0.6, label=label)


def _one_voxel(axes, rows: list[dict]) -> None:
    """The line a distance of one voxel would follow."""
    pairs = sorted({(row["resolution"], row["voxel_size"]) for row in rows})
    axes.plot(*zip(*pairs, strict=True), ":", color=MUTED, linewidth=1, label="one voxel")


def _middle(span: dict) -> float:
    """A mean is drawn as one line: its interval is thinner than that."""
    return span["estimate"] if "estimate" in span else 0.5 * (span["lower"] + span["upper"])


def _svg(draw, name: str, title: str, log: str = "xy", heights: tuple[int, ...] = (1,)) -> str:
    with rc_context(STYLE | {"svg.hashsalt": name}):
        figure = Figure(figsize=SIZE, layout="constrained")
        FigureCanvasSVG(figure)
        panels = figure.subplots(
            len(heights), sharex=True, squeeze=False, gridspec_kw={"height_ratios": heights}
        )[:, 0]
        for axes in panels:
            axes.set_xscale("log" if "x" in log else "linear")
            axes.set_yscale("log" if "y" in log else "linear")
        draw(*panels)
        for axes in panels:
            for axis, letter in ((axes.xaxis, "x"), (axes.yaxis, "y")):
                if letter in log and not (letter == "x" and log == "xy"):
                    _number_decades(axis, (1, 2, 5) if log == "xy" else (1,))
            axes.grid(linewidth=0.7)
            axes.set_axisbelow(True)
        file = io.StringIO()
        figure.savefig(file, format="svg", transparent=True, metadata={"Date": None})
    return _inline(file.getvalue(), name, title)


def _number_decades(axis, steps: tuple[int, ...]) -> None:
    """Write numbers as the rest of the page does, at these multiples of powers of ten."""
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda x, _: written(float(x), digits=2)))
    axis.set_minor_locator(NullLocator())


def _inline(svg: str, name: str, title: str) -> str:
    """Make a file into a part of a page: own identifiers, the page's colours and fonts."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r"<style[^>]*>.*?</style>", "", body, flags=re.DOTALL)
    body = re.sub(r'\bid="', f'id="{name}-', body)
    body = body.replace("url(#", f"url(#{name}-").replace('href="#', f'href="#{name}-')
    body = re.sub(r"font-family:[^;\"]*;?", "", body)
    body = re.sub(r"font: ([0-9.]+px)[^;\"]*", r"font-size: \1", body)
    for stand_in, color in NAMES.items():
        body = body.replace(stand_in, f"var(--{color})")
    box = re.search(r'viewBox="([^"]*)"', body)[1]
    attributes = f'class="plot" viewBox="{box}" role="img" aria-label="{title}"'
    return re.sub(
        r"<svg[^>]*>",
        f'<svg xmlns:xlink="http://www.w3.org/1999/xlink" {attributes}>',
        body,
        count=1,
    ).strip()
