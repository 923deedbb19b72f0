"""Pictures of a round trip: the error against resolution, and both surfaces side by side.

matplotlib draws without a display; the same input gives the same bytes.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..mesh import Mesh
from ..mesh.measures import face_normals
from .roundtrip import RoundTrip, RoundTripRow

INK, GREY = "#222222", "#9a9a9a"
LINES = "#0072b2", "#d55e00", "#009e73"  # Okabe and Ito 2008
LIGHT = np.array([0.35, -0.6, 0.72])
PNG_OPTIONS = {"dpi": 110, "metadata": {"Software": None}}


def draw_errors(trip: RoundTrip, path: Path, *, title: str) -> None:
    """Write a PNG of the Hausdorff interval and the mean distance against voxel size, log-log."""
    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    rows = [row for row in trip.rows if row.comparison is not None]
    for method, color in zip(trip.methods, LINES, strict=False):
        _plot_method(axes, [row for row in rows if row.method == method], color)
    rows = list({row.voxel_size: row for row in rows}.values())
    sizes = np.array([row.voxel_size for row in rows])
    axes.plot(sizes, sizes, ":", color=GREY, label="one voxel")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(
        sizes, [f"{size:.3g}\n1/{row.resolution:g}" for size, row in zip(sizes, rows, strict=True)]
    )
    axes.minorticks_off()
    axes.set_xlabel("voxel size, world units, and resolution")
    axes.set_ylabel("distance, world units")
    orders = [trip.order(method) for method in trip.methods]
    found = " and ".join(f"{order:.2f}" for order in orders if order is not None)
    order = f": observed order {found}" if found else ""
    axes.set_title(title + order, color=INK, fontsize=11)
    axes.grid(color="#e4e4e4")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    figure.savefig(path, **PNG_OPTIONS)


def _plot_method(axes, rows: Sequence[RoundTripRow], color: str) -> None:
    """The interval of the largest distance as a band, the mean distance as a dashed line."""
    if not rows:
        return
    sizes = np.array([row.voxel_size for row in rows])
    lower = np.array([row.comparison.distance.lower for row in rows])
    upper = np.array([row.comparison.distance.upper for row in rows])
    mean = np.array([row.comparison.forward.mean for row in rows])
    method = rows[0].method
    axes.fill_between(sizes, lower, upper, color=color, alpha=0.3, linewidth=0)
    axes.plot(sizes, upper, "o-", color=color, label=f"{method}: largest distance (certified)")
    axes.plot(sizes, mean, "s--", color=color, label=f"{method}: mean distance")


def draw_surfaces(meshes: list[tuple[str, Mesh]], path: Path) -> None:
    """Write a PNG of meshes side by side, shaded by one light, at one scale."""
    figure = Figure(figsize=(5.2 * len(meshes), 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    box = meshes[0][1].box
    half = 0.5 * box.longest_side
    for column, (title, mesh) in enumerate(meshes):
        axes = figure.add_subplot(1, len(meshes), column + 1, projection="3d")
        shade = 0.35 + 0.65 * np.clip(face_normals(mesh) @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
        colors = np.clip(shade[:, None] * np.array([0.55, 0.72, 0.86]), 0, 1)
        _add_triangles(axes, mesh.triangles, colors)
        for axis, center in zip("xyz", box.center, strict=True):
            getattr(axes, f"set_{axis}lim")(center - half, center + half)
        axes.set_box_aspect((1, 1, 1), zoom=1.35)
        axes.view_init(elev=38, azim=-60)
        axes.set_axis_off()
        axes.set_title(title, color=INK, fontsize=11)
    figure.savefig(path, **PNG_OPTIONS)


def _add_triangles(axes, triangles: np.ndarray, colors: np.ndarray) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    axes.add_collection3d(
        Poly3DCollection(triangles, facecolors=colors, edgecolors=colors, linewidths=0.2)
    )
