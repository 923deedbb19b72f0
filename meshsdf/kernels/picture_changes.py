"""Finding what has to be laid over one another anew when layers of a texture changed."""

import numpy as np
from numba import njit

from .node_values import MIXED, corner_of_cell, texel_index, tile_above
from .octree_tables import FIRST_GROUP, NO_ENTRY, find_code, find_entry, part_bit, sheets_of
from .sheets import decode_normal
from .texel_codes import decoded
from .texture_lookup import ABSENT, FIRST_TILE, needed

FAR = np.int64(1) << 60
UNKNOWN, YES, NO = 0, 1, 2


@njit(cache=True, nogil=True)
def changed_slots(before, after, stored, found):
    """Fill ``found`` with the entries whose slots differ; how many. Marks in ``stored`` those that
    ``after`` stores."""
    n = 0
    for e in range(len(after)):
        stored[e] |= after[e] != ABSENT
        if before[e] != after[e]:
            found[n] = e
            n += 1
    return n


@njit(cache=True, nogil=True)
def changed_texels(masks, before, after, pool, tiles, entries, shown, bits):
    """Set in ``bits[i]`` (8,) the texels of ``entries[i]``, which is and was stored, that differ in
    one channel; ``shown[i]`` if there are any."""
    for i in range(len(entries)):
        e = entries[i]
        old, new = before[e], after[e]
        for t in range(512):
            if not needed(masks, e, t):
                continue
            a = tiles[FIRST_TILE - old] if old <= FIRST_TILE else pool[old, t]
            b = tiles[FIRST_TILE - new] if new <= FIRST_TILE else pool[new, t]
            if a != b:
                bits[i, t >> 6] |= np.uint64(1) << np.uint64(t & 63)
                shown[i] = True


@njit(cache=True, nogil=True)
def unlike_above(tables, slots, pool, tiles, kind, entries, first, seen, shown, bits):
    """Set in ``bits[i]`` the texels of ``entries[i]``, stored here and in another state not, that
    are not what is seen there in that state, ``seen[first[i]:]``; ``shown[i]`` if there are any.

    Nor are sums of texels, to the last bit, what is seen in between, unless all are one number:
    bits are set, too, where those around differ from a texel.
    """
    for i in range(len(entries)):
        e, at = entries[i], first[i]
        slot = slots[e]
        for t in range(512):
            if not needed(tables.masks, e, t):
                continue
            own = tiles[FIRST_TILE - slot] if slot <= FIRST_TILE else pool[slot, t]
            r, g, b, a = decoded(kind, np.int64(own))
            same = r == seen[at, 0] and g == seen[at, 1] and b == seen[at, 2] and a == seen[at, 3]
            shown[i] |= not same
            if not same:
                bits[i, t >> 6] |= np.uint64(1) << np.uint64(t & 63)
            at += 1


@njit(cache=True, nogil=True)
def _all_around(tables, slots, pool, tiles, e, t, own):
    """Whether all texels around texel t of entry e hold its number."""
    slot = slots[e]
    x, y, z = t >> 6, (t >> 3) & 7, t & 7
    if slot <= FIRST_TILE and 0 < x < 7 and 0 < y < 7 and 0 < z < 7:
        return True
    for d in range(27):
        ox, oy, oz = x + d // 9 - 1, y + d // 3 % 3 - 1, z + d % 3 - 1
        beside = tables.neighbors[e, 9 * ((ox >> 3) + 1) + 3 * ((oy >> 3) + 1) + (oz >> 3) + 1]
        if beside <= FIRST_GROUP:
            return False
        at = ((ox & 7) << 6) + ((oy & 7) << 3) + (oz & 7)
        if beside == NO_ENTRY or not needed(tables.masks, beside, at):
            continue
        other = slots[beside]
        if other == ABSENT:
            other = tile_above(tables, slots, beside)
            if other == MIXED:
                return False
        if (tiles[FIRST_TILE - other] if other <= FIRST_TILE else pool[other, at]) != own:
            return False
    return True


