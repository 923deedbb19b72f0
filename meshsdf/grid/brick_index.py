"""Which 8^3 bricks exist, and what is known of those that do not: a two-level page table.

Brick ``(x, y, z)`` covers the nodes ``8 x ... 8 x + 7`` along each axis. Bricks are grouped into
pages of 16^3; the root table names the page of each group, or says at once that the whole group
is outside, inside or a constant tile. Memory grows with the bricks that exist, and one structure
serves distance bands and volume textures. The grouping is that of OpenVDB's lowest internal node
(16^3 leaves of 8^3 voxels; Museth 2013, doi:10.1145/2487228.2487235).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import BrickCoordinates, Ijk, Ijk1, Indices, PageTable, RootTable
from ..errors import GridError
from ..kernels.brick_lookup import INSIDE, OUTSIDE, find_bricks

BRICK = 8
"""Nodes along one side of a brick."""

PAGE = 16
"""Bricks along one side of a page."""

__all__ = ["BRICK", "INSIDE", "OUTSIDE", "PAGE", "BrickIndex"]


@dataclass(frozen=True, eq=False)
class BrickIndex:
    """Brick coordinate -> slot (>= 0), or a code: OUTSIDE, INSIDE, or below that a constant tile.

    Attributes
    ----------
    coordinates : (b, 3) int64
        Brick coordinate of every slot, in lexicographic order.
    page_origin : (3,) int64
        Page coordinate of ``root[0, 0, 0]``; page p covers the bricks ``16 p ... 16 p + 15``.
    root : (px, py, pz) int32
        Number of the page, or the code of the whole page.
    pages : (p, 16, 16, 16) int32
        Slot or code of every brick of a page.
    """

    coordinates: BrickCoordinates
    page_origin: Ijk1
    root: RootTable
    pages: PageTable

    @classmethod
    def from_coordinates(
        cls, coordinates: BrickCoordinates, inside: Ijk | None = None
    ) -> "BrickIndex":
        """Index bricks given in lexicographic order.

        Of the others, those listed in ``inside`` are INSIDE, with the whole page where none of
        its bricks exists; the rest are OUTSIDE.

        Raises
        ------
        GridError
            The coordinates are not strictly increasing in lexicographic order.
        """
        _check_order(coordinates)
        if len(coordinates) == 0:
            empty = np.full((0, 0, 0), OUTSIDE, np.int32)
            return cls(
                coordinates, np.zeros(3, np.int64), empty, np.empty((0, 16, 16, 16), np.int32)
            )
        page = coordinates // PAGE
        page_origin = page.min(axis=0)
        local = page - page_origin
        root = np.full(local.max(axis=0) + 1, OUTSIDE, np.int32)
        root[tuple(local.T)] = 0
        named = root == 0
        root[named] = np.arange(np.count_nonzero(named), dtype=np.int32)
        pages = np.full((np.count_nonzero(named), PAGE, PAGE, PAGE), OUTSIDE, np.int32)
        entry = tuple((coordinates % PAGE).T)
        pages[(root[tuple(local.T)], *entry)] = np.arange(len(coordinates), dtype=np.int32)
        if inside is not None:
            _mark_inside(inside - page_origin * PAGE, root, pages)
        return cls(coordinates, page_origin, root, pages)

    @property
    def n_bricks(self) -> int:
        """Number of bricks that exist."""
        return len(self.coordinates)

    @cached_property
    def origin(self) -> Ijk1:
        """(3,) brick coordinate of the first brick of the root table."""
        return self.page_origin * PAGE

    def lookup(self, bricks: Ijk) -> Indices:
        """Return the slot or code of each of the (n, 3) bricks."""
        found = np.empty(len(bricks), np.int32)
        local = np.ascontiguousarray(bricks - self.origin)
        find_bricks(self.root, self.pages, local, found)
        return found


def _mark_inside(local: np.ndarray, root: np.ndarray, pages: np.ndarray) -> None:
    within = ((local >= 0) & (local < np.array(root.shape) * PAGE)).all(axis=1)
    local = local[within]
    page = tuple((local // PAGE).T)
    missing = root[page] < 0
    root[tuple((local[missing] // PAGE).T)] = INSIDE
    local = local[~missing]
    pages[(root[tuple((local // PAGE).T)], *(local % PAGE).T)] = INSIDE


def _check_order(coordinates: np.ndarray) -> None:
    step = np.diff(coordinates, axis=0)
    first = np.where(step[:, 0] != 0, step[:, 0], np.where(step[:, 1] != 0, step[:, 1], step[:, 2]))
    if (first <= 0).any():
        at = int(np.flatnonzero(first <= 0)[0])
        raise GridError(
            f"brick {coordinates[at + 1].tolist()} comes after {coordinates[at].tolist()}",
            "BrickIndex.from_coordinates(coordinates=...)",
            "sort the bricks by x, then y, then z, each once",
        )
