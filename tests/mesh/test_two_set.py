"""meshsdf.mesh.two_set: which meshes part space into inside and outside."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from meshsdf.errors import MeshError
from meshsdf.mesh import Mesh, check

from . import oracle_two_set as oracle
from .shapes import (
    cube,
    flipped,
    joined,
    klein_bottle,
    make,
    moebius_band,
    soup_of,
    with_faces,
    with_t_junction,
    without_faces,
)

QUARTER_TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])


def two_cubes_with_one_wall() -> Mesh:
    """Two cubes side by side whose common wall is there once: three sheets at its edges."""
    both = joined(cube(), cube((1, 0, 0)))
    return without_faces(both, 12, 13)


SHAPES = {  # name: (mesh, two_set, by index, by welding, oriented)
    "cube": (cube(), True, True, True, True),
    "flipped face": (flipped(cube(), 0), True, True, True, False),
    "duplicate face": (with_faces(cube(), cube().faces[3]), False, False, False, False),
    "reversed duplicate": (with_faces(cube(), cube().faces[3][::-1]), False, False, False, False),
    "missing face": (without_faces(cube(), 0), False, False, False, False),
    "shared edge": (joined(cube(), cube((1, 1, 0))), True, True, True, True),
    "shared vertex": (joined(cube(), cube((1, 1, 1))), True, True, True, True),
    "doubled wall": (joined(cube(), cube((1, 0, 0))), True, True, True, True),
    "one wall": (two_cubes_with_one_wall(), False, False, False, False),
    "overlap": (joined(cube(), cube((0.5, 0.4, 0.3))), True, True, True, True),
    "T-junction": (with_t_junction(cube(), 0, (0, 0, 0.5)), True, False, False, True),
    "unwelded": (soup_of(cube()), True, False, True, True),
    "Klein bottle": (klein_bottle(), True, True, True, False),
    "Möbius band": (moebius_band(), False, False, False, False),
    "nested": (joined(cube(size=3.0), flipped(cube((1, 1, 1)), *range(12))),) + (True,) * 4,
}


@pytest.mark.parametrize("name", SHAPES)
def test_every_shape_gets_its_known_verdict(name):
    mesh, *expected = SHAPES[name]
    report = check(mesh)
    found = [report.two_set, report.two_set_by_index, report.two_set_by_welding, report.oriented]
    assert found == expected
    assert report.two_set == oracle.is_two_set(mesh)
    assert report.oriented == oracle.is_oriented(mesh)
    assert (report.n_open_edges == 0) == report.two_set == (len(report.holes) == 0)


@pytest.mark.parametrize("name", SHAPES)
def test_rays_agree_everywhere_when_two_set_and_somewhere_disagree_when_not(name):
    mesh, two_set, *_ = SHAPES[name]
    rng = np.random.default_rng(5)
    points = rng.uniform(mesh.box.lower - 0.2, mesh.box.upper + 0.2, (60, 3))
    directions = rng.normal(size=(24, 3))
    votes = np.array([oracle.ray_votes(mesh, p, directions) for p in points])
    agree = (votes == votes[:, :1]).all(axis=1)
    assert agree.all() == two_set
    assert votes.any()
    assert not votes.all()


@pytest.mark.parametrize("name", SHAPES)
def test_a_watertight_mesh_of_trimesh_is_two_set_and_consistent_winding_is_oriented(name):
    mesh = SHAPES[name][0]
    other = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    report = check(mesh)
    if other.is_watertight:
        assert report.two_set_by_index
        assert report.oriented_by_index == bool(other.is_winding_consistent)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("scale", [1e-9, 1e6, 1e150])
def test_the_verdict_does_not_depend_on_size_turn_or_numbering(name, scale):
    mesh, *expected = SHAPES[name]
    rng = np.random.default_rng(2)
    turned = mesh.vertices @ QUARTER_TURN.T * 2.0 ** np.round(np.log2(scale))
    numbers = rng.permutation(mesh.n_vertices)
    vertices = np.empty_like(turned)
    vertices[numbers] = turned
    faces = numbers[mesh.faces][rng.permutation(mesh.n_faces)]
    report = check(make(vertices, faces))
    found = [report.two_set, report.two_set_by_index, report.two_set_by_welding, report.oriented]
    assert found == expected
    before = check(mesh)
    for name_ in ("n_open_edges", "n_components", "n_duplicate_faces", "n_nonmanifold_edges"):
        assert getattr(report, name_) == getattr(before, name_), name_


def test_a_t_junction_at_ugly_coordinates_cancels_and_one_ulp_beside_it_does_not():
    rng = np.random.default_rng(8)
    for _ in range(50):
        middle = rng.uniform(-9, 9, 3)
        half = rng.integers(-(2**20), 2**20, 3) * 2.0**-21  # both sums are exact to 53 bits
        middle = np.round(middle * 2.0**21) * 2.0**-21
        a, b, c, d = middle - half, middle + half, rng.normal(size=3), rng.normal(size=3)
        whole = make([a, b, c, d], [(0, 1, 2), (1, 0, 3), (2, 1, 3), (0, 2, 3)])
        report = check(with_t_junction(whole, 0, middle))
        assert report.two_set
        assert report.oriented
        assert not report.two_set_by_index
        assert report.n_tjunction_edges == 3
        beside = middle.copy()
        beside[0] = np.nextafter(beside[0], np.inf)
        report = check(with_t_junction(whole, 0, beside))
        assert not report.two_set
        assert report.n_open_edges == 3


def test_a_collinear_sliver_closes_a_t_junction_by_index_and_stays_in_the_chain():
    split = with_t_junction(cube(), 0, (0, 0, 0.5))
    a, b, _ = cube().faces[0]
    filled = with_faces(split, (a, b, 8))
    report = check(filled)
    assert report.two_set_by_index
    assert report.n_degenerate_faces == 1
    assert report.strict
    assert report.n_components == 1


def test_faces_that_repeat_a_corner_change_nothing_but_their_count():
    report = check(with_faces(cube(), (0, 0, 5), (3, 3, 3)))
    assert report.two_set_by_index
    assert report.oriented
    assert report.n_degenerate_faces == 2
    assert report.n_components == 1
    assert report.n_nonmanifold_edges == 0


def test_one_vertex_moved_by_one_ulp_in_a_soup_opens_a_crack():
    vertices = soup_of(cube((0.1, 0.2, 0.3))).vertices.copy()
    vertices[0, 0] = np.nextafter(vertices[0, 0], np.inf)
    report = check(make(vertices, np.arange(36)))
    assert not report.two_set
    assert report.n_open_edges == 4
    assert report.crack_width == pytest.approx(np.spacing(0.1))


def test_a_long_edge_may_meet_several_short_ones_and_gaps_are_found_on_the_line():
    # Along the x axis: one edge 0..8 against edges 0..2, 2..4, 5..8: the gap 4..5 survives.
    top = [(0, 0, 0), (8, 0, 0), (4, 1, 0)]
    low = [
        (0, 0, 0),
        (2, 0, 0),
        (1, -1, 0),
        (4, 0, 0),
        (3, -1, 0),
        (5, 0, 0),
        (8, 0, 0),
        (6, -1, 0),
    ]
    mesh = make([*top, *low], [(0, 1, 2), (4, 3, 5), (6, 4, 7), (9, 8, 10)])
    report = check(mesh, self_intersections=False)
    on_axis = [
        sorted(float(x) for x in (p[0], q[0]))
        for hole in report.holes
        for p, q in zip(hole.points, np.roll(hole.points, -1, axis=0), strict=True)
        if p[1] == q[1] == 0
    ]
    assert on_axis == [[4.0, 5.0]]


lattice_points = st.lists(st.tuples(*[st.integers(0, 2)] * 3), min_size=4, max_size=9, unique=False)


@settings(max_examples=150, deadline=None)
@given(lattice_points, st.integers(0, 2**31), st.integers(1, 4))
def test_random_lattice_tetrahedra_agree_with_the_slow_twin(points, seed, n_solids):
    rng = np.random.default_rng(seed)
    faces = []
    for _ in range(n_solids):
        a, b, c, d = rng.integers(0, len(points), 4)
        faces += [(a, c, b), (a, b, d), (b, c, d), (c, a, d)]
    keep = rng.random(len(faces)) < rng.choice([0.7, 1.0])
    faces = [face for face, kept in zip(faces, keep, strict=True) if kept] or faces
    # Split some edges, so that many lines carry several edges
    vertices = np.array(points, dtype=float)
    mesh = make(vertices * rng.choice([1.0, 2.0**-30]), faces)
    for face in rng.integers(0, mesh.n_faces, 3):
        a, b, _ = mesh.faces[face]
        mesh = with_t_junction(mesh, face, 0.5 * (mesh.vertices[a] + mesh.vertices[b]))
    report = check(mesh, self_intersections=False)
    assert report.two_set == oracle.is_two_set(mesh)
    assert report.oriented == oracle.is_oriented(mesh)
    total = sum(hole.length for hole in report.holes)
    assert total >= oracle.open_length(mesh) * (1 - 1e-12)


def test_a_fan_of_needles_is_decided_quickly_and_exactly():
    n = 20_000
    angle = np.linspace(0, 1e-9, n)
    rim = np.stack([np.cos(angle), np.sin(angle), np.linspace(0, 1, n)], axis=1)
    faces = [(0, i + 1, i + 2) for i in range(0, n - 1, 2)]
    report = check(make([(0.0, 0, 0), *rim], faces), self_intersections=False)
    assert report.n_open_edges == 3 * len(faces)
    assert report.recommended_sign == "unsigned"


def test_the_input_is_unchanged_and_numbers_are_those_of_the_mesh():
    mesh = soup_of(cube())
    before = mesh.vertices.copy(), mesh.faces.copy()
    report = check(mesh)
    assert np.array_equal(mesh.vertices, before[0])
    assert np.array_equal(mesh.faces, before[1])
    assert (report.n_vertices, report.n_welded_vertices, report.n_faces) == (36, 8, 12)


def test_a_mesh_without_faces_is_refused():
    with pytest.raises(MeshError, match="the mesh has no faces"):
        check(make(np.zeros((3, 3)), np.empty((0, 3))))


def test_the_recommended_sign_follows_from_the_verdict():
    assert check(cube()).recommended_sign == "winding"
    assert check(klein_bottle()).recommended_sign == "parity"
    assert check(without_faces(cube(), 0)).recommended_sign == "winding"
    assert check(make(np.eye(3), [(0, 1, 2)])).recommended_sign == "unsigned"


def test_progress_is_told():
    stages = []
    check(cube(), progress=lambda stage, fraction: stages.append((stage, fraction)))
    assert {stage for stage, _ in stages} == {"edges", "self-intersections"}
    assert stages[-1][1] == 1.0
