"""How the nodes of a grid lie on the slices of an image, and the slices in an atlas.

A texture that engines read has columns u, rows v and slices w, row 0 on top. Of an array [i, j, k]:

- ``up="z"``: columns along +x, rows along +y, slices along +z
- ``up="y"``: columns along +x, rows along -z, slices along +y: the turn about x that makes a model
  whose y points up stand upright where z points up. It is a turn, so nothing is mirrored.

In an atlas slice s is the cell in row ``s // columns`` and column ``s % columns``, the first on
top and left.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

Up = Literal["y", "z"]

ALONG = {"z": ("+x", "+y", "+z"), "y": ("+x", "-z", "+y")}
"""Which way columns, rows and slices run."""


@dataclass(frozen=True)
class Slicing:
    """The slices of a grid, and their places in an atlas.

    Attributes
    ----------
    shape : tuple of 3 int
        Nodes of the grid along x, y and z, each at least 1.
    up : "y" or "z"
        Which axis the slices are stacked along.
    columns : int or None
        Slices beside each other in the atlas; None: no atlas, each slice is an image of its own.
    """

    shape: tuple[int, int, int]
    up: Up
    columns: int | None

    @property
    def width(self) -> int:
        """Pixels of a slice from left to right."""
        return self.shape[0]

    @property
    def height(self) -> int:
        """Pixels of a slice from top to bottom."""
        return self.shape[1 if self.up == "z" else 2]

    @property
    def n_slices(self) -> int:
        """Number of slices."""
        return self.shape[2 if self.up == "z" else 1]

    @property
    def rows(self) -> int | None:
        """Slices above each other in the atlas."""
        return None if self.columns is None else -(-self.n_slices // self.columns)

    @property
    def image_shapes(self) -> list[tuple[int, int]]:
        """Height and width of every image in the file."""
        if self.columns is None:
            return [(self.height, self.width)] * self.n_slices
        return [(self.rows * self.height, self.columns * self.width)]

    def slices_of(self, values: np.ndarray) -> np.ndarray:
        """The (s, height, width) view of an array [i, j, k]."""
        if self.up == "z":
            return values.transpose(2, 1, 0)
        return values.transpose(1, 2, 0)[:, ::-1]

    def cells_of(self, images: list[np.ndarray]) -> list[np.ndarray]:
        """Views of the part of the images that each slice takes, in the order of slices."""
        if self.columns is None:
            return images
        cells = images[0].reshape(self.rows, self.height, self.columns, self.width)
        return [cells[s // self.columns, :, s % self.columns] for s in range(self.n_slices)]


def nearly_square(width: int, height: int, n_slices: int) -> int:
    """Return how many columns make the atlas whose longer side is shortest.

    Examples
    --------
    >>> nearly_square(64, 64, 64), nearly_square(64, 32, 7)
    (8, 2)
    """
    columns = np.arange(1, n_slices + 1)
    rows = -(-n_slices // columns)
    # Of those with equal sides the one with the fewest empty cells, then the fewest columns
    sides = np.maximum(columns * width, rows * height)
    return int(columns[np.lexsort((columns, columns * rows, sides))[0]])
