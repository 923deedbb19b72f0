"""Which 8^3 bricks exist, and what is known of those that do not: a page table.

Brick ``(x, y, z)`` covers the nodes ``8 x ... 8 x + 7`` along each axis. Bricks are grouped into
lower pages of 16^3, these into upper pages of 16^3 (2048 nodes a side), and the root table names
the upper pages; each level may say at once that a whole group is outside, inside or a constant
tile. Memory grows with the bricks that exist, and one structure serves distance bands and volume
textures. The lower grouping is that of OpenVDB's lowest internal node (16^3 leaves of 8^3 voxels;
Museth 2013, doi:10.1145/2487228.2487235).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import (
    BrickCoordinates,
    BrickRuns,
    Ijk,
    Ijk1,
    Indices,
    PageTable,
    RootTable,
)
from ..errors import GridError
from ..kernels.brick_lookup import INSIDE, OUTSIDE, find_bricks, mark_runs_inside

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
        Coordinate of the first lower page; page p covers the bricks ``16 p ... 16 p + 15``.
    root : (rx, ry, rz) int32
        Number of the upper page that covers the lower pages ``page_origin + 16 r ... + 15``, or
        the code of all of them.
    pages : (p, 16, 16, 16) int32
        First the upper pages, which hold numbers of lower pages or codes, then the lower pages,
        which hold slots of bricks or codes.
    """

    coordinates: BrickCoordinates
    page_origin: Ijk1
    root: RootTable
    pages: PageTable

    @classmethod
    def from_coordinates(
        cls, coordinates: BrickCoordinates, inside: BrickRuns | None = None
    ) -> "BrickIndex":
        """Index bricks given in lexicographic order.

        Of the others, the runs ``inside`` (r, 4) are INSIDE: x, y, z0, z1 for the bricks
        (x, y, z0) ... (x, y, z1 - 1), with the whole page where none of its bricks exists; the
        rest are OUTSIDE.

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
        page_origin = (coordinates // PAGE).min(axis=0)
        local = coordinates // PAGE - page_origin
        group = tuple((local // PAGE).T)
        root = np.full((local // PAGE).max(axis=0) + 1, OUTSIDE, np.int32)
        root[group] = 0
        n_upper = number_marked(root, 0)
        upper = np.full((n_upper, PAGE, PAGE, PAGE), OUTSIDE, np.int32)
        entry = (root[group], *(local % PAGE).T)
        upper[entry] = 0
        n_lower = number_marked(upper, n_upper)
        lower = np.full((n_lower, PAGE, PAGE, PAGE), OUTSIDE, np.int32)
        slots = np.arange(len(coordinates), dtype=np.int32)
        lower[(upper[entry] - n_upper, *(coordinates % PAGE).T)] = slots
        pages = np.concatenate([upper, lower])
        if inside is not None:
            first = np.array([*page_origin[:2], page_origin[2], page_origin[2]]) * PAGE
            mark_runs_inside(root, pages, inside - first)
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


def number_marked(entries: np.ndarray, first: int) -> int:
    """Number the marked entries (0) in order, from ``first`` on; return how many there are."""
    marked = entries == 0
    n = int(np.count_nonzero(marked))
    entries[marked] = np.arange(first, first + n, dtype=np.int32)
    return n


def without_uniform_pages(root: RootTable, pages: PageTable) -> tuple[np.ndarray, np.ndarray]:
    """Return the tables without pages that hold one code alone, which stands above them instead.

    ``root`` and the upper pages are changed. What is left depends on the bricks and codes alone,
    not on where bricks were looked for.
    """
    n_upper = int(np.count_nonzero(root >= 0))
    upper, lower = pages[:n_upper], pages[n_upper:]
    stays, code = _is_varied(lower), lower[:, 0, 0, 0]
    # Numbers as they will be, but for upper pages that go
    number = np.where(stays, n_upper + np.cumsum(stays) - 1, code).astype(np.int32)
    named = upper >= 0
    upper[named] = number[upper[named] - n_upper]
    upper_stays, code = _is_varied(upper), upper[:, 0, 0, 0]
    upper[upper >= 0] -= np.int32(np.count_nonzero(~upper_stays))
    number = np.where(upper_stays, np.cumsum(upper_stays) - 1, code).astype(np.int32)
    named = root >= 0
    root[named] = number[root[named]]
    if stays.all() and upper_stays.all():
        return root, pages
    return root, np.concatenate([upper[upper_stays], lower[stays]])


def _is_varied(pages: np.ndarray) -> np.ndarray:
    """Which pages name anything below them, or hold more than one code."""
    flat = pages.reshape(len(pages), PAGE**3)
    return (flat.max(axis=1, initial=-1) >= 0) | (flat != flat[:, :1]).any(axis=1)


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
