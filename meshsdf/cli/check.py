"""``meshsdf check``: the two-set property, with the evidence."""

import click

from .console import NO, YES, Console
from .options import json_option, path


@click.command(epilog="Example: meshsdf check bunny.obj --json")
@click.argument("mesh", type=path)
@json_option
def command(mesh: str, as_json: bool) -> int:
    """Does MESH part space into inside and outside? Exit 0 when it does, else 1.

    Decided exactly for the numbers in the file: T-junctions and unwelded triangles pass, a real
    crack fails. Holes are named and located; self-intersections are reported, but do not decide.
    """
    console = Console("check", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, read_mesh
    from ..mesh.two_set import check

    check_input(mesh, kind="mesh")
    with console.stage("load"):
        loaded = read_mesh(mesh, warn=console.warn)
    with console.stage("check"):
        report = check(loaded, progress=console.progress)
    console.result(f"{mesh}: {report.describe()}")
    seconds = console.timings("load", "check")
    tail = {"warnings": console.warnings, "seconds": seconds}
    console.json({"input": mesh} | report.to_json() | tail)
    return YES if report.two_set else NO
