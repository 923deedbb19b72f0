"""meshsdf.surface.marching_cubes: many random cells and grids at once, with zeros and ties."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from meshsdf.grid import Grid
from meshsdf.surface import marching_cubes, singular_cells
from tests.surface.cell_oracle import count_pieces, euler_of_side
from tests.surface.soundness import (
    assert_closed,
    assert_manifold,
    euler_characteristic,
    open_edges,
    vertex_set,
    volume,
)
from tests.surface.test_cell_decider import KNOWN, decided, generic_cells

TOPOLOGIES = ["manifold", "trilinear"]


def unit_grid(values):
    return Grid(values, 1.0, np.zeros(3))


def side_by_side(blocks, between):
    """(n, a, b, c) blocks in one volume with a layer of ``between`` after each, on all axes."""
    n, side = len(blocks), int(np.ceil(len(blocks) ** (1 / 3)))
    padded = np.full((side**3, *(size + 1 for size in blocks.shape[1:])), between)
    padded[:n, :-1, :-1, :-1] = blocks
    lattice = padded.reshape(side, side, side, *padded.shape[1:]).transpose(0, 3, 1, 4, 2, 5)
    return np.ascontiguousarray(lattice.reshape([side * size for size in padded.shape[1:]]))


def apart(cells):
    """(s, 8) cells in a row, number n between planes 3 n and 3 n + 1, missing data between."""
    planes = np.full((3 * len(cells), 2, 2), np.nan)
    cubes = cells.reshape(-1, 2, 2, 2)
    planes[0::3], planes[1::3] = cubes[:, 0], cubes[:, 1]
    return unit_grid(planes)


def n_pieces(mesh):
    """Number of connected pieces."""
    sides = mesh.faces.ravel(), np.roll(mesh.faces, 1, axis=1).ravel()
    graph = coo_array((np.ones(len(sides[0]), bool), sides), (mesh.n_vertices,) * 2)
    return connected_components(graph, directed=False)[0]


def facts_of_cells(mesh, n_cells):
    """(n_cells, 3) components, Euler characteristic and border loops in each cell of `apart`."""
    cell = (mesh.vertices[:, 0] // 3).astype(int)
    sides = [mesh.faces[:, [n, (n + 1) % 3]] for n in range(3)]
    edges = np.unique(np.sort(np.concatenate(sides), axis=1), axis=0)
    rim = open_edges(mesh)

    def pieces(vertices, pairs):
        graph = coo_array((np.ones(len(pairs), bool), pairs.T), (mesh.n_vertices,) * 2)
        labels = connected_components(graph, directed=False)[1]
        first = np.unique(labels[vertices], return_index=True)[1]
        return np.bincount(cell[vertices[first]], minlength=n_cells)

    counts = [np.bincount(cell[n], minlength=n_cells)
              for n in (slice(None), edges[:, 0], mesh.faces[:, 0])]  # fmt: skip
    euler = counts[0] - counts[1] + counts[2]
    return np.stack([pieces(np.arange(len(cell)), edges), euler, pieces(np.unique(rim), rim)], 1)


def random_cells(rng):
    """(20000, 8) whole numbers with zeros and ties, of two sizes alone, and any numbers."""
    whole = rng.integers(-2, 3, (8000, 8)).astype(float)
    return np.concatenate([whole, rng.choice([-1.0, 1.0], (2000, 8)), rng.normal(size=(10000, 8))])


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_twenty_thousand_cells_are_closed_by_a_border_outside(topology):
    cells = random_cells(np.random.default_rng(0))
    together = side_by_side(cells.reshape(-1, 2, 2, 2), 1.0)
    mesh = marching_cubes(unit_grid(together), border="pad", topology=topology)
    assert_closed(mesh)
    assert mesh.n_faces > 10 * len(cells)


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_ten_thousand_grids_of_zeros_and_ties_are_closed(topology):
    """Of 5 nodes a side, positive on their borders, which neighbours share."""
    within = np.random.default_rng(1).integers(-2, 3, (10000, 3, 3, 3)).astype(float)
    mesh = marching_cubes(unit_grid(side_by_side(within, 1.0)), border="pad", topology=topology)
    assert_closed(mesh)
    assert mesh.n_faces > 70 * len(within)


def test_cells_hold_what_was_decided_singular_or_not():
    rng = np.random.default_rng(2)
    cells = np.concatenate([random_cells(rng), generic_cells(rng)])
    mesh = marching_cubes(apart(cells), topology="trilinear")
    assert_manifold(mesh)
    assert np.array_equal(facts_of_cells(mesh, len(cells)), decided(cells))


def test_twelve_cells_hold_what_is_known_of_them():
    cells = np.array([cell for _, _, cell in KNOWN], float)
    for sign in (1, -1):
        mesh = marching_cubes(apart(sign * cells), topology="trilinear")
        assert facts_of_cells(mesh, 12).tolist() == [list(facts) for facts, _, _ in KNOWN]


def test_vertices_lie_in_their_cells_on_edges_or_at_the_mean_of_their_neighbours():
    cells = generic_cells(np.random.default_rng(9))
    mesh = marching_cubes(apart(cells), topology="trilinear")
    local = mesh.vertices - [3, 0, 0] * (mesh.vertices[:, :1] // 3)
    assert local.min() >= 0
    assert local.max() <= 1
    within = np.flatnonzero(((local > 0) & (local < 1)).sum(axis=1) > 1)
    assert len(within) > 200
    start, end = mesh.faces.ravel(), np.roll(mesh.faces, 1, axis=1).ravel()  # around: each once
    around = coo_array((np.ones(len(start)), (start, end)), (mesh.n_vertices,) * 2).tocsr()[within]
    mean = (around @ local) / around.sum(axis=1)[:, None]
    assert np.abs(mean - local[within]).max() <= 1e-10  # coordinates of thousands, rounded


def finer(values, m):
    """The piecewise trilinear interpolant at m places per voxel."""
    for axis, n in enumerate(values.shape):
        at = np.arange(m * (n - 1) + 1) / m
        low = np.minimum(at.astype(int), n - 2)
        line = np.moveaxis(values, axis, -1)
        values = line[..., low] * (1 - (at - low)) + line[..., low + 1] * (at - low)
        values = np.moveaxis(values, -1, axis)
    return values


def test_random_grids_have_the_pieces_and_handles_of_their_interpolant():
    """The sampled interpolant is counted as in `cell_oracle`, more finely where it differs."""
    rng = np.random.default_rng(3)
    finest = []
    for _ in range(25):
        values = np.pad(rng.normal(size=(4, 4, 4)), 1, constant_values=1.0)
        mesh = marching_cubes(unit_grid(values), topology="trilinear")
        assert_closed(mesh)
        found = n_pieces(mesh), euler_characteristic(mesh)
        for m in (4, 8, 16, 32):
            inside = finer(values, m)[None] < 0
            # No inside node on the border: chi(closed surface) = 2 chi(what it surrounds)
            pieces = count_pieces(inside)[0] + count_pieces(~inside)[0] - 1
            expected = pieces, 2 * euler_of_side(inside)[0]
            if found == expected:
                break
        assert found == expected
        finest.append(m)
    assert np.mean(finest) < 8


def test_the_two_promises_differ_where_inside_corners_hang_together():
    """A bar along a diagonal: one piece for the interpolant, else a row of beads."""
    values = np.ones((9, 9, 9))
    for n in range(2, 7):
        values[n, n, 4] = -3.0
    found = {}
    for topology in TOPOLOGIES:
        mesh = marching_cubes(unit_grid(values), topology=topology)
        assert_closed(mesh)
        found[topology] = n_pieces(mesh)
    assert found == {"manifold": 5, "trilinear": 1}


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_scaling_the_values_moves_nothing(topology):
    rng = np.random.default_rng(4)
    values, whole = rng.normal(size=(19, 18, 17)), rng.integers(-2, 3, (19, 18, 17)).astype(float)
    for given in (values, whole):
        mesh = marching_cubes(unit_grid(given), topology=topology)
        for power in (-300, -30, 300):
            other = marching_cubes(unit_grid(given * 2.0**power), topology=topology)
            assert np.array_equal(other.vertices, mesh.vertices)
            assert np.array_equal(other.faces, mesh.faces)
    small = marching_cubes(unit_grid(1e-9 * values), topology=topology)
    mesh = marching_cubes(unit_grid(values), topology=topology)
    assert np.array_equal(small.faces, mesh.faces)
    # Ends of an edge differ in sign: a / (a - b) of values rounded once more is off by less than
    # 4 u; coordinates are below 32 = 2**5
    assert np.abs(small.vertices - mesh.vertices).max() <= 2.0 ** (5 - 52)


def test_a_change_of_sign_turns_the_surface_of_the_interpolant_inside_out():
    values = np.pad(np.random.default_rng(6).normal(size=(12, 13, 14)), 1, constant_values=1.0)
    mesh, turned = (marching_cubes(unit_grid(v), topology="trilinear") for v in (values, -values))
    assert np.allclose(vertex_set(mesh), vertex_set(turned), rtol=0, atol=1e-14)
    assert n_pieces(mesh) == n_pieces(turned)
    assert euler_characteristic(mesh) == euler_characteristic(turned)
    assert volume(mesh) == pytest.approx(-volume(turned), rel=0.02)


def test_exchanging_axes_changes_nothing_in_the_surface_of_the_interpolant():
    values = np.random.default_rng(7).normal(size=(17, 9, 12))
    mesh = marching_cubes(unit_grid(values), border="pad", topology="trilinear")
    for order in ([1, 2, 0], [1, 0, 2]):
        moved = unit_grid(values.transpose(order))
        other = marching_cubes(moved, border="pad", topology="trilinear")
        assert_closed(other)
        assert n_pieces(other) == n_pieces(mesh)
        assert euler_characteristic(other) == euler_characteristic(mesh)
        assert volume(other) == pytest.approx(volume(mesh), rel=0.02)


def test_singular_cells_are_told_by_their_lowest_nodes():
    rng = np.random.default_rng(8)
    values = rng.choice([-2.0, -1.0, 1.0, 2.0], (3, 4, 5))
    found = singular_cells(unit_grid(values)).tolist()
    blocks = [(list(cell), values[tuple(slice(n, n + 2) for n in cell)].reshape(1, 8))
              for cell in np.ndindex(2, 3, 4)]  # fmt: skip
    assert found == [cell for cell, block in blocks if len(singular_cells(apart(block)))]
    assert 5 < len(found) < 24
    assert singular_cells(unit_grid(values + 5.0), level=5.0).tolist() == found
    assert len(singular_cells(unit_grid(rng.normal(size=(9, 9, 9))))) == 0


def test_where_every_cell_is_singular_the_surface_is_closed_and_manifold_all_the_same():
    checkers = 1 - 2.0 * (np.indices((6, 6, 6)).sum(axis=0) % 2)
    assert len(singular_cells(unit_grid(checkers))) == 5**3
    for topology in TOPOLOGIES:
        assert_closed(marching_cubes(unit_grid(checkers), border="cap", topology=topology))
