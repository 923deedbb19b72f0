"""meshsdf.mesh.outer_boundary: what bounds a union, and nothing else."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.io import read_mesh
from meshsdf.mesh import (
    Mesh,
    area,
    cylinder,
    find_self_intersections,
    torus,
    trefoil_tube,
    volume,
)
from meshsdf.mesh.outer_boundary import NEAR
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.spatial.closest_point import ClosestPoint
from tests.models import model, needs_models

from .shapes import cube, joined, make, soup_of, with_t_junction
from .unions import (
    assert_bounds,
    bounding,
    exposed_area,
    lattice_boxes,
    lattice_tetrahedra,
    moved,
    random_bodies,
    rotation,
    united,
)

HOMES = ("meshsdf.kernels.parallel", "meshsdf.mesh.meetings", "meshsdf.mesh.face_pieces")
HOMES += ("meshsdf.mesh.outer_boundary",)
seeds = st.integers(0, 10**6)
few = settings(max_examples=8)


def turned_inside_out(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


def split(mesh: Mesh) -> Mesh:
    """Every face cut in four at the middles of its edges."""
    a, b, c = mesh.triangles.swapaxes(0, 1)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    corners = np.concatenate([np.stack(q, axis=1) for q in quarters])
    return make(corners.reshape(-1, 3), np.arange(3 * len(corners)))


@few
@given(seeds)
def test_overlapping_bodies_are_bounded_as_manifold3d_says(seed):
    bodies = random_bodies(seed)
    _, boundary = bounding(joined(*bodies))
    union = united(*bodies)
    assert area(boundary) == pytest.approx(area(union), rel=1e-12)
    assert volume(boundary) == pytest.approx(volume(union), rel=1e-12)


@few
@given(seeds, st.booleans())
def test_boxes_on_a_lattice_are_bounded_by_the_squares_around_their_cells(seed, is_turned):
    # Faces in one plane, common edges and corners; turned, all of that up to rounding
    boxes, cells = lattice_boxes(seed)
    if is_turned:
        boxes = [moved(box, rotation(seed), (0.1, 0.2, 0.3)) for box in boxes]
    _, boundary = bounding(joined(*boxes))
    assert area(boundary) == pytest.approx(exposed_area(cells), rel=1e-12)
    assert volume(boundary) == pytest.approx(cells.sum(), rel=1e-12)


@few
@given(seeds, st.booleans())
def test_tetrahedra_on_a_lattice_are_bounded_where_the_winding_number_says(seed, is_turned):
    bodies = lattice_tetrahedra(seed)
    if is_turned:
        bodies = [moved(body, rotation(seed), (0.1, 0.2, 0.3)) for body in bodies]
    if seed % 3 == 0:  # numbers below 0, and bodies that cancel others
        bodies[::2] = [turned_inside_out(body) for body in bodies[::2]]
    assert_bounds(joined(*bodies), seed=seed)


@few
@given(seeds, st.sampled_from(["smooth", "lattice"]))
def test_one_body_crumpled_into_itself_is_bounded_where_the_winding_number_says(seed, kind):
    rng = np.random.default_rng(seed)
    ball = icosphere(1.0, subdivisions=int(rng.integers(0, 2)))
    crumpled = ball.vertices + rng.normal(size=ball.vertices.shape) * rng.choice([0.2, 0.6, 1.5])
    if kind == "lattice":
        crumpled = rng.integers(0, 4, ball.vertices.shape).astype(float)
    assert_bounds(Mesh(crumpled, ball.faces), seed=seed)


def test_three_boxes_through_one_point_make_one_body():
    boxes = [cube(), cube((-0.5, 0, 0)), cube((-1, -1, -1)), cube((0, -1, -0.5))]
    _, boundary = bounding(joined(*boxes))
    assert area(boundary) == pytest.approx(area(united(*boxes)), rel=1e-12)
    assert_bounds(joined(*boxes))


def test_of_a_body_within_another_nothing_is_left_and_of_twins_one():
    ball, kernel = icosphere(1.0), icosphere(0.5, subdivisions=2)
    for mesh, n_inner in ((joined(ball, kernel), 320), (joined(ball, ball), ball.n_faces)):
        found, boundary = bounding(mesh)
        assert found.n_inner == n_inner
        assert_array_equal(found.face_ids, np.arange(ball.n_faces))
        assert_array_equal(boundary.triangles, ball.triangles)


def test_twins_with_other_faces_count_once():
    box = box_mesh((1.0, 2.0, 3.0))
    for turn in (np.eye(3), rotation(5)):
        both = joined(moved(box, turn), moved(split(split(box)), turn))
        _, boundary = bounding(both)
        assert area(boundary) == pytest.approx(22.0, rel=1e-12)
        assert volume(boundary) == pytest.approx(6.0, rel=1e-12)


def test_a_cavity_stays_and_so_does_everything_that_is_sound():
    cavity = joined(icosphere(1.0), turned_inside_out(icosphere(0.5)))
    apart = joined(cube(), cube((2, 0, 0)), cube((0, 1.25, 0)))
    on_edges = joined(cube(), cube((1, 1, 0)), cube((-1, -1, 0)))
    shapes = [cavity, apart, on_edges, torus(1.0, 0.4), trefoil_tube(), cylinder(), cube()]
    shapes += [soup_of(cube()), with_t_junction(cube(), 0, (0, 0, 0.5)), split(box_mesh())]
    shapes += [turned_inside_out(cavity)]
    for mesh in shapes:
        found, _ = bounding(mesh)
        assert found is None


def test_what_cancels_leaves_nothing():
    box = box_mesh()
    found, boundary = bounding(joined(box, turned_inside_out(split(box))))
    assert boundary.n_faces == 0
    assert found.n_inner == 12 + 48


@pytest.mark.parametrize("turn", [np.eye(3), rotation(1)])
def test_gaps_stay_open_and_contacts_close(turn):
    def area_with_gap(gap: float) -> float:
        boxes = cube(), cube((0.25, 0.25, 1 + gap), 0.5)
        return area(bounding(joined(*(moved(box, turn) for box in boxes)))[1])

    for gap in (1e-3, 1e-9, 1e-11):
        assert area_with_gap(gap) == pytest.approx(7.5, rel=1e-10)
    for gap in (0.0, 1e-16, -1e-16, 1e-14):
        assert area_with_gap(gap) == pytest.approx(7.0, rel=1e-12)
    for overlap in (1e-3, 1e-9, 1e-11):
        assert area_with_gap(-overlap) == pytest.approx(7.0 - 2 * overlap, rel=1e-12)


@pytest.mark.parametrize("noise", [0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-9])
def test_no_noise_on_coincident_sheets_tears_a_hole(noise):
    rng = np.random.default_rng(0)
    fine = split(split(split(box_mesh())))
    welded = Mesh(fine.welded.points, fine.welded.faces)
    for turn in (np.eye(3), rotation(2)):
        rough = welded.vertices @ turn.T + noise * rng.normal(size=welded.vertices.shape)
        _, boundary = bounding(joined(moved(box_mesh(), turn), Mesh(rough, welded.faces)))
        places = moved(fine, turn).triangles.mean(axis=1)
        allowed = 16 * NEAR * 2.0 + 5 * noise
        assert ClosestPoint(boundary)(places).distance.max() < allowed
        # Both sheets may be kept where rounding cannot tell which is outside; never both when exact
        most = 6.0 + 1e-9 if noise < NEAR / 8 else 12.0
        assert area(boundary) < most


def test_t_junctions_and_needles_are_harmless():
    for seed in range(12):
        rng = np.random.default_rng(seed)
        turn = rotation(seed) if seed % 2 else np.eye(3)
        bodies = []
        for _ in range(3):
            box = moved(cube(rng.integers(-2, 3, 3) / 4.0), turn)
            points = np.round(box.vertices * 2.0**20) / 2.0**20  # middles of edges are exact
            box, face = make(points, box.faces), int(rng.integers(12))
            a, b = points[box.faces[face, :2]]
            body = with_t_junction(box, face, (a + b) / 2)
            # Split some faces so near an edge that what is beside it is a needle
            for _ in range(6):
                body = with_needle(body, rng, 10.0 ** -rng.integers(3, 18))
            bodies.append(body)
        assert_bounds(joined(*bodies), seed=seed, n=500)


def with_needle(mesh: Mesh, rng: np.random.Generator, width: float) -> Mesh:
    """Split a face at a point ``width`` beside one of its edges or corners."""
    face = int(rng.integers(mesh.n_faces))
    a, b, c = mesh.faces[face]
    beside = [(0.5, 0.5 - width, width), (1 - 2 * width, width, width)]
    weights = rng.permutation(beside[rng.integers(2)])
    points = np.vstack([mesh.vertices, weights @ mesh.triangles[face]])
    o = len(points) - 1
    rest = np.delete(mesh.faces, face, axis=0)
    return make(points, np.vstack([rest, [[a, b, o], [b, c, o], [c, a, o]]]))


@needs_models
@pytest.mark.parametrize(("name", "n_crossing"), [("cow.obj", 81), ("Duck.glb", 4)])
def test_real_bodies_that_cross_themselves_a_little(name, n_crossing):
    mesh = read_mesh(model(name))
    mesh = Mesh(mesh.welded.points / mesh.box.longest_side, mesh.welded.faces)
    assert find_self_intersections(mesh.vertices, np.array(mesh.faces)).n_pairs == n_crossing
    found, _ = bounding(mesh)
    assert 0 < found.n_inner < 100
    assert_bounds(mesh, n=4000)


def test_pieces_lie_on_their_faces_in_order():
    mesh = joined(*random_bodies(3))
    found, boundary = bounding(mesh)
    assert (np.diff(found.face_ids) >= 0).all()
    assert_allclose(found.weights.sum(axis=2), 1.0, atol=1e-15)
    assert found.weights.min() >= 0
    assert len(found.cut_face) > 0
    corners = np.einsum("fij,fjk->fik", found.weights, mesh.triangles[found.face_ids])
    assert_allclose(boundary.triangles, corners, atol=1e-15)
    # Turned like their faces
    normals = [np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]) for t in (corners, mesh.triangles)]
    assert (np.einsum("ij,ij->i", normals[0], normals[1][found.face_ids]) > 0).all()


def test_units_do_not_matter_and_a_place_far_away_hardly():
    mesh = joined(*random_bodies(4))
    here, boundary = bounding(mesh)
    for scale in (2.0**-70, 2.0**70):
        there, _ = bounding(Mesh(mesh.vertices * scale, mesh.faces))
        assert_array_equal(there.corners, here.corners)
        assert_array_equal(there.cut_weights, here.cut_weights)
    for scale, offset in ((1e-9, 0.0), (1e9, 0.0), (1.0, 1e6)):
        _, other = bounding(Mesh((mesh.vertices + offset) * scale, mesh.faces))
        assert area(other) / scale**2 == pytest.approx(area(boundary), rel=1e-8)


def test_the_number_of_threads_changes_no_bit(monkeypatch):
    mesh = joined(*random_bodies(5), icosphere(0.7, subdivisions=4))
    here, _ = bounding(mesh)
    for threads in (1, 5):
        for home in HOMES:
            monkeypatch.setattr(sys.modules[home], "n_threads", lambda n=threads: n)
        there, _ = bounding(mesh)
        for name in ("face_ids", "corners", "cut_face", "cut_weights"):
            assert_array_equal(getattr(there, name), getattr(here, name))
