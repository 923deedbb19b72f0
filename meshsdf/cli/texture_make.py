"""``meshsdf texture bake | procedural | project``: make a texture, or add a layer to one."""

from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import click

from .console import YES, Console, file_size, plural
from .options import Number, PositiveNumber, force_option, json_option, path


class Vector(click.ParamType):
    """Three finite numbers."""

    name = "x,y,z"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        parts = value.split(",")
        if len(parts) != 3:
            self.fail(f"{value!r} is not three numbers such as 0,0,1", param, ctx)
        return tuple(Number().convert(part, param, ctx) for part in parts)


class Setting(click.ParamType):
    """A name and what it is to be: (name, text)."""

    name = "name=value"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        name, equals, text = value.partition("=")
        if not (name.strip() and equals):
            self.fail(f"{value!r} is no setting; write name=value", param, ctx)
        return name.strip().replace("-", "_"), text.strip()


class Level(click.ParamType):
    """A level of detail: a number, or "auto"."""

    name = "auto|0|1|..."

    def convert(self, value, param, ctx):
        if value == "auto" or isinstance(value, int):
            return value
        if value.isascii() and value.isdigit():
            return int(value)
        self.fail(f"{value!r} is no level; use auto, or 0 for the finest texels", param, ctx)


def made_options(function: Callable) -> Callable:
    """What all commands that make textures share."""
    for option in reversed(
        (
            click.option(
                "--resolution",
                type=PositiveNumber(),
                help="Texels along the longest side.  [default: 512]",
            ),
            click.option("--texel", type=PositiveNumber(), help="Size of a texel, world units."),
            click.option(
                "--base",
                type=click.Choice(["srgb8", "half"]),
                default="srgb8",
                show_default=True,
                help="How colours are kept: 8 bits in sRGB, or linear in half precision.",
            ),
            click.option(
                "--level",
                type=Level(),
                default="auto",
                show_default=True,
                help="Detail to keep: 0 all, 1 half as fine, ...; auto fine bricks only where "
                "coarser ones would be off by more than 1/255.",
            ),
            click.option("--add", is_flag=True, help="Add a layer to OUT, which exists."),
            click.option("--layer", default="", help="Name of the layer."),
            force_option,
            json_option,
        )
    ):
        function = option(function)
    return function


@click.command(epilog="Example: meshsdf texture bake spot.obj spot.mtex --resolution 1024")
@click.argument("mesh", type=path)
@click.argument("out", type=path)
@made_options
def bake(mesh: str, out: str, **options) -> int:
    """Keep the colours of MESH (image, materials, vertex colours) in space, OUT (.mtex)."""
    console = _console("bake", options)
    from ..texture.source_kinds import mesh_params

    def operation(texture, loaded):
        if loaded.vertex_colors is None and not loaded.materials:
            console.warn(f"{mesh} has no colours of its own; the layer is grey")
        return "mesh-colors", mesh_params(loaded)

    return _make(console, mesh, out, operation, options | {"default": "mesh"})


@click.command(epilog="Example: meshsdf texture procedural bunny.obj oak.mtex --kind wood_grain")
@click.argument("mesh", type=path)
@click.argument("out", type=path)
@click.option("--kind", default="wood", show_default=True, help="Which texture; see --list.")
@click.option(
    "--parameter",
    "parameters",
    type=Setting(),
    multiple=True,
    help="Such as ring_width=0.1 or dark=#553311; may be given several times.",
)
@click.option("--list", "is_list", is_flag=True, is_eager=True, callback=lambda *a: _list(*a),
              expose_value=False, help="Tell kinds and parameters, and stop.")  # fmt: skip
@made_options
def procedural(mesh: str, out: str, kind: str, parameters, **options) -> int:
    """Fill the surface of MESH with a solid texture, OUT (.mtex), or with one that sees its shape:
    edge-wear, cavity-dirt, thickness.

    Lengths among the parameters are in world units. Without scale=... the pattern's unit is the
    longest side of the mesh's box, and so it is for lengths that see the shape.
    """
    console = _console("procedural", options)
    from ..texture.procedural import lengths_for
    from ..texture.procedural import procedural as make

    settings = dict(parameters)
    make(kind, signed_distance=len, **settings)  # wrong names are told before the mesh is read

    def operation(texture, loaded):
        lengths = lengths_for(kind, loaded.box.size.max())
        known = {name: repr(length) for name, length in lengths.items()} | settings
        return "bake", {"texture_kind": kind, **known}

    return _make(console, mesh, out, operation, options | {"default": kind})


