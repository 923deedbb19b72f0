"""``meshsdf convert``: a mesh, or another volume, to a volume."""

from pathlib import Path

import click
from click.core import ParameterSource

from .console import Console
from .exr_options import exr_options, taken_exr_options
from .options import (
    Names,
    PositiveNumber,
    half_width_option,
    json_option,
    max_memory_option,
    path,
    sign_option,
)

FOR_MESHES = ("resolution", "voxel_size", "sign", "closest", "hermite", "grids")
"""Options that say how a mesh is measured."""

FOR_VOLUMES = ("sparse", "grid")


@click.command(epilog="Example: meshsdf convert bunny.obj bunny.npz --resolution 256")
@click.argument("source", type=path)
@click.argument("out", type=path)
@click.option("--resolution", type=PositiveNumber(), help="Voxels along the longest side.")
@click.option("--voxel-size", type=PositiveNumber(), help="Size of a voxel, world units.")
@half_width_option
@sign_option
@click.option("--dense", is_flag=True, help="A full grid; of a mesh, exact at every node.")
@click.option("--sparse", is_flag=True, help="Of a full grid, the band of --half-width alone.")
@click.option("--half", is_flag=True, help="Store 16-bit floats.")
@click.option("--closest", is_flag=True, help="Also store closest faces and barycentrics.")
@click.option(
    "--hermite",
    is_flag=True,
    help="Also store crossings, normals, features, for mesh --method dual-contouring; NPZ, Zarr.",
)
@click.option("--grid", help="Which grid of a .vdb, or array of a .vti.  [default: as info says]")
@click.option(
    "--grids",
    type=Names("surface", "closest", "uv", "Cd"),
    help="VDB: also store, beside the surface, the closest point on the mesh, its texture "
    "coordinates, its linear colour; names with commas between.",
)
@click.option(
    "--compression",
    type=click.Choice(["none", "active", "zip", "blosc"]),
    help="VDB: store every voxel of a leaf, those in the band, or pack these.  [default: active]",
)
@exr_options
@max_memory_option
@click.option(
    "--force",
    is_flag=True,
    help="Overwrite files that exist, and accept the loss of what OUT cannot hold.",
)
@json_option
@click.pass_context
def command(context: click.Context, source: str, out: str, as_json: bool, **options: object) -> int:
    """Turn SOURCE into a volume, OUT: a mesh into exact signed distances, or a volume into another
    format.

    Without --resolution or --voxel-size the longest side of a mesh gets 128 voxels. What a volume
    holds is copied; what OUT has no place for is told and refused, unless --force accepts it.
    """
    from ..io import kind_of
    from ..io.registry import checked_input

    if Path(source).is_dir():
        checked_input(source)
    kind = kind_of(source)
    given = {name for name in options if _is_given(context, name)}
    _check_options(kind, out, given, options)
    for_exr = taken_exr_options(out, options)
    options["writer"] = for_exr
    if options["compression"] is not None:
        options["writer"] = {"compression": options["compression"]}
    console = Console("convert", as_json=as_json)
    console.watch_compilation()
    if kind == "mesh":
        from .convert_mesh import convert_mesh

        return convert_mesh(console, source, out, options)
    from .convert_volume import convert_volume

    half_width = options["half_width"] if "half_width" in given else None
    return convert_volume(console, source, out, options | {"half_width": half_width})


def _is_given(context: click.Context, name: str) -> bool:
    return context.get_parameter_source(name) is not ParameterSource.DEFAULT


def _check_options(kind: str, out: str, given: set[str], options: dict) -> None:
    """UsageError where options do not go together, or with what is converted."""
    wrong = FOR_VOLUMES if kind == "mesh" else FOR_MESHES
    for name in wrong:
        if name in given:
            option = "--" + name.replace("_", "-")
            other = "volumes" if kind == "mesh" else "meshes; distances of a volume are copied"
            raise click.UsageError(f"{option} is for {other}")
    suffix = out.lower()
    if options["compression"] is not None and not suffix.endswith(".vdb"):
        raise click.UsageError("--compression is for .vdb files")
    if kind == "volume":
        if "half_width" in given and not options["sparse"]:
            raise click.UsageError("--half-width is for meshes, or for --sparse")
        if options["sparse"] and options["dense"]:
            raise click.UsageError("give --sparse or --dense, not both")
        return
    if options["resolution"] is not None and options["voxel_size"] is not None:
        raise click.UsageError("give --resolution or --voxel-size, not both")
    if options["dense"] and options["closest"]:
        raise click.UsageError("--closest is for narrow bands; leave out --dense")
    if options["hermite"] and (
        options["dense"] or not suffix.endswith((".npz", ".zarr", ".zarr.zip"))
    ):
        raise click.UsageError("--hermite is for narrow bands in .npz and .zarr")
    if options["grids"] is not None and (options["dense"] or not suffix.endswith(".vdb")):
        raise click.UsageError("--grids is for narrow bands in .vdb files")
