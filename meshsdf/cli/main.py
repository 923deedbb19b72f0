"""The command ``meshsdf``: finds the subcommand, runs it, turns errors into exit codes.

Exit codes: 0 done, the answer is yes; 1 done, the answer is no; 2 misuse, or an output that exists
or cannot be written there; 3 the input cannot be used or would not fit in memory; 130 interrupted;
143 told to end (SIGTERM).
"""

import gc
import os
import signal
import sys
import traceback
import warnings
from importlib import import_module
from pathlib import Path

import click

from ..errors import MemoryLimitError, MeshsdfError, OutputError
from .console import CTRL_C, INTERRUPTED, MISUSE, UNUSABLE

COMMANDS = {
    "check": "Does a mesh part space into inside and outside? Says where it does not.",
    "convert": "Turn a mesh into a volume of signed distances, or a volume into another format.",
    "mesh": "Turn a volume into a mesh.",
    "roundtrip": "Mesh to volume to mesh: how much is lost at which resolution?",
    "compare": "How far apart are two meshes?",
    "info": "What is in a mesh or a volume file.",
    "sample": "Points with their signed distances to a mesh, for learning.",
    "render": "Draw a mesh or a volume, or how far it is from another mesh.",
    "texture": "Colour in space: from meshes, formulas and images; out to files.",
    "paint": "Paint on a mesh in a browser, without texture coordinates.",
    "demo": "Make a mesh, check, convert and round-trip it, and draw pictures.",
}
GARBAGE_AFTER = 50_000  # new objects: imports make far more, and nearly all of them stay


class LazyGroup(click.Group):
    """Subcommands live in modules of their names and are imported only when they run."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        return import_module(f".{name}", __package__).command

    def invoke(self, ctx: click.Context):
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise _InterruptedError from None  # what click makes of it adds an empty line

    def resolve_command(self, ctx: click.Context, args: list[str]):
        name = args[0]
        if name not in COMMANDS and not name.startswith("-"):
            raise click.UsageError(f"there is no command {name!r}{_hint(name)}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.command(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: meshsdf convert bunny.obj bunny.npz --resolution 256",
)
@click.version_option(package_name="meshsdf", prog_name="meshsdf")
def group() -> None:
    """Polygon meshes to exact signed distance volumes and back, with the loss proved."""


def run(arguments: list[str]) -> int:
    """Run one command line and return its exit code."""
    try:
        return group.main(args=arguments, prog_name="meshsdf", standalone_mode=False) or 0
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except MeshsdfError as error:
        return _refuse(error)
    except MemoryError:
        fix = "lower the resolution, or set --max-memory to be told beforehand"
        return _refuse(MemoryLimitError("the system gave no more memory", "this command", fix))
    except (KeyboardInterrupt, _InterruptedError, click.Abort):
        after_the_key = "\n" if sys.stderr is not None and sys.stderr.isatty() else ""
        click.echo(f"{after_the_key}interrupted; nothing is left half written", err=True)
        return INTERRUPTED
    except Exception as error:  # noqa: BLE001 (a fault of ours must not look like the answer "no")
        return _refuse(UnexpectedError(*_fault(error)))


def main() -> None:
    """Entry point of the console script."""
    if sys.stdout is not None:
        sys.stdout.reconfigure(errors="backslashreplace")  # names of files may be any bytes
    gc.set_threshold(GARBAGE_AFTER)
    warnings.simplefilter("ignore", RuntimeWarning)  # overflow is judged where it matters
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _on_ctrl_c)
    code = run(sys.argv[1:])
    if code == INTERRUPTED:
        code = 128 + _ended_by[0] if _ended_by else code
        # At once: the interpreter's own way out forgets the code if an import was interrupted
        os._exit(code)
    sys.exit(code)


_ended_by: list[int] = []  # the signals that came, in their order


def _on_ctrl_c(number: int, frame: object) -> None:
    _ended_by.append(number)
    CTRL_C.set()
    raise KeyboardInterrupt


class _InterruptedError(Exception):
    """Ctrl-C was pressed while a command ran."""


class UnexpectedError(MeshsdfError):
    """A fault of the program."""


def _refuse(error: MeshsdfError) -> int:
    click.echo(f"{type(error).__name__}: {error}", err=True)
    return MISUSE if isinstance(error, OutputError) else UNUSABLE


def _fault(error: Exception) -> tuple[str, str, str]:
    """What, where and how to go on, for an exception that nobody foresaw."""
    package = Path(__file__).parents[1]
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if package in Path(frame.filename).parents]
    place = f"{Path(own[-1].filename).relative_to(package)}, line {own[-1].lineno}"
    words = " ".join(str(error).split())[:300]
    what = f"{type(error).__name__}: {words}" if words else type(error).__name__
    return what, place, "this is a fault of meshsdf: report it with this text and the input"


def _hint(name: str) -> str:
    """How a wrong command may have been meant."""
    from difflib import get_close_matches

    near = get_close_matches(name, COMMANDS, n=1)
    if near:
        return f"; did you mean {near[0]!r}?"
    if "." in name:
        return f"; to look at a file, write: meshsdf info {name}"
    return f"; there are {', '.join(COMMANDS)}"
