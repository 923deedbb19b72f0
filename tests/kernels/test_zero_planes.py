"""meshsdf.kernels.zero_planes and zero_bounds: zeros are where the pieces are, and nowhere else."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshsdf.kernels.zero_bounds import bound_triangles
from meshsdf.kernels.zero_planes import (
    EMPTY,
    FITTED,
    UNSURE,
    count_pieces,
    fill_pieces,
    fit_planes,
)
from meshsdf.mesh import Mesh
from meshsdf.spatial import ClosestPoint
from tests.report.zero_samples import fine_roots, interpolated
from tests.surface.bands import band_of, sphere_distance

LIMIT = 0.05
PLACE = np.array([2.0, 10.0, 20.0, 30.0])  # voxel size and origin


def blocks_of(kind, n=16):
    """(n, 4, 4, 4) values with a change of sign in the middle cell."""
    rng = np.random.default_rng(0)
    points = np.stack(np.indices((4, 4, 4)), axis=-1) - 1.5
    blocks = []
    while len(blocks) < n:
        if kind == "random":
            block = rng.normal(size=(4, 4, 4))
        elif kind == "plane":
            block = points @ rng.normal(size=3) + 0.3 * rng.normal()
        else:
            away = rng.normal(size=3)
            away *= rng.uniform(3, 20) / np.linalg.norm(away)
            block = np.linalg.norm(points - away, axis=-1) - np.linalg.norm(away)
            block += rng.uniform(-0.5, 0.5)
        middle = block[1:3, 1:3, 1:3]
        if middle.min() < 0 < middle.max():
            blocks.append(block)
    return np.array(blocks)


def fitted(blocks, depth=0, limit=LIMIT):
    """All boxes of a depth in all blocks, and what is said of them."""
    parts = np.stack(np.indices((2**depth,) * 3), axis=-1).reshape(-1, 3)
    cells = np.repeat(np.arange(len(blocks)), len(parts))
    lows = np.tile(parts, (len(blocks), 1))
    n = len(cells)
    state, planes, thickness = np.empty(n, np.uint8), np.zeros((n, 4)), np.zeros(n)
    fit_planes(blocks, cells, lows, 0.5**depth, limit, 0, n, state, planes, thickness)
    return cells, lows, state, planes, thickness


def pieces_of(lows, sizes, planes, thickness):
    """Corners of every piece, below 3 for none; vertices; faces; the number of each one's piece."""
    counts = np.empty(len(lows), np.int64)
    count_pieces(lows, sizes, planes, thickness, 0, len(lows), counts)
    shape = [array[counts >= 3] for array in (lows, sizes, planes, thickness)]
    n = len(shape[0])
    first = np.concatenate([[0], np.cumsum(counts[counts >= 3])])
    vertices, faces = np.empty((first[-1], 3)), np.empty((first[-1] - 2 * n, 3), np.int32)
    box = np.empty(len(faces), np.int64)
    corners = np.zeros((n, 3), np.int64)
    fill_pieces(*shape, corners, PLACE, first, 0, n, vertices, faces, box)
    assert (np.bincount(box) == counts[counts >= 3] - 2).all()
    return counts, vertices, faces, box


@pytest.mark.parametrize("kind", ["sphere", "random", "plane"])
@pytest.mark.parametrize("depth", [0, 1, 3])
def test_zeros_of_a_box_are_near_its_plane_and_there_are_none_in_empty_ones(kind, depth):
    blocks = blocks_of(kind)
    cells, lows, state, planes, thickness = fitted(blocks, depth)
    size = 0.5**depth
    for c, block in enumerate(blocks):
        roots = fine_roots(block, 12)
        for n in np.flatnonzero(cells == c):
            low = 1 + size * lows[n]
            inside = roots[((roots >= low) & (roots <= low + size)).all(axis=1)]
            if state[n] == EMPTY:
                assert len(inside) == 0
            elif state[n] == FITTED:
                off = np.abs(planes[n, 0] + inside @ planes[n, 1:])
                assert (off <= thickness[n] * np.linalg.norm(planes[n, 1:]) + 1e-13).all()
    assert (thickness[state == FITTED] <= LIMIT).all()
    if kind == "plane":
        assert set(np.unique(state)) <= {EMPTY, FITTED}
        assert thickness.max() < 1e-11
    if kind == "sphere" and depth == 3:
        assert (state == FITTED).sum() > 10 * len(blocks)