def _list(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    if not value:
        return
    from ..texture.procedural import PROCEDURALS, lengths_for, parameters_of
    from ..texture.sdf_patterns import ON_SHAPE

    for kind in [*sorted(PROCEDURALS), *sorted(ON_SHAPE)]:
        click.echo(kind.replace("_", "-") if kind in ON_SHAPE else kind)
        lengths = lengths_for(kind, 1.0)
        for one in parameters_of(kind):
            meaning = one.meaning
            if one.name in lengths:
                meaning += f"; if not given, {lengths[one.name]:g} of the mesh's longest side"
            click.echo(f"  {one.name}={_text(one.default)}  {meaning}")
    ctx.exit()


def _text(value: object) -> str:
    return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)


@click.command(epilog="Example: meshsdf texture project bunny.obj photo.jpg bunny.mtex --by camera "
               "--eye 0,0.1,0.6 --target 0,0.1,0")  # fmt: skip
@click.argument("mesh", type=path)
@click.argument("image", type=path)
@click.argument("out", type=path)
@click.option(
    "--by",
    type=click.Choice(["planar", "triplanar", "cylindrical", "spherical", "decal", "camera"]),
    default="triplanar",
    show_default=True,
    help="How the image is laid over the surface.",
)
@click.option("--center", type=Vector(), help="Where it stands.  [default: middle of the mesh]")
@click.option(
    "--axis",
    type=Vector(),
    default="0,1,0",
    show_default=True,
    help="Axis of a cylinder or sphere; planes and decals look against it.",
)
@click.option("--size", type=PositiveNumber(), help="Of the image.  [default: of the mesh]")
@click.option("--eye", type=Vector(), help="Of a camera: where it is.")
@click.option("--target", type=Vector(), help="Of a camera: what is in the middle.")
@click.option("--up", type=Vector(), default="0,1,0", show_default=True, help="Of a camera.")
@click.option("--field-of-view", type=PositiveNumber(), default=30.0, show_default=True,
              help="Of a camera: from the lower to the upper border, degrees.")  # fmt: skip
@made_options
def project(mesh: str, image: str, out: str, by: str, center, axis, size, eye, target, up,
            field_of_view: float, **options) -> int:  # fmt: skip
    """Lay IMAGE over the surface of MESH, OUT (.mtex)."""
    if by == "camera" and (eye is None or target is None):
        raise click.UsageError("--by camera needs --eye and --target")
    console = _console("project", options)
    from ..io.pictures import read_picture

    picture = read_picture(image)

    def operation(texture, loaded):
        params = {"image": picture, "projection": by}
        if by == "camera":
            return "project", params | {
                "eye": list(eye), "target": list(target), "up": list(up),
                "field_of_view": field_of_view,
            }  # fmt: skip
        return "project", params | _placed(by, loaded, picture, center, axis, size)

    name = Path(image).stem
    return _make(
        console, mesh, out, operation, options | {"default": name, "inputs": {"image": image}}
    )


