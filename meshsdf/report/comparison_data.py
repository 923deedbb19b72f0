"""What a report tells of two surfaces, as plain types: the part of its dict that all pages share.

Lengths stand in three units side by side: ``{"world": span, "voxels": span, "percent": span}``,
percent of the diagonal of the first one's box. A span is ``{"lower": ..., "upper": ...}`` and holds
the truth, or ``{"estimate": x}`` where nothing is proved. What could not be measured is null.
"""

import math
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

from ..arrays import Number
from ..box import Box
from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport
from .compare import Comparison, Measures
from .enclosure import Enclosure
from .hausdorff import OneSided
from .lost_parts import LostPart
from .percentiles import Shares
from .sharp_edges import SharpEdges
from .statistics import Statistics

LIBRARIES = ("meshsdf", "numpy", "numba", "scipy", "matplotlib")
MOST_LISTED = 20  # of holes, parts and lost places that a report lists one by one

Spread = tuple[Statistics | None, Statistics | None]


def comparison_data(
    found: Comparison, surface: Mesh, spread: Spread | None, edges: SharpEdges | None
) -> dict:
    """Tell how far two surfaces are apart.

    Parameters
    ----------
    found : Comparison
        Of both.
    surface : Mesh
        The second one.
    spread : pair of Statistics, optional
        How distances are spread, there and back.
    edges : SharpEdges, optional
        Those of the first one.
    """
    forward, backward = spread or (None, None)
    return {
        "largest": in_units(found.distance, found),
        "worst": "forward" if _is_forward(found) else "backward",
        "forward": _direction(found.forward, forward, found),
        "backward": _direction(found.backward, backward, found),
        "measures": _measures(found.before, found.after, surface),
        "sharp_edges": _sharp_edges(edges, found),
    }


def mesh_data(mesh: Mesh, name: str) -> dict:
    """Name and size of a mesh."""
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


def two_set_data(check: TwoSetReport) -> dict:
    """The whole report but for the tails of long lists, and its words."""
    plain = check.to_json()
    for name in ("holes", "components"):
        plain[name] = plain[name][:MOST_LISTED]
    words = check.describe().splitlines()[
        :-1
    ]  # the last is about the sign, which has its own place
    return plain | {"n_holes": len(check.holes), "words": words}


def versions() -> dict:
    """What computed the report."""
    found = {name: version(name) for name in LIBRARIES}
    system = f"{platform.system()} {platform.machine()}"
    return found | {"python": platform.python_version(), "platform": system}


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
    kept = {end: 100.0 * share for end, share in asdict(edges.kept).items()}
    return {
        "angle": edges.angle,
        "n_edges": edges.n_edges,
        "length": edges.length,
        "largest": in_units(distance, found),
        "witness": edges.witness.tolist(),
        "kept_percent": None if found.voxel_size is None else kept,
    }


def _is_forward(found: Comparison) -> bool:
    return found.forward.distance.lower >= found.backward.distance.lower


def plain(value: Any) -> Any:
    """The same with floats beyond all range as None, so that any reader takes the JSON."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
