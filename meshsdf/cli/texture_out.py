"""``meshsdf texture apply | export | info``: a texture out to meshes, pictures and volumes."""

from collections.abc import Callable
from pathlib import Path

import click

from .console import YES, Console, file_size
from .options import PositiveNumber, force_option, json_option, path
from .texture_make import texture_facts, texture_words


def laid_options(function: Callable) -> Callable:
    """How a mesh is laid out on an image."""
    for option in reversed(
        (
            click.option("--size", type=click.IntRange(8, 16384), default=2048, show_default=True,
                         help="Of the image, pixels a side."),
            click.option(
                "--atlas",
                type=click.Choice(["auto", "own", "xatlas", "squares"]),
                default="auto",
                show_default=True,
                help="Whose texture coordinates: the mesh's own, xatlas's, or a square for every "
                "two faces; auto takes the first that is there and works.",
            ),
            click.option("--time-limit", type=PositiveNumber(), default=60.0, show_default=True,
                         help="Seconds that xatlas may take."),
            force_option,
            json_option,
        )
    ):  # fmt: skip
        function = option(function)
    return function


@click.command(epilog="Example: meshsdf texture apply oak.mtex bunny.obj oak.glb")
@click.argument("texture", type=path)
@click.argument("mesh", type=path)
@click.argument("out", type=path)
@click.option(
    "--vertex-colors/--image",
    "at_vertices",
    default=None,
    help="Colours at vertices, or an image.  [default: vertices for .ply, else an image]",
)
@laid_options
def apply(texture: str, mesh: str, out: str, at_vertices, size, atlas, time_limit, force, as_json):
    """Give MESH the colours of TEXTURE (.mtex), OUT (.glb, .obj or .ply).

    MESH may be any mesh of the textured surface: another resolution, remeshed, with other UVs. One
    that lies mostly elsewhere is refused; how much lies elsewhere is told.
    """
    console = Console("texture-apply", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, check_output, read_mesh, write_mesh
    from ..io.texture_files import Layout, colored_mesh, words_of
    from ..texture.fit import require_fit
    from ..texture.journal import Project

    check_input(mesh, kind="mesh")
    check_output(out, force, kind="mesh")
    with console.stage("load"):
        loaded = read_mesh(mesh, warn=console.warn)
        project = Project.open(texture, warn=console.warn)
    with project, console.stage("colours"):
        where = f"mesh {mesh}, texture {texture}"
        require_fit(project.texture, loaded, where=where, warn=console.warn)
        layout = Layout(size, atlas, time_limit)
        colored, facts = colored_mesh(
            project.texture, loaded, out, at_vertices=at_vertices, layout=layout, warn=console.warn
        )
    with console.stage("write"):
        write_mesh(out, colored, force=force)
    seconds = console.timings("load", "colours", "write")
    console.result(f"{out}: {words_of(facts)}, {seconds['total']:.2f} s")
    head = {"texture": texture, "input": mesh, "output": out}
    console.json(head | facts | {"seconds": seconds, "warnings": console.warnings})
    return YES


@click.command(epilog="Example: meshsdf texture export oak.mtex --to oak.vdb --to oak.glb")
@click.argument("texture", type=path)
@click.option(
    "--to",
    "outputs",
    type=path,
    multiple=True,
    required=True,
    help="A mesh (.glb, .obj with an image; .ply with vertex colours), a volume of colours (.vdb) "
    "or the image alone (.png, .jpg, .exr), with the mesh that it fits beside it "
    "(NAME-atlas.obj); may be given several times.",
)
@click.option(
    "--channel",
    type=click.Choice(["base", "normal", "height", "orm", "mask"]),
    default="base",
    show_default=True,
    help="Of an image alone.",
)
@click.option("--displaced", is_flag=True, help="Move the mesh by the height channel first.")
@click.option("--resolution", type=PositiveNumber(), default=256.0, show_default=True,
              help="Of the volume that the displaced mesh comes from.")  # fmt: skip
@laid_options
def export(
    texture, outputs, channel, displaced, resolution, size, atlas, time_limit, force, as_json
):
    """Write what TEXTURE (.mtex) shows on its own mesh."""
    console = Console("texture-export", as_json=as_json)
    console.watch_compilation()
    from ..io.texture_files import (
        Layout,
        check_texture_outputs,
        mesh_beside,
        words_of,
        write_texture,
    )
    from ..texture.journal import Project

    check_texture_outputs(outputs, force)
    with console.stage("load"):
        project = Project.open(texture, warn=console.warn)
    written, with_mesh = [], set()
    with project:
        shown = project.texture
        mesh = shown.surface
        if displaced:
            mesh = _displaced(shown, mesh, resolution, console)
        for out in outputs:
            with console.stage("export"):
                options = {"layout": Layout(size, atlas, time_limit), "channel": channel}
                options["with_mesh"] = mesh_beside(out) not in with_mesh
                facts = write_texture(out, shown, mesh, **options, force=force, warn=console.warn)
            if "mesh" in facts:
                with_mesh.add(mesh_beside(out))
            n_bytes = Path(out).stat().st_size
            written.append({"output": out, "bytes": n_bytes} | facts)
            mesh_words = f", on the mesh {facts['mesh']}" if "mesh" in facts else ""
            words = f"{out}: {words_of(facts)}{mesh_words}, {file_size(n_bytes)}"
            console.result(words, is_last=False)
    seconds = console.timings("load", "export")
    facts = {"input": texture, "written": written, "seconds": seconds}
    console.json(facts | {"warnings": console.warnings})
    return YES


@click.command(epilog="Example: meshsdf texture info oak.mtex")
@click.argument("texture", type=path)
@json_option
def info(texture: str, as_json: bool) -> int:
    """What is in TEXTURE (.mtex): texels, layers, operations."""
    console = Console("texture-info", as_json=as_json)
    from ..texture.journal import Project

    with Project.open(texture, warn=console.warn) as project:
        facts = texture_facts(project)
        names = project.history.names
    console.result(f"{texture}: {texture_words(facts)}", is_last=False)
    for layer in reversed(facts["layers"]):
        state = "" if layer["visible"] else ", hidden"
        console.result(
            f"  layer {layer['number']} {layer['name']!r}: {layer['mode']}, "
            f"opacity {layer['opacity']:g}{state}, {layer['n_bricks']} bricks",
            is_last=False,
        )
    console.result(f"  {facts['last_seq']} operations: {', '.join(names[-8:]) or 'none'}")
    console.json({"input": texture} | facts | {"operations": names, "warnings": console.warnings})
    return YES


def _displaced(texture, mesh, resolution: float, console: Console):
    from ..surface import marching_cubes
    from ..texture.displace import displaced_band

    with console.stage("displacement"):
        band = displaced_band(texture, mesh, resolution=resolution, progress=console.progress)
        return marching_cubes(band)
