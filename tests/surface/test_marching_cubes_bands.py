"""meshsdf.surface.marching_cubes: bricks, dense grids and blocks of them give the same faces."""

import numpy as np
import pytest
from scipy.ndimage import label

from meshsdf.grid import BrickIndex, Grid, NarrowBand
from meshsdf.surface import brick_field, marching_cubes, singular_cells
from tests.surface.bands import (
    band_from_blocks,
    band_of,
    blocks_from_nodes,
    nodes_of,
    sphere_distance,
)
from tests.surface.soundness import assert_closed, joined, triangle_set


def unit_grid(values, origin=(0.0, 0.0, 0.0)):
    return Grid(np.asarray(values, float), 1.0, np.array(origin, float))


def dyadic(rng, shape):
    """Values whose crossings are halves and quarters, so that sums of coordinates are exact."""
    return rng.choice([-1.0, 1.0, 3.0], shape)


def random_band(rng, lower, choices, background):
    """Blocks of any of the values among missing ones; (band, the values at all nodes)."""
    n_blocks = (4, 4, 3)
    stored = np.zeros(n_blocks, bool)
    stored[1:-1, 1:-1, 1:-1] = rng.random(tuple(n - 2 for n in n_blocks)) < 0.6
    pieces, _ = label(~stored)
    is_inside = rng.random(pieces.max() + 1) < 0.5
    is_inside[pieces[0, 0, 0]] = False
    constant = np.where(is_inside[pieces], -background, background)
    blocks = np.broadcast_to(constant[..., None, None, None], (*n_blocks, 8, 8, 8)).copy()
    blocks[stored] = rng.choice(choices, (np.count_nonzero(stored), 8, 8, 8))
    nodes = blocks.transpose(0, 3, 1, 4, 2, 5).reshape([8 * n for n in n_blocks])
    return band_from_blocks(blocks, lower, half_width=background), nodes.astype(np.float32)


@pytest.mark.parametrize("topology", ["manifold", "trilinear"])
def test_a_band_of_any_values_gives_the_triangles_of_the_dense_grid_with_those_values(topology):
    """Bricks and planes are two ways through the same cells."""
    rng = np.random.default_rng(8)
    n_ghosts = 0
    for _ in range(6):
        band, nodes = random_band(rng, (0, 0, 0), rng.uniform(-4, 4, 1000), background=4.0)
        for level in (0.0, 3.75, -2.5):
            mesh = marching_cubes(band, level=level, topology=topology)
            assert_closed(mesh)
            dense = Grid(nodes, 1.0, np.zeros(3))
            whole = marching_cubes(dense, level=level, topology=topology)
            assert np.array_equal(triangle_set(mesh), triangle_set(whole))
            n_ghosts += len(brick_field.field_of_band(band, level).corners) - band.index.n_bricks
        assert np.array_equal(singular_cells(band), singular_cells(dense))
    assert n_ghosts > 50


