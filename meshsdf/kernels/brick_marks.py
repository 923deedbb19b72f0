"""Find the bricks near a mesh: conservative marks, then slots in lexicographic order.

A cell (a brick of 8 nodes, or what a page covers: 128, 2048) is marked when the box of its nodes,
grown by the reach, meets the triangle's box, its plane and the three planes through its edges; no
cell that holds a node within reach of the mesh is missed.
"""

import numpy as np
from numba import njit

from .brick_lookup import find_page
from .clip import clip_line, triangle_range

FEW_CELLS = 27
LOWER, UPPER = 7, 11
"""log2 of the nodes along one side of what a lower and an upper page cover."""


@njit(cache=True, nogil=True)
def _slab_of(x, edges):
    """The slab [edges[s], edges[s + 1]) that holds x, or the nearest; slabs are nearly equal."""
    n_slabs = len(edges) - 1
    guess = np.int64((x - edges[0]) * n_slabs / (edges[n_slabs] - edges[0]))
    s = min(max(guess, 0), n_slabs - 1)
    while s > 0 and x < edges[s]:
        s -= 1
    while s < n_slabs - 1 and x >= edges[s + 1]:
        s += 1
    return s


@njit(cache=True, nogil=True)
def slab_ranges(points, corners, reach, edges, first, last):
    """``first[n], last[n]`` = slabs at the ends of the x extent of ``corners[n]``, grown by reach.

    Slab s is [edges[s], edges[s + 1]). The ranges are int16 (n,): they are the largest arrays of a
    conversion when faces are many.
    """
    for n in range(len(corners)):
        x0, x1 = np.inf, -np.inf
        for c in range(corners.shape[1]):
            x = points[corners[n, c], 0]
            x0, x1 = min(x0, x), max(x1, x)
        first[n], last[n] = _slab_of(x0 - reach, edges), _slab_of(x1 + reach, edges)


@njit(cache=True, nogil=True)
def bin_by_slab(first, last, start, items):
    """CSR lists of the items whose range of slabs holds slab s.

    Two passes: with ``items`` empty it only counts into ``start`` (n_slabs + 1,); call again with
    ``items`` of length ``start[-1]`` to fill.
    """
    n_slabs = len(start) - 1
    fill = len(items) > 0
    place = start.copy()
    if not fill:
        start[:] = 0
    for item in range(len(first)):
        for s in range(first[item], last[item] + 1):
            if fill:
                items[place[s]] = item
                place[s] += 1
            else:
                start[s + 1] += 1
    if not fill:
        for s in range(n_slabs):
            start[s + 1] += start[s]


@njit(cache=True, nogil=True)
def _cells_within(a, b, c, reach, shift):
    """The first and the last cell with a node within ``reach`` of three coordinates' range."""
    first = np.int64(np.ceil(min(a, b, c) - reach - 1e-6)) >> shift
    last = np.int64(np.floor(max(a, b, c) + reach + 1e-6)) >> shift
    return max(first, 0), last


@njit(cache=True, nogil=True)
def _within(points, p, box):
    """Tell whether point p lies in a box; a box of NaN holds none."""
    x, y, z = points[p, 0], points[p, 1], points[p, 2]
    return (
        box[0, 0] <= x <= box[1, 0] and box[0, 1] <= y <= box[1, 1] and box[0, 2] <= z <= box[1, 2]
    )


@njit(cache=True, nogil=True)
def _page_of(root, pages, shift, x, y, z):
    """The page that has the entry of a cell, or a code."""
    px, py, pz = x >> 4, y >> 4, z >> 4
    if shift == LOWER:
        return root[px, py, pz] if py < root.shape[1] and pz < root.shape[2] else np.int32(-1)
    return find_page(root, pages, px, py, pz)


@njit(cache=True, nogil=True)
def _is_marked(root, pages, shift, x, y, z):
    """Tell whether a cell is marked, or lies where nothing is to be marked."""
    if shift == UPPER:
        return y >= root.shape[1] or z >= root.shape[2] or root[x, y, z] == 0
    page = _page_of(root, pages, shift, x, y, z)
    return page < 0 or pages[page, x & 15, y & 15, z & 15] == 0


@njit(cache=True, nogil=True)
def _are_marked(root, pages, shift, x0, x1, y0, y1, z0, z1):
    """Tell whether a few cells, a box of them, are all marked."""
    if (x1 - x0 + 1) * (y1 - y0 + 1) * (z1 - z0 + 1) > FEW_CELLS:
        return False
    for x in range(x0, x1 + 1):
        for y in range(y0, y1 + 1):
            for z in range(z0, z1 + 1):
                if not _is_marked(root, pages, shift, x, y, z):
                    return False
    return True


