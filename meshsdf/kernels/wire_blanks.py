"""Which bricks that say nothing must be sent nevertheless.

In a picture that is nothing almost everywhere a brick whose nodes all are nothing is sent only to
hide what coarser bricks say there.
"""

import numpy as np
from numba import njit

from .octree_tables import find_code, sheets_of

UNSENT, SILENT, SAYING = range(3)  # of a brick: there is none, all of it is nothing, something is


@njit(cache=True, nogil=True)
def silent_above(tables, kinds, entries, out):
    """``out[n]`` = nothing is shown where the brick of ``entries[n]`` would not be sent.

    ``kinds`` (e,) says what bricks are. Looked at is the brick above; only if some of its sheets
    have no brick to send and others have, the one above that, too.
    """
    for n in range(len(entries)):
        e = entries[n]
        level = np.int64(tables.levels[e])
        bx, by, bz = tables.bricks[e, 0], tables.bricks[e, 1], tables.bricks[e, 2]
        found, goes_on = True, True
        while goes_on and level + 1 < len(tables.heads):
            level, bx, by, bz = level + 1, bx >> 1, by >> 1, bz >> 1
            code = find_code(tables.heads, tables.pages, level, bx, by, bz)
            begin, end = sheets_of(tables.groups, code)
            n_sent = 0
            for entry in range(begin, end):
                n_sent += kinds[entry] != UNSENT
                found &= kinds[entry] != SAYING
            # Above a brick that is sent is another; without one nothing is known
            found &= n_sent > 0
            goes_on = found and n_sent < end - begin
        out[n] = found


@njit(cache=True, nogil=True)
def mark_below(tables, kinds, turned, marked, parted):
    """Mark the silent bricks for which `silent_above` looks at the bricks of ``turned`` entries.

    Only those one level below; marked in ``parted`` are entries there of whose brick some sheets
    are sent and others not: those below them look at what is above them, too.
    """
    for n in range(len(turned)):
        level = np.int64(tables.levels[turned[n]]) - 1
        brick = tables.bricks[turned[n]]
        for d in range(8 if level >= 0 else 0):
            x, y, z = 2 * brick[0] + (d >> 2), 2 * brick[1] + ((d >> 1) & 1), 2 * brick[2] + (d & 1)
            code = find_code(tables.heads, tables.pages, level, x, y, z)
            begin, end = sheets_of(tables.groups, code)
            n_sent = 0
            for entry in range(begin, end):
                n_sent += kinds[entry] != UNSENT
                marked[entry] |= kinds[entry] == SILENT
            if 0 < n_sent < end - begin:
                parted[begin] = True
