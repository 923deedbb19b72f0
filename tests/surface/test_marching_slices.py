"""meshsdf.surface.marching_slices: the mesh of the whole grid, from two slices at a time."""

import json
import subprocess
import sys
from itertools import product

import numpy as np
import pytest

from meshsdf.errors import SurfaceError
from meshsdf.grid import Grid
from meshsdf.mesh import Mesh
from meshsdf.surface import marching_cubes, marching_cubes_slices
from tests.surface.bands import nodes_of, sphere_distance
from tests.surface.soundness import assert_closed, assert_manifold

ORIGIN = np.array([0.1, -0.2, 0.3])
BORDERS = ("open", "cap", "pad")
CHOICES = list(product(BORDERS, ("manifold", "trilinear")))


def together(parts):
    """The mesh of all parts, after each has named only vertices given so far."""
    vertices, faces, material = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], []
    n = 0
    for part in parts:
        n += len(part.vertices)
        assert part.faces.min(initial=0) >= 0
        assert part.faces.max(initial=-1) < n
        vertices.append(part.vertices)
        faces.append(part.faces)
        if part.material_index is not None:
            material.append(part.material_index)
    return Mesh(
        np.concatenate(vertices),
        np.concatenate(faces).astype(np.int32),
        material_index=np.concatenate(material) if material else None,
    )


def assert_same(values, border, topology, voxel_size=0.37, level=0.0):
    grid = Grid(values, voxel_size, ORIGIN)
    whole = marching_cubes(grid, border=border, topology=topology, level=level)
    parts = marching_cubes_slices(
        iter(values), voxel_size=voxel_size, origin=ORIGIN, border=border, topology=topology,
        level=level,
    )  # fmt: skip
    mesh = together(parts)
    assert np.array_equal(mesh.vertices, whole.vertices)
    assert np.array_equal(mesh.faces, whole.faces)
    assert (mesh.material_index is None) == (whole.material_index is None)
    if whole.material_index is not None:
        assert np.array_equal(mesh.material_index, whole.material_index)
    return mesh


def random_values(rng, shape):
    kinds = rng.integers(-2, 3, shape).astype(float), rng.normal(size=shape)
    return kinds[rng.integers(2)].astype((np.float32, np.float64)[rng.integers(2)])


@pytest.mark.parametrize(("border", "topology"), CHOICES)
def test_slices_give_the_mesh_of_the_grid_bit_for_bit(border, topology):
    rng = np.random.default_rng(0)
    n_faces = 0
    for shape in ((2, 2, 2), (7, 3, 130), (5, 9, 63), (4, 5, 62), (3, 2, 64), (2, 70, 4)):
        mesh = assert_same(random_values(rng, shape), border, topology, level=0.25)
        assert_manifold(mesh)
        if border != "open":
            assert_closed(mesh)
        n_faces += mesh.n_faces
    assert n_faces > 5000


@pytest.mark.parametrize(("border", "topology"), CHOICES)
def test_missing_data_are_left_out_as_of_the_grid(border, topology):
    rng = np.random.default_rng(1)
    n_open = 0
    for shape in ((6, 7, 8), (5, 4, 66)):
        values = random_values(rng, shape)
        missing = rng.random(shape) < 0.15
        if border == "cap":
            missing = np.pad(missing[1:-1, 1:-1, 1:-1], 1)
        values[missing] = np.nan
        mesh = assert_same(values, border, topology)
        assert_manifold(mesh)
        n_open += mesh.n_vertices - 3 * mesh.n_faces / 2 + mesh.n_faces != 0
    assert n_open


def test_an_empty_grid_gives_empty_parts():
    for values in (np.ones((3, 4, 5)), np.full((3, 4, 5), np.nan), -np.ones((3, 4, 5))):
        assert assert_same(values, "open", "manifold").n_faces == 0
    assert assert_same(-np.ones((2, 2, 2)), "cap", "trilinear").n_faces == 12


def test_a_slice_may_be_changed_once_the_next_is_asked_for():
    values = sphere_distance(nodes_of((-5, -5, -5), (11, 11, 11)), radius=3.3)

    def reused():
        buffer = np.empty((11, 11))
        for plane in values:
            buffer[:] = plane
            yield buffer
            buffer[:] = np.nan

    mesh = together(marching_cubes_slices(reused()))
    assert_closed(mesh)
    assert np.array_equal(mesh.vertices, marching_cubes(Grid(values, 1.0, np.zeros(3))).vertices)


