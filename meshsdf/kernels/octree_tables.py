"""Find a brick's texels in an octree of textures: one page table for every level.

An entry is one sheet of one brick; entries of all levels are numbered through, finest level first.
Every level has one root page of 16^3 upper pages of 16^3 lower pages of 16^3 bricks. A lower page
holds an entry (>= 0), NO_ENTRY, or FIRST_GROUP - g for a brick of several sheets, which
``groups[g]`` lists.

Functions that are called for every point take the arrays one by one: a tuple of arrays costs a
count of references at every call.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

NO_ENTRY = -1
FIRST_GROUP = -3
SELF = 13  # among the 27 neighbours, which are numbered 9 dx + 3 dy + dz + SELF


class OctreeTables(NamedTuple):
    """What kernels know of an octree; L levels, e entries.

    Attributes
    ----------
    heads : (L, 4) int64
        Coordinate of the first brick that the level's root page covers; the root page.
    pages : (p, 4096) int32
        All pages of all levels; page (or brick) (x, y, z) of 16^3 is at 256 x + 16 y + z.
    groups : (g, 2) int32
        First entry and number of entries of a brick with several sheets.
    bricks : (e, 3) int64
        Brick coordinates in the level of the entry.
    levels : (e,) int32
        The entry's level; 0 is the finest.
    masks : (e, 8) uint64
        Needed texels; bit 8 j + k of word i.
    sheets : (e, 3) float32
        Mean normal of the sheet; zero if it has none.
    neighbors : (e, 27) int32
        Entry of the brick beside, whose normal is nearest; NO_ENTRY if there is none. Where this
        brick has one sheet and that one several, what the page table says of it (FIRST_GROUP - g):
        which is meant depends on the side that the point is on.
    parents : (e,) int32
        Entry of the brick a level up; NO_ENTRY at the top.
    texel_first : (e + 1,) int64
        Where an entry's texels begin in ``texel_normals``.
    texel_normals : (t, 2) int8
        Octahedral code of the surface's mean normal at every needed texel.
    texel : float64
        Spacing of the finest level's nodes, world units.
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
def nearest_sheet(groups, sheets, code, nx, ny, nz):
    """Of a brick's sheets the one that looks most the way of (nx, ny, nz); the first on a tie."""
    group = FIRST_GROUP - code
    best, most = np.int32(NO_ENTRY), -4.0e38
    for s in range(groups[group, 1]):
        entry = groups[group, 0] + s
        dot = sheets[entry, 0] * nx + sheets[entry, 1] * ny + sheets[entry, 2] * nz
        if dot > most:
            best, most = entry, dot
    return best


@njit(cache=True, nogil=True, inline="always")
def find_entry(heads, pages, groups, sheets, level, bx, by, bz, nx, ny, nz):
    """The entry of brick (bx, by, bz) whose sheet looks the way of (nx, ny, nz), or NO_ENTRY."""
    code = find_code(heads, pages, level, bx, by, bz)
    if code <= FIRST_GROUP:
        code = nearest_sheet(groups, sheets, code, nx, ny, nz)
    return code


@njit(cache=True, nogil=True)
def link_entries(tables, begin, end):
    """Fill ``neighbors`` and ``parents`` of the entries ``begin ... end - 1``."""
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    top = len(heads) - 1
    for e in range(begin, end):
        level = tables.levels[e]
        bx, by, bz = tables.bricks[e, 0], tables.bricks[e, 1], tables.bricks[e, 2]
        nx, ny, nz = sheets[e, 0], sheets[e, 1], sheets[e, 2]
        single = find_code(heads, pages, level, bx, by, bz) >= 0
        for n in range(27):
            dx, dy, dz = n // 9 - 1, n // 3 % 3 - 1, n % 3 - 1
            code = find_code(heads, pages, level, bx + dx, by + dy, bz + dz)
            if code <= FIRST_GROUP and not single:
                code = nearest_sheet(groups, sheets, code, nx, ny, nz)
            tables.neighbors[e, n] = code
        tables.neighbors[e, SELF] = e
        tables.parents[e] = NO_ENTRY
        if level < top:
            tables.parents[e] = find_entry(
                heads, pages, groups, sheets, level + 1, bx >> 1, by >> 1, bz >> 1, nx, ny, nz
            )


@njit(cache=True, nogil=True)
def find_entries(tables, level, bricks, normals, found):
    """``found[n]`` = entry of brick n whose sheet looks the way of ``normals[n]``."""
    heads, pages, groups, sheets = tables.heads, tables.pages, tables.groups, tables.sheets
    for n in range(len(bricks)):
        bx, by, bz = bricks[n, 0], bricks[n, 1], bricks[n, 2]
        nx, ny, nz = normals[n, 0], normals[n, 1], normals[n, 2]
        found[n] = find_entry(heads, pages, groups, sheets, level, bx, by, bz, nx, ny, nz)
