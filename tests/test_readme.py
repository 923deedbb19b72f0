"""The README is true: every public name and command is there, and its code runs."""

import importlib
import re
from pathlib import Path

import meshsdf
from meshsdf.cli.main import COMMANDS

README = (Path(__file__).parent.parent / "README.md").read_text()


def test_every_public_name_is_documented_and_exists():
    for name in meshsdf.__all__:
        assert f"`{name}`" in README, f"README.md does not mention `{name}`"
        assert getattr(meshsdf, name).__doc__, f"{name} has no docstring"


def test_all_is_exactly_the_public_names():
    listed = {
        name
        for name in dir(meshsdf)
        if not name.startswith("_") and not isinstance(getattr(meshsdf, name), type(meshsdf))
    }
    assert listed == set(meshsdf.__all__) | {"TYPE_CHECKING", "import_module"}
    assert sorted(meshsdf.__all__) == meshsdf.__all__


def test_every_command_is_documented_and_its_help_ends_with_an_example():
    for name in COMMANDS:
        assert f"`meshsdf {name}" in README, f"README.md does not mention meshsdf {name}"
        command = importlib.import_module(f"meshsdf.cli.{name}").command
        assert command.epilog.startswith(f"Example: meshsdf {name} ")


def test_python_examples_run(capsys):
    blocks = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, "README.md", "exec"), {})
    assert "no point is farther than" in capsys.readouterr().out


def test_pictures_exist():
    for target in re.findall(r"!\[[^]]*\]\(([^)]+)\)", README):
        assert (Path(__file__).parent.parent / target).is_file(), target