@njit(cache=True, nogil=True)
def mark_cells(points, faces, ids, reach, shift, cell0, cell1, root, pages):
    """Mark every cell with x coordinate in [cell0, cell1) that is near one of the faces ``ids``.

    Cells have ``2**shift`` nodes a side: with shift `UPPER` the entries of ``root`` are marked (0),
    with `LOWER` those of the upper pages, with 3 those of the lower ones. Coordinates are local
    to the root table.
    """
    side = 1 << shift
    half = 0.5 * (side - 1)
    done = np.full((2, 3), np.nan)  # corners of a box in which all faces mark marked cells
    for n in range(len(ids)):
        p, q, r = faces[ids[n], 0], faces[ids[n], 1], faces[ids[n], 2]
        if _within(points, p, done) and _within(points, q, done) and _within(points, r, done):
            continue
        a, b, c = points[p], points[q], points[r]
        x0, x1 = _cells_within(a[0], b[0], c[0], reach, shift)
        y0, y1 = _cells_within(a[1], b[1], c[1], reach, shift)
        z0, z1 = _cells_within(a[2], b[2], c[2], reach, shift)
        x0, x1 = max(cell0, x0), min(cell1 - 1, x1)
        if _are_marked(root, pages, shift, x0, x1, y0, y1, z0, z1):
            # As by far most small faces: marked by their neighbours
            low, high = reach + 2e-6 - 1.0, side - reach - 2e-6
            done[0, 0] = x0 * side + low if x0 > cell0 else -np.inf
            done[1, 0] = x1 * side + high if x1 < cell1 - 1 else np.inf
            done[0, 1], done[1, 1] = y0 * side + low, y1 * side + high
            done[0, 2], done[1, 2] = z0 * side + low, z1 * side + high
            continue
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        wx, wy, wz = vx - ux, vy - uy, vz - uz
        longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
        longest = max(longest, wx * wx + wy * wy + wz * wz)
        area = np.sqrt(nx * nx + ny * ny + nz * nz)
        flat = area > 1e-5 * longest  # else the normal is not worth testing
        if flat:
            nx, ny, nz = nx / area, ny / area, nz / area
        grown = reach + half + 1e-6
        z_min, z_max = min(a[2], b[2], c[2]) - grown, max(a[2], b[2], c[2]) + grown
        # Centre (cx, cy, cz) of a cell may lie this far from the plane of the face
        thick = reach + half * (abs(nx) + abs(ny) + abs(nz)) + 1e-6
        for x in range(x0, x1 + 1):
            cx = x * side + half
            y_min, y_max = triangle_range(
                a[0], a[1], b[0], b[1], c[0], c[1], cx - grown, cx + grown
            )
            if y_min > y_max:
                continue
            y0 = max(0, np.int64(np.floor((y_min - grown - half) / side)))
            y1 = np.int64(np.floor((y_max + grown) / side))
            for y in range(y0, y1 + 1):
                cy = y * side + half
                low, high = z_min, z_max
                if flat:
                    plane = nx * (cx - a[0]) + ny * (cy - a[1]) - nz * a[2]
                    low, high = clip_line(low, high, plane, nz, thick)
                    low, high = clip_line(low, high, -plane, -nz, thick)
                z0 = max(0, np.int64(np.floor((low - half) / side)))
                z1 = np.int64(np.floor((high - half) / side)) + 1 if high >= low else -1
                for z in range(z0, z1 + 1):
                    cz = z * side + half
                    if cz < low or cz > high:
                        continue
                    if _is_marked(root, pages, shift, x, y, z):
                        continue
                    if shift == UPPER:
                        root[x, y, z] = 0
                    else:
                        page = _page_of(root, pages, shift, x, y, z)
                        pages[page, x & 15, y & 15, z & 15] = 0


@njit(cache=True, nogil=True)
def list_bricks(root, pages, x, slot, coordinates):
    """Number the marked bricks of column x in lexicographic order, from ``slot`` on.

    Writes their local coordinates when ``coordinates`` is not empty; returns how many there are.
    """
    n = 0
    for y in range(root.shape[1] * 256):
        for pz in range(root.shape[2] * 16):
            page = find_page(root, pages, x >> 4, y >> 4, pz)
            if page < 0:
                continue
            for z in range(16):
                if pages[page, x & 15, y & 15, z] >= 0:
                    if len(coordinates) > 0:
                        pages[page, x & 15, y & 15, z] = slot + n
                        c = coordinates[slot + n]
                        c[0], c[1], c[2] = x, y, 16 * pz + z
                    n += 1
    return n
