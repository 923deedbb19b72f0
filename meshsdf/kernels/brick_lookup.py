"""Find a brick in the page table.

``pages`` (p, 16, 16, 16) holds two levels of pages. ``root`` names an upper page for every 256^3
bricks, an upper page's entry names a lower page for 16^3, a lower page's entry is a brick's slot.
In place of a name or slot (>= 0) each may hold one code for all below: -1 outside, -2 inside, -3
and below a constant tile. Brick coordinates are local: relative to the first brick of the root
table. Beyond the table everything is outside.
"""

import numpy as np
from numba import njit

OUTSIDE = -1
INSIDE = -2


@njit(cache=True, nogil=True, inline="always")
def find_page(root, pages, px, py, pz):
    """Return the number or code of the lower page (px, py, pz), which holds 16^3 bricks."""
    rx, ry, rz = px >> 4, py >> 4, pz >> 4
    if not (0 <= rx < root.shape[0] and 0 <= ry < root.shape[1] and 0 <= rz < root.shape[2]):
        return np.int32(-1)
    upper = root[rx, ry, rz]
    if upper < 0:
        return upper
    return pages[upper, px & 15, py & 15, pz & 15]


@njit(cache=True, nogil=True, inline="always")
def find_brick(root, pages, bx, by, bz):
    """Return the slot or code of local brick (bx, by, bz)."""
    page = find_page(root, pages, bx >> 4, by >> 4, bz >> 4)
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


@njit(cache=True, nogil=True)
def mark_inside(root, pages, x, y, z0, z1):
    """Code the missing bricks (x, y, z0 ... z1 - 1) as inside, whole pages where none is stored."""
    z = z0
    while z < z1:
        page = find_page(root, pages, x >> 4, y >> 4, z >> 4)
        if page >= 0:
            pages[page, x & 15, y & 15, z & 15] = INSIDE
            z += 1
            continue
        upper = root[x >> 8, y >> 8, z >> 8]
        if upper < 0:
            root[x >> 8, y >> 8, z >> 8] = INSIDE
            z = (z | 255) + 1
        else:
            pages[upper, (x >> 4) & 15, (y >> 4) & 15, (z >> 4) & 15] = INSIDE
            z = (z | 15) + 1


@njit(cache=True, nogil=True)
def mark_runs_inside(root, pages, runs):
    """`mark_inside` for runs (r, 4) of local bricks x, y, z0, z1, as far as the table reaches."""
    for r in range(len(runs)):
        x, y = runs[r, 0], runs[r, 1]
        z0, z1 = max(runs[r, 2], 0), min(runs[r, 3], 256 * root.shape[2])
        if 0 <= x < 256 * root.shape[0] and 0 <= y < 256 * root.shape[1]:
            mark_inside(root, pages, x, y, z0, z1)
