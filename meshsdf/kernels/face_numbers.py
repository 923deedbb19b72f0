"""Small numbers for the faces of a surface, so that parts in conflict have none in common.

Greedy and breadth first over the surface, one face after another: a face takes the number of the
one it was reached from unless a part in conflict with one of its parts has that number, else the
least that is free. So numbers change along few edges, and the outcome is the same at any time.
"""

import numpy as np
from numba import njit

MOST_NUMBERS = 32


@njit(cache=True, nogil=True)
def number_faces(edges, half_edges, first, of_face, part, clash, used, numbers):
    """Fill ``numbers`` (m,) uint8.

    Face f is of the parts ``part[of_face[f]:of_face[f + 1]]``; part p is number p % 32 of brick
    p // 32, and bit b of ``clash[p]`` says that it may have no number in common with part b of that
    brick. ``used`` (p,) uint32, all 0, gets the numbers of the parts as bits. Where none of 32
    numbers is left, 0 is given, and the parts stay in conflict.
    """
    m = len(numbers)
    queue, wish, seen = np.empty(m, np.int32), np.zeros(m, np.uint8), np.zeros(m, np.bool_)
    for seed in range(m):
        if seen[seed]:
            continue
        queue[0], seen[seed] = seed, True
        at, n = 0, 1
        while at < n:
            f = queue[at]
            at += 1
            begin, end = of_face[f], of_face[f + 1]
            number = wish[f]
            if end > begin:
                number = _free_number(part, clash, used, begin, end, number)
                for k in range(begin, end):
                    used[part[k]] |= np.uint32(1) << np.uint32(number)
            numbers[f] = number
            for side in range(3):
                edge = edges[f, side]
                if edge < 0:
                    continue
                for h in range(first[edge], first[edge + 1]):
                    g = half_edges[h] // 3
                    if not seen[g]:
                        seen[g], wish[g] = True, number
                        queue[n] = g
                        n += 1


@njit(cache=True, nogil=True)
def _free_number(part, clash, used, begin, end, wish):
    """The wished number if no part in conflict has it, else the least that none has, else 0."""
    taken = np.uint32(0)
    for k in range(begin, end):
        brick = part[k] & ~np.int64(31)
        for b in range(32):
            if (clash[part[k]] >> np.uint32(b)) & np.uint32(1):
                taken |= used[brick + b]
    if not (taken >> np.uint32(wish)) & np.uint32(1):
        return np.uint8(wish)
    for number in range(MOST_NUMBERS):
        if not (taken >> np.uint32(number)) & np.uint32(1):
            return np.uint8(number)
    return np.uint8(0)