def test_slices_may_be_views_in_any_order_of_memory():
    values = sphere_distance(nodes_of((-5, -6, -4), (11, 13, 9)), radius=3.3)
    expected = marching_cubes(Grid(values, 1.0, np.zeros(3)))
    turned = np.asfortranarray(values)
    read_only = values.copy()
    read_only.flags.writeable = False
    for given in (turned, read_only, np.repeat(values, 2, axis=2)[:, :, ::2]):
        assert np.array_equal(together(marching_cubes_slices(given)).faces, expected.faces)


def test_parts_come_as_the_slices_do():
    seen = []

    def slices():
        for i in range(9):
            seen.append(i)
            yield np.full((4, 4), i - 3.5)

    parts = marching_cubes_slices(slices())
    assert seen == []
    n_seen = [(len(part.vertices), len(part.faces), len(seen)) for part in parts]
    assert [n for n in n_seen if n[0]] == [(16, 0, 5)]  # between slices 3 and 4
    assert [n for n in n_seen if n[1]] == [(0, 18, 6)]


# In a process of its own: what other threads allocate would count, too
PEAKS = """
import json, tracemalloc
import numpy as np
from meshsdf.surface import marching_cubes_slices

n = 96
j, k = np.indices((n, n)) - n / 2

def peak(n_slices):
    slices = ((np.hypot(j, k) - n / 4 + np.sin(i)).astype(np.float32) for i in range(n_slices))
    tracemalloc.start()
    n_faces = sum(len(part.faces) for part in marching_cubes_slices(slices))
    found = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return n_faces, found

peak(3)  # loads the kernels
print(json.dumps([n, *peak(10), *peak(120)]))
"""


def test_memory_does_not_grow_with_the_number_of_slices():
    done = subprocess.run([sys.executable, "-c", PEAKS], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    n, few_faces, few, many_faces, many = json.loads(done.stdout)
    assert many_faces > 9 * few_faces
    assert many < 1.2 * few
    assert many < 40 * 4 * n * n  # some tens of planes of float32


def test_choices_are_judged_at_the_call():
    slices = [np.ones((2, 2))] * 2
    for name, value in (("level", np.nan), ("voxel_size", 0.0), ("voxel_size", np.inf)):
        with pytest.raises(SurfaceError, match=f"{name} is {value}"):
            marching_cubes_slices(slices, **{name: value})
    with pytest.raises(SurfaceError, match="origin is"):
        marching_cubes_slices(slices, origin=np.array([0, np.nan, 0]))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (np.ones((4, 5, 1)), r"slice 2 has the shape \(4, 5, 1\)"),
        (np.ones((4, 6)), r"slice 2 is \(4, 6\) of float64, those before are \(4, 5\)"),
        (np.ones((4, 5), np.float32), r"slice 2 is \(4, 5\) of float32"),
        (np.ones((4, 5), int), "slice 2 holds int64"),
        ([[1.0, 2.0]], "slice 2 holds list"),
    ],
)
def test_a_slice_unlike_the_first_is_refused_by_its_number(wrong, message):
    parts = marching_cubes_slices(iter([np.ones((4, 5)), np.ones((4, 5)), wrong]))
    assert len(next(parts).faces) == len(next(parts).faces) == 0
    with pytest.raises(SurfaceError, match=message):
        next(parts)


@pytest.mark.parametrize("n", [0, 1])
def test_fewer_than_two_slices_are_refused(n):
    with pytest.raises(SurfaceError, match=f"there are {n} slices, so no cell"):
        list(marching_cubes_slices([np.ones((4, 5))] * n))
    with pytest.raises(SurfaceError, match=r"slice 0 has the shape \(1, 5\)"):
        list(marching_cubes_slices([np.ones((1, 5))] * 2))


def test_a_cap_needs_data_at_the_border():
    for place in ((0, 2, 2), (1, 0, 2), (1, 2, 3), (2, 2, 2)):
        values = np.ones((3, 4, 4))
        values[place] = np.nan
        with pytest.raises(SurfaceError, match=f"slice {place[0]} has 1 border nodes without data"):
            list(marching_cubes_slices(values, border="cap"))
    values = np.ones((3, 4, 4))
    values[1, 2, 2] = np.nan
    assert list(marching_cubes_slices(values, border="cap"))
