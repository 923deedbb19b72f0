"""``meshsdf compare``: how far apart two meshes are."""

import os
import shlex
from functools import partial

import click

from .console import NO, YES, Console
from .options import Length, PositiveNumber, force_option, json_option, path
from .reports import check_reports, limit_words, report_option, write_reports

SHARE = 1e-3  # of a limit, or of the distance: how narrow the interval is to be


@click.command(
    epilog="Example: meshsdf compare scan.ply cad.obj --max-error 0.1 --report scan.html"
)
@click.argument("a", type=path)
@click.argument("b", type=path)
@click.option(
    "--tolerance",
    type=PositiveNumber(),
    help="Exit 1 if they may be farther apart than this, world units.",
)
@click.option(
    "--max-error",
    type=Length(),
    help="The same, and also in voxels: 0.01 (world units), or 0.5vox with --voxel-size.",
)
@click.option(
    "--voxel-size",
    type=PositiveNumber(),
    help="Also give distances in voxels of this size, world units.",
)
@click.option(
    "--time-budget",
    type=PositiveNumber(),
    help="Seconds after which the interval is left as wide as it is; reading the files, "
    "measuring all vertices and statistics come on top.",
)
@click.option(
    "--statistics/--no-statistics",
    default=True,
    help="Enclose mean, rms and percentiles too, which takes longer.  [default: statistics]",
)
@report_option
@force_option
@json_option
@click.pass_context
def command(
    context: click.Context,
    a: str,
    b: str,
    tolerance: float | None,
    max_error: tuple[float, bool] | None,
    voxel_size: float | None,
    time_budget: float | None,
    statistics: bool,
    reports: tuple[str, ...],
    force: bool,
    as_json: bool,
) -> int:
    """How far apart are the surfaces of A and B, at most, in the mean, and where?

    The largest distance is given as an interval that contains the truth.
    """
    if max_error is not None and max_error[1] and voxel_size is None:
        text = f"--max-error {max_error[0]:g}vox needs --voxel-size, the length of a voxel"
        raise click.UsageError(text)
    console = Console("compare", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, read_mesh
    from ..report.compare import compare
    from ..report.tolerance import Tolerance

    for name in (a, b):
        check_input(name, kind="mesh")
    check_reports(reports, force)
    limits = _limits(tolerance, max_error, voxel_size)
    width = None if not limits else Tolerance(SHARE * min(limits.values()), SHARE)
    with console.stage("load"):
        first = read_mesh(a, warn=lambda text: console.warn(f"{a}: {text}"))
        second = read_mesh(b, warn=lambda text: console.warn(f"{b}: {text}"))
    options = {"voxel_size": voxel_size, "tolerance": width, "time_budget": time_budget}
    options["statistics"] = statistics
    with console.stage("compare"):
        comparison = compare(first, second, **options, progress=console.progress)
    missed = [word for word, limit in limits.items() if comparison.distance.upper > limit]
    console.result(f"{a} and {b}:\n{comparison.describe()}", is_last=not reports)
    for word in missed:
        console.say(_sentence(comparison.distance, word, limits[word]))
    if reports:
        from ..report.formats import render_comparison

        with console.stage("check"):
            pair = _pair((first, second), comparison, console)
        whole = [
            _sentence(comparison.distance, word, limits[word], "The meshes") for word in missed
        ]
        asked = _asked(context.params, whole, console.warnings)
        write_reports(reports, force, console, partial(render_comparison, pair, asked))
    head = {"a": a, "b": b, "tolerance": tolerance, "passed": not missed}
    head["max_error"] = None if max_error is None else list(limits.values())[-1]
    if reports:
        head["reports"] = list(reports)
    seconds = console.timings("load", "compare")
    console.json(head | comparison.to_json() | {"warnings": console.warnings, "seconds": seconds})
    return NO if missed else YES


def _limits(
    tolerance: float | None, max_error: tuple[float, bool] | None, voxel_size: float | None
) -> dict[str, float]:
    """What the distance is held against, world units, by the words of the command line."""
    limits = {}
    if tolerance is not None:
        limits[f"--tolerance {tolerance:g}"] = tolerance
    if max_error is not None:
        value, in_voxels = max_error
        word = f"--max-error {value:g}{'vox' if in_voxels else ''}"
        limits[word] = value * voxel_size if in_voxels else value
    return limits


def _sentence(distance, word: str, limit: float, who: str = "they") -> str:
    """Whether they are too far apart, or are only not known to be near enough."""
    from ..report.enclosure import ceil_digits, floor_digits

    if distance.lower > limit:
        return f"{who} are {floor_digits(distance.lower)} apart, above {word}"
    return f"{who} may be {ceil_digits(distance.upper)} apart, above {word}"


def _pair(meshes: tuple, comparison, console: Console):
    """What a report needs beside the comparison."""
    from ..mesh.two_set import check
    from ..report.compare_report import ComparedPair, edges_between

    checks = tuple(check(mesh, self_intersections=False) for mesh in meshes)
    edges = edges_between(*meshes, comparison.voxel_size, progress=console.progress)
    return ComparedPair(meshes, comparison, checks, edges)


def _asked(options: dict, missed: list[str], warnings: list[str]):
    """What the user asked for, as the report repeats it."""
    from ..report.compare_report import ComparisonAsked

    tolerance = options["tolerance"]
    return ComparisonAsked(
        *(os.path.basename(options[name]) for name in "ab"),
        command=_command(options),
        tolerance=None if tolerance is None else f"{tolerance:g}",
        max_error=limit_words(options["max_error"]),
        missed=tuple(missed),
        warnings=tuple(warnings),
    )


def _command(options: dict) -> str:
    """The command line that gives the same numbers."""
    words = ["meshsdf", "compare", options["a"], options["b"]]
    for name in ("tolerance", "voxel_size", "time_budget"):
        if options[name] is not None:
            words += [f"--{name.replace('_', '-')}", _exact(options[name])]
    if options["max_error"] is not None:
        value, in_voxels = options["max_error"]
        words += ["--max-error", f"{_exact(value)}{'vox' if in_voxels else ''}"]
    return shlex.join(words + ([] if options["statistics"] else ["--no-statistics"]))


def _exact(value: float) -> str:
    """As short as possible, and read back as the same number."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)
