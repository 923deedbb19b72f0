"""One grid of a ``.vdb`` file: values in bricks, constant tiles, a place in the world, and words.

The tree of a ``.vdb`` file has leaves of 8^3 voxels, lower nodes of 16^3 leaves, upper nodes of
32^3 lower nodes and a root. A `BrickIndex` says the same: a leaf is a brick, a lower node a lower
page, and a tile of any size a code: -1 is the background, -2 its opposite (the inside of a level
set), both inactive; -3 - t is tile t of the grid.
"""

from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool

from ..arrays import BrickMasks, Ijk1, Matrix4
from ..grid import BrickIndex
from ..grid.brick_grid import node_mask
from ..grid.brick_index import BRICK
from .vdb_metadata import Metadata, check_metadata
from .vdb_pages import constant_blocks
from .vdb_values import ValueLayout
from .volume_checks import check_index

VALUE_TYPES = {
    "float": (np.dtype(np.float32), ()),
    "double": (np.dtype(np.float64), ()),
    "int32": (np.dtype(np.int32), ()),
    "int64": (np.dtype(np.int64), ()),
    "vec3s": (np.dtype(np.float32), (3,)),
    "vec3d": (np.dtype(np.float64), (3,)),
    "vec3i": (np.dtype(np.int32), (3,)),
}
"""dtype and shape of one value, by the name that the format has for it."""


CLASSES = ("level set", "fog volume", "staggered", "unknown")
"""What a grid may be."""

LARGEST_NODE = 2**31 - 2**13
"""The format counts voxels with 32 bits; the last upper node must fit as a whole."""

LONGEST_NAME = 1000


@runtime_checkable
class LeafValues(Protocol):
    """An array (b, 8, 8, 8) or (b, 8, 8, 8, 3), or what makes parts of one when asked."""

    @property
    def dtype(self) -> np.dtype: ...

    @property
    def shape(self) -> tuple[int, ...]: ...

    def __getitem__(self, slots: np.ndarray, /) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class VdbGrid:
    """A grid as a ``.vdb`` file holds it, whatever it means.

    Attributes
    ----------
    name : str
        By which other programs find it: "surface", "density", "Cd".
    index : BrickIndex
        Which bricks exist, and the code of every tile.
    values : (b, 8, 8, 8) or (b, 8, 8, 8, 3) array
        float32, float64, int32 or int64, three together for vectors.
    active : (b, 8) uint64
        Bit ``8 j + k`` of word i tells whether voxel (i, j, k) of the brick is active.
    background : () or (3,) array
        The value where nothing is stored, of the same dtype.
    matrix : (4, 4) float64
        Takes (i, j, k, 1) to world space; affine.
    grid_class : str
        "level set", "fog volume", "staggered" or "unknown".
    tile_values, tile_active : (t,) or (t, 3) array, (t,) bool
        What the codes -3, -4, … stand for.
    metadata : dict
        What else the file says of the grid.
    is_half : bool
        Whether the file holds, or is to hold, float16.
    """

    name: str
    index: BrickIndex
    values: LeafValues
    active: BrickMasks
    background: np.ndarray
    matrix: Matrix4
    grid_class: str = "unknown"
    tile_values: np.ndarray | None = None
    tile_active: Bool[np.ndarray, " t"] | None = None
    metadata: Metadata = field(default_factory=dict)
    is_half: bool = False

    @property
    def value_type(self) -> str:
        """The format's name for the type of a value; ValueError if it has none."""
        kind = (self.values.dtype, tuple(self.values.shape[4:]))
        for name, known in VALUE_TYPES.items():
            if kind == known:
                return name
        raise ValueError(f"values of {kind[0]} {kind[1]} have no name in the format")

    @property
    def code_values(self) -> np.ndarray:
        """Values by ``-1 - code``."""
        layout = ValueLayout(self.background, False, 0)
        known = np.stack([self.background, layout.opposite])
        return known if self.tile_values is None else np.concatenate([known, self.tile_values])

    @property
    def code_active(self) -> Bool[np.ndarray, " c"]:
        """Whether tiles are active, by ``-1 - code``."""
        known = np.zeros(2, bool)
        return known if self.tile_active is None else np.concatenate([known, self.tile_active])

    def active_extent(self) -> tuple[int, Ijk1, Ijk1]:
        """Return how many voxels are active, and the lowest and highest of them.

        Without any, the lowest is (0, 0, 0) and the highest (-1, -1, -1).
        """
        boxes = [_leaf_box(self.index, self.active)]
        count = int(np.bitwise_count(self.active).sum())
        for places, side, codes in constant_blocks(self.index):
            places = places[self.code_active[-1 - codes]]
            count += len(places) * side**3
            if len(places):
                boxes.append((places.min(axis=0), places.max(axis=0) + side - 1))
        boxes = [box for box in boxes if box is not None]
        if not boxes:
            return 0, np.zeros(3, np.int64), np.full(3, -1)
        lows, highs = zip(*boxes, strict=True)
        return count, np.min(lows, axis=0), np.max(highs, axis=0)


