"""meshsdf.grid.cut_band: the part of a full grid near the surface, as a narrow band."""

import numpy as np
import pytest

from meshsdf.errors import GridError
from meshsdf.grid import Grid
from meshsdf.grid.cut_band import cut_band, reaches_border
from meshsdf.io.dense_form import full_grid
from meshsdf.mesh import icosphere
from meshsdf.sdf import mesh_to_band, mesh_to_grid

STEP = 0.1


def ball_grid(shape=(30, 37, 41), *, origin=(-1.5, -1.8, -2.0), radius=1.0) -> Grid:
    """Distances to a sphere about the world's origin."""
    points = np.stack(np.indices(shape), axis=-1) * STEP + np.array(origin)
    distance = np.linalg.norm(points, axis=-1) - radius
    return Grid(distance.astype(np.float32), STEP, np.array(origin, float), "winding")


def nodes_of(grid, band):
    """Index in the band of every node of the grid, which lie in one place."""
    first = np.rint((grid.origin - band.translation) / grid.voxel_size).astype(np.int64)
    ijk = np.indices(grid.values.shape).reshape(3, -1).T
    world = grid.origin + grid.voxel_size * ijk
    np.testing.assert_allclose(band.to_world(ijk + first), world, atol=1e-12)
    return ijk + first


@pytest.mark.parametrize("origin", [(-1.5, -1.8, -2.0), (-1.53, -1.81, -2.04), (-0.05, 0, 0)])
@pytest.mark.parametrize("half_width", [1.0, 2.5, 4.0])
def test_every_node_keeps_its_value_or_its_side(origin, half_width):
    grid = ball_grid(origin=origin)
    band = cut_band(grid, half_width)
    limit = np.float32(half_width * STEP)
    flat = grid.values.ravel()
    near = np.abs(flat) < limit
    expected = np.where(near, flat, np.where(flat < 0, -limit, limit))
    np.testing.assert_array_equal(band.value_at(nodes_of(grid, band)).astype(np.float32), expected)
    assert band.n_active == near.sum() > 100
    assert (band.sign, band.half_width, band.background) == ("winding", half_width, limit)


def test_numbers_of_nodes_line_up_where_the_origin_is_a_node():
    grid = ball_grid(origin=(-1.5, -18 * STEP, -2.0))
    assert (cut_band(grid).translation == 0).all()
    assert (
        cut_band(ball_grid(origin=(-1.53, -1.8, -2.0))).translation == [-1.53, -1.8, -2.0]
    ).all()


@pytest.mark.parametrize("sign", ["winding", "unsigned"])
def test_a_band_comes_back_from_the_full_grid_it_became(sign):
    band = mesh_to_band(icosphere(subdivisions=3), resolution=40, half_width=2.5, sign=sign)
    again = cut_band(full_grid(band))
    assert again.index.coordinates.tobytes() == band.index.coordinates.tobytes()
    assert again.values.tobytes() == band.values.tobytes()
    assert again.active.tobytes() == band.active.tobytes()
    for name in ("voxel_size", "half_width", "sign", "background"):
        assert getattr(again, name) == getattr(band, name)
    random = np.random.default_rng(0)
    ijk = random.integers(-60, 60, (5000, 3))
    np.testing.assert_array_equal(again.value_at(ijk), band.value_at(ijk))


def test_the_band_of_a_dense_transform_is_that_of_the_mesh():
    mesh = icosphere(subdivisions=3)
    grid, band = mesh_to_grid(mesh, resolution=30), mesh_to_band(mesh, resolution=30)
    cut = cut_band(grid, 3.0)
    assert cut.active_ijk().tobytes() == band.active_ijk().tobytes()
    np.testing.assert_allclose(cut.active_values(), band.active_values(), rtol=0, atol=1e-7)


def test_a_jump_across_zero_keeps_its_signs():
    values = np.full((16, 16, 24), 5.0, np.float32)
    values[3:11, 2:9, 5:20] = -5.0
    values[8, 8, 8] = 0.01
    band = cut_band(Grid(values, 1.0, np.zeros(3)), 1.0)
    ijk = np.indices(values.shape).reshape(3, -1).T
    np.testing.assert_array_equal(band.value_at(ijk) < 0, values.ravel() < 0)
    assert band.n_active == 1


def test_an_inside_that_reaches_the_border_is_seen():
    assert not reaches_border(ball_grid())
    for axis, end in ((0, 1.4), (0, -1.4), (1, 1.7), (1, -1.8), (2, 1.9), (2, -2.0)):
        place = np.zeros(3)
        place[axis] = -end
        moved = np.array([-1.5, -1.8, -2.0]) + place
        assert reaches_border(ball_grid(origin=tuple(moved)))


def test_what_has_no_band_is_refused():
    grid = ball_grid()
    far = Grid(grid.values + 50, STEP, grid.origin)
    with pytest.raises(GridError, match=r"none of the 45510 nodes is nearer .* than 0\.3"):
        cut_band(far)
    values = grid.values.copy()
    values[3, :2] = np.nan
    with pytest.raises(GridError, match="82 of 45510 nodes have no value"):
        cut_band(Grid(values, STEP, grid.origin))
    with pytest.raises(GridError, match=r"half_width is 0\.5 voxels"):
        cut_band(grid, 0.5)
    clipped = Grid(np.clip(grid.values, -0.2, 0.2), STEP, grid.origin, half_width=2.0)
    with pytest.raises(GridError, match="clipped beyond 2 voxels"):
        cut_band(clipped, 3.0)
    assert cut_band(clipped).half_width == 2.0
