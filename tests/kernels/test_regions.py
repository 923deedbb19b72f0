"""meshsdf.kernels.regions: flats, how wide they are, and the regions they make."""

import numpy as np
import pytest
import trimesh

from meshsdf import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.surface.regions import cut_regions


def folded_strips(widths, turn):
    """Strips of length 10, of the given widths, each turned by ``turn`` degrees from the last."""
    angles = np.radians(turn) * np.arange(len(widths))
    steps = np.asarray(widths)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    profile = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])
    n = len(profile)
    ends = [np.column_stack([np.full(n, z), profile]) for z in (0.0, 10.0)]
    i = np.arange(n - 1)
    one, two = np.stack([i, i + 1, n + i], axis=1), np.stack([i + 1, n + i + 1, n + i], axis=1)
    return Mesh(np.concatenate(ends), np.concatenate([one, two]).astype(np.int32))


def n_regions(mesh, voxel_size, feature_angle=30.0):
    regions = cut_regions(mesh, sign="winding", feature_angle=feature_angle, voxel_size=voxel_size)
    return len(np.unique(regions.labels)), len(regions.creases)


@pytest.mark.parametrize("turn", [0.01, 3.0, 29.0])
def test_wide_flats_are_regions_however_little_they_turn(turn):
    mesh = folded_strips([4.0, 4.0, 4.0], turn)
    assert n_regions(mesh, 1.0) == (3, 2)
    assert n_regions(mesh, 10.0) == (1, 0)


def test_sharp_edges_part_narrow_flats_too():
    mesh = folded_strips([0.1, 0.1, 0.1], 31.0)
    assert n_regions(mesh, 1.0) == (3, 2)
    assert n_regions(mesh, 1.0, feature_angle=32.0) == (1, 0)


def test_narrow_flats_join_each_other_but_not_wide_ones():
    mesh = folded_strips([4.0, 0.1, 0.1, 0.1, 4.0], 3.0)
    assert n_regions(mesh, 1.0) == (3, 2)


def test_a_strip_counts_by_its_width_even_if_cut_finely():
    strips = folded_strips([1.2, 1.2], 5.0)
    vertices, faces = strips.vertices, strips.faces
    for _ in range(4):
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    fine = Mesh(vertices, faces.astype(np.int32))
    # 10 long: its area is half of 1.07 times its outline
    assert n_regions(fine, 1.05)[0] == n_regions(strips, 1.05)[0] == 2
    assert n_regions(fine, 1.09)[0] == n_regions(strips, 1.09)[0] == 1


def test_a_ball_is_one_region_of_coarse_voxels_and_a_polyhedron_of_fine_ones():
    ball = icosphere(1.0, subdivisions=2)
    assert n_regions(ball, 1.0)[0] == 1
    assert n_regions(ball, 0.01) == (ball.n_faces, 3 * ball.n_faces // 2)
    assert n_regions(box_mesh(), 100.0) == (6, 12)
