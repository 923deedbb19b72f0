"""Distances of the nodes near a mesh, feature by feature.

The closest point of a node lies inside a face, inside an edge, or at a vertex, and then the node
lies in that feature's normal region: the prism over the face, the wedge around the edge, the cone
at the vertex (Mauch 2003, "Efficient algorithms for solving static Hamilton-Jacobi equations",
ch. 4). Each region, cut at the reach, is scanned along lattice lines: its half-spaces clip the
line to an interval, and only the nodes in it are tested. The regions of a surface hardly overlap,
so the work is about one test per node of the band. The conditions are necessary for any triangle
soup: every face at an edge, and every edge at a vertex, adds its own half-space.

Exactness: a region is widened by a slack that covers the rounding of its planes, so the closest
feature of a node is never missed (flat edges have no region and are left out, see `folds`); edge
and vertex tests measure the true distance wherever they are applied, and a face is measured by its
plane at most `FACE_SLACK` (or the rounding of its plane) outside its prism. Faces thinner than
`SLIVER` have no trustworthy plane: they are measured by their closest point in a capsule around
their longest edge, and impose nothing on their edges.

Lengths are in voxels; ``squared`` (b, 512) float64 and ``nearest`` (b, 512) int32 hold the slab's
bricks from slot ``slot0`` on. Ties go to the lower face, so the order of work does not matter.
"""

import numpy as np
from numba import njit

from .brick_lookup import find_brick
from .clip import add_half_space, clip_row, clip_rows, clip_segment, triangle_range
from .folds import FACE_SLACK, SLIVER
from .point_triangle import closest_on_triangle

SLACK = 1e-6  # voxels; generous, since edges and vertices measure the true distance
MAX_FACES = 16  # half-spaces used per edge or vertex; leaving some out only widens the region
SMALL = 4.0  # voxels; shorter features are bounded by their boxes along a line


@njit(cache=True, nogil=True)
def scan_faces(points, faces, ids, reach, x0, x1, root, pages, slot0, squared, nearest):
    """Scan the prisms of the faces ``ids`` over the nodes with x in [x0, x1)."""
    planes = np.empty((5, 4))
    for n in range(len(ids)):
        f = ids[n]
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        nx, ny, nz, area, longest = _normal(a, b, c)
        if area <= SLIVER * longest * longest:
            _scan_sliver(a, b, c, f, reach, x0, x1, root, pages, slot0, squared, nearest)
            continue
        slack = FACE_SLACK + 1e-15 * (longest + reach) * longest * longest / area
        # The prism, relative to corner a: inside its three edges, within reach of its plane
        k = _add_edge_plane(planes, 0, a, b, a, nx, ny, nz, slack)
        k = _add_edge_plane(planes, k, b, c, a, nx, ny, nz, slack)
        k = _add_edge_plane(planes, k, c, a, a, nx, ny, nz, slack)
        k = add_half_space(planes, k, nx, ny, nz, reach)
        k = add_half_space(planes, k, -nx, -ny, -nz, reach)
        grow_x, grow_y = reach * abs(nx) + slack, reach * abs(ny) + slack
        grow_z = reach * abs(nz) + slack
        x_min, x_max = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
        y_min, y_max = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
        z_min = min(a[2], b[2], c[2]) - grow_z - a[2]
        z_max = max(a[2], b[2], c[2]) + grow_z - a[2]
        small = longest < SMALL and abs(nx) > 0.05
        lean = ny / nx if small else 0.0
        x_first = max(x0, np.int64(np.ceil(x_min - grow_x)))
        x_last = min(x1 - 1, np.int64(np.floor(x_max + grow_x)))
        for x in range(x_first, x_last + 1):
            if small:
                # The prism leans with the normal: y = y of a corner + lean * (x - its x)
                y0, y1 = lean * (x - x_max), lean * (x - x_min)
                y_low = max(y_min + min(y0, y1), y_min - grow_y) - slack
                y_high = min(y_max + max(y0, y1), y_max + grow_y) + slack
            else:
                y_low, y_high = triangle_range(
                    a[0], a[1], b[0], b[1], c[0], c[1], x - grow_x, x + grow_x
                )
                y_low, y_high = y_low - grow_y, y_high + grow_y
            if y_low > y_high:
                continue
            for y in range(np.int64(np.ceil(y_low)), np.int64(np.floor(y_high)) + 1):
                low, high = clip_row(planes, k, x - a[0], y - a[1], z_min, z_max)
                if low > high:
                    continue
                slot = np.int32(-1)
                brick = np.int64(-1)
                node = ((x & 7) << 6) | ((y & 7) << 3)
                plane = nx * (x - a[0]) + ny * (y - a[1])
                z_last = np.int64(np.floor(high + a[2]))
                for z in range(np.int64(np.ceil(low + a[2])), z_last + 1):
                    if z >> 3 != brick:
                        brick = z >> 3
                        slot = find_brick(root, pages, x >> 3, y >> 3, brick)
                    if slot >= 0:
                        height = plane + nz * (z - a[2])
                        _keep(squared, nearest, slot - slot0, node | (z & 7), height * height, f)


