"""Grids of a ``.vdb`` file for tests, and a plain list of all that such a grid holds."""

import dataclasses
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.grid import BrickIndex, NarrowBand
from meshsdf.grid.brick_grid import node_mask, node_words
from meshsdf.io.vdb_grid import VALUE_TYPES, VdbGrid
from meshsdf.io.vdb_pages import constant_blocks

PAGES = np.array([[0, 0, 0], [1, 0, 3], [31, 17, 18]])
SYSTEM_PYTHON = "/usr/bin/python3"
PROCESS = Path(__file__).with_name("openvdb_process.py")


def has_openvdb() -> bool:
    """Whether the system's Python has Debian's OpenVDB module."""
    if not Path(SYSTEM_PYTHON).exists():
        return False
    command = [SYSTEM_PYTHON, "-c", "import pyopenvdb, numpy"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


needs_openvdb = pytest.mark.skipif(
    not has_openvdb(), reason="Debian's python3-openvdb is not installed"
)


def run_openvdb(*arguments) -> None:
    """Run the script that uses OpenVDB; its words are shown if it fails."""
    command = [SYSTEM_PYTHON, PROCESS, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def random_grid(seed: int, value_type: str = "float", *, n_bricks: int = 14, **changes) -> VdbGrid:
    """Scattered bricks with every kind of inactive value, and tiles of every size and state."""
    random = np.random.default_rng(seed)
    dtype, shape = VALUE_TYPES[value_type]

    def draw(*n):
        values = random.normal(size=(*n, *shape)) * 10
        return values.astype(dtype)

    # Lower nodes in one upper node, of eight blocks; the next is a tile of the root
    pages = PAGES + 32 * random.integers(-3, 3, 3)
    bricks = 16 * pages[random.integers(0, 3, n_bricks)] + random.integers(0, 16, (n_bricks, 3))
    bricks = np.concatenate([bricks, 16 * pages])
    index = BrickIndex.from_coordinates(np.unique(bricks, axis=0))
    root = np.pad(index.root, [(0, 2), (0, 0), (0, 0)], constant_values=-1)
    index = dataclasses.replace(index, root=root)
    n, background, tiles = index.n_bricks, np.array(draw()), draw(5)
    active = random.random((n, 512)) < random.random((n, 1))
    active[:2] = [[True], [False]][: min(n, 2)]
    pool = np.stack([background, -background, *draw(3)])
    values = np.empty((n, 512, *shape), dtype)
    for brick in range(n):
        few = random.permutation(5)[: random.integers(1, 5)]
        values[brick] = pool[random.choice(few, 512)]
    values[active] = draw(int(active.sum()))
    n_upper = int((index.root >= 0).sum())
    for table, share in ((index.root, 0.5), (index.pages[:n_upper], 0.01), (index.pages, 0.02)):
        chosen = (table == -1) & (random.random(table.shape) < share)
        table[chosen] = random.integers(-7, -1, int(chosen.sum()))
    root[2:] = random.integers(-7, -1)
    grid = VdbGrid(
        "surface",
        index,
        values.reshape(n, 8, 8, 8, *shape),
        node_words(active.reshape(n, 8, 8, 8)),
        background,
        np.diag([0.25, 0.25, 0.25, 1.0]),
        tile_values=tiles,
        tile_active=random.random(5) < 0.5,
    )
    return dataclasses.replace(grid, **changes)


def text(words: str) -> bytes:
    """A text as the format has it."""
    return struct.pack("<I", len(words)) + words.encode()


def vdb_bytes(**parts) -> bytes:
    """A file with one leaf, written from the description of the format alone; any part replaced.

    The leaf at (0, 0, 0) has the values 0 ... 511, the first of them active; background 3.
    """
    part = {
        "magic": b" BDV",
        "version": 224,
        "file_metadata": struct.pack("<I", 0),
        "n_grids": struct.pack("<i", 1),
        "name": text("surface"),
        "type": text("Tree_float_5_4_3"),
        "offsets": None,
        "flags": 0,
        "grid_class": "level set",
        "transform": text("UniformScaleMap") + struct.pack("<15d", *[1.0] * 12, *[0.5] * 3),
        "buffers": struct.pack("<I", 1),
        "background": struct.pack("<f", 3.0),
        "counts": struct.pack("<2I", 0, 1),
        "tiles": b"",
        "origin": struct.pack("<3i", 0, 0, 0),
        "upper_children": b"\x01" + bytes(4095),
        "lower_children": b"\x01" + bytes(511),
        "leaf_mask": b"\x01" + bytes(63),
        "leaf_code": b"\x06",
        "leaf_size": b"",
        "leaf_values": np.arange(512, dtype="<f4").tobytes(),
        **parts,
    }
    size = struct.pack("<q", -4 * 4096) if part["flags"] & 5 else b""
    sizes = struct.pack("<q", -4 * 32768) if part["flags"] & 5 else b""
    node = (
        part["origin"] + part["upper_children"] + bytes(4096) + b"\x06" + sizes + bytes(4 * 32768)
    )
    node += (
        part["lower_children"] + bytes(512) + b"\x06" + size + bytes(4 * 4096) + part["leaf_mask"]
    )
    leaf = part["leaf_mask"] + part["leaf_code"] + part["leaf_size"] + part["leaf_values"]
    words = struct.pack("<I", 1) + text("class") + text("string") + text(part["grid_class"])
    tree = part["buffers"] + part["background"] + part["counts"] + part["tiles"]
    tree += part.get("node", node + leaf)
    grid = struct.pack("<I", part["flags"]) + part.get("grid_metadata", words)
    grid += part["transform"] + tree
    head = part["magic"] + bytes(4) + struct.pack("<3IB", part["version"], 10, 0, 1) + bytes(36)
    head += part["file_metadata"] + part["n_grids"] + part["name"] + part["type"] + text("")
    start = len(head) + 24
    told = part["offsets"] or (start, start + len(grid))
    offsets = [start if told[0] is None else told[0], 0, told[1]]
    return head + struct.pack("<3q", *offsets) + grid


def empty_band() -> NarrowBand:
    """A band without bricks."""
    index = BrickIndex.from_coordinates(np.empty((0, 3), np.int64))
    values, active = np.empty((0, 8, 8, 8), np.float32), np.empty((0, 8), np.uint64)
    return NarrowBand(index, values, active, 0.1, np.zeros(3), 3.0, "unsigned")


def entries(grid: VdbGrid) -> np.ndarray:
    """Rows (i, j, k, side, active, value...): voxels of bricks, and tiles of 8 or 128.

    Larger tiles are listed as those of 128 they are made of; inactive background is left out.
    """
    size = grid.background.size
    n, offsets = grid.index.n_bricks, np.indices((8, 8, 8)).reshape(3, -1).T
    nodes = (grid.index.coordinates[:, None] * 8 + offsets).reshape(-1, 3)
    values = np.asarray(grid.values[np.arange(n)]).reshape(len(nodes), size)
    rows = [_rows(nodes, 1, node_mask(grid.active).reshape(-1), values)]
    for places, side, codes in constant_blocks(grid.index):
        values = grid.code_values[-1 - codes].reshape(len(places), size)
        rows.append(_rows(places, side, grid.code_active[-1 - codes], values))
    return split(np.concatenate(rows), grid.background)


def split(rows: np.ndarray, background: np.ndarray) -> np.ndarray:
    """The entries in order, large tiles cut into those of 128."""
    parts = []
    for side in np.unique(rows[:, 3]):
        part = rows[rows[:, 3] == side]
        if side > 128:
            steps = np.indices((int(side) // 128,) * 3).reshape(3, -1).T * 128
            moved = part[:, None, :3] + steps
            part = np.repeat(part, len(steps), axis=0)
            part[:, :3], part[:, 3] = moved.reshape(-1, 3), 128
        parts.append(part)
    rows = np.concatenate(parts) if parts else rows
    plain = (rows[:, 3] > 1) & (rows[:, 4] == 0)
    plain &= (rows[:, 5:] == np.ravel(background).astype(float)).all(axis=1)
    rows = rows[~plain]
    return rows[np.lexsort(rows[:, 3::-1].T)]


def _rows(places, side, active, values) -> np.ndarray:
    return np.column_stack([places, np.full(len(places), side), active, values.astype(float)])


def assert_same_band(a: NarrowBand, b: NarrowBand):
    """Every bit of a band but for the order and the origin of its pages."""
    for field in dataclasses.fields(NarrowBand):
        if field.name == "index":
            continue
        x, y = getattr(a, field.name), getattr(b, field.name)
        assert type(x) is type(y), field.name
        same = x.tobytes() == y.tobytes() if isinstance(x, np.ndarray) else x == y
        assert same, field.name
    assert_array_equal(a.index.coordinates, b.index.coordinates)
    random = np.random.default_rng(0)
    for reach in (50, 700, 5000, 10**6):
        nodes = random.integers(-reach, reach, (3000, 3))
        assert_array_equal(a.value_at(nodes), b.value_at(nodes))
