"""Arcs between crossings, by their names.

An arc joins two crossings on a cell face and belongs to one loop of each of the two cells; the mesh
has an edge between the loops' points, the chord. The arc is named ``4 c + q`` from either end:
crossing c, between the loops q and q + 1 around it. The lesser name is its key.
"""

from numba import njit

from .dual_arrays import other_end


@njit(cache=True, nogil=True)
def mark_keys(loops, is_wanted, begin, end, is_marked):
    """Mark the keys of arcs between two loops of which one is wanted."""
    for c in range(begin, end):
        for q in range(4):
            a, b = loops.around[c, q], loops.around[c, (q + 1) & 3]
            is_marked[4 * c + q] = (
                a >= 0
                and b >= 0
                and (is_wanted[a] or is_wanted[b])
                and other_end(loops, c, q)[0] > c
            )


@njit(cache=True, nogil=True)
def arc_ends(names, loops, ends, is_key):
    """``ends[n]`` (n, 2) int32: the crossings that an arc joins; and whether its name is a key."""
    for n in range(len(names)):
        other, _ = other_end(loops, names[n] >> 2, names[n] & 3)
        ends[n, 0], ends[n, 1] = names[n] >> 2, other
        is_key[n] = other > names[n] >> 2
