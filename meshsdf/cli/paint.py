"""``meshsdf paint``: the painting page in a browser."""

import os
import webbrowser
from contextlib import ExitStack, contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread

import click

from .console import YES, Console, plural
from .options import PositiveNumber, path

PROJECT = ".mtex"
GREY = (0.578, 0.578, 0.578, 1.0)  # linear; #c8c8c8 on a screen
PIP_LINE = "pip install '.[paint]', in the folder that meshsdf was installed from"
EXTRA = ("starlette", "uvicorn", "websockets")
BELOW = ("h11", "anyio")  # what those stand on
REDIRECT = """<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0;url={address}"><title>meshsdf paint</title>"""


@click.command(epilog="Example: meshsdf paint bunny.obj --open")
@click.argument("mesh", type=path)
@click.option(
    "--project",
    type=path,
    help="The file (.mtex) that keeps what is painted; made if it is not there.  "
    "[default: MESH's name, beside it]",
)
@click.option(
    "--resolution",
    type=PositiveNumber(),
    help="Of a new project: texels along the longest side.  [default: 512]",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    help="Where the page is served; 0 for any that is free.  [default: 8757 if it is free]",
)
@click.option("--open", "opens", is_flag=True, help="Open the page in the browser.")
@click.option(
    "--allow-remote",
    metavar="ADDRESS",
    help="Serve on this address of the machine (0.0.0.0: on all), which others may see, "
    "and not on 127.0.0.1.",
)
def command(mesh: str, project: str | None, resolution, port, opens: bool, allow_remote):
    """Paint on MESH in a browser, without texture coordinates.

    Every stroke is on the disk before the page counts it as saved. MESH may be a project (.mtex),
    too. The page is served to this machine alone; Ctrl-C ends it.
    """
    console = Console("paint", as_json=False)
    console.watch_compilation()
    check_extra()
    from ..server.bundle import COMMAND
    from ..server.helper import Helper
    from ..server.paint import Place, paint
    from ..server.security import LOOPBACK
    from ..server.static_page import has_page

    with Helper() as helper, ExitStack() as meanwhile:
        with _warming_up(console, helper):
            live, loaded = _opened(console, mesh, project, resolution)
            meanwhile.callback(live.close)
        if not has_page():
            console.warn(f"the painting page is not here; this command adds it: {COMMAND}")
        if allow_remote:
            console.warn("others on the network can reach this server, and may read what it says")
        place = Place(allow_remote or LOOPBACK, port)
        with _opener(console, opens) as ready:
            meanwhile.pop_all()  # from here on the server closes it
            paint(live, name=Path(mesh).stem, mesh=loaded, place=place, ready=ready)
    n_steps = plural(live.project.last_seq, "step")
    console.say(f"{live.project.path}: closed, with {n_steps}")
    return YES


@contextmanager
def _warming_up(console: Console, helper):
    """Beside the body, load what strokes need, and leave when both are done.

    On a new machine that is compiled here (by two processes), not when the first stroke comes.
    """
    from ..errors import MeshsdfError
    from ..server.warm_up import warm_up

    troubles: list[str] = []

    def work() -> None:
        try:
            warm_up(Path(folder), helper)
        except (MeshsdfError, OSError) as error:
            troubles.append(f"the first strokes may be slow: {error}")

    thread = Thread(target=work, daemon=True)  # of which Ctrl-C need not wait for the end
    with TemporaryDirectory(prefix="meshsdf-", ignore_cleanup_errors=True) as folder:
        thread.start()
        yield
        thread.join()
    for words in troubles:
        console.warn(words)


def check_extra() -> None:
    """Say how to install what only painting needs, if that is not there."""
    missing = next((name for name in EXTRA if find_spec(name) is None), "")
    if not missing:
        try:
            import_module("..server.paint", __package__)
        except ModuleNotFoundError as error:
            missing = (error.name or "").split(".")[0]
            if missing not in (*EXTRA, *BELOW):
                raise
    if missing:
        from ..errors import ServerError

        what = f"painting needs the package {missing}, which is not installed"
        raise ServerError(what, "meshsdf paint", PIP_LINE)


