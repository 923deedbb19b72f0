"""Surface nets: closed and manifold whatever the values, vertices in the middle of crossings."""

from itertools import product

import numpy as np
import pytest

from meshsdf import Grid, marching_cubes, mesh_to_band, surface_nets
from meshsdf.errors import SurfaceError
from meshsdf.mesh.measures import euler_number, volume
from meshsdf.mesh.primitives import icosphere
from meshsdf.surface.cube_cases import CORNERS as CASES
from meshsdf.surface.cube_cases import loops
from meshsdf.surface.dual_cases import ALL_FACES

from .soundness import assert_closed

CORNERS = np.array(list(product((0, 1), repeat=3)))


def random_grid(kind, shape=(22, 23, 24), seed=0):
    rng = np.random.default_rng(seed)
    inner = rng.normal(size=shape).astype(np.float32)
    if kind == "ties":
        inner = rng.integers(-2, 3, shape).astype(np.float32)
    values = np.pad(inner, 1, constant_values=np.float32(2))
    return Grid(values, 0.5, np.array([1.0, -2.0, 3.0]))


def unions_of_crossings(inside):
    """Of a cell's crossed edges (pairs of corners), those that one surface inside it joins.

    Corners inside hang together along edges and across diagonals of sides; so do those outside
    along edges. A surface parts one group inside from one group outside.
    """

    def groups(which, steps):
        label = {corner: corner for corner in range(8) if which[corner]}
        for _ in range(8):
            for a, b in product(label, repeat=2):
                if np.abs(CORNERS[a] - CORNERS[b]).sum() in steps:
                    label[a] = label[b] = min(label[a], label[b])
        return label

    within, without = groups(inside, {1, 2}), groups(~inside, {1})
    found = {}
    for a, b in product(range(8), repeat=2):
        if inside[a] and not inside[b] and np.abs(CORNERS[a] - CORNERS[b]).sum() == 1:
            found.setdefault((within[a], without[b]), []).append((a, b))
    return list(found.values())


@pytest.mark.parametrize("kind", ["ties", "noise"])
def test_any_values_give_a_closed_manifold(kind):
    surface = surface_nets(random_grid(kind))
    assert surface.n_faces > 10000
    assert_closed(surface)


def test_vertices_are_the_means_of_the_crossings_of_each_part():
    grid = random_grid("noise", shape=(7, 8, 9), seed=3)
    values, expected = grid.values.astype(np.float64), []
    for cell in np.ndindex(*(n - 1 for n in values.shape)):
        at = np.array(cell) + CORNERS
        corner = values[tuple(at.T)]
        for part in unions_of_crossings(corner < 0):
            a, b = np.array(part).T
            t = corner[a] / (corner[a] - corner[b])
            expected.append((at[a] + t[:, None] * (at[b] - at[a])).mean(axis=0))
    expected = grid.voxel_size * np.array(expected) + grid.origin
    found = surface_nets(grid).vertices[: len(expected)]  # others stand on folded arcs
    order = [np.lexsort(np.round(places, 6).T) for places in (found, expected)]
    np.testing.assert_allclose(found[order[0]], expected[order[1]], atol=1e-5)


def test_corners_inside_that_face_each_other_are_joined():
    pattern = sum(1 << CASES.index(corner) for corner in ((0, 0, 0), (1, 1, 0)))
    assert len(loops(pattern)) == 2
    assert len(loops(pattern, ALL_FACES)) == 1
    values = np.ones((4, 4, 4), np.float32)
    values[1, 1, 1] = values[2, 2, 1] = -1
    grid = Grid(values, 1.0, np.zeros(3))
    assert euler_number(surface_nets(grid)) == 2
    assert euler_number(marching_cubes(grid)) == 4


@pytest.mark.parametrize("resolution", [16, 32, 64])
def test_a_ball_is_off_by_the_square_of_the_voxel(resolution):
    band = mesh_to_band(icosphere(1.0, subdivisions=6), resolution=resolution)
    surface = surface_nets(band)
    off = np.abs(np.linalg.norm(surface.vertices, axis=1) - 1)
    assert off.max() < 0.5 * band.voxel_size**2 + 2e-4  # of the icosphere itself
    assert volume(surface) == pytest.approx(4 / 3 * np.pi, rel=3 * band.voxel_size**2)


def test_an_open_border_and_a_cap():
    i, j, k = np.indices((9, 9, 9)).astype(np.float64)
    half = Grid(np.sqrt(i**2 + (j - 4) ** 2 + (k - 4) ** 2) - 3.3, 1.0, np.zeros(3))
    assert euler_number(surface_nets(half)) == 1
    assert_closed(surface_nets(half, border="cap"))


def test_bad_choices_are_refused():
    grid = random_grid("noise", shape=(4, 4, 4))
    with pytest.raises(SurfaceError, match="level is nan"):
        surface_nets(grid, level=float("nan"))
    assert surface_nets(grid, level=-99.0).n_faces == 0