@pytest.mark.parametrize("side", [4, 8, 16, 24])
@pytest.mark.parametrize("topology", ["manifold", "trilinear"])
def test_blocks_of_cells_by_themselves_give_the_triangles_of_the_whole(side, topology):
    values = dyadic(np.random.default_rng(12), (21, 14, 11))
    whole = marching_cubes(unit_grid(values), topology=topology)
    parts = []
    for corner in np.ndindex(*(-(-(n - 1) // side) for n in values.shape)):
        low = np.array(corner) * side
        block = values[tuple(slice(a, a + side + 1) for a in low)]
        parts.append(marching_cubes(unit_grid(block, origin=low), topology=topology))
    assert (len(parts) > 1) == (side < 24)
    together = joined(parts)
    # Vertices within cells are means: rounded, and moved by a rounded sum
    found, expected = (np.round(triangle_set(m), 9) for m in (together, whole))
    order = [np.lexsort(t.T[::-1]) for t in (found, expected)]
    assert np.array_equal(found[order[0]], expected[order[1]])
    assert len(np.unique(np.round(together.vertices, 9), axis=0)) == whole.n_vertices


def test_bricks_may_have_any_coordinates():
    rng = np.random.default_rng(10)
    for lower in ([-2, 14, -1], [-1000, 15, 100_000], [-17, -33, -2]):
        # Crossings are halves and eighths, so that sums of coordinates are exact.
        band, nodes = random_band(rng, lower, [-7.0, -1.0, 1.0, 7.0], background=7.0)
        dense = marching_cubes(Grid(nodes, 1.0, 8.0 * np.array(lower)))
        assert np.array_equal(triangle_set(marching_cubes(band)), triangle_set(dense))


def test_an_inside_block_whose_neighbours_hold_no_inside_node_is_closed_through_missing_bricks():
    blocks = np.full((5, 5, 5, 8, 8, 8), 4.0)
    for neighbour in ((1, 2, 2), (3, 2, 2), (2, 1, 2), (2, 3, 2), (2, 2, 1), (2, 2, 3)):
        blocks[neighbour] = 1.0
    blocks[2, 2, 2] = -4.0  # missing, as are the blocks beside its edges and corners
    band = band_from_blocks(blocks, (0, 0, 0), half_width=4.0)
    assert band.index.n_bricks == 6
    mesh = marching_cubes(band)
    assert_closed(mesh)
    nodes = blocks.transpose(0, 3, 1, 4, 2, 5).reshape(40, 40, 40)
    assert np.array_equal(triangle_set(mesh), triangle_set(marching_cubes(unit_grid(nodes))))


def test_blocks_missing_inside_a_shape_are_inside():
    def distance(points):
        return sphere_distance(points, (32.5, 31.25, 33.75), 21.0)

    band = band_of(distance, (0, 0, 0), (8, 8, 8), 1.0)
    assert band.index.n_bricks < 8**3
    assert (band.value_at(np.array([[32, 31, 33]])) == -3).all()
    assert_closed(marching_cubes(band))
    values = distance(nodes_of((0, 0, 0), (64, 64, 64))).astype(np.float32)
    for level in (0.0, 1.75):
        dense = marching_cubes(Grid(values, 1.0, np.zeros(3)), level=level)
        assert np.array_equal(triangle_set(marching_cubes(band, level=level)), triangle_set(dense))


def test_moving_the_nodes_through_the_bricks_moves_the_surface_and_changes_nothing_else():
    values = dyadic(np.random.default_rng(9), (11, 12, 13))
    expected = triangle_set(marching_cubes(unit_grid(values), border="pad"))
    for step in ([1, 0, 0], [3, 5, 7], [8, 9, 10], [4, 16, 23]):
        around = np.full((40, 48, 56), 1.0)
        low = np.array(step) + 8
        around[tuple(slice(a, a + n) for a, n in zip(low, values.shape, strict=True))] = values
        band = band_from_blocks(blocks_from_nodes(4.0 * around), (0, 0, 0), half_width=13.0)
        inner = marching_cubes(unit_grid(around))
        assert np.array_equal(triangle_set(marching_cubes(band)), triangle_set(inner))
        moved = marching_cubes(unit_grid(values, origin=low), border="pad")
        assert np.array_equal(triangle_set(moved), expected + np.tile(low, 3))


def test_a_surface_ten_million_units_away_is_as_exact_as_its_coordinates():
    voxel, step = 1 / 128, 10 * 2**24  # in bricks: 1.3e9 nodes, 1e7 units
    near = band_of(lambda p: sphere_distance(p, radius=0.2), (-4, -4, -4), (8, 8, 8), voxel)
    far = NarrowBand(
        shifted(near.index, step), near.values, near.active, voxel, np.zeros(3), 3.0, "parity"
    )
    here, there = marching_cubes(near), marching_cubes(far)
    assert np.array_equal(here.faces, there.faces)
    shift = 8.0 * step * voxel
    assert shift > 1e7
    assert np.abs(there.vertices - shift - here.vertices).max() <= 2 * np.spacing(shift)


def shifted(index, step):
    """The same bricks ``step`` (a multiple of 16) further along every axis."""
    return BrickIndex(
        index.coordinates + step, index.page_origin + step // 16, index.root, index.pages
    )