@njit(cache=True, nogil=True)
def scan_edges(
    points, faces, ends, first, order, ids, reach, x0, x1, root, pages, slot0, squared, nearest
):
    """Scan the wedges of the edges ``ids``; edge e has half-edges ``order[first[e]:...]``."""
    inward = np.empty((MAX_FACES, 3))
    planes = np.empty((MAX_FACES + 2, 4))
    hull = np.empty(6)
    for n in range(len(ids)):
        e = ids[n]
        a, b = points[ends[e, 0]], points[ends[e, 1]]
        lx, ly, lz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        length = np.sqrt(lx * lx + ly * ly + lz * lz)
        if length == 0.0:
            continue  # its ends differ by less than rounding, and are scanned as vertices
        ux, uy, uz = lx / length, ly / length, lz / length
        n_in, f = _into_faces(points, faces, order, first[e], first[e + 1], a, ux, uy, uz, inward)
        n_faces = first[e + 1] - first[e]
        _wedge_hull(inward, n_in == 2 and n_faces == 2, ux, uy, uz, reach, hull)
        # The wedge, relative to end a: outside its faces, between its ends
        k = 0
        for i in range(n_in):
            k = add_half_space(planes, k, inward[i, 0], inward[i, 1], inward[i, 2], SLACK)
        k = add_half_space(planes, k, ux, uy, uz, length + SLACK)
        k = add_half_space(planes, k, -ux, -uy, -uz, SLACK)
        small = length < SMALL
        x_first = max(x0, np.int64(np.ceil(min(a[0], b[0]) + hull[0])))
        x_last = min(x1 - 1, np.int64(np.floor(max(a[0], b[0]) + hull[1])))
        t0, t1, s0, s1 = 0.0, 1.0, 0.0, 1.0
        for x in range(x_first, x_last + 1):
            if not small:
                t0, t1 = clip_segment(0.0, 1.0, a[0], lx, x - hull[1], x - hull[0])
                if t0 > t1:
                    continue
            y0, y1 = a[1] + t0 * ly, a[1] + t1 * ly
            y_first = np.int64(np.ceil(min(y0, y1) + hull[2]))
            y_last = np.int64(np.floor(max(y0, y1) + hull[3]))
            for y in range(y_first, y_last + 1):
                if not small:
                    s0, s1 = clip_segment(t0, t1, a[1], ly, y - hull[3], y - hull[2])
                    if s0 > s1:
                        continue
                z0, z1 = s0 * lz, s1 * lz
                wx, wy = x - a[0], y - a[1]
                low, high = min(z0, z1) + hull[4], max(z0, z1) + hull[5]
                low, high = clip_row(planes, k, wx, wy, low, high)
                if low > high:
                    continue
                slot = np.int32(-1)
                brick = np.int64(-1)
                node = ((x & 7) << 6) | ((y & 7) << 3)
                z_last = np.int64(np.floor(high + a[2]))
                for z in range(np.int64(np.ceil(low + a[2])), z_last + 1):
                    if z >> 3 != brick:
                        brick = z >> 3
                        slot = find_brick(root, pages, x >> 3, y >> 3, brick)
                    if slot >= 0:
                        wz = z - a[2]
                        t = min(length, max(0.0, ux * wx + uy * wy + uz * wz))
                        dx, dy, dz = wx - t * ux, wy - t * uy, wz - t * uz
                        distance = dx * dx + dy * dy + dz * dz
                        _keep(squared, nearest, slot - slot0, node | (z & 7), distance, f)


