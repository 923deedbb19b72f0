"""Options of commands that may write ``.exr`` volumes."""

from collections.abc import Callable

import click

from .options import PositiveNumber


class Remap(PositiveNumber):
    """A length above zero, or the word ``range``."""

    name = "length|range"

    def convert(self, value, param, ctx):
        return value if value == "range" else super().convert(value, param, ctx)


_OPTIONS = (
    click.option(
        "--layout",
        type=click.Choice(["atlas", "parts"]),
        help="EXR: all slices in one image, or each in a part of its own.  [default: atlas]",
    ),
    click.option(
        "--columns",
        type=click.IntRange(min=1),
        help="EXR: slices beside each other in the atlas.  [default: nearly square]",
    ),
    click.option(
        "--up",
        type=click.Choice(["y", "z"]),
        help="EXR: stack slices along this axis; y turns the model to stand upright.  [default: z]",
    ),
    click.option(
        "--remap",
        type=Remap(),
        help="EXR: store values as 0 to 1, where 0.5 is the surface and 1 this distance; range "
        "takes the largest.",
    ),
)
NAMES = ("layout", "columns", "up", "remap")


def exr_options(command: Callable) -> Callable:
    """Give a command the options; see `taken_exr_options`."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def taken_exr_options(out: str, given: dict) -> dict:
    """Return what was given; a usage error if it is not for this kind of file."""
    taken = {name: given[name] for name in NAMES if given[name] is not None}
    if taken and not out.lower().endswith(".exr"):
        raise click.UsageError(f"--{next(iter(taken))} is for .exr files")
    if taken.get("layout") == "parts" and "columns" in taken:
        raise click.UsageError("--columns is for --layout atlas")
    return taken
