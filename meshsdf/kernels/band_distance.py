"""Distances of the nodes near a mesh, feature by feature.

The closest point of a node lies inside a face, inside an edge, or at a vertex, and then the node
lies in that feature's normal region: the prism over the face, the wedge around the edge, the cone
at the vertex (Mauch 2003, "Efficient algorithms for solving static Hamilton-Jacobi equations",
ch. 4). Each region, cut at the reach, is scanned along lattice lines: its half-spaces clip the
line to an interval, and only the nodes in it are tested. The regions of a surface hardly overlap,
so the work is about one test per node of the band. The conditions are necessary for any triangle
soup: every face at an edge, and every edge at a vertex, adds its own half-space.

Exactness: a region is widened by a slack that covers the rounding of its planes, so the closest
feature of a node is never missed; edge and vertex tests measure the true distance wherever they
are applied, and a face is measured by its plane at most `FACE_SLACK` (or the rounding of its
plane) outside its prism. Faces thinner than `SLIVER` have no trustworthy plane: they are measured
by their closest point in a capsule around their longest edge, and impose nothing on their edges.

Lengths are in voxels; ``squared`` (b, 512) float64 and ``nearest`` (b, 512) int32 hold the slab's
bricks from slot ``slot0`` on. Ties go to the lower face, so the order of work does not matter.
"""

import numpy as np
from numba import njit

from .brick_lookup import find_brick
from .clip import clip_line, clip_segment, triangle_range
from .point_triangle import closest_on_triangle

SLIVER = 1e-5  # altitude / longest edge
FACE_SLACK = 1e-8  # voxels; covers prisms that part by less than a flat edge's wedge
FLAT_EDGE = 1e-9  # sine of the wedge angle below which the two prisms cover the wedge
SLACK = 1e-6  # voxels; generous, since edges and vertices measure the true distance
MAX_FACES = 16  # half-spaces used per edge; leaving some out only widens the region


