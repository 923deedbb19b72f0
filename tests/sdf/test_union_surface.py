"""meshsdf.sdf.union and marching cubes: the surface of a union, and a scene of 27 bodies."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.io import read_mesh
from meshsdf.mesh import Mesh, area, check, euler_number, icosphere, n_components, volume
from meshsdf.mesh.components import component_labels
from meshsdf.sdf import mesh_to_band
from meshsdf.surface import marching_cubes
from tests.mesh.shapes import joined
from tests.mesh.unions import united
from tests.models import model, needs_models

from .test_narrow_band import ROUNDING, libigl_distances
from .test_union import assert_points_of, wound


@pytest.mark.parametrize("resolution", [64, 128])
def test_marching_cubes_gives_the_surface_of_the_union(resolution):
    bodies = [icosphere(1.0), icosphere(0.8, center=(0.9, 0.2, 0.1))]
    bodies.append(icosphere(0.7, center=(0.3, 0.9, 0.3)))
    union = united(*bodies)
    band = mesh_to_band(joined(*bodies), resolution=resolution)
    surface = marching_cubes(band)
    assert (euler_number(surface), n_components(surface)) == (2, 1)
    # Cells cut off ridges and fill grooves by less than half a voxel
    assert libigl_distances(union, surface.vertices).max() < 0.5 * band.voxel_size
    assert volume(surface) == pytest.approx(volume(union), rel=4 / resolution**2)
    assert area(surface) == pytest.approx(area(union), rel=0.3 / resolution)


@needs_models
def test_the_27_bodies_of_boolean_are_one():
    mesh = read_mesh(model("boolean.glb"))
    report = check(mesh, self_intersections=False)
    labels, n = component_labels(mesh.welded.table)
    assert n == report.n_components == 27
    bodies = [Mesh(mesh.welded.points, mesh.welded.faces[labels == i]) for i in range(n)]
    union = united(*bodies)
    band = mesh_to_band(mesh, resolution=128, report=report)
    points, values = band.to_world(band.active_ijk()), band.active_values()
    h = band.voxel_size
    assert_allclose(np.abs(values) / h, libigl_distances(union, points) / h, atol=ROUNDING)
    clear = np.abs(values) > 1e-6 * h
    assert_array_equal((values < 0)[clear], wound(union, points)[clear])
    surface = marching_cubes(band)
    assert (euler_number(surface), n_components(surface)) == (2, 1)
    assert volume(surface) == pytest.approx(volume(union), rel=1e-3)
    assert_points_of(mesh, union)
