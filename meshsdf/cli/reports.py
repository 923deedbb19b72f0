"""The option ``--report`` of the commands that write one: refuse early, write at the end."""

import os
from collections.abc import Callable

import click

from .console import Console
from .options import path

report_option = click.option(
    "--report",
    "reports",
    type=path,
    multiple=True,
    help="Also write all of it to a page (.html), a text (.md) or for programs (.json); may be "
    "given several times.",
)


def check_reports(reports: tuple[str, ...], force: bool) -> None:
    """Refuse before any work starts what could not be written after it."""
    from ..errors import OutputError, ReportError
    from ..io import check_output
    from ..report.formats import format_of

    for name in reports:
        try:
            format_of(name)
        except ReportError as error:
            raise OutputError(error.what, error.where, error.fix) from None
        check_output(name, force)
    places = [os.path.realpath(name) for name in reports]
    for i, place in enumerate(places):
        if place in places[:i]:
            what = "two reports would be written to one file"
            raise OutputError(what, f"--report {reports[i]}", "name each once")


def write_reports(
    reports: tuple[str, ...], force: bool, console: Console, render: Callable[..., dict]
) -> None:
    """Write what ``render(names=..., progress=...)`` gives, and name the files."""
    from ..io import write_text

    with console.stage("report"):
        for name, text in render(names=reports, progress=console.progress).items():
            write_text(name, text, force=force)
    console.result(", ".join(reports))


def limit_words(limit: tuple[float, bool] | None) -> str | None:
    """A length as the user wrote it."""
    return None if limit is None else f"{limit[0]:g}{'vox' if limit[1] else ''}"