@njit(cache=True, nogil=True)
def scan_faces(points, faces, ids, reach, x0, x1, root, pages, slot0, squared, nearest):
    """Scan the prisms of the faces ``ids`` over the nodes with x in [x0, x1)."""
    for n in range(len(ids)):
        f = ids[n]
        a, b, c = points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]
        nx, ny, nz, area, longest = _normal(a, b, c)
        if area <= SLIVER * longest * longest:
            _scan_sliver(a, b, c, f, reach, x0, x1, root, pages, slot0, squared, nearest)
            continue
        # Planes through the edges, normals in the face and pointing out of it
        px, py, pz = _edge_plane(a, b, nx, ny, nz)
        qx, qy, qz = _edge_plane(b, c, nx, ny, nz)
        rx, ry, rz = _edge_plane(c, a, nx, ny, nz)
        size = longest + reach
        slack = FACE_SLACK + 1e-15 * size * longest * longest / area
        grow_x, grow_y, grow_z = reach * abs(nx), reach * abs(ny), reach * abs(nz)
        z_low = min(a[2], b[2], c[2]) - grow_z - slack
        z_high = max(a[2], b[2], c[2]) + grow_z + slack
        x_first = max(x0, np.int64(np.ceil(min(a[0], b[0], c[0]) - grow_x - slack)))
        x_last = min(x1 - 1, np.int64(np.floor(max(a[0], b[0], c[0]) + grow_x + slack)))
        for x in range(x_first, x_last + 1):
            y_low, y_high = triangle_range(
                a[0], a[1], b[0], b[1], c[0], c[1], x - grow_x - slack, x + grow_x + slack
            )
            if y_low > y_high:
                continue
            y_first = np.int64(np.ceil(y_low - grow_y - slack))
            y_last = np.int64(np.floor(y_high + grow_y + slack))
            for y in range(y_first, y_last + 1):
                offset = px * (x - a[0]) + py * (y - a[1]) - pz * a[2]
                low, high = clip_line(z_low, z_high, offset, pz, slack)
                offset = qx * (x - b[0]) + qy * (y - b[1]) - qz * b[2]
                low, high = clip_line(low, high, offset, qz, slack)
                offset = rx * (x - c[0]) + ry * (y - c[1]) - rz * c[2]
                low, high = clip_line(low, high, offset, rz, slack)
                if low > high:
                    continue
                plane = nx * (x - a[0]) + ny * (y - a[1])
                low, high = clip_line(low, high, plane - nz * a[2], nz, reach)
                low, high = clip_line(low, high, nz * a[2] - plane, -nz, reach)
                if low > high:
                    continue
                slot = np.int32(-1)
                brick = np.int64(-1)
                node = ((x & 7) << 6) | ((y & 7) << 3)
                for z in range(np.int64(np.ceil(low)), np.int64(np.floor(high)) + 1):
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
    for n in range(len(ids)):
        e = ids[n]
        a, b = points[ends[e, 0]], points[ends[e, 1]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        length = np.sqrt(ux * ux + uy * uy + uz * uz)
        if length == 0.0:
            continue  # its ends differ by less than rounding, and are scanned as vertices
        ux, uy, uz = ux / length, uy / length, uz / length
        # Directions from the edge into its faces
        f = faces.shape[0]
        n_in = 0
        for i in range(first[e], first[e + 1]):
            face = order[i] // 3
            f = min(f, face)
            _, _, _, area, longest = _normal(
                points[faces[face, 0]], points[faces[face, 1]], points[faces[face, 2]]
            )
            if area <= SLIVER * longest * longest or n_in == MAX_FACES:
                continue
            o = points[faces[face, (order[i] % 3 + 2) % 3]]
            wx, wy, wz = o[0] - a[0], o[1] - a[1], o[2] - a[2]
            along = wx * ux + wy * uy + wz * uz
            wx, wy, wz = wx - along * ux, wy - along * uy, wz - along * uz
            scale = 1.0 / np.sqrt(wx * wx + wy * wy + wz * wz)
            inward[n_in, 0], inward[n_in, 1], inward[n_in, 2] = wx * scale, wy * scale, wz * scale
            n_in += 1
        reach_x0, reach_x1 = -reach, reach
        reach_y0, reach_y1 = -reach, reach
        reach_z0, reach_z1 = -reach, reach
        if n_in == 2 and first[e + 1] - first[e] == 2:
            p, q = inward[0], inward[1]
            # Rays that bound the wedge: across the edge, along each face's normal
            rx, ry, rz = uy * p[2] - uz * p[1], uz * p[0] - ux * p[2], ux * p[1] - uy * p[0]
            sx, sy, sz = uy * q[2] - uz * q[1], uz * q[0] - ux * q[2], ux * q[1] - uy * q[0]
            sine = rx * q[0] + ry * q[1] + rz * q[2]
            facing = p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
            if facing < 0.0 and abs(sine) < FLAT_EDGE:
                continue
            if sine > 0.0:
                rx, ry, rz = -rx, -ry, -rz
            if sx * p[0] + sy * p[1] + sz * p[2] > 0.0:
                sx, sy, sz = -sx, -sy, -sz
            if facing < -0.5:
                # The wedge opens by less than 60 degrees: its hull is small
                stretch = reach / np.sqrt(0.5 * (1.0 + rx * sx + ry * sy + rz * sz)) + SLACK
                reach_x0 = min(0.0, stretch * rx, stretch * sx) - SLACK
                reach_x1 = max(0.0, stretch * rx, stretch * sx) + SLACK
                reach_y0 = min(0.0, stretch * ry, stretch * sy) - SLACK
                reach_y1 = max(0.0, stretch * ry, stretch * sy) + SLACK
                reach_z0 = min(0.0, stretch * rz, stretch * sz) - SLACK
                reach_z1 = max(0.0, stretch * rz, stretch * sz) + SLACK
        lx, ly, lz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        x_first = max(x0, np.int64(np.ceil(min(a[0], b[0]) + reach_x0)))
        x_last = min(x1 - 1, np.int64(np.floor(max(a[0], b[0]) + reach_x1)))
        for x in range(x_first, x_last + 1):
            t0, t1 = clip_segment(0.0, 1.0, a[0], lx, x - reach_x1, x - reach_x0)
            if t0 > t1:
                continue
            y0, y1 = a[1] + t0 * ly, a[1] + t1 * ly
            y_first = np.int64(np.ceil(min(y0, y1) + reach_y0))
            y_last = np.int64(np.floor(max(y0, y1) + reach_y1))
            for y in range(y_first, y_last + 1):
                s0, s1 = clip_segment(t0, t1, a[1], ly, y - reach_y1, y - reach_y0)
                if s0 > s1:
                    continue
                z0, z1 = a[2] + s0 * lz, a[2] + s1 * lz
                low, high = min(z0, z1) + reach_z0, max(z0, z1) + reach_z1
                wx, wy = x - a[0], y - a[1]
                for i in range(n_in):
                    m = inward[i]
                    offset = m[0] * wx + m[1] * wy - m[2] * a[2]
                    low, high = clip_line(low, high, offset, m[2], SLACK)
                offset = ux * wx + uy * wy - uz * a[2]
                low, high = clip_line(low, high, offset, uz, length + SLACK)
                low, high = clip_line(low, high, -offset, -uz, SLACK)
                if low > high:
                    continue
                slot = np.int32(-1)
                brick = np.int64(-1)
                node = ((x & 7) << 6) | ((y & 7) << 3)
                for z in range(np.int64(np.ceil(low)), np.int64(np.floor(high)) + 1):
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
    away = np.empty((MAX_FACES, 3))
    for n in range(len(ids)):
        v = ids[n]
        p = points[v]
        f = order[first[edges[start[v]]]] // 3
        n_away = 0
        for i in range(start[v], start[v + 1]):
            e = edges[i]
            f = min(f, order[first[e]] // 3)
            if n_away == MAX_FACES:
                continue
            q = points[ends[e, 0] + ends[e, 1] - v]
            dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
            length = np.sqrt(dx * dx + dy * dy + dz * dz)
            if length == 0.0:
                continue
            scale = 1.0 / length
            away[n_away, 0], away[n_away, 1], away[n_away, 2] = dx * scale, dy * scale, dz * scale
            n_away += 1
        x_first = max(x0, np.int64(np.ceil(p[0] - reach)))
        x_last = min(x1 - 1, np.int64(np.floor(p[0] + reach)))
        for x in range(x_first, x_last + 1):
            wx = x - p[0]
            disc = np.sqrt(max(0.0, reach * reach - wx * wx))
            for y in range(np.int64(np.ceil(p[1] - disc)), np.int64(np.floor(p[1] + disc)) + 1):
                wy = y - p[1]
                high = np.sqrt(max(0.0, reach * reach - wx * wx - wy * wy))
                low = -high
                for i in range(n_away):
                    d = away[i]
                    low, high = clip_line(low, high, d[0] * wx + d[1] * wy, d[2], SLACK)
                    if low > high:
                        break
                if low > high:
                    continue
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
def _edge_plane(p, q, nx, ny, nz):
    """Unit normal of the plane through edge pq across the face, pointing out of the face."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    mx, my, mz = uy * nz - uz * ny, uz * nx - ux * nz, ux * ny - uy * nx
    scale = 1.0 / np.sqrt(mx * mx + my * my + mz * mz)
    return mx * scale, my * scale, mz * scale
