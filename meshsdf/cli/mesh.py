"""``meshsdf mesh``: volume to mesh."""

from dataclasses import asdict

import click

from .console import YES, Console, plural
from .options import Names, Number, force_option, json_option, path

OPEN = "open at the grid's border"


@click.command(epilog="Example: meshsdf mesh bunny.npz bunny.ply")
@click.argument("volume", type=path)
@click.argument("out", type=path)
@click.option(
    "--method",
    type=click.Choice(["marching-cubes", "dual-contouring", "surface-nets"]),
    default="marching-cubes",
    show_default=True,
    help="How the surface is extracted; dual contouring gives sharp features back where VOLUME was "
    "made with convert --hermite, or --source names its mesh; surface nets are OpenVDB's.",
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
@click.option(
    "--topology",
    type=click.Choice(["manifold", "trilinear"]),
    default="manifold",
    show_default=True,
    help="What cells hold whose signs leave a choice: inside parts kept apart, or as the trilinear "
    "interpolant has it.",
)
@click.option(
    "--carry",
    type=Names("colours", "uv"),
    help="Give the mesh what the one of --source has: colours, uv or colours,uv.",
)
@click.option("--source", type=path, help="The mesh that VOLUME was made from.")
@click.option("--grid", help="Which grid of a .vdb file.  [default: the first level set]")
@force_option
@json_option
def command(
    volume: str,
    out: str,
    method: str,
    level: float | None,
    border: str,
    topology: str,
    carry: tuple[str, ...] | None,
    source: str | None,
    grid: str | None,
    force: bool,
    as_json: bool,
) -> int:
    """Extract the surface of VOLUME as a closed, oriented, manifold mesh, OUT."""
    console = Console("mesh", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, check_output, read_mesh, read_volume, write_mesh
    from ..mesh.topology import topology as topology_of
    from ..surface import carry as carry_attributes
    from ..surface import (
        choose_normals,
        default_level,
        dual_contouring,
        marching_cubes,
        require_faces,
        surface_nets,
    )

    is_dual = method == "dual-contouring"
    if carry is not None and source is None:
        raise click.UsageError("--carry needs --source MESH")
    if source is not None and carry is None and not is_dual:
        raise click.UsageError("--source is for --carry and --method dual-contouring")
    if method != "marching-cubes" and topology != "manifold":
        raise click.UsageError("--topology is for --method marching-cubes")
    check_input(volume, kind="volume")
    if source is not None:
        check_input(source, kind="mesh")
    check_output(out, kind="mesh", force=force)
    with console.stage("load"):
        loaded = read_volume(volume, grid=grid, warn=console.warn)
    if level is None:
        level, warnings = default_level(loaded)
        for warning in warnings:
            console.warn(warning)
    owner = None
    if source is not None:
        owner = read_mesh(source, warn=console.warn)
    options = {"level": level, "border": border, "progress": console.progress}
    if is_dual:
        for warning in choose_normals(loaded, owner, level=level).warnings:
            console.warn(warning)
        surface = dual_contouring(loaded, owner, **options)
    elif method == "surface-nets":
        surface = surface_nets(loaded, **options)
    else:
        surface = marching_cubes(loaded, topology=topology, **options)
    require_faces(surface, level=level)
    shape = topology_of(surface)
    if carry is not None:
        with console.stage("carry"):
            surface = carry_attributes(surface, owner, carry, progress=console.progress)
    with console.stage("write"):
        write_mesh(out, surface, force=force)
    facts = {"n_vertices": surface.n_vertices, "n_faces": surface.n_faces, **asdict(shape)}
    seconds = console.timings("load", "surface", "write")
    console.result(
        f"{out}: {plural(surface.n_vertices, 'vertex', 'vertices')}, "
        f"{plural(surface.n_faces, 'face')}, "
        f"{shape.describe(OPEN)}, {seconds['total']:.2f} s"
    )
    head = {"input": volume, "output": out, "method": method, "level": level}
    console.json(head | facts | {"seconds": seconds, "warnings": console.warnings})
    return YES
