"""meshsdf.surface.continuation: the faces of marching cubes, from a surface's own cells only."""

import importlib

import numpy as np
import pytest

from meshsdf.box import Box
from meshsdf.errors import SurfaceError
from meshsdf.grid import Grid
from meshsdf.implicit import (
    Exactness,
    box,
    complement,
    difference,
    from_function,
    gyroid,
    plane,
    sphere,
    torus,
    union,
)
from meshsdf.surface import continue_surface, lattice_cells, marching_cubes
from tests.surface.soundness import (
    assert_closed,
    assert_manifold,
    euler_characteristic,
    open_edges,
    triangle_set,
    volume,
)


class Recorded:
    """A shape that remembers where it was asked for values, call by call."""

    def __init__(self, shape):
        self.shape = shape
        self.calls = []
        self.exactness, self.box, self.gradient = shape.exactness, shape.box, shape.gradient

    def __call__(self, points):
        self.calls.append(points.copy())
        return self.shape(points)

    @property
    def points(self):
        return np.concatenate(self.calls)


def shape_of_nodes(values):
    """The function that has given values at nodes 0, 1, 2 ... and none between; only signs."""

    def value(points):
        index = np.rint(points).astype(int)
        assert (index == points).all()
        return values[tuple(index.T)]

    return from_function(value, Exactness.SIGN, box=None)


def box_of(values):
    return Box(np.zeros(3), np.array(values.shape) - 1.0)


def mixed_cells(values, level=0.0):
    """(n, 3) lowest nodes of the cells with data whose corners lie on both sides."""
    ijk = np.stack(np.indices(np.array(values.shape) - 1), axis=-1).reshape(-1, 3)
    offsets = np.stack(np.indices((2, 2, 2)), axis=-1).reshape(-1, 3)
    corners = values[tuple((ijk[:, None] + offsets).transpose(2, 0, 1))]
    inside = corners < level
    return ijk[inside.any(1) & ~inside.all(1) & ~np.isnan(corners).any(1)]


def dense(shape, voxel_size, n):
    """Node values on n + 1 nodes along each axis, from (0, 0, 0) on."""
    nodes = voxel_size * np.stack(np.indices((n + 1,) * 3), axis=-1).reshape(-1, 3)
    return shape(nodes.astype(float)).reshape((n + 1,) * 3)


def random_values(rng, number):
    values = rng.integers(-2, 3, rng.integers(3, 9, 3)).astype(float)
    if number % 3 == 1:
        values = rng.normal(size=values.shape)
    if number % 3 == 2:
        values[rng.random(values.shape) < 0.05] = np.nan
    return values


def test_with_a_seed_in_every_cell_any_values_give_the_triangles_of_marching_cubes():
    rng = np.random.default_rng(1)
    n_faces = 0
    for number in range(90):
        values = random_values(rng, number)
        cells = mixed_cells(values)
        if len(cells) == 0:
            continue
        mesh = continue_surface(
            shape_of_nodes(values), voxel_size=1.0, seeds=cells + 0.5, box=box_of(values)
        )
        expected = marching_cubes(Grid(values, 1.0, np.zeros(3)))
        np.testing.assert_array_equal(triangle_set(mesh), triangle_set(expected))
        assert mesh.n_vertices == expected.n_vertices
        assert_manifold(mesh)
        n_faces += mesh.n_faces
    assert n_faces > 12_000


