"""What an octree shows at a block of points: the same as `level_value` says of each, but faster.

A point's way to its texels is a chain of dependent reads. Taken step by step for many points, the
chains of several overlap in the processor, and each step's branches are easy to foresee: first the
bricks of all points are found, then the cells that lie in one brick or across one face are blended,
then those across more, and what is left (tiles beside bricks, missing corners, borders of levels)
is left to `level_value`.
"""

import math

import numpy as np
from numba import njit

from .octree_tables import SELF, find_code, nearest_sheet
from .texel_codes import decoded
from .texture_lookup import ABSENT, FIRST_TILE, blend, blended, level_value

BLOCK = 256
COLUMNS = 9
NODE, BASE, SLOT, STEP_X, STEP_Y, STEP_Z, PLAIN, ACROSS, OTHER = range(COLUMNS)
ROW, PAIR, COLUMN = np.uint64(0x303), np.uint64(0x3), np.uint64(0x101)


@njit(cache=True, nogil=True)
def block_values(
    heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, count, levels, places,
    normals, parts, numbers, between, out,
):  # fmt: skip
    """``out[q]`` (count, 4) = F_levels[q] at ``places[q]``, in nodes of that level.

    ``normals`` (count, 3), ``parts`` (count,). Scratch: numbers (BLOCK, COLUMNS) int64, between
    (BLOCK, 3) float32. Levels and places may change to those of the coarser level that answers.
    """
    n_plain = n_across = n_other = 0
    code, at_level, at_x, at_y, at_z = np.int32(-1), np.int64(-1), 0, 0, 0
    for q in range(count):
        level = levels[q]
        x, y, z = places[q, 0], places[q, 1], places[q, 2]
        while True:
            i, j, k = math.floor(x), math.floor(y), math.floor(z)
            bx, by, bz = i >> 3, j >> 3, k >> 3
            if (bx ^ at_x) | (by ^ at_y) | (bz ^ at_z) | (level ^ at_level):
                code = find_code(heads, pages, level, bx, by, bz)
                at_x, at_y, at_z, at_level = bx, by, bz, level
            base = code
            if base < -1:
                base = nearest_sheet(
                    groups, sheets, base, normals[q, 0], normals[q, 1], normals[q, 2], parts[q]
                )
            slot = np.int32(ABSENT)
            if base >= 0:
                slot = slots[base]
            n_axes = ((i & 7) == 7) + ((j & 7) == 7) + ((k & 7) == 7)
            if base < 0 or slot != ABSENT or n_axes:
                break
            level += 1
            x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
        levels[q] = level
        places[q, 0], places[q, 1], places[q, 2] = x, y, z
        between[q, 0], between[q, 1] = np.float32(x - i), np.float32(y - j)
        between[q, 2] = np.float32(z - k)
        numbers[q, NODE] = ((i & 7) << 6) + ((j & 7) << 3) + (k & 7)
        numbers[q, BASE], numbers[q, SLOT] = base, slot
        numbers[n_plain, PLAIN] = numbers[n_across, ACROSS] = numbers[n_other, OTHER] = q
        n_plain += base >= 0 and n_axes < 2
        n_across += base >= 0 and n_axes > 1
        n_other += base < 0
    n_plain, n_other = _find_steps(
        neighbors, masks, slots, tiles, kind, n_plain, n_other, numbers, out
    )
    _blend_plain(pool, kind, n_plain, numbers, between, out)
    n_other = _blend_across(
        neighbors, masks, slots, pool, kind, n_across, n_other, numbers, between, out
    )
    for n in range(n_other):
        q = numbers[n, OTHER]
        out[q, 0], out[q, 1], out[q, 2], out[q, 3] = level_value(
            heads, pages, groups, sheets, neighbors, masks, slots, pool, tiles, kind, levels[q],
            places[q, 0], places[q, 1], places[q, 2], normals[q, 0], normals[q, 1], normals[q, 2],
            parts[q],
        )  # fmt: skip


@njit(cache=True, nogil=True)
def _find_steps(neighbors, masks, slots, tiles, kind, n_plain, n_other, numbers, out):
    """How far the corners of cells in one brick, or across one face, are apart in the pool.

    Keeps those all of whose corners are stored in bricks, and adds the rest to the others; cells
    of one tile are done. Returns how many are kept, and how many the others are.
    """
    kept = 0
    for n in range(n_plain):
        q = numbers[n, PLAIN]
        t, base, slot = numbers[q, NODE], numbers[q, BASE], numbers[q, SLOT]
        numbers[q, STEP_X], numbers[q, STEP_Y], numbers[q, STEP_Z] = 64, 8, 1
        # Masks of the corners on both sides of the face, if the cell is across one
        here, there, beside = ROW, np.uint64(0), base
        word = t >> 6
        low = masks[base, word]
        if word == 7:
            beside = np.int64(neighbors[base, SELF + 9])
            there = ROW
        else:
            low &= masks[base, word + 1]
        shift = np.uint64(t & 63)
        turn = shift
        step = STEP_X
        if (t >> 3) & 7 == 7:
            beside, here, there = np.int64(neighbors[base, SELF + 3]), PAIR, PAIR
            turn, step = shift & np.uint64(7), STEP_Y
        elif t & 7 == 7:
            beside, here, there = np.int64(neighbors[base, SELF + 1]), COLUMN, COLUMN
            turn, step = shift & np.uint64(56), STEP_Z
        exist = (low >> shift) & here == here
        other = slot
        if there and beside >= 0:
            other = np.int64(slots[beside])
            high = masks[beside, 0] if step == STEP_X else masks[beside, word]
            if step != STEP_X:
                high &= masks[beside, word + 1]
            exist &= (high >> turn) & there == there
            numbers[q, step] += 512 * (other - slot - (step == STEP_X))
            numbers[q, step] -= 64 * (step == STEP_Y) + 8 * (step == STEP_Z)
        if slot >= 0 and other >= 0 and beside >= 0 and exist:
            numbers[kept, PLAIN] = q
            kept += 1
        elif slot <= FIRST_TILE and slot == other and beside >= 0 and (exist or not there):
            out[q, 0], out[q, 1], out[q, 2], out[q, 3] = decoded(
                kind, np.int64(tiles[FIRST_TILE - slot])
            )
        else:
            numbers[n_other, OTHER] = q
            n_other += 1
    return kept, n_other


