"""``meshsdf texture``: colour in space, from meshes, formulas and images, and out to files."""

from importlib import import_module

import click

COMMANDS = {
    "bake": ("texture_make", "The colours that a mesh brings along: image, materials, vertices."),
    "procedural": ("texture_make", "Wood, marble and other solid textures."),
    "project": ("texture_make", "An image laid over the surface."),
    "apply": ("texture_out", "Give a mesh a texture's colours: an image or vertex colours."),
    "export": ("texture_out", "A texture as picture, mesh or volume."),
    "info": ("texture_out", "What is in a texture."),
}


class TextureGroup(click.Group):
    """Subcommands whose modules are imported only when they run."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        return getattr(import_module(f".{COMMANDS[name][0]}", __package__), name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


@click.command(
    cls=TextureGroup,
    epilog="Example: meshsdf texture procedural bunny.obj wood.mtex --kind wood_grain",
)
def command() -> None:
    """Colour that lives in space: kept in a project file (.mtex), found by position, without UVs.

    A texture fits any mesh of its surface: remeshed, decimated, or with other UVs.
    """
