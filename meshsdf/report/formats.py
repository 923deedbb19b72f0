"""A report in the format that its file's name asks for."""

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from ..errors import ReportError
from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport
from ..progress import Progress, silent
from ..sdf import SignChoice
from .compare_report import ComparedPair, ComparisonAsked, compare_data, words_of
from .report_data import Asked, report_data
from .roundtrip import RoundTrip

FORMATS = {".html": "html", ".htm": "html", ".json": "json", ".md": "markdown"}


def format_of(name: str | os.PathLike) -> str:
    """Return "html", "json" or "markdown" by the suffix.

    Raises
    ------
    ReportError
        Another suffix.
    """
    suffix = Path(name).suffix.lower()
    if suffix not in FORMATS:
        what = f"a report with suffix {suffix!r} cannot be written"
        raise ReportError(what, f"report {os.fspath(name)}", "name it .html, .json or .md")
    return FORMATS[suffix]


def render_reports(
    trip: RoundTrip,
    mesh: Mesh,
    check: TwoSetReport,
    choice: SignChoice,
    asked: Asked,
    *,
    names: Sequence[str | os.PathLike],
    progress: Progress = silent,
) -> dict[str | os.PathLike, str]:
    """Write a round trip as text in every format asked for.

    Parameters
    ----------
    trip : RoundTrip
        Made with ``details=True``, or the report lacks what that measures.
    mesh : Mesh
        What made it.
    check : TwoSetReport
        What was found about the mesh.
    choice : SignChoice
        How inside was told.
    asked : Asked
        What the user asked for.
    names : sequence of path
        Their suffixes name the formats.

    Returns
    -------
    texts : dict
        What each file holds.

    Raises
    ------
    ReportError
        A suffix that names no format.

    Notes
    -----
    The same input gives the same bytes. JSON and HTML of one round trip hold the same dict.
    """
    formats = [format_of(name) for name in names]
    data = report_data(trip, mesh, check, choice, asked)

    def text() -> str:
        from .markdown import markdown

        return markdown(data)

    return _rendered(names, formats, data, text, lambda: _page(trip, mesh, data, progress))


def render_comparison(
    pair: ComparedPair,
    asked: ComparisonAsked,
    *,
    names: Sequence[str | os.PathLike],
    progress: Progress = silent,
) -> dict[str | os.PathLike, str]:
    """Write a comparison as text in every format asked for.

    Parameters
    ----------
    pair : ComparedPair
        Both meshes and what was found of them.
    asked : ComparisonAsked
        What the user asked for.
    names : sequence of path
        Their suffixes name the formats.

    Returns
    -------
    texts : dict
        As for `render_reports`, which also tells what is raised.
    """
    formats = [format_of(name) for name in names]
    data = compare_data(pair, asked)

    def text() -> str:
        from .compare_markdown import compare_markdown

        return compare_markdown(data)

    def drawn() -> str:
        from .heat_maps import pair_maps, pair_scales
        from .html import compare_page

        scales, says = pair_scales(pair.comparison), words_of(data)
        return compare_page(
            data, pair_maps(pair.meshes, pair.comparison, scales, says, progress=progress)
        )

    return _rendered(names, formats, data, text, drawn)


def _rendered(
    names: Sequence[str | os.PathLike],
    formats: list[str],
    data: dict,
    text: Callable[[], str],
    drawn: Callable[[], str],
) -> dict[str | os.PathLike, str]:
    """Every format once, for all files that ask for it."""
    writers = {
        "json": lambda: json.dumps(data, indent=2, allow_nan=False) + "\n",
        "markdown": text,
        "html": drawn,
    }
    made = {kind: writers[kind]() for kind in dict.fromkeys(formats)}
    return {name: made[kind] for name, kind in zip(names, formats, strict=True)}


def _page(trip: RoundTrip, mesh: Mesh, data: dict, progress: Progress) -> str:
    from .heat_maps import common_scales, heat_maps
    from .html import page

    shown = [i for i in data["last_rows"] if trip.rows[i].comparison is not None]
    if not shown:
        return page(data)
    scales = common_scales([trip.rows[i] for i in shown])
    maps = {i: heat_maps(mesh, trip.rows[i], scales, progress=progress) for i in shown}
    return page(data, maps)