def check_grid(grid: VdbGrid) -> None:
    """ValueError says why a grid cannot be written."""
    check_index(grid.index)
    check_metadata(grid.metadata)
    n, layout = grid.index.n_bricks, (grid.values.dtype, tuple(grid.values.shape[4:]))
    if "\x1e" in grid.name or len(grid.name) > LONGEST_NAME:
        raise ValueError(f"a grid cannot be named {grid.name[:LONGEST_NAME]!r}")
    if grid.value_type and tuple(grid.values.shape[:4]) != (n, BRICK, BRICK, BRICK):
        raise ValueError(f"values are {grid.values.shape} for {n} bricks")
    if grid.grid_class not in CLASSES:
        raise ValueError(f"the class {grid.grid_class!r} is none of {', '.join(CLASSES)}")
    if grid.active.shape != (n, BRICK):
        raise ValueError(f"active is {grid.active.shape} for {n} bricks")
    for name, own in (("background", 0), ("tile_values", 1)):
        array = getattr(grid, name)
        if array is not None and (array.dtype, array.shape[own:]) != layout:
            raise ValueError(f"{name} is {array.dtype} {array.shape} beside {layout[0]} values")
    tiles = [0 if a is None else len(a) for a in (grid.tile_values, grid.tile_active)]
    lowest = min(grid.index.root.min(initial=0), grid.index.pages.min(initial=0))
    if tiles[0] != tiles[1] or lowest < -2 - tiles[0]:
        raise ValueError(
            f"there are {tiles[0]} values and {tiles[1]} states for {-2 - lowest} tiles"
        )
    matrix = grid.matrix
    if not np.isfinite(matrix).all() or matrix[3].tolist() != [0, 0, 0, 1]:
        raise ValueError("the matrix is no affine transform")
    nodes = grid.index.coordinates * BRICK
    if n and (nodes.min() < -LARGEST_NODE or nodes.max() > LARGEST_NODE):
        raise ValueError(f"a brick lies beyond node {LARGEST_NODE}, the last the format can name")


def _leaf_box(index: BrickIndex, active: BrickMasks) -> tuple[Ijk1, Ijk1] | None:
    """The lowest and highest active voxel of the bricks, or None without one."""
    used = np.flatnonzero(active.any(axis=1))
    if len(used) == 0:
        return None
    bricks = index.coordinates[used]
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for axis in range(3):
        # Only the outermost layer of bricks can hold the outermost voxels
        for brick, out, pick in (
            (bricks[:, axis].min(), low, np.min),
            (bricks[:, axis].max(), high, np.max),
        ):
            mask = node_mask(active[used[bricks[:, axis] == brick]]).any(axis=0)
            out[axis] = brick * BRICK + pick(np.nonzero(mask)[axis])
    return low, high
