"""Laying layers of a texture over one another, texel by texel, and finding what has to be redone.

What a layer shows at a texel of level l is its own texel where it stores the brick, and F_(l+1) of
`kernels.texture_lookup` where it does not.
"""

import numpy as np
from numba import njit

from .blending import composite
from .octree_tables import FIRST_GROUP, NO_ENTRY, find_code
from .sheets import decode_normal
from .texel_codes import F1
from .texture_lookup import ABSENT, FIRST_TILE, level_value, needed, read_texel


@njit(cache=True, nogil=True)
def layer_values(tables, slots, pool, tiles, kind, entries, first, out):
    """``out`` (n, 4) float32 = what one channel of a layer shows at the texels of entries.

    Those of ``entries[i]`` go to the rows from ``first[i]`` on, in the order of the mask's bits.
    """
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    neighbors, masks = tables.neighbors, tables.masks
    for i in range(len(entries)):
        e = entries[i]
        slot, level, at = slots[e], tables.levels[e], first[i]
        code = tables.texel_first[e]
        bx, by, bz = tables.bricks[e, 0], tables.bricks[e, 1], tables.bricks[e, 2]
        for t in range(512):
            if not needed(masks, e, t):
                continue
            if slot != ABSENT:
                r, g, b, a = read_texel(kind, slot, pool, tiles, t)
            else:
                nx, ny, nz = decode_normal(
                    tables.texel_normals[code, 0], tables.texel_normals[code, 1]
                )
                r, g, b, a = level_value(
                    heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind,
                    np.int64(level + 1), 0.5 * (8 * bx + (t >> 6)), 0.5 * (8 * by + ((t >> 3) & 7)),
                    0.5 * (8 * bz + (t & 7)), np.float64(nx), np.float64(ny), np.float64(nz),
                )  # fmt: skip
            out[at, 0], out[at, 1], out[at, 2], out[at, 3] = r, g, b, a
            at += 1
            code += 1


@njit(cache=True, nogil=True)
def lay_over(mode, values, masks, opacity, below):
    """``below`` (n, 4) = ``values`` over it, alpha (or coverage) times opacity times mask.

    ``masks`` holds a row per texel, or one for all.
    """
    many = len(masks) > 1
    for n in range(len(values)):
        coverage = values[n, 3] * (opacity * masks[n if many else 0, 0])
        under = below[n, 0], below[n, 1], below[n, 2], below[n, 3]
        over = values[n, 0], values[n, 1], values[n, 2]
        below[n, 0], below[n, 1], below[n, 2], below[n, 3] = composite(mode, under, over, coverage)


@njit(cache=True, nogil=True)
def add_up(values, masks, opacity, below):
    """Add the first of ``values`` (n, 4), times opacity times mask, to the first of ``below``."""
    many = len(masks) > 1
    for n in range(len(values)):
        below[n, 0] += values[n, 0] * (opacity * masks[n if many else 0, 0])
        below[n, 3] = F1


@njit(cache=True, nogil=True)
def changed_nodes(tables, entries, before, after, pool, tiles, boxes):
    """Widen ``boxes[i]`` (least x, y, z, most x, y, z), nodes of the brick of ``entries[i]``, by
    the needed texels that differ between the stored slots ``before[i]`` and ``after[i]``."""
    masks = tables.masks
    for i in range(len(entries)):
        old, new = before[i], after[i]
        for t in range(512):
            if not needed(masks, entries[i], t):
                continue
            a = tiles[FIRST_TILE - old] if old <= FIRST_TILE else pool[old, t]
            b = tiles[FIRST_TILE - new] if new <= FIRST_TILE else pool[new, t]
            if a != b:
                x, y, z = t >> 6, (t >> 3) & 7, t & 7
                boxes[i, 0], boxes[i, 3] = min(boxes[i, 0], x), max(boxes[i, 3], x)
                boxes[i, 1], boxes[i, 4] = min(boxes[i, 1], y), max(boxes[i, 4], y)
                boxes[i, 2], boxes[i, 5] = min(boxes[i, 2], z), max(boxes[i, 5], z)


@njit(cache=True, nogil=True)
def mark_dependents(tables, slots, box_of, boxes, reach, candidates, begin, end, marked):
    """Mark those of ``candidates``, which a layer does not store, whose F_(l+1) may have changed.

    ``boxes[box_of[e]]`` (6,) are the nodes of entry e that changed, counted in its level, and
    ``reach[l]`` (6,) holds all those of level l. Levels are climbed until every brick that the
    candidate's texels lie between is stored: then no coarser one counts.
    """
    top = len(tables.heads)
    nodes = np.empty(6, np.int64)
    for i in range(begin, end):
        e = candidates[i]
        _nodes_of(tables.bricks, e, nodes)
        near = False
        for level in range(tables.levels[e] + 1, top):
            _climb(nodes)
            if _meet(nodes, reach[level]):
                near = True
                break
        if not near:
            continue
        _nodes_of(tables.bricks, e, nodes)
        for level in range(tables.levels[e] + 1, top):
            _climb(nodes)
            hit, complete = _look_around(tables, slots, box_of, boxes, level, nodes)
            if hit:
                marked[e] = True
            if hit or complete:
                break


@njit(cache=True, nogil=True)
def _nodes_of(bricks, e, nodes):
    for axis in range(3):
        nodes[axis] = 8 * bricks[e, axis]
        nodes[axis + 3] = nodes[axis] + 7


@njit(cache=True, nogil=True)
def _climb(nodes):
    """Turn a box of nodes into the box of those a level up that they lie between."""
    for axis in range(3):
        nodes[axis] >>= 1
        nodes[axis + 3] = (nodes[axis + 3] >> 1) + 1


@njit(cache=True, nogil=True)
def _meet(a, b):
    apart = False
    for axis in range(3):
        apart |= a[axis] > b[axis + 3] or a[axis + 3] < b[axis]
    return not apart


@njit(cache=True, nogil=True)
def _look_around(tables, slots, box_of, boxes, level, nodes):
    """Whether changed nodes are among ``nodes``; whether their bricks are stored, one sheet each.

    (Of a brick with several sheets, the one that is looked up may lack nodes, which then come from
    further up.)
    """
    complete = True
    for bx in range(nodes[0] >> 3, (nodes[3] >> 3) + 1):
        for by in range(nodes[1] >> 3, (nodes[4] >> 3) + 1):
            for bz in range(nodes[2] >> 3, (nodes[5] >> 3) + 1):
                code = np.int64(find_code(tables.heads, tables.pages, level, bx, by, bz))
                if code == NO_ENTRY:
                    continue
                start, count = code, 1
                if code <= FIRST_GROUP:
                    start = np.int64(tables.groups[FIRST_GROUP - code, 0])
                    count = np.int64(tables.groups[FIRST_GROUP - code, 1])
                    complete = False
                for entry in range(start, start + count):
                    if box_of[entry] >= 0 and _meet(nodes, boxes[box_of[entry]]):
                        return True, complete
                    if slots[entry] == ABSENT:
                        complete = False
    return False, complete
