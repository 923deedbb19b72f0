"""The house of meshsdf: who may import whom, and how long a file may be."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent / "meshsdf"
MAX_LINES = 400

# Upper floors may import lower ones; rooms on one floor may not import each other.
FLOORS = [
    {"cli"},
    {"server", "batch"},
    {"report", "io"},
    {"ray", "levelset", "texture"},
    {"sdf", "surface"},
    {"spatial", "implicit"},
    {"mesh", "grid"},
    {"kernels"},
    {"box"},
    {"arrays"},
    {"progress", "srgb"},
    {"errors"},
]
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
COMPILER = {"numba", "llvmlite"}
WEB = {"starlette", "uvicorn", "websockets"}

FILES = sorted(ROOT.rglob("*.py"))


def room_of(path: Path) -> str:
    """First folder (or module) below the package; empty for the package's own __init__."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return "" if parts in (("__init__",), ("__main__",)) else parts[0]


def imports(path: Path):
    """Yield (line, dotted module) of every import; relative ones resolved to meshsdf.…"""
    package = ["meshsdf", *path.relative_to(ROOT).parent.parts]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            if node.level == 0:
                yield node.lineno, node.module
                continue
            base = package[: len(package) - node.level + 1]
            if node.module:
                yield node.lineno, ".".join([*base, node.module])
            else:
                for alias in node.names:
                    yield node.lineno, ".".join([*base, alias.name])


def forbidden(room: str, module: str) -> str | None:
    """Why ``room`` may not import ``module``, or None."""
    top, *rest = module.split(".")
    if top == "meshsdf":
        target = rest[0] if rest else ""
        if room in ("", target) or (room == "cli" and target == ""):
            return None
        if target not in FLOOR_OF:
            return f"{room} -> {target or 'the package itself'}"
        if FLOOR_OF[target] <= FLOOR_OF[room]:
            return f"{room} -> {target}"
    if top in COMPILER and room != "kernels":
        return f"{room} -> {top} (the compiler belongs to kernels)"
    if top in WEB and room != "server":
        return f"{room} -> {top} (the web framework belongs to server)"
    return None


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_import_points_down(path):
    room = room_of(path)
    assert room == "" or room in FLOOR_OF, f"{path}: the house has no room named {room}"
    wrong = [
        f"{path}:{line}: {arrow}"
        for line, module in imports(path)
        if (arrow := forbidden(room, module))
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_outgrows_its_purpose(path):
    n_lines = len(path.read_text().splitlines())
    assert n_lines <= MAX_LINES or path.name.endswith("_tables.py"), f"{path}: {n_lines} lines"


def test_the_rules_catch_an_arrow_that_points_up_or_sideways():
    assert forbidden("grid", "meshsdf.sdf.narrow_band") == "grid -> sdf"
    assert forbidden("sdf", "meshsdf.surface") == "sdf -> surface"
    assert forbidden("sdf", "numba") == "sdf -> numba (the compiler belongs to kernels)"
    assert forbidden("sdf", "meshsdf.kernels.bins") is None
    assert forbidden("arrays", "meshsdf.box") == "arrays -> box"