def _opened(console: Console, mesh: str, project: str | None, resolution: float | None):
    """The project, made if it is not there, and the mesh from its own file if it is that one's."""
    from ..io import check_input, read_mesh
    from ..texture.live import LiveStrokes

    if Path(mesh).suffix.lower() == PROJECT:
        if project is not None:
            raise click.UsageError("MESH is a project already; leave --project out")
        return LiveStrokes.open(mesh, warn=console.warn), None
    check_input(mesh, kind="mesh")
    file = _project_file(console, mesh, project)
    with console.stage("load"):
        loaded = read_mesh(mesh, warn=console.warn)
    if not os.path.lexists(file):
        _create(console, file, loaded, resolution)
    live = LiveStrokes.open(file, warn=console.warn)
    texture = live.project.texture
    _say_what_differs(console, texture, loaded, resolution)
    return live, loaded if _is_same(texture.surface, loaded) else None


def _project_file(console: Console, mesh: str, project: str | None) -> Path:
    """Which file is the project, said in words where nobody named it."""
    if project is not None:
        if Path(project).suffix.lower() != PROJECT:
            raise click.UsageError(f"--project is {project!r}; projects end in {PROJECT}")
        return Path(project)
    beside = Path(mesh).with_suffix(PROJECT)
    if os.access(beside.parent, os.W_OK | os.X_OK):
        return beside
    here = Path(beside.name)
    console.say(f"nothing can be written beside {mesh}; the project is {here.resolve()}")
    return here


def _create(console: Console, file: Path, mesh, resolution: float | None) -> None:
    """A new project with a layer of the mesh's own colours, or of grey, and one to paint on."""
    from ..io.atomic import atomic_path
    from ..texture.journal import Project
    from ..texture.operations import Operation
    from ..texture.source_kinds import mesh_params

    sizes = {"resolution": resolution, "progress": console.progress}
    with atomic_path(file) as temporary, Project.create(temporary, mesh, **sizes) as made:
        has_colors = mesh.vertex_colors is not None or bool(mesh.materials)
        ground = {} if has_colors else {"color": list(GREY)}
        made.apply(Operation("add-layer", {"name": "base", **ground}))
        if has_colors:
            number = made.texture.layers[-1].number
            made.apply(Operation("mesh-colors", {"layer": number, **mesh_params(mesh)}))
        made.apply(Operation("add-layer", {"name": "paint"}))
    console.say(f"{file}: a new project")


def _say_what_differs(console: Console, texture, mesh, resolution: float | None) -> None:
    """Warn of what was asked for and is otherwise in a project that was there before."""
    if mesh is not None and not _is_same(texture.surface, mesh):
        console.warn(
            f"the project was made around another mesh ({texture.surface.n_faces} faces), "
            "which is painted; name another --project for this one"
        )
    has = float(texture.surface.box.size.max()) / texture.octree.texel
    if resolution is not None and abs(has - resolution) > 0.01 * resolution:
        console.warn(f"the project keeps its {has:.0f} texels along the longest side")


def _is_same(first, second) -> bool:
    """Whether two meshes have the same vertices and faces."""
    import numpy as np

    return (
        np.array_equal(first.faces, second.faces)
        and first.vertices.shape == second.vertices.shape
        and bool(np.allclose(first.vertices, second.vertices, rtol=1e-6, atol=0.0))
    )


@contextmanager
def _opener(console: Console, opens: bool):
    """What is called with the page's address: it prints it, and opens it if asked to.

    A browser is started with a file's name, as others may see what programs are started with.
    """
    with TemporaryDirectory(prefix="meshsdf-") as folder:

        def ready(address: str) -> None:
            console.result(address)
            console.say("the painting page is served there; Ctrl-C ends it")
            if opens:
                page = Path(folder) / "open.html"
                page.touch(0o600)
                page.write_text(REDIRECT.format(address=address))
                # Browsers without windows keep their caller waiting
                Thread(target=show, args=(page,), daemon=True).start()

        def show(page: Path) -> None:
            if not webbrowser.open(page.as_uri()):
                console.warn("no browser could be opened; open the address yourself")

        yield ready