@pytest.mark.parametrize("kind", ["sphere", "random", "plane"])
def test_pieces_cover_the_zeros_and_every_point_of_them_has_a_change_of_sign_beside(kind):
    blocks = blocks_of(kind)
    rng = np.random.default_rng(1)
    cells, lows, state, planes, thickness = fitted(blocks, 2)
    size = 0.25
    keep = np.flatnonzero(state == FITTED)
    shape = lows[keep], np.full(len(keep), size), planes[keep], thickness[keep]
    full, vertices, faces, box = pieces_of(*shape)
    keep, first = keep[full >= 3], np.concatenate([[0], np.cumsum(full[full >= 3])])
    local = (vertices - PLACE[1:]) / PLACE[0] + 1  # in block coordinates
    # Every point is between a negative and a positive value, both within the thickness
    weights = rng.dirichlet(np.ones(3), len(faces))
    points = np.einsum("fk,fkx->fx", weights, local[faces])
    normals = planes[keep[box], 1:]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    step = thickness[keep[box], None] * normals
    for c in np.unique(cells[keep]):
        own = cells[keep[box]] == c
        assert (interpolated(blocks[c], points[own] + step[own]) >= -1e-13).all()
        assert (interpolated(blocks[c], points[own] - step[own]) <= 1e-13).all()
    # Zeros of a box, moved to its plane, are within its piece: areas with and without them agree
    seen = 0
    for f in range(0, len(keep), 7):
        n = keep[f]
        roots = fine_roots(blocks[cells[n]], 12)
        low = 1 + size * lows[n]
        inside = roots[((roots >= low) & (roots <= low + size)).all(axis=1)]
        corner = local[first[f] : first[f + 1]]
        normal = planes[n, 1:] / np.linalg.norm(planes[n, 1:])
        moved = inside - ((inside - corner[0]) @ normal)[:, None] * normal
        sides = np.cross(np.roll(corner, -1, axis=0) - corner, normal)
        beyond = np.einsum("kcx,cx->kc", moved[:, None] - corner, sides)
        sign = np.sign(np.einsum("cx,cx->c", corner.mean(axis=0) - corner, sides))
        assert (sign[sign != 0] == sign[sign != 0][0]).all()  # one way around
        assert (beyond * sign[sign != 0][0] >= -1e-9).all()
        seen += len(inside)
    assert seen > 100


@pytest.mark.parametrize("normal", [(1, 1, 0), (1, 0, -1), (1, 1, 1), (2, -1, 0)])
def test_a_plane_through_the_edges_of_boxes_leaves_no_gap(normal):
    # Lattice and plane meet in edges and corners of boxes, where signs hang on rounding
    points = np.stack(np.indices((4, 4, 4)), axis=-1) - 1.5
    block = points @ (np.array(normal) / 3.0)
    _, lows, state, planes, thickness = fitted(block[None], 2)
    keep = state == FITTED
    sizes = np.full(keep.sum(), 0.25)
    _, vertices, faces, _ = pieces_of(lows[keep], sizes, planes[keep], thickness[keep])
    roots = fine_roots(block[1:3, 1:3, 1:3], 16) + 1.0
    mesh = Mesh((vertices - PLACE[1:]) / PLACE[0] + 1, faces)
    assert ClosestPoint(mesh).distances(roots).distance.max() < 1e-11


def test_where_neighbours_have_no_values_a_box_at_the_cell_face_cannot_be_fitted():
    block = np.stack(np.indices((4, 4, 4)), axis=-1) @ np.array([1.0, 0.2, 0.1]) - 1.6
    block[:, :, 3] = np.nan
    *_, state, _, _ = fitted(block[None], 1)
    lows = np.stack(np.indices((2, 2, 2)), axis=-1).reshape(-1, 3)
    assert (state[(lows[:, 2] == 0)] != UNSURE).all()
    assert FITTED in state[lows[:, 2] == 0]
    assert FITTED not in state[lows[:, 2] == 1]


@pytest.mark.parametrize("size", [0.02, 0.5, 2.0])
def test_no_point_of_a_triangle_is_farther_from_a_sphere_than_its_bound(size):
    h, radius = 0.1, 1.0
    band = band_of(sphere_distance, (-2, -2, -2), (4, 4, 4), h)
    rng = np.random.default_rng(0)
    n = 400
    middle = rng.normal(size=(n, 3))
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    turns = Rotation.random(n, random_state=0).as_matrix()
    flat = size * h * np.array([[1.0, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0]])
    corners = middle[:, None] * rng.uniform(0.9, 1.1, (n, 1, 1)) + np.einsum(
        "nxy,cy->ncx", turns, flat
    )
    center = np.array([0.05, 0.02, -0.01])
    points = (corners - center).reshape(-1, 3)
    pieces = np.arange(3 * n, dtype=np.int32).reshape(n, 3)
    origin = (center - band.translation) / h - 8.0 * band.index.origin
    numbers = np.array([band.background, 0.0, h, *origin])
    nodes = band.index.root, band.index.pages, band.values, numbers
    upper = np.empty(n)
    bound_triangles(points, pieces, *nodes, 3 * h, 0, n, upper)
    weights = np.concatenate([np.eye(3), rng.dirichlet(np.ones(3), 50)])
    seen = np.abs(np.linalg.norm(np.einsum("sk,nkx->nsx", weights, corners), axis=-1) - radius)
    seen = seen.max(axis=1)
    found = np.isfinite(upper)
    # The zero set is off the sphere by h^2 / 4 / (radius - sqrt(3) h) at most
    off = h**2 / 4 / (radius - np.sqrt(3) * h)
    assert (seen[found] <= upper[found] + off).all()
    assert found[seen < 0.5 * h].mean() > 0.9
    if size < 1:
        assert (upper[found] <= 1.3 * seen[found] + 0.1 * h).all()
    bound_triangles(points, pieces, *nodes, 0.0, 0, n, upper)
    assert np.isinf(upper).all()
