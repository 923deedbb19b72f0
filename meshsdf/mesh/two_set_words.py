"""A two-set report as sentences for people and as plain types for machines."""

from math import isfinite

import numpy as np

from .two_set_report import FLAT, TwoSetReport


def report_to_json(report: TwoSetReport) -> dict:
    """Every fact of a report as bool, int, float, str, list and dict.

    Lengths, areas and volumes beyond the range of floats become null.
    """
    crossings = report.self_intersections
    plain = {
        name: _finite(value) if isinstance(value, float) else value
        for name, value in vars(report).items()
        if isinstance(value, bool | int | float | str)
    }
    return plain | {
        "n_components": report.n_components,
        "crack_width": report.crack_width,
        "crack_certain_beyond": None if report.repair is None else report.repair.certain_beyond,
        "holes": [
            {
                "length": _finite(hole.length),
                "n_edges": hole.n_edges,
                "closed": hole.closed,
                "center": hole.center.tolist(),
            }
            for hole in report.holes
        ],
        "components": [
            {
                "n_faces": part.n_faces,
                "area": _finite(part.area),
                "volume": _finite(part.volume),
                "closed": part.closed,
                "oriented": part.oriented,
                "inside_out": part.inside_out,
                "lower": part.box.lower.tolist(),
                "upper": part.box.upper.tolist(),
            }
            for part in report.components
        ],
        "n_self_intersections": None if crossings is None else crossings.n_pairs,
        "first_self_intersection": (
            None
            if crossings is None or crossings.first_place is None or crossings.first_pair is None
            else {
                "faces": list(crossings.first_pair),
                "place": crossings.first_place.tolist(),
            }
        ),
    }


def describe_report(report: TwoSetReport) -> str:
    """The verdict first, then what else is worth knowing, then what follows from it."""
    verdict = _closed_words(report) if report.two_set else _open_words(report)
    sentences = [*verdict, *_part_words(report), *_face_words(report), *_crossing_words(report)]
    reason = report.recommended_sign_reason
    if report.flat and reason != FLAT:
        sentences.append(f"{FLAT}.".capitalize())
    sentences.append(f"convert will {_METHOD[report.recommended_sign]}: {reason}.")
    return "\n".join(sentences)


_METHOD = {
    "winding": "use winding numbers",
    "parity": "count crossings (parity)",
    "unsigned": "write unsigned distances",
}


def _closed_words(report: TwoSetReport) -> list[str]:
    """Why the mesh is two-set."""
    if report.two_set_by_index:
        how = "every edge has an even number of faces"
    elif report.two_set_by_welding:
        n_repeated = report.n_vertices - report.n_welded_vertices
        how = (
            f"closed once {_count(n_repeated, 'vertex', 'vertices')} at repeated positions "
            f"{'is' if n_repeated == 1 else 'are'} merged"
        )
    else:
        how = (
            f"closed in space though not by its indices: "
            f"{_count(report.n_tjunction_edges, 'edge')} cancel exactly on common lines "
            "(T-junctions)"
        )
    words = [f"two-set: {how}."]
    if not report.oriented:
        words.append(
            f"not oriented: faces disagree about their front at "
            f"{_count(report.n_orientation_conflicts, 'edge')}."
        )
    return words


def _open_words(report: TwoSetReport) -> list[str]:
    """Where the mesh is open, and how far that can matter."""
    longest = report.holes[0]
    n = len(report.holes)
    size = f"{_count(longest.n_edges, 'edge')}, {longest.length:.3g} units long, near "
    size += _place(longest.center)
    which = f"1 hole of {size}" if n == 1 else f"{n} holes, the largest of {size}"
    words = [f"not two-set: {which}."]
    if report.crack_width is not None:
        words.append(
            f"{'It is only a crack' if n == 1 else 'They are only cracks'}: moving vertices by "
            f"{report.crack_width:.2g} units closes the mesh"
            + _certificate_words(report.repair.certain_beyond)
        )
    else:
        words.append(
            f"Inside is undefined there; further than {report.certain_beyond:.2g} units from "
            f"{'the rim' if n == 1 else 'the rims'} the sign is the same however "
            f"{'it is' if n == 1 else 'they are'} filled (within the convex hull of "
            f"{'the' if n == 1 else 'each'} rim)."
        )
    if report.n_tjunction_edges:
        words.append(
            f"{_count(report.n_tjunction_edges, 'more edge')} only look open: they cancel exactly "
            "on common lines (T-junctions)."
        )
    if report.n_orientation_conflicts:
        words.append(
            f"Faces disagree about their front at "
            f"{_count(report.n_orientation_conflicts, 'closed edge')}."
        )
    return words


def _certificate_words(certain_beyond: float | None) -> str:
    if certain_beyond is None:
        return "."
    return f", and every sign further than {certain_beyond:.2g} units from the surface is proved."


def _part_words(report: TwoSetReport) -> list[str]:
    """How many parts, and which face the wrong way."""
    words = []
    if report.n_components > 1:
        n_closed = sum(part.closed for part in report.components)
        words.append(f"{report.n_components} parts, {n_closed} of them closed by themselves.")
    turned = [part for part in report.components if part.inside_out]
    if turned:
        largest = max(turned, key=lambda part: -part.volume)
        which = "1 part is" if len(turned) == 1 else f"{len(turned)} parts are"
        words.append(
            f"{which} inside out (faces look inward), the largest with "
            f"{_count(largest.n_faces, 'face')} near {_place(largest.box.center)}; "
            "inside is still inside, but normals point the wrong way."
        )
    return words


def _face_words(report: TwoSetReport) -> list[str]:
    """Faces, edges and vertices that other programs may stumble over."""
    words = []
    if report.n_degenerate_faces:
        n = _count(report.n_degenerate_faces, "face")
        words.append(f"{n} of zero area: kept for the check, ignored for distances.")
    if report.n_duplicate_faces:
        n = _count(report.n_duplicate_faces, "face")
        what = f"{n} with the same corners as another"
        if not report.strict:
            what += "; sheets that lie double separate nothing and cancel"
        words.append(what + ".")
    branching = []
    if report.n_nonmanifold_edges:
        branching.append(f"{_count(report.n_nonmanifold_edges, 'edge')} with more than two faces")
    if report.n_nonmanifold_vertices:
        n = _count(report.n_nonmanifold_vertices, "vertex", "vertices")
        branching.append(f"{n} where sheets touch or branch")
    if branching:
        words.append(f"{' and '.join(branching)}: not manifold, harmless here.")
    return words


def _crossing_words(report: TwoSetReport) -> list[str]:
    """Self-intersections, as information."""
    crossings = report.self_intersections
    if crossings is None or crossings.first_place is None:
        return []
    n = _count(crossings.n_pairs, "pair")
    does = "crosses" if crossings.n_pairs == 1 else "cross"
    return [f"{n} of faces {does} (first near {_place(crossings.first_place)}): harmless here."]


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def _count(n: int, singular: str, plural: str | None = None) -> str:
    return f"{n} {singular}" if n == 1 else f"{n} {plural or singular + 's'}"


def _place(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in point.tolist()) + ")"
