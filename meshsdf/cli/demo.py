"""``meshsdf demo``: the whole chain on a trefoil knot."""

import json

import click

from .console import YES, Console
from .options import force_option, json_option, path

RESOLUTIONS = (32, 64, 128)


@click.command(epilog="Example: meshsdf demo out/")
@click.argument("folder", type=path)
@force_option
@json_option
def command(folder: str, force: bool, as_json: bool) -> int:
    """Make a trefoil knot, check it, convert it, bring it back, and draw what was lost.

    Leaves meshes, a volume, two pictures and the numbers as JSON in FOLDER.
    """
    console = Console("demo", as_json=as_json)
    console.watch_compilation()
    from ..io import (
        atomic_write,
        check_output,
        make_folder,
        write_mesh,
        write_text,
        write_volume,
    )
    from ..mesh.tubes import trefoil_tube
    from ..mesh.two_set import check
    from ..report.figures import draw_errors, draw_surfaces
    from ..report.roundtrip import roundtrip
    from ..report.words import roundtrip_table
    from ..sdf import mesh_to_band

    out = make_folder(folder)
    names = ["trefoil.ply", "trefoil.npz", "check.json", "roundtrip.json"]
    names += [f"trefoil_{n}.ply" for n in RESOLUTIONS] + ["errors.png", "surfaces.png"]
    for name in names:
        check_output(out / name, force=force)

    knot = trefoil_tube(n_along=480, n_around=48)
    write_mesh(out / "trefoil.ply", knot, force=force)
    report = check(knot, progress=console.progress)
    console.result(f"trefoil.ply: {report.describe()}", is_last=False)
    write_text(out / "check.json", json.dumps(report.to_json(), indent=2), force=force)
    band = mesh_to_band(knot, resolution=RESOLUTIONS[-1], report=report, progress=console.progress)
    write_volume(out / "trefoil.npz", band, force=force)
    trip = roundtrip(knot, RESOLUTIONS, report=report, progress=console.progress)
    console.result(roundtrip_table(trip), is_last=False)
    rows = [row.to_json() for row in trip.rows]
    facts = {"rows": rows, "order": trip.order(trip.methods[0])}
    write_text(out / "roundtrip.json", json.dumps(facts, indent=2), force=force)
    for row in trip.rows:
        write_mesh(out / f"trefoil_{row.resolution:g}.ply", row.surface, force=force)
    with console.stage("pictures"):
        with atomic_write(out / "errors.png", force) as file:
            draw_errors(trip, file, title="Trefoil knot, mesh to volume to mesh")
        coarse = trip.rows[0]
        pair = [("mesh", knot), (f"after {coarse.resolution:g} voxels", coarse.surface)]
        with atomic_write(out / "surfaces.png", force) as file:
            draw_surfaces(pair, file)
    console.result(f"{out}: {', '.join(names)}")
    tail = {"warnings": console.warnings, "seconds": console.timings()}
    console.json({"output": str(out), "files": names} | facts | tail)
    return YES