def _placed(by: str, mesh, picture, center, axis, size) -> dict:
    """Matrix and sizes of a projection that stands around a mesh."""
    import numpy as np

    extent = float(size or mesh.box.size.max())
    middle = np.array(center) if center is not None else 0.5 * (mesh.box.lower + mesh.box.upper)
    z = np.array(axis, float)
    if not z.any():
        raise click.UsageError("--axis 0,0,0 has no direction")
    z /= np.linalg.norm(z)
    y = np.array([0.0, 1.0, 0.0]) if abs(z[1]) < 0.9 else np.array([0.0, 0.0, -1.0])
    x = np.cross(y, z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    height = extent * picture.shape[0] / picture.shape[1]
    sizes = {
        "planar": {"width": extent, "height": height},
        "triplanar": {"width": extent, "height": height},
        "decal": {"width": extent, "height": height, "depth": 2 * extent},
        "cylindrical": {"height": extent},
        "spherical": {},
    }[by]
    if by in ("planar", "cylindrical", "decal", "triplanar"):
        corner = {"planar": (0.5 * extent, 0.5 * height, 0.0), "cylindrical": (0, 0, 0.5 * extent)}
        middle = middle - matrix[:3, :3] @ np.array(corner.get(by, (0.0, 0.0, 0.0)))
    matrix[:3, 3] = middle
    return {"matrix": matrix, **sizes}


def _console(name: str, options: dict) -> Console:
    if options["resolution"] is not None and options["texel"] is not None:
        raise click.UsageError("--resolution and --texel exclude each other")
    if options["add"] and (options["resolution"] or options["texel"]):
        raise click.UsageError("--add keeps the texels of the texture that exists")
    console = Console(f"texture-{name}", as_json=options["as_json"])
    console.watch_compilation()
    return console


def _make(console: Console, mesh: str, out: str, operation: Callable, options: dict) -> int:
    """Make the project or open it, and add one layer with what the operation makes."""
    from ..io import check_input, read_mesh
    from ..texture.operations import Operation

    check_input(mesh, kind="mesh")
    with console.stage("load"):
        loaded = read_mesh(mesh, warn=console.warn)
    with _project(console, loaded, out, options) as project:
        with console.stage("fill"):
            name = options["layer"] or options["default"]
            project.apply(Operation("add-layer", {"name": name}))
            number = project.texture.layers[-1].number
            kind, params = operation(project.texture, loaded)
            params = {"layer": number, "level": options["level"], **params}
            project.apply(Operation(kind, params), progress=console.within("fill"))
        with console.stage("write"):
            project.checkpoint()
        facts = texture_facts(project)
    n_bytes = Path(out).stat().st_size
    seconds = console.timings("load", "octree", "fill", "write")
    console.result(f"{out}: {texture_words(facts)}, {file_size(n_bytes)}, {seconds['total']:.2f} s")
    console.json(
        {"input": mesh, **options.get("inputs", {}), "output": out, "bytes": n_bytes} | facts
        | {"seconds": seconds, "warnings": console.warnings}
    )  # fmt: skip
    return YES


@contextmanager
def _project(console: Console, mesh, out: str, options: dict):
    """The project to fill: a new one that appears when all is done, or one that exists."""
    from ..io.atomic import atomic_path, check_output
    from ..texture.journal import Project

    if options["add"]:
        with Project.open(out, warn=console.warn) as project:
            yield project
        return
    if Path(out).suffix.lower() != ".mtex":
        raise click.UsageError(f"OUT is {out!r}; textures are kept in files that end in .mtex")
    check_output(out, options["force"])
    with atomic_path(out, options["force"]) as temporary:
        sizes = {"resolution": options["resolution"], "texel": options["texel"]}
        with console.stage("octree"):
            project = Project.create(temporary, mesh, base=options["base"], **sizes)
        with project:
            yield project


def texture_facts(project) -> dict:
    """What scripts ask for of a project."""
    texture = project.texture
    octree = texture.octree
    return {
        "kind": "texture",
        "texel": octree.texel,
        "base": texture.base,
        "n_levels": octree.n_levels,
        "n_texels": octree.n_texels(0),
        "n_bricks": texture.pool.n_used,
        "n_tiles": len(texture.tiles),
        "memory": texture.pool.n_bytes,
        "last_seq": project.last_seq,
        "channels": sorted(texture.pool.arrays),
        "layers": [
            {
                "number": layer.number,
                "name": layer.name,
                "opacity": layer.opacity,
                "mode": layer.mode,
                "visible": layer.visible,
                "n_bricks": int((layer.slots >= 0).sum()),
            }
            for layer in texture.layers
        ],
    }


def texture_words(facts: dict) -> str:
    """The facts in a line."""
    return (
        f"texture, {plural(len(facts['layers']), 'layer')}, texels of {facts['texel']:.4g}, "
        f"{facts['n_texels']} on the surface, {plural(facts['n_bricks'], 'brick')}"
    )
