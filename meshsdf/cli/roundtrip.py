"""``meshsdf roundtrip``: mesh to volume to mesh, and the loss."""

import click

from .console import NO, YES, Console
from .options import (
    Length,
    Names,
    PositiveNumber,
    Resolutions,
    half_width_option,
    json_option,
    max_memory_option,
    path,
    sign_option,
)


@click.command(epilog="Example: meshsdf roundtrip bunny.obj --resolution 64,128,256")
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
    type=Names("marching-cubes", "dual-contouring"),
    default=("marching-cubes",),
    help="How the surface is extracted; with both, they are compared.  [default: marching-cubes]",
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
@max_memory_option
@json_option
def command(
    mesh: str,
    resolutions: tuple[float, ...],
    methods: tuple[str, ...],
    half_width: float,
    sign: str,
    max_error: tuple[float, bool] | None,
    until: float | None,
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
    with console.stage("load"):
        loaded = read_mesh(mesh, warn=console.warn)
    with console.stage("check"):
        report = check(loaded, self_intersections=False)
        choice = choose_sign(report, sign)
    trip = roundtrip(
        loaded,
        resolutions,
        methods=methods,
        sign=sign,
        half_width=half_width,
        until=until,
        report=report,
        max_memory=max_memory,
        progress=console.progress,
    )
    last = [trip.last(method) for method in trip.methods]
    warnings = [warning for row in last for warning in row.warnings]
    for warning in dict.fromkeys([*choice.warnings, *warnings]):
        console.warn(warning)
    missed = [sentence for row in last for sentence in _missed(row, max_error, until)]
    console.result(f"{mesh}: sign by {choice.method} ({choice.reason})\n{roundtrip_table(trip)}")
    for sentence in missed:
        console.say(sentence)
    console.json(
        {
            "input": mesh,
            "method": ",".join(trip.methods),
            "sign": choice.method,
            "rows": [row.to_json() for row in trip.rows],
            "order": trip.order(trip.methods[0]),
            "orders": {method: trip.order(method) for method in trip.methods},
            "passed": not missed,
            "warnings": console.warnings,
            "seconds": console.timings("load", "check"),
        }
    )
    return NO if missed else YES


def _missed(row, max_error: tuple[float, bool] | None, until: float | None) -> list[str]:
    """A sentence for every demand that the last row does not certainly meet."""
    missed = []
    if max_error is not None and not row.is_within(*max_error):
        unit = "vox" if max_error[1] else ""
        limit = f"--max-error {max_error[0]:g}{unit}"
        missed.append(f"{row.method} at {row.resolution:g}: the error may exceed {limit}")
    if until is not None and not row.is_within(until):
        why = "finer voxels do not help, or do not fit in memory"
        missed.append(f"{row.method} at {row.resolution:g} does not reach --until {until:g}: {why}")
    return missed