def test_from_one_seed_whole_components_come_and_each_of_their_nodes_is_evaluated_once():
    rng = np.random.default_rng(2)
    n_parts = 0
    for _ in range(60):
        values = np.pad(rng.normal(size=(6, 7, 8)) + 1.2, 1, constant_values=1.0)
        cells = mixed_cells(values)
        if len(cells) == 0:
            continue
        shape = Recorded(shape_of_nodes(values))
        seed = cells[rng.integers(len(cells))] + 0.5
        mesh = continue_surface(shape, voxel_size=1.0, seeds=seed[None], box=box_of(values))
        assert_closed(mesh)
        everything = {
            tuple(t) for t in triangle_set(marching_cubes(Grid(values, 1.0, np.zeros(3))))
        }
        found = {tuple(t) for t in triangle_set(mesh)}
        assert found <= everything
        n_parts += found != everything
        # The nodes are the corners of cells that hold a triangle, and no others
        asked = {tuple(p) for p in shape.points}
        assert len(asked) == len(shape.points)
        own = {tuple(c) for c in np.floor(mesh.triangles.mean(axis=1)).astype(int)}
        assert asked == {
            (i + x, j + y, k + z) for i, j, k in own for x in (0, 1) for y in (0, 1) for z in (0, 1)
        }
    assert n_parts > 20


def shapes():
    """Shapes within (0, 4)^3, with the number of their components and Euler characteristic."""
    c = np.array([2.0, 2.0, 2.0])
    return {
        "sphere": (sphere(1.5, c), 1, 2),
        "torus": (torus(1.2, 0.45, c), 1, 0),
        "box": (box(np.array([2.0, 1.0, 3.1]), c), 1, 2),
        "shell": (difference(sphere(1.6, c), sphere(0.7, c)), 2, 4),
        "two": (union(sphere(0.5, c - 1.3), sphere(0.4, c + 1.2)), 2, 4),
        "hole": (difference(box(np.full(3, 3.0), c), torus(0.9, 0.3, c)), 2, 2),
    }


@pytest.mark.parametrize("name", shapes())
@pytest.mark.parametrize("level", [0.0, 0.125])
def test_a_search_finds_all_components_and_the_mesh_is_that_of_the_dense_grid(name, level):
    shape, _, euler = shapes()[name]
    h, n = 0.0625, 64
    around = Box(np.zeros(3), np.full(3, 4.0))
    mesh = continue_surface(shape, voxel_size=h, level=level, box=around)
    expected = marching_cubes(Grid(dense(shape, h, n), h, np.zeros(3)), level=level)
    np.testing.assert_array_equal(triangle_set(mesh), triangle_set(expected))
    assert_closed(mesh)
    assert euler_characteristic(mesh) == euler


def test_a_surface_that_reaches_the_box_ends_there_and_open():
    shape, h, n = gyroid(1.5), 0.0625, 48
    mesh = continue_surface(shape, voxel_size=h, box=Box(np.zeros(3), np.full(3, 3.0)))
    expected = marching_cubes(Grid(dense(shape, h, n), h, np.zeros(3)))
    np.testing.assert_array_equal(triangle_set(mesh), triangle_set(expected))
    assert_manifold(mesh)
    ends = mesh.vertices[open_edges(mesh)]
    assert len(ends) > 100
    assert ((ends == 0) | (ends == 3)).all(axis=1).any(axis=1).all()
    sheet = continue_surface(
        plane(np.array([1.0, 2.0, 3.0]), 1.0), voxel_size=0.25, seeds=np.array([[1.0, 0, 0]]),
        box=Box(np.full(3, -2.0), np.full(3, 2.0)),
    )  # fmt: skip
    np.testing.assert_allclose(sheet.vertices @ [1, 2, 3], 1.0, atol=1e-13)
    np.testing.assert_allclose(np.ptp(sheet.vertices, axis=0), [4, 4, 11 / 3])


def test_the_mesh_does_not_depend_on_the_seeds_nor_on_the_size_of_the_waves(monkeypatch):
    shape = shapes()["two"][0]
    first = continue_surface(shape, voxel_size=0.1)
    on_both = np.array([[0.7, 0.7, 0.2], [3.2, 3.2, 2.8]])
    other = continue_surface(shape, voxel_size=0.1, seeds=on_both)
    monkeypatch.setattr(lattice_cells, "CELLS_PER_WAVE", 7)
    monkeypatch.setattr(lattice_cells, "POINTS_PER_CALL", 11)
    for mesh in (other, continue_surface(shape, voxel_size=0.1, seeds=on_both[::-1])):
        np.testing.assert_array_equal(mesh.vertices, first.vertices)
        np.testing.assert_array_equal(mesh.faces, first.faces)


