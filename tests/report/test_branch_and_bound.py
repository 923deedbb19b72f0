"""meshsdf.report.branch_and_bound: what holds at every step of a search."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh
from meshsdf.progress import silent
from meshsdf.report.branch_and_bound import PROBED_FROM, Search, faces_around
from meshsdf.report.tolerance import Tolerance
from meshsdf.spatial import ClosestPoint

from .mesh_pairs import libigl_distances, mesh_pair, samples_of


def search_of(source, target, **tolerance):
    return Search(source, ClosestPoint(target), Tolerance(**tolerance), silent)


def areas(pieces):
    a, b, c = np.moveaxis(pieces, 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


@pytest.mark.parametrize("seed", [3, 9, 17, 30, 44])
def test_the_interval_is_true_after_every_step_and_only_narrows(seed):
    source, target = mesh_pair(seed)
    samples = samples_of(source, 20_000, np.random.default_rng(seed))
    seen = libigl_distances(samples, target).max()
    search = search_of(source, target, relative=1e-6)
    best, upper = 0.0, np.inf
    for _ in range(40):
        assert best <= search.best <= search.upper <= upper
        assert seen <= search.upper + search.rounding
        best, upper = search.best, search.upper
        if search.is_done:
            break
        search.step()


def test_a_level_cuts_pieces_at_the_middle_of_their_longest_side():
    source, target = mesh_pair(21)  # many pieces are left for several levels
    search = search_of(source, target, relative=1e-9)
    for _ in range(3):
        before = np.concatenate([pieces.points for pieces in search.waiting])
        level = search.level
        while search.level == level:
            search.step()
        after = np.concatenate([pieces.points for pieces in search.waiting])
        sides = np.linalg.norm(before - before[:, [1, 2, 0]], axis=2)
        longest = sides.argmax(axis=1)
        each = np.arange(len(before))
        middles = 0.5 * (before[each, longest] + before[each, (longest + 1) % 3])
        known = {point.tobytes() for point in np.concatenate([before.reshape(-1, 3), middles])}
        assert {point.tobytes() for point in after.reshape(-1, 3)} <= known
        assert len(after) > 20
        new = {point.tobytes() for point in middles}
        assert all(any(point.tobytes() in new for point in piece) for piece in after)
        assert areas(after).max() <= 0.5 * areas(before).max() * (1 + 1e-12)


def test_probing_raises_the_first_record_and_changes_no_truth():
    # 5000 triangles of a square against twenty points: the farthest place is inside a face
    rng = np.random.default_rng(0)
    plane = rng.random((2600, 2))
    faces = Delaunay(plane).simplices.astype(np.int32)
    source = Mesh(np.column_stack([plane, np.zeros(len(plane))]), faces)
    each = np.repeat(np.arange(20, dtype=np.int32)[:, None], 3, axis=1)
    target = Mesh(rng.random((20, 3)) * [1, 1, 0.1], each)
    plain = search_of(source, target, relative=1e-6)
    probing = Search(source, ClosestPoint(target), Tolerance(relative=1e-6), silent, probes=True)
    assert source.n_faces > PROBED_FROM
    assert probing.best > plain.best
    place, face = probing.witness + probing.closest.center, faces[[probing.source_face]]
    assert libigl_distances(place[None], Mesh(source.vertices, face))[0] < 1e-14
    for search in (plain, probing):
        while not search.is_done:
            search.step()
    assert probing.best <= plain.upper
    assert plain.best <= probing.upper


def test_equal_bounds_are_found_again_from_any_order_of_faces():
    source, target = mesh_pair(8)
    order = np.random.default_rng(0).permutation(source.n_faces)
    ends = []
    for mesh in (source, Mesh(source.vertices, source.faces[order])):
        search = search_of(mesh, target, relative=1e-6)
        while not search.is_done:
            search.step()
        ends.append((search.best, search.upper))
    assert ends[0][0] == pytest.approx(ends[1][0], rel=1e-6)
    assert ends[0][1] == pytest.approx(ends[1][1], rel=2e-6)


def test_neighbours_share_the_edge_they_are_listed_for():
    # A box, a third sheet on one of its edges, and a face without area
    box = box_mesh()
    vertices = np.vstack([box.vertices, [[5.0, 5, 5]]])
    extra = np.array([[*box.faces[0, :2], 8], [0, 0, 1]], np.int32)
    mesh = Mesh(vertices, np.concatenate([box.faces, extra]))
    around = faces_around(mesh)
    assert around.dtype == np.int32
    for face, row in enumerate(around):
        for k in range(3):
            if row[3 + k] >= 0:
                assert row[3 + k] != face
                assert {row[k], row[(k + 1) % 3]} <= set(around[row[3 + k], :3])
    assert (around[:12, 3:] >= 0).all()
    assert (around[12, 4:] == -1).all()
