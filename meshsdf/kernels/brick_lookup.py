"""Find a brick in the two-level page table.

``root[page]`` names a page of 16^3 entries or holds one code for the whole page; a page's entry
is a slot (>= 0) or a code: -1 outside, -2 inside, -3 and below a constant tile. Brick coordinates
are local: relative to the first brick of the root table. Beyond the table everything is outside.
"""

import numpy as np
from numba import njit

OUTSIDE = -1
INSIDE = -2


@njit(cache=True, nogil=True, inline="always")
def find_brick(root, pages, bx, by, bz):
    """Return the slot or code of local brick (bx, by, bz)."""
    px, py, pz = bx >> 4, by >> 4, bz >> 4
    if not (0 <= px < root.shape[0] and 0 <= py < root.shape[1] and 0 <= pz < root.shape[2]):
        return np.int32(-1)
    page = root[px, py, pz]
    if page < 0:
        return page
    return pages[page, bx & 15, by & 15, bz & 15]


@njit(cache=True, nogil=True)
def find_bricks(root, pages, bricks, found):
    """``found[n] = find_brick(bricks[n])`` for (n, 3) int64 local brick coordinates."""
    for n in range(len(bricks)):
        found[n] = find_brick(root, pages, bricks[n, 0], bricks[n, 1], bricks[n, 2])


@njit(cache=True, nogil=True)
def read_nodes(root, pages, values, background, ijk, out):
    """``out[n]`` = stored value of local node ``ijk[n]``; +-background where there is no brick."""
    for n in range(len(ijk)):
        i, j, k = ijk[n, 0], ijk[n, 1], ijk[n, 2]
        slot = find_brick(root, pages, i >> 3, j >> 3, k >> 3)
        if slot >= 0:
            out[n] = values[slot, i & 7, j & 7, k & 7]
        elif slot == INSIDE:
            out[n] = -background
        else:
            out[n] = background
