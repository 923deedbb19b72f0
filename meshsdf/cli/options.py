"""Options that several commands share, and the types they parse to."""

import math
import re

import click

UNITS = {"": 1, "k": 1e3, "m": 1e6, "g": 1e9, "t": 1e12}


class Number(click.ParamType):
    """A finite number."""

    name = "number"

    def convert(self, value, param, ctx):
        try:
            number = float(value)
        except ValueError:
            self.fail(f"{value!r} is not a number", param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


class PositiveNumber(Number):
    """A finite number above zero."""

    def convert(self, value, param, ctx):
        number = super().convert(value, param, ctx)
        if number <= 0:
            self.fail(f"{value} is not above 0", param, ctx)
        return number


class Resolutions(click.ParamType):
    """Comma-separated numbers above zero."""

    name = "n,n,..."

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        parts = value.split(",")
        if not all(part.strip() for part in parts):
            self.fail(f"{value!r} lacks a number; write 64 or 64,128,256", param, ctx)
        return tuple(PositiveNumber().convert(part, param, ctx) for part in parts)


class Names(click.ParamType):
    """Comma-separated names out of a few."""

    def __init__(self, *names: str) -> None:
        self.names = names
        self.name = ",".join(names)

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        found = tuple(part.strip() for part in value.split(","))
        for part in found:
            if part not in self.names:
                self.fail(f"{part!r} is not one of {', '.join(self.names)}", param, ctx)
        return found


class PositiveNumbers(Resolutions):
    """Comma-separated numbers above zero, told as such."""

    name = "number,..."


class Counts(click.ParamType):
    """Comma-separated names out of a few, each with or without a count: a dict, None for none."""

    name = "name[=count],..."

    def __init__(self, *names: str) -> None:
        self.names = names

    def convert(self, value, param, ctx):
        if isinstance(value, dict):
            return value
        found = {}
        for part in value.split(","):
            name, equals, count = (text.strip() for text in part.partition("="))
            if name not in self.names or name in found:
                told = "is given twice" if name in found else f"is none of {', '.join(self.names)}"
                self.fail(f"{name!r} {told}", param, ctx)
            if equals and not (count.isascii() and count.isdigit() and len(count) < 16):
                self.fail(f"{count!r} is no count", param, ctx)
            found[name] = int(count) if equals else None
        return found


class Bytes(click.ParamType):
    """A size such as 500M, 4G or 1.5e9."""

    name = "size"

    def convert(self, value, param, ctx):
        if isinstance(value, float):
            return value
        found = re.fullmatch(r"([0-9.eE+]+)\s*([kmgtKMGT]?)[bB]?", value.strip())
        if not found:
            self.fail(f"{value!r} is not a size; write 500M, 4G or a number of bytes", param, ctx)
        return PositiveNumber().convert(found[1], param, ctx) * UNITS[found[2].lower()]


class Length(click.ParamType):
    """A length in world units, or in voxels when it ends in ``vox``: (value, is_voxels)."""

    name = "length"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        in_voxels = value.endswith("vox")
        number = value.removesuffix("vox")
        try:
            float(number)
        except ValueError:
            text = f"{value!r} is no length; write 0.01 (world units) or 0.5vox (voxels)"
            self.fail(text, param, ctx)
        return PositiveNumber().convert(number, param, ctx), in_voxels


path = click.Path(path_type=str)
json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
force_option = click.option("--force", is_flag=True, help="Overwrite files that exist.")
max_memory_option = click.option(
    "--max-memory",
    type=Bytes(),
    default=None,
    help="Refuse work that needs more, e.g. 4G.  [default: 80% of what is free]",
)
sign_option = click.option(
    "--sign",
    type=click.Choice(["auto", "parity", "winding", "unsigned"]),
    default="auto",
    show_default=True,
    help="How inside is told; auto takes what check recommends.",
)
half_width_option = click.option(
    "--half-width",
    type=PositiveNumber(),
    default=3.0,
    show_default=True,
    help="Voxels on each side of the surface.",
)
