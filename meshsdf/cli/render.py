"""``meshsdf render``: a picture of a mesh or a volume."""

import re
from pathlib import Path

import click

from .console import YES, Console
from .options import Number, PositiveNumber, force_option, json_option, path

SEEN = "of the points that pixels show; no bound on the others, for that see meshsdf compare"
VIEWS = ("three-quarter", "front", "back", "left", "right", "top", "bottom")
SIDE = click.IntRange(1, 16384)
BACKGROUNDS = {"white": "#ffffff", "black": "#000000", "transparent": ""}


class View(click.ParamType):
    """A named view, or azimuth and elevation in degrees."""

    name = "name|azimuth,elevation"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple) or value in VIEWS:
            return value
        parts = value.split(",")
        if len(parts) != 2:
            words = f"{value!r} is none of {', '.join(VIEWS)}, nor two angles such as 30,20"
            self.fail(words, param, ctx)
        azimuth, elevation = (Number().convert(part, param, ctx) for part in parts)
        if not -90 <= elevation <= 90:
            self.fail(f"the elevation {elevation:g} is not from -90 to 90 degrees", param, ctx)
        return azimuth, elevation


class Background(click.ParamType):
    """A colour as (red, green, blue) from 0 to 1 in sRGB, or None for none."""

    name = "white|black|transparent|#rrggbb"

    def convert(self, value, param, ctx):
        if value is None or isinstance(value, tuple):
            return value
        code = BACKGROUNDS.get(value, value)
        if not code:
            return None
        if not re.fullmatch("#[0-9a-fA-F]{6}", code):
            words = f"{value!r} is no colour; write {', '.join(BACKGROUNDS)} or #rrggbb"
            self.fail(words, param, ctx)
        return tuple(int(code[k : k + 2], 16) / 255 for k in (1, 3, 5))


@click.command(epilog="Example: meshsdf render bunny.obj bunny.png")
@click.argument("mesh", type=path)
@click.argument("out", type=path)
@click.option("--width", type=SIDE, default=1280, show_default=True, help="Pixels.")
@click.option("--height", type=SIDE, help="Pixels.  [default: 3/4 of the width]")
@click.option(
    "--view",
    type=View(),
    default="three-quarter",
    show_default=True,
    help=f"From where: {', '.join(VIEWS[:-1])} or {VIEWS[-1]}; or degrees from the front towards "
    "+x, and upward, such as 30,20.",
)
@click.option(
    "--up",
    type=click.Choice(["y", "z"]),
    default="y",
    show_default=True,
    help="Which way is up; the front is seen along -z, or along +y if z is up.",
)
@click.option(
    "--smooth/--flat",
    default=None,
    help="Shade across edges of less than 40 degrees, or show every face.  [default: as suits the "
    "faces' size]",
)
@click.option(
    "--background",
    type=Background(),
    default="white",
    show_default=True,
    help="White, black, transparent or #rrggbb.",
)
@click.option(
    "--error-of",
    type=path,
    help="Paint the distance from every point seen to this other mesh.",
)
@click.option(
    "--scale",
    type=PositiveNumber(),
    help="Distance at the upper end of the colours, world units.  [default: the largest seen]",
)
@click.option("--texture", type=path, help="Paint it with a texture (.mtex).")
@force_option
@json_option
def command(
    mesh: str,
    out: str,
    width: int,
    height: int | None,
    view: str | tuple[float, float],
    up: str,
    smooth: bool | None,
    background: tuple[float, float, float] | None,
    error_of: str | None,
    scale: float | None,
    texture: str | None,
    force: bool,
    as_json: bool,
) -> int:
    """Draw MESH, or the surface of a volume, as a picture, OUT (.png, .jpg or .exr).

    The light moves with the camera. Colours and textures of the mesh are shown. MESH may be a
    texture (.mtex), which is drawn on its own mesh.
    """
    if texture is not None and error_of is not None:
        raise click.UsageError("--texture and --error-of exclude each other")
    if scale is not None and error_of is None:
        raise click.UsageError("--scale is for --error-of")
    console = Console("render", as_json=as_json)
    console.watch_compilation()
    from ..io import check_input, read_mesh
    from ..io.pictures import check_picture, write_picture
    from ..ray import frame, render_distances, render_mesh

    if mesh.lower().endswith(".mtex") and texture is None:
        texture = mesh
    if mesh != texture:
        check_input(mesh)
    if error_of is not None:
        check_input(error_of, kind="mesh")
    check_picture(out, force)
    height = height or max(width * 3 // 4, 1)
    look = {"width": width, "height": height, "smooth": smooth, "background": _linear(background)}
    look["progress"] = lambda _, share: console.progress("render", share)
    facts = {"input": mesh, "output": out, "width": width, "height": height, "view": view}
    words = ""
    with console.stage("load"):
        painted = None if texture is None else _texture(texture, console)
        loaded = painted.surface if mesh == texture else _read(mesh, console)
        other = error_of and read_mesh(error_of, warn=console.warn)
        if painted is not None and mesh != texture:
            from ..texture.fit import require_fit

            where = f"mesh {mesh}, texture {texture}"
            require_fit(painted, loaded, where=where, warn=console.warn)
    with console.stage("render"):
        if other:
            title = f"distance to {Path(error_of).name}, world units"
            drawn = render_distances(
                loaded, other, view=view, up=up, largest=scale, title=title, **look
            )
            picture = drawn.picture
            facts |= {"error_of": error_of, "scale": drawn.largest, "n_seen": drawn.n_seen}
            facts |= {"max_seen": drawn.max_seen, "mean_seen": drawn.mean_seen, "seen": SEEN}
            words = (
                f"\ndistance to {error_of}: at most {drawn.max_seen:.6g} and in the mean "
                f"{drawn.mean_seen:.6g} {SEEN}"
            )
        else:
            camera = frame(loaded, view, width / height, up=up)
            if painted is not None:
                from .texture_look import texture_paint

                look["paint"] = texture_paint(painted, loaded, camera, height)
                look["even_light"] = False
                facts |= {"texture": texture}
            picture = render_mesh(loaded, camera, **look)
    with console.stage("write"):
        write_picture(out, picture, force=force)
    seconds = console.timings("load", "render", "write")
    console.result(f"{out}: {width} x {height} pixels, {seconds['total']:.2f} s{words}")
    console.json(facts | {"seconds": seconds, "warnings": console.warnings})
    return YES


def _linear(background: tuple[float, float, float] | None):
    import numpy as np

    from ..srgb import linear_from_srgb

    return None if background is None else linear_from_srgb(np.array(background))


def _texture(path: str, console: Console):
    """The texture of a project."""
    from ..texture.journal import Project

    with Project.open(path, warn=console.warn) as project:
        return project.texture


def _read(path: str, console: Console):
    """A mesh, or the surface of a volume at the level that `meshsdf mesh` takes."""
    from ..io import kind_of, read_mesh, read_volume

    if kind_of(path) == "mesh":
        return read_mesh(path, warn=console.warn)
    from ..surface import default_level, marching_cubes, require_faces

    volume = read_volume(path, warn=console.warn)
    level, warnings = default_level(volume)
    for warning in warnings:
        console.warn(warning)
    surface = marching_cubes(volume, level=level, progress=console.progress)
    require_faces(surface, level=level)
    return surface