@njit(cache=True, nogil=True)
def changed_boxes(tables, entries, bits, row_of, boxes, reach):
    """``boxes[i]`` (6,) = least and most of the nodes in ``bits[i]``, counted in the entry's level.

    ``row_of[e]`` becomes the row of an entry that has any, and ``reach[l]`` (6,) holds all of a
    level; the least lies beyond the most if there is none.
    """
    for level in range(len(reach)):
        for axis in range(3):
            reach[level, axis], reach[level, axis + 3] = FAR, -FAR
    for i in range(len(entries)):
        e = entries[i]
        for axis in range(3):
            boxes[i, axis], boxes[i, axis + 3] = FAR, -FAR
        for t in range(512):
            if (bits[i, t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
                row_of[e] = i
                at = t >> 6, (t >> 3) & 7, t & 7
                for axis in range(3):
                    node = 8 * tables.bricks[e, axis] + at[axis]
                    boxes[i, axis] = min(boxes[i, axis], node)
                    boxes[i, axis + 3] = max(boxes[i, axis + 3], node)
        if row_of[e] == i:
            near = reach[tables.levels[e]]
            for axis in range(3):
                near[axis] = min(near[axis], boxes[i, axis])
                near[axis + 3] = max(near[axis + 3], boxes[i, axis + 3])


@njit(cache=True, nogil=True)
def mark_dependents(
    tables, before, after, stored, row_of, bits, boxes, reach, rooted, begin, end, marked
):  # fmt: skip
    """Mark the entries ``begin ... end - 1`` that a layer does not store and whose texels it shows
    otherwise now, among those ``stored`` in the picture.

    A texel is made of nodes one level up; those that are not stored, of nodes further up. Bricks
    are told by boxes of nodes, then texels by the bits. ``rooted[e]`` is what `_is_rooted` says of
    an entry, YES or NO, once it was asked.
    """
    nodes, corner, whole = np.empty(6, np.int64), np.empty(6, np.int64), np.empty(6, np.int64)
    _reach_of_all(reach, whole)
    for e in range(begin, end):
        if marked[e] or not stored[e] or after[e] != ABSENT:
            continue
        if not _is_near(tables, e, reach, whole, nodes):
            continue
        if not _depends(tables, after, row_of, bits, boxes, rooted, e, nodes, corner):
            continue
        tile = tile_above(tables, after, e)
        marked[e] = not (tile <= FIRST_TILE and tile == tile_above(tables, before, e))


@njit(cache=True, nogil=True)
def _reach_of_all(reach, whole):
    """``whole`` (6,) = least and most of the finest nodes that may be made of ``reach``."""
    for axis in range(3):
        whole[axis], whole[axis + 3] = FAR, -FAR
    for level in range(1, len(reach)):
        if reach[level, 0] <= reach[level, 3]:
            for axis in range(3):
                whole[axis] = min(whole[axis], (reach[level, axis] - 1) << level)
                whole[axis + 3] = max(whole[axis + 3], (reach[level, axis + 3] + 1) << level)


@njit(cache=True, nogil=True)
def _is_near(tables, e, reach, whole, nodes):
    level = np.int64(tables.levels[e])
    for axis in range(3):
        nodes[axis] = (8 * tables.bricks[e, axis]) << level
        nodes[axis + 3] = (8 * tables.bricks[e, axis] + 7) << level
    if not _meet(nodes, whole):
        return False
    for axis in range(3):
        nodes[axis] = 8 * tables.bricks[e, axis]
        nodes[axis + 3] = nodes[axis] + 7
    for above in range(level + 1, len(tables.heads)):
        _climb(nodes)
        if _meet(nodes, reach[above]):
            return True
    return False


@njit(cache=True, nogil=True)
def _is_rooted(tables, e):
    """Whether all texels of an entry lie between nodes that exist, at every level above it.

    Where sheets part, the one that is looked up may lack them, and further up is looked on.
    """
    code, nodes = tables.texel_first[e], np.empty(6, np.int64)
    for t in range(512):
        if not needed(tables.masks, e, t):
            continue
        facing = _facing(tables, code)
        code += 1
        _point(tables.bricks, e, t, nodes)
        for level in range(np.int64(tables.levels[e]) + 1, len(tables.heads)):
            _climb(nodes)
            if not _any_exists(tables, level, nodes, facing):
                return False
    return True


@njit(cache=True, nogil=True)
def _any_exists(tables, level, nodes, facing):
    base = _sheet_at(tables, level, nodes, facing)
    found = False
    for c in range(8):
        found |= _node_in_box(tables, level, base, nodes, facing, c)[0] >= 0
    return found


@njit(cache=True, nogil=True, inline="always")
def _sheet_at(tables, level, nodes, facing):
    """The entry around the least corner of a box of nodes that looks along ``facing``."""
    return find_entry(
        tables.heads, tables.pages, tables.groups, tables.sheets, level, nodes[0] >> 3,
        nodes[1] >> 3, nodes[2] >> 3, facing[0], facing[1], facing[2], facing[3],
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _node_in_box(tables, level, base, nodes, facing, c):
    """Of the c-th node of a box of at most 8 (x first): the entry that has it, or NO_ENTRY, and
    which texel of that it is."""
    i, j, k = nodes[0], nodes[1], nodes[2]
    cx, cy, cz = c & 1, (c >> 1) & 1, c >> 2
    t = texel_index(i + cx, j + cy, k + cz)
    if i + cx > nodes[3] or j + cy > nodes[4] or k + cz > nodes[5]:
        return np.int64(NO_ENTRY), t
    e = np.int64(
        corner_of_cell(
            tables.heads, tables.pages, tables.groups, tables.sheets, tables.neighbors, level,
            base, i, j, k, cx, cy, cz, facing[0], facing[1], facing[2], facing[3],
        )
    )  # fmt: skip
    if e < 0 or not needed(tables.masks, e, t):
        return np.int64(NO_ENTRY), t
    return e, t


@njit(cache=True, nogil=True, inline="always")
def _facing(tables, code):
    """The normal of a texel, and its part."""
    nx, ny, nz = decode_normal(tables.texel_normals[code, 0], tables.texel_normals[code, 1])
    part = part_bit(tables.texel_parts, code)
    return np.float64(nx), np.float64(ny), np.float64(nz), part


@njit(cache=True, nogil=True, inline="always")
def _point(bricks, e, t, nodes):
    """Texel t of an entry as a box of nodes."""
    nodes[0] = nodes[3] = 8 * bricks[e, 0] + (t >> 6)
    nodes[1] = nodes[4] = 8 * bricks[e, 1] + ((t >> 3) & 7)
    nodes[2] = nodes[5] = 8 * bricks[e, 2] + (t & 7)


@njit(cache=True, nogil=True)
def _depends(tables, slots, row_of, bits, boxes, rooted, e, nodes, corner):
    """Whether a texel of entry e is made of changed ones: of its brick first, then one by one."""
    level, code = np.int64(tables.levels[e]), tables.texel_first[e]
    if not _is_brick_near(tables, slots, row_of, boxes, rooted, e, nodes):
        return False
    for t in range(512):
        if needed(tables.masks, e, t):
            _point(tables.bricks, e, t, nodes)
            facing = _facing(tables, code)
            code += 1
            if _is_made_of_changed(
                tables, slots, row_of, bits, level, nodes, corner, facing
            ):  # fmt: skip
                return True
    return False


@njit(cache=True, nogil=True)
def _is_brick_near(tables, slots, row_of, boxes, rooted, e, nodes):
    """Whether boxes of changed nodes meet the nodes that texels of an entry may be made of."""
    for axis in range(3):
        nodes[axis] = 8 * tables.bricks[e, axis]
        nodes[axis + 3] = nodes[axis] + 7
    parted = False
    for above in range(np.int64(tables.levels[e]) + 1, len(tables.heads)):
        _climb(nodes)
        complete = True
        for bx in range(nodes[0] >> 3, (nodes[3] >> 3) + 1):
            for by in range(nodes[1] >> 3, (nodes[4] >> 3) + 1):
                for bz in range(nodes[2] >> 3, (nodes[5] >> 3) + 1):
                    code = np.int64(find_code(tables.heads, tables.pages, above, bx, by, bz))
                    parted |= code <= FIRST_GROUP
                    begin, end = sheets_of(tables.groups, code)
                    for entry in range(begin, end):
                        row = row_of[entry]
                        if row >= 0 and _meet(nodes, boxes[row]):
                            return True
                        if slots[entry] == ABSENT:
                            complete = False
        if complete:
            if parted and rooted[e] == UNKNOWN:
                rooted[e] = YES if _is_rooted(tables, e) else NO
            if not parted or rooted[e] == YES:
                return False
    return False


@njit(cache=True, nogil=True)
def _is_made_of_changed(tables, slots, row_of, bits, level, nodes, corner, facing):
    """Whether a node is made of changed ones: of those around it on the first level where any is
    stored and, for each of these that is not, of those around that one further up."""
    top = len(tables.heads)
    missing = 0
    while level + 1 < top:
        level += 1
        _climb(nodes)
        hit, stored, missing = _around(tables, slots, row_of, bits, level, nodes, facing)
        if hit:
            return True
        if stored:
            break
    at = -1
    while missing:
        at += 1
        if not (missing >> at) & 1:
            continue
        missing &= ~(1 << at)
        for axis in range(3):
            corner[axis] = nodes[axis] + ((at >> axis) & 1)
            corner[axis + 3] = corner[axis]
        for above in range(level + 1, top):
            _climb(corner)
            hit, stored, _ = _around(tables, slots, row_of, bits, above, corner, facing)
            if hit:
                return True
            if stored:
                break
    return False


@njit(cache=True, nogil=True)
def _around(tables, slots, row_of, bits, level, nodes, facing):
    """Of a box of at most 8 nodes: whether any is changed, whether any is stored, and which exist
    and are not (bits, x first); on the sheet of the part and the way of
    ``facing``."""
    base = _sheet_at(tables, level, nodes, facing)
    stored, missing = False, 0
    for c in range(8):
        e, t = _node_in_box(tables, level, base, nodes, facing, c)
        if e < 0:
            continue
        if row_of[e] >= 0 and (bits[row_of[e], t >> 6] >> np.uint64(t & 63)) & np.uint64(1):
            return True, stored, missing
        if slots[e] == ABSENT:
            missing |= 1 << c
        else:
            stored = True
    return False, stored, missing


@njit(cache=True, nogil=True, inline="always")
def _climb(nodes):
    """Turn a box of nodes into the box of those a level up that they are made of."""
    for axis in range(3):
        nodes[axis] >>= 1
        nodes[axis + 3] = (nodes[axis + 3] + 1) >> 1


@njit(cache=True, nogil=True, inline="always")
def _meet(a, b):
    apart = False
    for axis in range(3):
        apart |= a[axis] > b[axis + 3] or a[axis + 3] < b[axis]
    return not apart
