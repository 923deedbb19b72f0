"""``meshsdf convert``: mesh to volume."""

import os
from dataclasses import replace

import click

from .console import YES, Console, file_size, plural
from .options import (
    PositiveNumber,
    force_option,
    half_width_option,
    json_option,
    max_memory_option,
    path,
    sign_option,
)


@click.command(epilog="Example: meshsdf convert bunny.obj bunny.npz --resolution 256")
@click.argument("mesh", type=path)
@click.argument("out", type=path)
@click.option("--resolution", type=PositiveNumber(), help="Voxels along the longest side.")
@click.option("--voxel-size", type=PositiveNumber(), help="Size of a voxel, world units.")
@half_width_option
@sign_option
@click.option("--dense", is_flag=True, help="A full grid, exact at every node.")
@click.option("--half", is_flag=True, help="Store 16-bit floats.")
@click.option("--closest", is_flag=True, help="Also store closest faces and barycentrics.")
@click.option(
    "--hermite",
    is_flag=True,
    help="Also store crossings, normals and features, for mesh --method dual-contouring; NPZ only.",
)
@max_memory_option
@force_option
@json_option
def command(
    mesh: str,
    out: str,
    resolution: float | None,
    voxel_size: float | None,
    half_width: float,
    sign: str,
    dense: bool,
    half: bool,
    closest: bool,
    hermite: bool,
    max_memory: float | None,
    force: bool,
    as_json: bool,
) -> int:
    """Turn MESH into a volume of exact signed distances, OUT.

    Without --resolution or --voxel-size the longest side gets 128 voxels.
    """
    if resolution is not None and voxel_size is not None:
        raise click.UsageError("give --resolution or --voxel-size, not both")
    if dense and closest:
        raise click.UsageError("--closest is for narrow bands; leave out --dense")
    if hermite and (dense or not out.lower().endswith(".npz")):
        raise click.UsageError("--hermite is for narrow bands in .npz files")
    if voxel_size is None and resolution is None:
        resolution = 128
    console = Console("convert", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, check_output, read_mesh, write_volume
    from ..mesh.two_set import check
    from ..sdf import (
        choose_sign,
        mesh_to_band,
        mesh_to_grid,
        resolve_voxel_size,
        union_words,
    )
    from ..surface import sample_hermite

    check_input(mesh, kind="mesh")
    check_output(out, kind="volume", force=force)
    with console.stage("load"):
        loaded = read_mesh(mesh, warn=console.warn)
    with console.stage("check"):
        report = check(loaded, self_intersections=False)
        size = resolve_voxel_size(loaded, resolution, voxel_size)
        choice = choose_sign(report, sign, voxel_size=size)
    options = {
        "resolution": resolution,
        "voxel_size": voxel_size,
        "half_width": half_width,
        "sign": sign,
        "report": report,
        "max_memory": max_memory,
        "progress": console.progress,
    }
    if dense:
        volume = mesh_to_grid(loaded, **options)
    else:
        volume = mesh_to_band(loaded, closest=closest, **options)
    if hermite and volume.is_signed:
        volume = replace(volume, hermite=sample_hermite(loaded, volume, progress=console.progress))
    with console.stage("write"):
        write_volume(out, volume, half=half, force=force)

    for warning in choice.warnings:
        console.warn(warning)
    if hermite and not volume.is_signed:
        console.warn("no Hermite data: an unsigned band has no crossings")
    if volume.sign != choice.method:
        console.warn("no node is inside, so distances are unsigned")
    facts = volume.facts()
    if facts.get("uncertain_voxels"):
        n = plural(facts["uncertain_voxels"], "voxel")
        where = "near the membranes of openings: the winding number is within 0.05 of 1/2"
        console.warn(f"{n} {'nearer than that' if choice.by_crossings else where}")
    if facts.get("n_inner_faces"):
        console.warn(union_words(report, facts["n_inner_faces"]))
    stages = ("load", "check", "bricks", "union", "distance", "far field", "sign", "write")
    seconds = console.timings(*stages)
    seconds["distance"] += sum(seconds.pop(name) for name in ("bricks", "union", "far field"))
    console.result(_words(mesh, out, facts, choice, loaded, seconds["total"]))
    console.json(
        {"input": mesh, "output": out, "bytes": os.path.getsize(out)}
        | facts
        | {"sign": volume.sign, "sign_reason": choice.reason}
        | {"seconds": seconds, "warnings": console.warnings}
    )
    return YES


def _words(mesh: str, out: str, facts: dict, choice, loaded, total: float) -> str:
    shape = " x ".join(str(n) for n in facts["shape"])
    kind = "dense grid" if facts["n_bricks"] is None else f"{plural(facts['n_bricks'], 'brick')}"
    return (
        f"{mesh}: {plural(loaded.n_vertices, 'vertex', 'vertices')}, "
        f"{plural(loaded.n_faces, 'face')}\n"
        f"sign: {facts['sign']} ({choice.reason})\n"
        f"{out}: {shape} nodes of {facts['voxel_size']:.6g}, {kind}, "
        f"{plural(facts['active_voxels'], 'active voxel')}, "
        f"{file_size(os.path.getsize(out))}, {total:.2f} s"
    )
