"""Find a brick's texels in an octree of textures: one page table for every level.

An entry is one sheet of one brick; entries of all levels are numbered through, finest level first.
Every level has one root page of 16^3 upper pages of 16^3 lower pages of 16^3 bricks. A lower page
holds an entry (>= 0), NO_ENTRY, or FIRST_GROUP - g for a brick of several sheets, which
``groups[g]`` lists.

Sheets that look the same way and need the same texels are divided by the small numbers that the
faces of the surface have: an entry then is of some of these numbers, its parts. Who looks for an
entry says of which part, too, as a bit; ANY_PART if it is not known, or where nothing is divided.

Functions that are called for every point take the arrays one by one: a tuple of arrays costs a
count of references at every call.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

NO_ENTRY = -1
FIRST_GROUP = -3
ANY_PART = -1  # all bits
FIRST_BITS = 2  # column of groups
SELF = 13  # among the 27 neighbours, which are numbered 9 dx + 3 dy + dz + SELF


class OctreeTables(NamedTuple):
    """What kernels know of an octree; L levels, e entries.

    Attributes
    ----------
    heads : (L, 4) int64
        Coordinate of the first brick that the level's root page covers; the root page.
    pages : (p, 4096) int32
        All pages of all levels; page (or brick) (x, y, z) of 16^3 is at 256 x + 16 y + z.
    groups : (g, 2) or (g, 10) int32
        First entry and number of entries of a brick with several sheets; where sheets are divided
        anywhere, then the bits of the parts of each, ANY_PART of those that are not.
    bricks : (e, 3) int64
        Brick coordinates in the level of the entry.
    levels : (e,) int32
        The entry's level; 0 is the finest.
    masks : (e, 8) uint64
        Needed texels; bit 8 j + k of word i.
    sheets : (e, 3) float32
        Mean normal of the sheet, of all parts together; zero if it has none.
    neighbors : (e, 27) int32
        Entry of the brick beside, whose normal is nearest; NO_ENTRY if there is none. Where this
        brick has one sheet and that one several, or sheets are divided, what the page table says
        of it (FIRST_GROUP - g): which is meant depends on the side that the point is on.
    parents : (e,) int32
        Entry of the brick a level up; NO_ENTRY at the top.
    texel_first : (e + 1,) int64
        Where an entry's texels begin in ``texel_normals``.
    texel_normals : (t, 2) int8
        Octahedral code of the surface's mean normal at every needed texel.
    texel : float64
        Spacing of the finest level's nodes, world units.
    texel_parts : (t,) or (0,) uint8
        Number of the face next to every needed texel; empty if no sheet is divided.
    """

    heads: np.ndarray
    pages: np.ndarray
    groups: np.ndarray
    bricks: np.ndarray
    levels: np.ndarray
    masks: np.ndarray
    sheets: np.ndarray
    neighbors: np.ndarray
    parents: np.ndarray
    texel_first: np.ndarray
    texel_normals: np.ndarray
    texel: float
    texel_parts: np.ndarray


@njit(cache=True, nogil=True, inline="always")
def part_bit(texel_parts, code):
    """The part that a texel is of, as a bit."""
    if len(texel_parts) == 0:
        return np.int64(ANY_PART)
    return np.int64(1) << np.int64(texel_parts[code])


@njit(cache=True, nogil=True, inline="always")
def find_code(heads, pages, level, bx, by, bz):
    """What the page table says of brick (bx, by, bz) of a level."""
    x, y, z = bx - heads[level, 0], by - heads[level, 1], bz - heads[level, 2]
    if (x | y | z) & ~4095:
        return np.int32(NO_ENTRY)
    page = pages[heads[level, 3], ((x >> 8) << 8) + ((y >> 8) << 4) + (z >> 8)]
    if page < 0:
        return np.int32(NO_ENTRY)
    page = pages[page, (((x >> 4) & 15) << 8) + (((y >> 4) & 15) << 4) + ((z >> 4) & 15)]
    if page < 0:
        return np.int32(NO_ENTRY)
    return pages[page, ((x & 15) << 8) + ((y & 15) << 4) + (z & 15)]


@njit(cache=True, nogil=True, inline="always")
def sheets_of(groups, code):
    """The first of a brick's entries and the one after the last, by its `find_code`."""
    begin, end = np.int64(code), np.int64(code) + 1
    if code == NO_ENTRY:
        begin, end = np.int64(0), np.int64(0)
    elif code <= FIRST_GROUP:
        begin = np.int64(groups[FIRST_GROUP - code, 0])
        end = begin + np.int64(groups[FIRST_GROUP - code, 1])
    return begin, end