@pytest.mark.parametrize("way", ["seed", "search", "root"])
def test_evaluations_grow_with_the_surface(way):
    counts, n_calls, resolutions = [], [], [20, 40, 80, 160]
    seeds = None if way == "search" else np.array([[1.0, 0, 0]])
    placement = "root" if way == "root" else "linear"
    for n in resolutions:
        shape = Recorded(sphere(1.0))
        mesh = continue_surface(shape, voxel_size=2 / n, seeds=seeds, placement=placement)
        counts.append(len(shape.points))
        n_calls.append(len(shape.calls))
        assert counts[-1] < (12 if way == "root" else 5) * mesh.n_vertices
    slope = np.polyfit(np.log(resolutions), np.log(counts), 1)[0]
    assert slope == pytest.approx(2, abs=0.05)
    assert max(np.array(n_calls) / resolutions) < 3  # as many waves as cells along a meridian


def test_far_apart_components_cost_no_more_than_near_ones():
    counts = []
    for distance in (4.0, 4000.0):
        shape = Recorded(union(sphere(1.0), sphere(1.0, np.array([distance, 0, 0]))))
        mesh = continue_surface(shape, voxel_size=0.125)
        assert euler_characteristic(mesh) == 4
        counts.append(len(shape.points))
    assert counts[1] < counts[0] + 16 * 10  # some more cubes for each of 10 doublings


def test_vertices_by_root_finding_lie_on_the_surface_to_rounding():
    for name in ("sphere", "torus", "box", "two"):
        shape = shapes()[name][0]
        mesh = continue_surface(shape, voxel_size=0.1, placement="root")
        # 2^-41 voxels beside the crossing, where the slope is at most 1, and rounding of 4.0
        assert np.abs(shape(mesh.vertices)).max() <= 0.1 * 2.0**-41 + 1e-14
        linear = continue_surface(shape, voxel_size=0.1)
        np.testing.assert_array_equal(mesh.faces, linear.faces)


def test_a_function_that_tells_only_the_side_has_its_surface_placed_by_roots():
    ball = sphere(1.5, np.array([2.0, 2.0, 2.0]))
    sign = from_function(lambda p: np.where(ball(p) < 0, -1.0, 1.0), Exactness.SIGN, box=ball.box)
    seeds = np.array([[3.5, 2.0, 2.0]])
    mesh = continue_surface(sign, voxel_size=0.125, seeds=seeds, placement="root")
    slack = 0.125 * 2.0**-41 + 1e-15
    assert np.abs(ball(mesh.vertices)).max() <= slack
    blocks = continue_surface(sign, voxel_size=0.125, seeds=seeds)
    assert np.abs(ball(blocks.vertices)).max() > 0.01


def test_distance_of_the_mesh_from_the_surface_is_within_the_stated_bounds_and_of_order_two():
    for placement, share in (("linear", 1 / 2), ("root", 3 / 8)):
        errors, sizes = [], [0.2, 0.1, 0.05, 0.025]
        for h in sizes:
            mesh = continue_surface(sphere(1.0), voxel_size=h, placement=placement)
            weights = np.random.default_rng(3).dirichlet(np.ones(3), 8)
            samples = np.concatenate([*(weights @ mesh.triangles), mesh.vertices])
            errors.append(np.abs(np.linalg.norm(samples, axis=1) - 1).max())
            assert errors[-1] <= share * h**2 / (1 - np.sqrt(3) * h)
        assert np.polyfit(np.log(sizes), np.log(errors), 1)[0] == pytest.approx(2, abs=0.1)


