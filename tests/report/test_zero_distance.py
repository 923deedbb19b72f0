"""meshsdf.report.zero_distance: between a mesh and where a band's interpolant changes its sign."""

import numpy as np
import pytest
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report.zero_distance import ZeroSides
from meshsdf.report.zero_set import ZeroSet
from meshsdf.sdf import mesh_to_band
from meshsdf.spatial import ClosestPoint
from meshsdf.surface import marching_cubes
from tests.report.zero_samples import (
    dense_values,
    fine_roots,
    interpolated,
    samples_of,
    turned,
)
from tests.surface.bands import band_from_blocks, band_of, blocks_from_nodes, sphere_distance


def sides_of(zero, tolerance):
    return ZeroSides(zero, tolerance, 1_000_000, lambda stage, share: None)


def random_band(seed, *, whole):
    """Two bricks a side of random values, positive at the rim; with zeros and ties if whole."""
    rng = np.random.default_rng(seed)
    values = rng.integers(-2, 3, (16, 16, 16)) * 1.0 if whole else rng.normal(size=(16, 16, 16))
    inner = np.zeros(values.shape, bool)
    inner[5:11, 5:11, 5:11] = True
    values[~inner] = 1.0 + np.abs(values[~inner])
    return band_from_blocks(blocks_from_nodes(values), (0, 0, 0), 8.0, 0.5, (1.0, 2.0, 3.0))


@pytest.mark.parametrize("seed", [None, 0])
def test_on_flat_faces_nothing_is_lost_but_digits(seed):
    body = box_mesh() if seed is None else turned(box_mesh(), seed)
    frame = np.eye(3) if seed is None else Rotation.random(random_state=seed).as_matrix()
    band = mesh_to_band(body, resolution=20, translation=np.array([0.013, 0.007, 0.003]))
    zero = ZeroSet(band, 0.0, 10**6)
    own = np.sort(np.abs(zero.centers @ frame), axis=1)
    zero.cells = zero.cells[own[:, 1] < 0.3]
    assert len(zero.cells) > 400
    digits = 1e-6 * band.voxel_size  # float32 of values up to two voxels, and their gradient is 1
    sides = sides_of(zero, 0.5 * digits)
    assert sides.from_zero_set(ClosestPoint(body)).upper < digits
    square = np.array([[0.2, 0.2, 0.5], [-0.2, 0.2, 0.5], [-0.2, -0.2, 0.5], [0.2, -0.2, 0.5]])
    patch = Mesh(square @ frame.T, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    assert sides.to_zero_set(patch).upper < digits
    assert not sides.met_limit


@pytest.mark.parametrize(("seed", "whole"), [(0, False), (0, True), (1, True)])
def test_intervals_hold_for_values_that_are_no_distances(seed, whole):
    band = random_band(seed, whole=whole)
    surface = marching_cubes(band, topology="trilinear")
    zero = ZeroSet(band, 0.0, 400_000)
    sides = sides_of(zero, 0.04 * band.voxel_size)
    values, low = dense_values(band)
    n_parts = 6
    fine = fine_roots(values, n_parts)
    assert np.abs(interpolated(values, fine)).max() < 1e-12
    roots = band.voxel_size * (fine + low) + band.translation
    spacing = np.sqrt(3) / n_parts * band.voxel_size
    tree = KDTree(roots)
    ball = icosphere(subdivisions=1)
    ball = Mesh(ball.vertices + np.array([4.7, 5.9, 6.8]), ball.faces)
    for mesh in (surface, ball):
        away = sides.from_zero_set(ClosestPoint(mesh))
        seen = ClosestPoint(mesh).distances(roots).distance.max()
        assert seen <= away.upper
        assert away.lower <= seen + spacing
        back = sides.to_zero_set(mesh)
        seen = tree.query(samples_of(mesh, 20_000, seed))[0].max()
        assert seen - spacing <= back.upper
        assert back.lower <= seen + 0.1 * band.voxel_size


def test_a_ball_around_a_ball_is_seen_from_both_sides():
    # The band of a ball of radius 1 against a mesh around one of 1.3: half a voxel is no obstacle
    h = 0.2
    band = band_of(sphere_distance, (-1, -1, -1), (2, 2, 2), h)
    outer = icosphere(1.3, subdivisions=4)
    sag = 1.3 - np.linalg.norm(outer.triangles.mean(axis=1), axis=1).min()
    sides = sides_of(ZeroSet(band, 0.0, 10**6), 0.01 * h)
    off = h**2 / 4 / (1 - np.sqrt(3) * h)  # the zero set is inside the unit sphere by less
    for found in (sides.from_zero_set(ClosestPoint(outer)), sides.to_zero_set(outer)):
        assert 0.3 - sag <= found.upper
        assert found.lower <= 0.3 + off
        assert found.width < 0.0101 * h


def test_a_narrower_tolerance_stays_within_the_wider_one():
    body = turned(box_mesh(), 7)
    band = mesh_to_band(body, resolution=8)
    wide, narrow = (sides_of(ZeroSet(band, 0.0, 10**6), x * band.voxel_size) for x in (0.1, 0.005))
    closest = ClosestPoint(body)
    for few, many in (
        (wide.from_zero_set(closest), narrow.from_zero_set(closest)),
        (wide.to_zero_set(body), narrow.to_zero_set(body)),
    ):
        assert many.width <= 0.00501 * band.voxel_size < few.width
        assert few.lower <= many.upper
        assert many.lower <= few.upper


def test_few_boxes_leave_wider_intervals_that_are_still_true():
    body = turned(box_mesh(), 7)
    band = mesh_to_band(body, resolution=8)
    rough = sides_of(ZeroSet(band, 0.0, 400), 0.01 * band.voxel_size)
    fine = sides_of(ZeroSet(band, 0.0, 10**6), 0.01 * band.voxel_size)
    closest = ClosestPoint(body)
    for few, many in (
        (rough.from_zero_set(closest), fine.from_zero_set(closest)),
        (rough.to_zero_set(body), fine.to_zero_set(body)),
    ):
        assert few.width > 0.1 * band.voxel_size
        assert few.lower <= many.upper
        assert many.lower <= few.upper
    assert rough.met_limit
    assert not fine.met_limit