@njit(cache=True, nogil=True)
def nearest_sheet(groups, sheets, code, nx, ny, nz, part):
    """Of a brick's sheets the one that looks most the way of (nx, ny, nz); the first on a tie.

    Of those that are of the part, if there are any.
    """
    group = FIRST_GROUP - code
    if part != ANY_PART and groups.shape[1] > FIRST_BITS:
        best = _nearest_of(groups, sheets, group, nx, ny, nz, part)
        if best != NO_ENTRY:
            return best
    best, most = np.int32(NO_ENTRY), -4.0e38
    for s in range(groups[group, 1]):
        entry = groups[group, 0] + s
        dot = sheets[entry, 0] * nx + sheets[entry, 1] * ny + sheets[entry, 2] * nz
        if dot > most:
            best, most = entry, dot
    return best


@njit(cache=True, nogil=True)
def _nearest_of(groups, sheets, group, nx, ny, nz, part):
    """The nearest sheet among those of a part, or NO_ENTRY."""
    best, most = np.int32(NO_ENTRY), -4.0e38
    for s in range(groups[group, 1]):
        entry = groups[group, 0] + s
        if groups[group, FIRST_BITS + s] & part:
            dot = sheets[entry, 0] * nx + sheets[entry, 1] * ny + sheets[entry, 2] * nz
            if dot > most:
                best, most = entry, dot
    return best


@njit(cache=True, nogil=True, inline="always")
def find_entry(heads, pages, groups, sheets, level, bx, by, bz, nx, ny, nz, part):
    """The entry of brick (bx, by, bz) whose sheet looks the way of (nx, ny, nz) and is of the part,
    or NO_ENTRY."""
    code = find_code(heads, pages, level, bx, by, bz)
    if code <= FIRST_GROUP:
        code = nearest_sheet(groups, sheets, code, nx, ny, nz, part)
    return code


@njit(cache=True, nogil=True)
def is_divided(groups, code):
    """Whether some sheet of a brick of several is divided."""
    if groups.shape[1] > FIRST_BITS:
        for s in range(groups[FIRST_GROUP - code, 1]):
            if groups[FIRST_GROUP - code, FIRST_BITS + s] != ANY_PART:
                return True
    return False


@njit(cache=True, nogil=True)
def parts_of(groups, code, entry):
    """The bits of the parts of an entry of a brick; ANY_PART unless it is divided."""
    if code > FIRST_GROUP or groups.shape[1] == FIRST_BITS:
        return np.int64(ANY_PART)
    group = FIRST_GROUP - code
    return np.int64(groups[group, FIRST_BITS + entry - groups[group, 0]])


@njit(cache=True, nogil=True)
def _link(groups, sheets, own, code, is_single, nx, ny, nz):
    """What an entry of some parts (bits) knows of the brick beside it, which ``code`` names."""
    if code > FIRST_GROUP:
        return np.int32(code)
    if not is_divided(groups, code):
        if is_single:
            return np.int32(code)
        return nearest_sheet(groups, sheets, code, nx, ny, nz, ANY_PART)
    if own == ANY_PART:
        return np.int32(code)
    # One sheet there if all parts of this one lead to it
    found = np.int32(NO_ENTRY)
    for number in range(32):
        part = np.int64(1) << number
        if own & part:
            entry = nearest_sheet(groups, sheets, code, nx, ny, nz, part)
            if found != NO_ENTRY and entry != found:
                return np.int32(code)
            found = entry
    return found


@njit(cache=True, nogil=True)
def link_entries(tables, begin, end):
    """Fill ``neighbors`` and ``parents`` of the entries ``begin ... end - 1``."""
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    top = len(heads) - 1
    for e in range(begin, end):
        level = tables.levels[e]
        bx, by, bz = tables.bricks[e, 0], tables.bricks[e, 1], tables.bricks[e, 2]
        nx, ny, nz = sheets[e, 0], sheets[e, 1], sheets[e, 2]
        here = find_code(heads, pages, level, bx, by, bz)
        own = parts_of(groups, here, np.int64(e))
        for n in range(27):
            dx, dy, dz = n // 9 - 1, n // 3 % 3 - 1, n % 3 - 1
            code = find_code(heads, pages, level, bx + dx, by + dy, bz + dz)
            tables.neighbors[e, n] = _link(groups, sheets, own, code, here >= 0, nx, ny, nz)
        tables.neighbors[e, SELF] = e
        tables.parents[e] = NO_ENTRY
        if level < top:
            tables.parents[e] = find_entry(
                heads, pages, groups, sheets, level + 1, bx >> 1, by >> 1, bz >> 1, nx, ny, nz, own
            )


@njit(cache=True, nogil=True)
def find_entries(tables, level, bricks, normals, parts, found):
    """``found[n]`` = entry of brick n whose sheet looks the way of ``normals[n]`` and is of the
    part ``parts[n]``, a bit."""
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    for n in range(len(bricks)):
        bx, by, bz = bricks[n, 0], bricks[n, 1], bricks[n, 2]
        nx, ny, nz = normals[n, 0], normals[n, 1], normals[n, 2]
        found[n] = find_entry(heads, pages, groups, sheets, level, bx, by, bz, nx, ny, nz, parts[n])