@njit(cache=True, nogil=True)
def _blend_plain(pool, kind, n_plain, numbers, between, out):
    """Blend the cells in one brick, or across one face, whose corners are all in bricks."""
    # A loop that only fetches has many reads under way at once
    texels, corners = pool.reshape(pool.size), np.empty((BLOCK, 8), pool.dtype)
    for n in range(n_plain):
        q = numbers[n, PLAIN]
        t = 512 * numbers[q, SLOT] + numbers[q, NODE]
        dx, dy, dz = numbers[q, STEP_X], numbers[q, STEP_Y], numbers[q, STEP_Z]
        corners[n, 0], corners[n, 1] = texels[t], texels[t + dz]
        corners[n, 2], corners[n, 3] = texels[t + dy], texels[t + dy + dz]
        corners[n, 4], corners[n, 5] = texels[t + dx], texels[t + dx + dz]
        corners[n, 6], corners[n, 7] = texels[t + dx + dy], texels[t + dx + dy + dz]
    for n in range(n_plain):
        q = numbers[n, PLAIN]
        out[q, 0], out[q, 1], out[q, 2], out[q, 3] = blend(
            kind, corners[n, 0], corners[n, 1], corners[n, 2], corners[n, 3], corners[n, 4],
            corners[n, 5], corners[n, 6], corners[n, 7], between[q, 0], between[q, 1],
            between[q, 2],
        )  # fmt: skip


@njit(cache=True, nogil=True)
def _blend_across(neighbors, masks, slots, pool, kind, n_across, n_other, numbers, between, out):
    """Blend the cells across edges and corners of bricks, all of whose corners are in bricks."""
    for n in range(n_across):
        q = numbers[n, ACROSS]
        t, base, s0 = numbers[q, NODE], numbers[q, BASE], numbers[q, SLOT]
        # The bricks of the corners are this one but along the axes that cross
        dx = 9 if t >> 6 == 7 else 0
        dy = 3 if (t >> 3) & 7 == 7 else 0
        dz = 1 if t & 7 == 7 else 0
        e1, e2 = neighbors[base, SELF + dz], neighbors[base, SELF + dy]
        e3, e4 = neighbors[base, SELF + dy + dz], neighbors[base, SELF + dx]
        e5, e6 = neighbors[base, SELF + dx + dz], neighbors[base, SELF + dx + dy]
        e7 = neighbors[base, SELF + dx + dy + dz]
        if (e1 | e2 | e3 | e4 | e5 | e6 | e7) < 0:
            numbers[n_other, OTHER] = q
            n_other += 1
            continue
        s1, s2, s3, s4 = slots[e1], slots[e2], slots[e3], slots[e4]
        s5, s6, s7 = slots[e5], slots[e6], slots[e7]
        x, ux = t >> 6, ((t >> 6) + 1) & 7
        y, uy = t & 56, (t + 8) & 56
        z, uz = t & 7, (t + 1) & 7
        exist = (
            (masks[base, x] >> np.uint64(y | z)) & (masks[e1, x] >> np.uint64(y | uz))
            & (masks[e2, x] >> np.uint64(uy | z)) & (masks[e3, x] >> np.uint64(uy | uz))
            & (masks[e4, ux] >> np.uint64(y | z)) & (masks[e5, ux] >> np.uint64(y | uz))
            & (masks[e6, ux] >> np.uint64(uy | z)) & (masks[e7, ux] >> np.uint64(uy | uz))
            & np.uint64(1)
        )  # fmt: skip
        if not exist or (s0 | s1 | s2 | s3 | s4 | s5 | s6 | s7) < 0:
            numbers[n_other, OTHER] = q
            n_other += 1
            continue
        x, ux = x << 6, ux << 6
        out[q, 0], out[q, 1], out[q, 2], out[q, 3] = blended(
            kind, pool[s0, x | y | z], pool[s1, x | y | uz], pool[s2, x | uy | z],
            pool[s3, x | uy | uz], pool[s4, ux | y | z], pool[s5, ux | y | uz],
            pool[s6, ux | uy | z], pool[s7, ux | uy | uz], between[q, 0], between[q, 1],
            between[q, 2],
        )  # fmt: skip
    return n_other
