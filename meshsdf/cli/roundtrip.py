"""``meshsdf roundtrip``: mesh to volume to mesh, and the loss."""

import os
import shlex
from functools import partial

import click

from .console import NO, YES, Console
from .options import (
    Length,
    Names,
    PositiveNumber,
    Resolutions,
    force_option,
    half_width_option,
    json_option,
    max_memory_option,
    path,
    sign_option,
)
from .reports import check_reports, limit_words, report_option, write_reports

LONGER = "a report also proves means and says where the error comes from: many times the work"


@click.command(
    epilog="Example: meshsdf roundtrip bunny.obj --resolution 64,128 --report bunny.html"
)
@click.argument("mesh", type=path)
@click.option(
    "--resolution",
    "resolutions",
    type=Resolutions(),
    default=(64.0, 128.0, 256.0),
    help="Voxels along the longest side, one row each.  [default: 64,128,256]",
)
@click.option(
    "--method",
    "methods",
    type=Names("marching-cubes", "dual-contouring", "surface-nets"),
    default=("marching-cubes",),
    help="How the surface is extracted; several are compared.  [default: marching-cubes]",
)
@half_width_option
@sign_option
@click.option(
    "--max-error",
    type=Length(),
    help="Exit 1 if the largest distance of the last row may exceed 0.01 (world units) or 0.5vox.",
)
@click.option(
    "--until",
    type=PositiveNumber(),
    help="Double the last resolution until the largest distance is below, world units; "
    "exit 1 if that cannot be.",
)
@click.option(
    "--carry-texture",
    is_flag=True,
    help="Also carry MESH's colours to what came back, in texels of a voxel, and compare them.",
)
@report_option
@click.option("--timings", is_flag=True, help="Tell times in the report, which then vary.")
@force_option
@max_memory_option
@json_option
@click.pass_context
def command(
    context: click.Context,
    mesh: str,
    resolutions: tuple[float, ...],
    methods: tuple[str, ...],
    half_width: float,
    sign: str,
    max_error: tuple[float, bool] | None,
    until: float | None,
    carry_texture: bool,
    reports: tuple[str, ...],
    timings: bool,
    force: bool,
    max_memory: float | None,
    as_json: bool,
) -> int:
    """How much is lost when MESH becomes a volume and a mesh again?

    The largest distance is given as an interval that contains the truth.
    """
    console = Console("roundtrip", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, read_mesh
    from ..mesh.two_set import check
    from ..report.roundtrip import roundtrip
    from ..report.words import roundtrip_table
    from ..sdf import choose_sign

    check_input(mesh, kind="mesh")
    check_reports(reports, force)
    with console.stage("load"):
        loaded = read_mesh(mesh, warn=console.warn)
    if carry_texture:
        from ..report.color_loss import require_colors

        require_colors(loaded, f"{mesh}, --carry-texture")
    with console.stage("check"):
        found = check(loaded, self_intersections=False)
        choice = choose_sign(found, sign)
    if reports:
        console.say(LONGER)
    trip = roundtrip(
        loaded,
        resolutions,
        methods=methods,
        sign=sign,
        half_width=half_width,
        until=until,
        report=found,
        max_memory=max_memory,
        details=bool(reports),
        carry_texture=carry_texture,
        progress=console.progress,
    )
    last = [trip.last(method) for method in trip.methods]
    warnings = [warning for row in last for warning in row.warnings]
    for warning in dict.fromkeys([*choice.warnings, *warnings]):
        console.warn(warning)
    missed = [sentence for row in last for sentence in _missed(row, max_error, until)]
    words = f"{mesh}: sign by {choice.method} ({choice.reason})\n{roundtrip_table(trip)}"
    console.result(words, is_last=not reports)
    for sentence in missed:
        console.say(sentence)
    if reports:
        from ..report.formats import render_reports
        from ..report.report_data import Asked

        asked = Asked(
            name=os.path.basename(mesh),
            command=_command(context.params),
            max_error=limit_words(max_error),
            until=None if until is None else f"{until:g}",
            missed=tuple(missed),
            warnings=tuple(console.warnings),
            seconds=console.timings("load", "check") if timings else None,
        )
        facts = trip, loaded, found, choice, asked
        write_reports(reports, force, console, partial(render_reports, *facts))
    console.json(
        {
            "input": mesh,
            "method": ",".join(trip.methods),
            "sign": choice.method,
            "rows": trip.rows_to_json(),
            "order": trip.order(trip.methods[0]),
            "orders": {method: trip.order(method) for method in trip.methods},
            "passed": not missed,
            "reports": list(reports),
            "warnings": console.warnings,
            "seconds": console.timings("load", "check"),
        }
    )
    return NO if missed else YES


def _missed(row, max_error: tuple[float, bool] | None, until: float | None) -> list[str]:
    """A sentence for every demand that the last row does not certainly meet."""
    missed = []
    if max_error is not None and not row.is_within(*max_error):
        limit = f"--max-error {limit_words(max_error)}"
        missed.append(f"{row.method} at {row.resolution:g}: the error may exceed {limit}")
    if until is not None and not row.is_within(until):
        why = "finer voxels do not help, or do not fit in memory"
        missed.append(f"{row.method} at {row.resolution:g} does not reach --until {until:g}: {why}")
    return missed


def _command(options: dict) -> str:
    """The command line that gives the same numbers, with all that decides them spelled out."""
    words = ["meshsdf", "roundtrip", options["mesh"]]
    words += ["--resolution", ",".join(f"{n:g}" for n in options["resolutions"])]
    words += ["--method", ",".join(options["methods"])]
    words += ["--half-width", f"{options['half_width']:g}", "--sign", options["sign"]]
    for name in ("until", "max_memory"):
        if options[name] is not None:
            words += [f"--{name.replace('_', '-')}", f"{options[name]:g}"]
    if options["max_error"] is not None:
        words += ["--max-error", limit_words(options["max_error"])]
    if options["carry_texture"]:
        words.append("--carry-texture")
    return shlex.join(words)
