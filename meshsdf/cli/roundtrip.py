"""``meshsdf roundtrip``: mesh to volume to mesh, and the loss."""

import click

from .console import NO, YES, Console
from .options import (
    Length,
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
    type=click.Choice(["marching-cubes"]),
    default="marching-cubes",
    show_default=True,
    help="How the surface is extracted.",
)
@half_width_option
@sign_option
@click.option("--max-error", type=Length(), help="Exit 1 if the last row's is larger; 0.01, 0.5vox")
@click.option(
    "--until", type=PositiveNumber(), help="Double the resolution until the error is below."
)
@max_memory_option
@json_option
def command(
    mesh: str,
    resolutions: tuple[float, ...],
    method: str,
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
        sign=sign,
        half_width=half_width,
        until=until,
        report=report,
        max_memory=max_memory,
        progress=console.progress,
    )
    rows = trip.rows
    for warning in [*choice.warnings, *rows[-1].warnings]:
        console.warn(warning)
    passed = max_error is None or rows[-1].is_within(*max_error)
    console.result(f"{mesh}: sign by {choice.method} ({choice.reason})\n{roundtrip_table(trip)}")
    if not passed:
        console.say(f"the error at {rows[-1].resolution:g} may exceed --max-error")
    console.json(
        {
            "input": mesh,
            "method": method,
            "sign": choice.method,
            "rows": [row.to_json() for row in rows],
            "order": trip.order,
            "passed": passed,
            "warnings": console.warnings,
            "seconds": console.timings("load", "check"),
        }
    )
    return YES if passed else NO
