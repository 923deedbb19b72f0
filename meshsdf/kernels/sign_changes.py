"""Where a change of sign leaves a brick: through which faces a membrane must be followed.

Faces are numbered -x, +x, -y, +y, -z, +z.
"""

from numba import njit


@njit(cache=True, nogil=True)
def _is_inside(own, grown, slot, axis, layer, side_axis, row, n):
    """State of the n-th node of a row: where ``axis`` is at ``layer``, ``side_axis`` at ``row``."""
    i = layer if axis == 0 else (row if side_axis == 0 else n)
    j = layer if axis == 1 else (row if side_axis == 1 else n)
    k = layer if axis == 2 else (row if side_axis == 2 else n)
    if slot < len(own):
        return own[slot, i, j, k]
    return grown[slot - len(own), i, j, k]


@njit(cache=True, nogil=True)
def mark_mixed_faces(own, grown, slots, beside, mixed, mixed_beside):
    """Mark the faces of bricks through which a change of sign goes on.

    ``own`` and ``grown`` (b, 8, 8, 8) bool hold the states; slots from ``len(own)`` on are in
    ``grown``. ``beside`` (n, 6) int32 are the slots of the neighbours of ``slots`` (n,), or
    negative. ``mixed`` (n, 6) receives the faces of the bricks themselves: those with nodes on
    both sides, and those next to which the last row differs from a neighbour's first (the change
    passes between two bricks, and so between the bricks beyond); of the latter the neighbour's
    face is marked in ``mixed_beside`` (n, 6, 6).
    """
    mixed[:] = False
    mixed_beside[:] = False
    for b in range(len(slots)):
        for face in range(6):
            axis, layer = face >> 1, 7 * (face & 1)
            n = 0
            for row in range(8):
                for m in range(8):
                    n += _is_inside(own, grown, slots[b], axis, layer, (axis + 1) % 3, row, m)
            mixed[b, face] = mixed[b, face] or 0 < n < 64
            if beside[b, face] < 0:
                continue
            for side in range(6):
                side_axis, row = side >> 1, 7 * (side & 1)
                if side_axis == axis:
                    continue
                for m in range(8):
                    here = _is_inside(own, grown, slots[b], axis, layer, side_axis, row, m)
                    there = _is_inside(
                        own, grown, beside[b, face], axis, 7 - layer, side_axis, row, m
                    )
                    if here != there:
                        mixed[b, side] = True
                        mixed_beside[b, face, side] = True
