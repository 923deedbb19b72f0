"""The command ``meshsdf``: finds the subcommand, runs it, turns errors into exit codes.

Exit codes: 0 done, the answer is yes; 1 done, the answer is no; 2 misuse; 3 the input cannot be
used or would not fit in memory; 130 interrupted.
"""

import os
import sys
from importlib import import_module, metadata

import click

from ..errors import MeshsdfError
from .console import INTERRUPTED, UNUSABLE

COMMANDS = {
    "check": "Does a mesh part space into inside and outside? Says where it does not.",
    "convert": "Turn a mesh into a volume of signed distances.",
    "mesh": "Turn a volume into a mesh.",
    "roundtrip": "Mesh to volume to mesh: how much is lost at which resolution?",
    "compare": "How far apart are two meshes?",
    "info": "What is in a mesh or a volume file.",
    "demo": "Make a mesh, check, convert and round-trip it, and draw pictures.",
}


class LazyGroup(click.Group):
    """Subcommands live in modules of their names and are imported only when they run."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        return import_module(f".{name}", __package__).command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.command(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: meshsdf convert bunny.obj bunny.npz --resolution 256",
)
@click.version_option(metadata.version("meshsdf"), prog_name="meshsdf")
def group() -> None:
    """Polygon meshes to exact signed distance volumes and back, with the loss proved."""


def run(arguments: list[str]) -> int:
    """Run one command line and return its exit code."""
    try:
        code = group.main(args=arguments, prog_name="meshsdf", standalone_mode=False)
        sys.stdout.flush()
        return code or 0
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except MeshsdfError as error:
        click.echo(f"{type(error).__name__}: {error}", err=True)
        return UNUSABLE
    except MemoryError:
        click.echo(
            "MemoryLimitError: the system gave no more memory\n"
            "  where: this command\n"
            "  fix:   lower the resolution, or set --max-memory to be told beforehand",
            err=True,
        )
        return UNUSABLE
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted; nothing is left half written", err=True)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output went away; keep the interpreter from complaining at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def main() -> None:
    """Entry point of the console script."""
    sys.exit(run(sys.argv[1:]))
