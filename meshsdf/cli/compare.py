"""``meshsdf compare``: how far apart two meshes are."""

import click

from .console import NO, YES, Console
from .options import PositiveNumber, json_option, path


@click.command(epilog="Example: meshsdf compare scan.ply cad.obj --tolerance 0.1")
@click.argument("a", type=path)
@click.argument("b", type=path)
@click.option(
    "--tolerance",
    type=PositiveNumber(),
    help="Exit 1 if they may be farther apart than this, world units.",
)
@click.option(
    "--voxel-size",
    type=PositiveNumber(),
    help="Also give distances in voxels of this size, world units.",
)
@json_option
def command(
    a: str, b: str, tolerance: float | None, voxel_size: float | None, as_json: bool
) -> int:
    """How far apart are the surfaces of A and B, at most, in the mean, and where?

    The largest distance is given as an interval that contains the truth.
    """
    console = Console("compare", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, read_mesh
    from ..report.compare import compare
    from ..report.enclosure import ceil_digits

    for name in (a, b):
        check_input(name, kind="mesh")
    with console.stage("load"):
        first = read_mesh(a, warn=lambda text: console.warn(f"{a}: {text}"))
        second = read_mesh(b, warn=lambda text: console.warn(f"{b}: {text}"))
    with console.stage("compare"):
        comparison = compare(first, second, voxel_size=voxel_size, progress=console.progress)
    passed = tolerance is None or comparison.distance.upper <= tolerance
    console.result(f"{a} and {b}:\n{comparison.describe()}")
    if not passed:
        distance = ceil_digits(comparison.distance.upper)
        console.say(f"they may be {distance} apart, above --tolerance {tolerance:g}")
    head = {"a": a, "b": b, "tolerance": tolerance, "passed": passed}
    seconds = console.timings("load", "compare")
    console.json(head | comparison.to_json() | {"warnings": console.warnings, "seconds": seconds})
    return YES if passed else NO
