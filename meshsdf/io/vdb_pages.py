"""Where the pages of a `BrickIndex` lie, and which blocks of nodes are constant."""

import numpy as np

from ..arrays import Ijk, Indices
from ..grid import BrickIndex
from ..grid.brick_index import BRICK, OUTSIDE, PAGE

PAGE_NODES = BRICK * PAGE
"""Nodes along one side of a lower page, and of a lower node of a tree: 128."""

UPPER = 32
"""Lower nodes along one side of an upper node of a tree."""

UPPER_NODES = UPPER * PAGE_NODES
"""Nodes along one side of an upper node: 4096."""


def page_places(index: BrickIndex) -> tuple[np.ndarray, np.ndarray]:
    """Return where the upper (u, 3) and lower (l, 3) pages lie, in units of lower pages."""
    named = np.argwhere(index.root >= 0)
    upper_places = np.empty((len(named), 3), np.int64)
    upper_places[index.root[index.root >= 0]] = index.page_origin + PAGE * named
    upper = index.pages[: len(named)]
    owner, *entry = np.nonzero(upper >= 0)
    lower_places = np.empty((len(index.pages) - len(named), 3), np.int64)
    number = upper[(owner, *entry)] - len(named)
    lower_places[number] = upper_places[owner] + np.stack(entry, axis=1)
    return upper_places, lower_places


def find_pages(index: BrickIndex, places: Ijk) -> Indices:
    """Return the number or code of each lower page, by its place in units of lower pages."""
    local = places - index.page_origin
    group = local >> 4
    found = np.full(len(places), OUTSIDE, np.int32)
    known = ((group >= 0) & (group < index.root.shape)).all(axis=1)
    found[known] = index.root[tuple(group[known].T)]
    below = found >= 0
    found[below] = index.pages[(found[below], *(local[below] & 15).T)]
    return found


def constant_blocks(index: BrickIndex) -> list[tuple[np.ndarray, int, np.ndarray]]:
    """Return, for each size, the first nodes of the blocks not outside, their side, their codes.

    The sides are those of a brick, a lower and an upper page: 8, 128 and 2048 nodes.
    """
    upper_places, lower_places = page_places(index)
    n_upper = len(upper_places)
    root = np.argwhere(index.root < OUTSIDE)
    blocks = [(index.origin * BRICK + root * PAGE_NODES * PAGE, index.root, root)]
    for pages, places, side in (
        (index.pages[:n_upper], upper_places, PAGE_NODES),
        (index.pages[n_upper:], lower_places, BRICK),
    ):
        entry = np.argwhere(pages < OUTSIDE)
        first = places[entry[:, 0]] * PAGE_NODES + entry[:, 1:] * side
        blocks.append((first, pages, entry))
    sides = (PAGE_NODES * PAGE, PAGE_NODES, BRICK)
    return [
        (first, side, table[tuple(entry.T)])
        for (first, table, entry), side in zip(blocks, sides, strict=True)
    ]