def test_a_level_moves_the_surface_by_as_much():
    for level in (-0.5, 0.25):
        mesh = continue_surface(sphere(1.0), voxel_size=0.1, level=level, placement="root")
        np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1 + level, atol=1e-12)
        assert_closed(mesh)
        assert volume(mesh) == pytest.approx(4 / 3 * np.pi * (1 + level) ** 3, rel=0.03)


def test_a_surface_that_touches_its_box_is_not_cut():
    for h in (0.25, 0.1, 1 / 3):
        assert_closed(continue_surface(box(np.ones(3)), voxel_size=h))
        assert_closed(continue_surface(sphere(1.0), voxel_size=h))


def test_a_seed_beside_the_surface_by_less_than_a_cell_will_do():
    grid = continue_surface(sphere(1.0), voxel_size=0.25)
    for seed in ([1.2, 0.1, 0.1], [0.0, 0.0, -0.99], [0.01, -1.01, 0.0]):
        mesh = continue_surface(sphere(1.0), voxel_size=0.25, seeds=np.array([seed]))
        np.testing.assert_array_equal(mesh.vertices, grid.vertices)


def test_progress_is_told_and_may_stop_the_work():
    told = []
    continue_surface(
        sphere(1.0), voxel_size=0.1, placement="root",
        progress=lambda stage, fraction: told.append((stage, fraction)),
    )  # fmt: skip
    assert list(dict.fromkeys(stage for stage, _ in told)) == [
        "searching", "growing", "roots", "surface",
    ]  # fmt: skip
    assert all(0 <= fraction <= 1 for _, fraction in told)

    def stop(stage, fraction):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        continue_surface(sphere(1.0), voxel_size=0.1, progress=stop)


def test_nothing_to_find_is_an_empty_mesh():
    mesh = continue_surface(sphere(1.0), voxel_size=0.1, level=-1.5)
    assert (mesh.n_vertices, mesh.n_faces) == (0, 0)


NEAR = np.array([[1.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("shape", "choices", "message"),
    [
        (sphere(1.0), {"voxel_size": 0}, "voxel_size is 0"),
        (sphere(1.0), {"level": np.nan}, "level is nan"),
        (gyroid(1.0), {}, "the shape has no box"),
        (complement(sphere(1.0)), {"seeds": NEAR}, "the shape has no box"),
        (union(sphere(1.0), sphere(1.1)), {"level": 0.5}, r"level is 0\.5, and the shape's box"),
        (sphere(1.0), {"seeds": np.empty((0, 3))}, "there are no seeds"),
        (sphere(1.0), {"seeds": np.array([[1.0, 0, 0], [9, 0, 0]])}, r"seed 1 at \[9\.0, 0\.0, 0"),
        (sphere(1.0), {"seeds": np.array([[np.nan, 0, 0]])}, "seed 0 at .* lies outside the box"),
        (sphere(1.0), {"seeds": np.zeros((1, 3))}, r"seed 0 at \[0\.0, 0\.0, 0\.0\] is not on the"),
        (sphere(1.0), {"voxel_size": 1e-7}, "has too many cells of 1e-07"),
        (sphere(1.0), {"voxel_size": 1e-300}, "has too many cells of 1e-300"),
        (
            from_function(lambda p: p[:, 0], Exactness.SIGN, box=sphere(1.0).box),
            {},
            "the function is only known by its sign",
        ),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_numbers(shape, choices, message):
    with pytest.raises(SurfaceError, match=message):
        continue_surface(shape, **{"voxel_size": 0.1, **choices})


def test_a_placement_of_another_name_and_a_wrong_number_of_values_are_refused():
    module = importlib.import_module("meshsdf.surface.continuation")
    with pytest.raises(SurfaceError, match=r"placement is 'cubic'(.|\n)*'linear', 'root'"):
        module.check_placement("cubic")
    with pytest.raises(SurfaceError, match=r"gave the shape \(3, 3\) for 3 points"):
        lattice_cells.evaluate(lambda points: points, np.ones((3, 3)))
