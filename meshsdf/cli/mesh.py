"""``meshsdf mesh``: volume to mesh."""

import click

from .console import YES, Console, plural
from .options import Number, force_option, json_option, path


@click.command(epilog="Example: meshsdf mesh bunny.npz bunny.ply")
@click.argument("volume", type=path)
@click.argument("out", type=path)
@click.option(
    "--method",
    type=click.Choice(["marching-cubes"]),
    default="marching-cubes",
    show_default=True,
    help="How the surface is extracted.",
)
@click.option(
    "--level",
    type=Number(),
    help="Distance of the surface, world units.  [default: 0; unsigned: one voxel]",
)
@click.option(
    "--border",
    type=click.Choice(["open", "cap", "pad"]),
    default="open",
    show_default=True,
    help="What happens where a dense grid ends.",
)
@force_option
@json_option
def command(
    volume: str, out: str, method: str, level: float | None, border: str, force: bool, as_json: bool
) -> int:
    """Extract the surface of VOLUME as a closed, oriented, manifold mesh, OUT."""
    console = Console("mesh", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, check_output, read_volume, write_mesh
    from ..mesh.measures import euler_number, is_watertight
    from ..surface import default_level, marching_cubes, require_faces

    check_input(volume, kind="volume")
    check_output(out, kind="mesh", force=force)
    with console.stage("load"):
        loaded = read_volume(volume)
    if level is None:
        level, warnings = default_level(loaded)
        for warning in warnings:
            console.warn(warning)
    surface = marching_cubes(loaded, level=level, border=border, progress=console.progress)
    require_faces(surface, level=level)
    with console.stage("write"):
        write_mesh(out, surface, force=force)
    facts = {
        "n_vertices": surface.n_vertices,
        "n_faces": surface.n_faces,
        "is_watertight": is_watertight(surface),
        "euler_number": euler_number(surface),
    }
    closed = "closed" if facts["is_watertight"] else "open at the grid's border"
    seconds = console.timings("load", "surface", "write")
    console.result(
        f"{out}: {plural(surface.n_vertices, 'vertex', 'vertices')}, "
        f"{plural(surface.n_faces, 'face')}, {closed}, "
        f"Euler number {facts['euler_number']}, {seconds['total']:.2f} s"
    )
    head = {"input": volume, "output": out, "method": method, "level": level}
    console.json(head | facts | {"seconds": seconds, "warnings": console.warnings})
    return YES