@njit(cache=True, nogil=True)
def scan_vertices(
    points,
    ends,
    first,
    order,
    start,
    edges,
    ids,
    reach,
    x0,
    x1,
    root,
    pages,
    slot0,
    squared,
    nearest,
):
    """Scan the cones of the vertices ``ids``; vertex v touches ``edges[start[v]:start[v + 1]]``."""
    planes = np.empty((MAX_FACES, 4))
    lows, highs = np.empty(8), np.empty(8)
    for n in range(len(ids)):
        v = ids[n]
        p = points[v]
        f = order[first[edges[start[v]]]] // 3
        k = 0
        for i in range(start[v], start[v + 1]):
            e = edges[i]
            f = min(f, order[first[e]] // 3)
            if k == MAX_FACES:
                continue
            q = points[ends[e, 0] + ends[e, 1] - v]
            dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
            length = np.sqrt(dx * dx + dy * dy + dz * dz)
            if length == 0.0:
                continue
            k = add_half_space(planes, k, dx / length, dy / length, dz / length, SLACK)
        x_first = max(x0, np.int64(np.ceil(p[0] - reach)))
        x_last = min(x1 - 1, np.int64(np.floor(p[0] + reach)))
        for x in range(x_first, x_last + 1):
            wx = x - p[0]
            disc = np.sqrt(max(0.0, reach * reach - wx * wx))
            y_last = np.int64(np.floor(p[1] + disc))
            for y_first in range(np.int64(np.ceil(p[1] - disc)), y_last + 1, 8):
                lows[:] = -reach
                highs[:] = reach
                clip_rows(planes, k, wx, y_first - p[1], lows, highs)
                for y in range(y_first, min(y_first + 8, y_last + 1)):
                    low, high = lows[y - y_first], highs[y - y_first]
                    if low > high:
                        continue
                    wy = y - p[1]
                    slot = np.int32(-1)
                    brick = np.int64(-1)
                    node = ((x & 7) << 6) | ((y & 7) << 3)
                    z_last = np.int64(np.floor(p[2] + high))
                    for z in range(np.int64(np.ceil(p[2] + low)), z_last + 1):
                        if z >> 3 != brick:
                            brick = z >> 3
                            slot = find_brick(root, pages, x >> 3, y >> 3, brick)
                        if slot >= 0:
                            wz = z - p[2]
                            distance = wx * wx + wy * wy + wz * wz
                            _keep(squared, nearest, slot - slot0, node | (z & 7), distance, f)


@njit(cache=True, nogil=True)
def _into_faces(points, faces, order, begin, end, a, ux, uy, uz, inward):
    """Unit directions from an edge into its faces; returns how many, and the lowest face."""
    f = order[begin] // 3
    n = 0
    for i in range(begin, end):
        face = order[i] // 3
        f = min(f, face)
        if n == len(inward):
            continue
        p, q, r = points[faces[face, 0]], points[faces[face, 1]], points[faces[face, 2]]
        _, _, _, area, longest = _normal(p, q, r)
        if area <= SLIVER * longest * longest:
            continue
        o = points[faces[face, (order[i] % 3 + 2) % 3]]
        wx, wy, wz = o[0] - a[0], o[1] - a[1], o[2] - a[2]
        along = wx * ux + wy * uy + wz * uz
        wx, wy, wz = wx - along * ux, wy - along * uy, wz - along * uz
        scale = 1.0 / np.sqrt(wx * wx + wy * wy + wz * wz)
        inward[n, 0], inward[n, 1], inward[n, 2] = wx * scale, wy * scale, wz * scale
        n += 1
    return n, f


@njit(cache=True, nogil=True)
def _wedge_hull(inward, is_regular, ux, uy, uz, reach, hull):
    """Fill the box (x0, x1, y0, y1, z0, z1) of a wedge's cross-section."""
    hull[0] = hull[2] = hull[4] = -reach
    hull[1] = hull[3] = hull[5] = reach
    if not is_regular:
        return
    p, q = inward[0], inward[1]
    # Rays that bound the wedge: across the edge, along each face's normal
    rx, ry, rz = uy * p[2] - uz * p[1], uz * p[0] - ux * p[2], ux * p[1] - uy * p[0]
    sx, sy, sz = uy * q[2] - uz * q[1], uz * q[0] - ux * q[2], ux * q[1] - uy * q[0]
    sine = rx * q[0] + ry * q[1] + rz * q[2]
    facing = p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
    if facing < -0.5:
        # The wedge opens by less than 60 degrees: its hull is small
        if sine > 0.0:
            rx, ry, rz = -rx, -ry, -rz
        if sx * p[0] + sy * p[1] + sz * p[2] > 0.0:
            sx, sy, sz = -sx, -sy, -sz
        stretch = reach / np.sqrt(0.5 * (1.0 + rx * sx + ry * sy + rz * sz)) + SLACK
        hull[0] = min(0.0, stretch * rx, stretch * sx) - SLACK
        hull[1] = max(0.0, stretch * rx, stretch * sx) + SLACK
        hull[2] = min(0.0, stretch * ry, stretch * sy) - SLACK
        hull[3] = max(0.0, stretch * ry, stretch * sy) + SLACK
        hull[4] = min(0.0, stretch * rz, stretch * sz) - SLACK
        hull[5] = max(0.0, stretch * rz, stretch * sz) + SLACK


@njit(cache=True, nogil=True)
def _scan_sliver(a, b, c, f, reach, x0, x1, root, pages, slot0, squared, nearest):
    """Measure a sliver by its closest point, in the capsule around its longest edge."""
    ab = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2
    bc = (c[0] - b[0]) ** 2 + (c[1] - b[1]) ** 2 + (c[2] - b[2]) ** 2
    ca = (a[0] - c[0]) ** 2 + (a[1] - c[1]) ** 2 + (a[2] - c[2]) ** 2
    if ab >= bc and ab >= ca:
        p, q, longest = a, b, ab
    elif bc >= ca:
        p, q, longest = b, c, bc
    else:
        p, q, longest = c, a, ca
    wide = reach + 2.0 * SLIVER * np.sqrt(longest) + SLACK
    lx, ly, lz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    x_first = max(x0, np.int64(np.ceil(min(p[0], q[0]) - wide)))
    x_last = min(x1 - 1, np.int64(np.floor(max(p[0], q[0]) + wide)))
    for x in range(x_first, x_last + 1):
        t0, t1 = clip_segment(0.0, 1.0, p[0], lx, x - wide, x + wide)
        if t0 > t1:
            continue
        y0, y1 = p[1] + t0 * ly, p[1] + t1 * ly
        y_first = np.int64(np.ceil(min(y0, y1) - wide))
        y_last = np.int64(np.floor(max(y0, y1) + wide))
        for y in range(y_first, y_last + 1):
            s0, s1 = clip_segment(t0, t1, p[1], ly, y - wide, y + wide)
            if s0 > s1:
                continue
            z0, z1 = p[2] + s0 * lz, p[2] + s1 * lz
            z_last = np.int64(np.floor(max(z0, z1) + wide))
            for z in range(np.int64(np.ceil(min(z0, z1) - wide)), z_last + 1):
                slot = find_brick(root, pages, x >> 3, y >> 3, z >> 3)
                if slot >= 0:
                    node = ((x & 7) << 6) | ((y & 7) << 3) | (z & 7)
                    distance = closest_on_triangle(float(x), float(y), float(z), a, b, c)[0]
                    _keep(squared, nearest, slot - slot0, node, distance, f)


@njit(cache=True, nogil=True)
def _keep(squared, nearest, brick, node, distance, f):
    """Keep the smaller squared distance; on a tie the lower face. ``nearest`` may be empty."""
    best = squared[brick, node]
    if distance < best:
        squared[brick, node] = distance
        if len(nearest) > 0:
            nearest[brick, node] = f
    elif len(nearest) > 0 and distance == best and f < nearest[brick, node]:
        nearest[brick, node] = f


@njit(cache=True, nogil=True)
def _normal(a, b, c):
    """Unit normal, twice the area and the longest edge of a triangle."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area = np.sqrt(nx * nx + ny * ny + nz * nz)
    longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
    longest = np.sqrt(max(longest, wx * wx + wy * wy + wz * wz))
    scale = 1.0 / area if area > 0.0 else 0.0
    return nx * scale, ny * scale, nz * scale, area, longest


@njit(cache=True, nogil=True)
def _add_edge_plane(planes, k, p, q, origin, nx, ny, nz, slack):
    """Add the half-space inside edge pq of a face with normal n, relative to ``origin``."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    mx, my, mz = uy * nz - uz * ny, uz * nx - ux * nz, ux * ny - uy * nx
    scale = 1.0 / np.sqrt(mx * mx + my * my + mz * mz)
    mx, my, mz = mx * scale, my * scale, mz * scale
    offset = mx * (p[0] - origin[0]) + my * (p[1] - origin[1]) + mz * (p[2] - origin[2])
    return add_half_space(planes, k, mx, my, mz, offset + slack)
