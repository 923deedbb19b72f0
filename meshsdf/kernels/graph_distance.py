"""Distance integrals over a triangle P that lies close to a mesh T which is a graph above it.

In P's own frame (P in the plane z = 0) let D be P grown by w sideways. Suppose that over D, between
the heights -Z and Z, T is the graph of a function t of slope at most L, the tangent of the largest
angle between P and a face, and write cos L for 1 / sqrt(1 + L²). Then for p in P

    d(p) <= |t(p)|,    d(p) >= |t(p)| cos L,    d² >= x² + (|t| - L x)² at horizontal offset x,

so that the closest point is never farther off sideways than |t(p)| sin 2L. On the part of P under
one face F, d(p) is at least the distance to the plane of F, unless a rival face is nearer: one
within that reach which is not wholly behind F's plane. And d(p) equals it where F holds the foot of
p on its plane. Both conditions are linear, so all but narrow strips along the borders of the
shadows has a distance that is linear, with closed integrals; on what is cut off
(`graph_parts`) d lies between two linear functions:

- above: the distance to F is convex, so the linear function with its values at the corners, or |t|
  where a corner's foot is outside F, is no less;
- below: the least distance to the planes of F and its rivals is concave, so the one with its values
  at the corners is no more; |t| cos L serves where that is larger on the average.

That T is such a graph is proven, with w the largest |t| on P (no closest point is farther) and
Z = w + L (longest side + w):

1. all faces that reach into D x [-Z, Z] look to one side of P, none steeper than L;
2. none of their edges there is open, branching, or used twice in one direction: a walk along T
   above any line in D therefore goes on until it leaves D, and rises by at most L;
3. exactly one of them is met above one point of P.

If two points of T lay above one place of D within the height w, the walks from both to the point
of 3 would stay below Z and both arrive there, which is one place of T, and as they can be walked
back, there was but one.

Rounding: P and T are moved by less than 40 u S to where the computed coordinates are exact, S the
size of all coordinates, and shadows are clipped where they are off by less than 400 u S; heights
then are off by (1 + 2 L) times that, L <= 2: in all less than 2048 u S, u = 2**-53.
"""

import numpy as np
from numba import njit

from .distance_integrals import LOWER, UPPER, add_shares, positive_moments
from .graph_parts import cut_parts
from .graph_shadows import (
    CRUMB,
    MARGIN,
    MAX_SIDES,
    cut_cells,
    describe_planes,
    gather_slots,
    place_faces,
    prove_graph,
)
from .point_triangle import triangle_frame

MAX_FACES = 256  # of the mesh around one piece; larger pieces are cut first
MAX_SLOTS = 1024  # whose boxes meet the piece's
MAX_CORNERS = MAX_SIDES + MAX_FACES + 8  # of a cell cut by the planes of its rivals
MAX_PARTS = 2048

UNKNOWN, WIDE, SETTLED = 0, 1, 2  # of a piece: no graph; a gap above a limit; neither
# Columns of ``sums``: ends of the integrals of d, d² and of signed d; of the angle, and its maximum
D_LOW, D_HIGH, S_LOW, S_HIGH, SIGNED_LOW, SIGNED_HIGH, ANGLE, MAX_ANGLE = range(8)


