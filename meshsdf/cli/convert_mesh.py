"""A mesh to a volume of exact signed distances."""

from dataclasses import replace
from functools import partial

from .console import YES, Console, file_size, plural

LONGEST_SIDE = 128  # voxels, unless told

_STAGES = ("load", "check", "bricks", "union", "distance", "far field", "sign", "write")


def convert_mesh(console: Console, mesh: str, out: str, options: dict) -> int:
    """Convert as the options of `convert` say; return the exit code."""
    from ..io import check_input, check_volume_output, read_mesh, stored_bytes
    from ..mesh.two_set import check
    from ..sdf import choose_sign, resolve_voxel_size, small_words

    resolution, voxel_size = options["resolution"], options["voxel_size"]
    if voxel_size is None and resolution is None:
        resolution = LONGEST_SIDE
    check_input(mesh, kind="mesh")
    check_volume_output(out, force=options["force"])
    options = _possible(console, out, options)
    with console.stage("load"):
        loaded = read_mesh(mesh, warn=console.warn)
    _check_carried(loaded, options)
    with console.stage("check"):
        report = check(loaded, self_intersections=False)
        size = resolve_voxel_size(loaded, resolution, voxel_size)
        choice = choose_sign(report, options["sign"], voxel_size=size)
    for warning in small_words(loaded, size, choice.method):
        console.warn(warning)
    measuring = {
        "resolution": resolution,
        "voxel_size": voxel_size,
        "half_width": options["half_width"],
        "sign": options["sign"],
        "report": report,
        "max_memory": options["max_memory"],
        "progress": console.progress,
    }
    measured = volume = _measured(console, loaded, options, measuring)
    if options["grids"] and not options["closest"]:
        volume = replace(measured, closest_face=None, barycentric=None)
    with console.stage("write"):
        _write(console, out, volume, options, (loaded, measured))
    _tell(console, volume, choice, report, asks_hermite=options["hermite"])
    facts = volume.facts()
    seconds = console.timings(*_STAGES)
    seconds["distance"] += sum(seconds.pop(name) for name in ("bricks", "union", "far field"))
    n_bytes = stored_bytes(out)
    console.result(_words(mesh, out, facts, choice, loaded, n_bytes, seconds["total"]))
    console.json(
        {"input": mesh, "output": out, "bytes": n_bytes}
        | facts
        | {"sign": volume.sign, "sign_reason": choice.reason}
        | ({"grids": ["surface", *_carried(options)]} if options["grids"] else {})
        | {"seconds": seconds, "warnings": console.warnings}
    )
    return YES


def _possible(console: Console, out: str, options: dict) -> dict:
    """The options, less those that the format has no place for, if losing them is accepted."""
    from ..io.losses import asked_losses, require_accepted

    closest, half = options["closest"], options["half"]
    lost = asked_losses(out, closest=closest, half=half)
    require_accepted(lost.values(), out, force=options["force"], warn=console.warn)
    return options | {name: False for name in lost}


def _measured(console: Console, mesh, options: dict, measuring: dict):
    from ..sdf import mesh_to_band, mesh_to_grid
    from ..surface import sample_hermite

    if options["dense"]:
        return mesh_to_grid(mesh, **measuring)
    closest = options["closest"] or bool(options["grids"])
    band = mesh_to_band(mesh, closest=closest, **measuring)
    if options["hermite"] and band.is_signed:
        band = replace(band, hermite=sample_hermite(mesh, band, progress=console.progress))
    return band


def _write(console: Console, out: str, volume, options: dict, carried: tuple) -> None:
    """Write the volume; ``carried`` is the mesh and its band, of which other grids are made."""
    from ..io import write_volume

    half, force = options["half"], options["force"]
    if options["grids"]:
        from ..io.vdb_carried import write_vdb_carried
        from ..surface.carried_voxels import carried_in_bricks

        vectors = {name: partial(carried_in_bricks, *carried, name) for name in _carried(options)}
        write_vdb_carried(out, volume, vectors, half=half, force=force, **options["writer"])
        return
    writer = options["writer"]
    write_volume(out, volume, half=half, force=force, warn=console.warn, options=writer)


def _carried(options: dict) -> list[str]:
    """Names of the grids beside the surface, in the order in which they are written."""
    from ..surface.carried_voxels import CARRIED_VOXELS

    return [name for name in CARRIED_VOXELS if name in (options["grids"] or ())]


def _check_carried(mesh, options: dict) -> None:
    from ..surface.carried_voxels import require_carried

    require_carried(mesh, _carried(options))


def _tell(console: Console, volume, choice, report, *, asks_hermite: bool) -> None:
    """Say what the user should know about the distances."""
    from ..sdf import union_words

    for warning in choice.warnings:
        console.warn(warning)
    if asks_hermite and not volume.is_signed:
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


def _words(mesh: str, out: str, facts: dict, choice, loaded, n_bytes: int, total: float) -> str:
    return (
        f"{mesh}: {plural(loaded.n_vertices, 'vertex', 'vertices')}, "
        f"{plural(loaded.n_faces, 'face')}\n"
        f"sign: {facts['sign']} ({choice.reason})\n"
        f"{volume_words(out, facts, n_bytes, total)}"
    )


def volume_words(out: str, facts: dict, n_bytes: int, total: float) -> str:
    """One line on a volume that was written."""
    shape = " x ".join(str(n) for n in facts["shape"])
    kind = "dense grid" if facts["n_bricks"] is None else f"{plural(facts['n_bricks'], 'brick')}"
    return (
        f"{out}: {shape} nodes of {facts['voxel_size']:.6g}, {kind}, "
        f"{plural(facts['active_voxels'], 'active voxel')}, {file_size(n_bytes)}, {total:.2f} s"
    )