@njit(cache=True, nogil=True)
def graph_measures(
    pieces,
    reach,
    begin,
    end,
    corners,
    edges,
    order,
    children,
    child_boxes,
    size,
    limits,
    thresholds,
    slack,
    known,
    sums,
    span,
    below,
):
    """Integrate the distance over ``pieces`` (k, 3, 3), where the mesh is a graph above them.

    ``reach[n]`` is a guess of the largest distance, or negative: leave it. Where it is a graph,
    ``sums[n]`` and ``span[n]`` are filled in, and ``known[n]`` is SETTLED if the gaps, per area,
    are within both ``limits`` (of d, of d²), else WIDE. Settled pieces are added to the shares
    ``below`` of the area within the thresholds.
    """
    slots = np.empty(MAX_SLOTS, np.int32)
    solid = np.empty((MAX_FACES, 3, 3))
    plane = np.empty((MAX_FACES, 9))
    cells = np.empty((MAX_FACES, MAX_SIDES, 3))
    n_sides = np.empty(MAX_FACES, np.int64)
    face_of_cell = np.empty(MAX_FACES, np.int64)
    edge, hold = np.empty((3, 3)), np.empty((MAX_SIDES, 2))
    polygons, values = np.empty((3, MAX_CORNERS, 3)), np.empty(MAX_CORNERS)
    rivals, parts = np.empty(MAX_FACES, np.int64), np.empty((MAX_PARTS, 8))
    axes, shape = np.empty((3, 3)), np.empty(7)
    box = np.empty(6)
    margin = MARGIN * size
    for n in range(begin, end):
        known[n] = UNKNOWN
        first, xx, xy, xz, yx, yy, yz, l, m, h = triangle_frame(  # noqa: E741
            pieces[n, 0], pieces[n, 1], pieces[n, 2]
        )
        for column in range(8):
            sums[n, column] = 0.0
        span[n, 0] = span[n, 1] = 0.0
        area = 0.5 * l * h
        if area == 0.0:
            known[n] = SETTLED
            continue
        if reach[n] < 0.0:
            continue
        axes[0, 0], axes[0, 1], axes[0, 2] = xx, xy, xz
        axes[1, 0], axes[1, 1], axes[1, 2] = yx, yy, yz
        axes[2, 0], axes[2, 1], axes[2, 2] = (
            xy * yz - xz * yy, xz * yx - xx * yz, xx * yy - xy * yx,
        )  # fmt: skip
        shape[0], shape[1], shape[2] = l, m, h
        shape[3], shape[4] = np.sqrt((l - m) * (l - m) + h * h), np.sqrt(m * m + h * h)
        shape[5], shape[6] = (l + m) / 3.0, h / 3.0
        around = reach[n] + margin
        for _ in range(3):
            for axis in range(3):
                x, y, z = pieces[n, 0, axis], pieces[n, 1, axis], pieces[n, 2, axis]
                box[axis], box[3 + axis] = min(x, y, z) - around, max(x, y, z) + around
            n_slots = gather_slots(box, children, child_boxes, slots)
            if n_slots < 0:
                break
            n_near = place_faces(
                n_slots, slots, order, corners, edges, pieces[n, first], axes, shape, around, solid
            )
            if n_near < 0:
                break
            describe_planes(n_near, solid, plane, margin)
            needed, turn, steep, n_cells = cut_cells(
                n_near, solid, plane, shape, margin, cells, n_sides, face_of_cell, hold
            )
            if needed < 0.0:
                break
            needed, steep = prove_graph(
                n_near,
                slots,
                order,
                edges,
                solid,
                plane,
                shape,
                turn,
                steep,
                needed,
                around,
                margin,
                edge,
            )
            if needed < 0.0:
                break
            if needed == 0.0:
                n_parts = cut_parts(
                    n_near, n_cells, cells, n_sides, face_of_cell, solid, plane, turn, steep,
                    margin, polygons, values, rivals, parts,
                )  # fmt: skip
                if n_parts < 0:
                    break
                _integrate(
                    n_parts, parts, n_cells, face_of_cell, plane, shape, turn, steep, area, margin,
                    sums[n], span[n],
                )  # fmt: skip
                _angles(n_cells, cells, n_sides, face_of_cell, plane, turn, sums[n])
                known[n] = WIDE
                gap, gap2 = sums[n, 1] - sums[n, 0], sums[n, 3] - sums[n, 2]
                if gap <= limits[0] * area and gap2 <= limits[1] * area:
                    known[n] = SETTLED
                    if len(thresholds) > 0:
                        _distribute(n_parts, parts, thresholds, slack, below)
                break
            if needed > 4.0 * (l + reach[n]):
                break
            around = 1.1 * needed + margin


@njit(cache=True, nogil=True)
def _integrate(
    n_parts, parts, n_cells, face_of_cell, plane, shape, turn, steep, area, margin, sums, span
):  # fmt: skip
    """Add up the integrals over all parts of a piece."""
    least, most, covered = np.inf, 0.0, 0.0
    for k in range(n_parts):
        part = parts[k]
        mean, square = positive_moments(part[1], part[2], part[3])
        low, low2 = part[0] * mean, part[0] * square
        mean, square = positive_moments(part[4], part[5], part[6])
        high, high2 = part[0] * mean, part[0] * square
        sums[D_LOW] += low
        sums[D_HIGH] += high
        sums[S_LOW] += low2
        sums[S_HIGH] += high2
        sums[SIGNED_LOW] += low if part[7] > 0.0 else -high
        sums[SIGNED_HIGH] += high if part[7] > 0.0 else -low
        least = min(least, part[1], part[2], part[3])
        most = max(most, part[4], part[5], part[6])
        covered += part[0]
    span[0], span[1] = max(least, 0.0), most
    # Gaps and overlaps that rounding leaves between the parts, and rounding of the slopes
    crumbs = abs(covered - area) + CRUMB * margin * shape[0] * n_parts
    for c in range(n_cells):
        p = plane[face_of_cell[c]]
        crumbs += CRUMB * margin * steep * (abs(p[2]) + abs(p[3]))
    sums[D_LOW] = max(sums[D_LOW] - crumbs * most, 0.0)
    sums[D_HIGH] += crumbs * most
    sums[S_LOW] = max(sums[S_LOW] - crumbs * most * most, 0.0)
    sums[S_HIGH] += crumbs * most * most
    sums[SIGNED_LOW] -= crumbs * most
    sums[SIGNED_HIGH] += crumbs * most


@njit(cache=True, nogil=True)
def _angles(n_cells, cells, n_sides, face_of_cell, plane, turn, sums):
    """Integral and maximum of the angle between P and the faces above it."""
    for c in range(n_cells):
        cell, area = cells[c], 0.0
        for i in range(2, n_sides[c]):
            area += 0.5 * (
                (cell[i - 1, 0] - cell[0, 0]) * (cell[i, 1] - cell[0, 1])
                - (cell[i - 1, 1] - cell[0, 1]) * (cell[i, 0] - cell[0, 0])
            )
        angle = np.arctan(plane[face_of_cell[c], 8])
        angle = angle if turn > 0.0 else np.pi - angle
        sums[ANGLE] += area * angle
        sums[MAX_ANGLE] = max(sums[MAX_ANGLE], angle)


@njit(cache=True, nogil=True)
def _distribute(n_parts, parts, thresholds, slack, below):
    """Add all parts of a piece to the shares of area within the thresholds."""
    for k in range(n_parts):
        p = parts[k]
        add_shares(p[4], p[5], p[6], p[0], thresholds, -slack, np.int64(LOWER), below)
        add_shares(p[1], p[2], p[3], p[0], thresholds, slack, np.int64(UPPER), below)
