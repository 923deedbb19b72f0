"""meshsdf.mesh.edge_chain: the lines that carry what does not cancel by index."""

import numpy as np
from numpy.testing import assert_array_equal

from meshsdf.mesh import check, residual_edge_lines, weld

from .shapes import cube, flipped, make, soup_of, with_t_junction, without_faces


def lines_of(mesh):
    labels, points = weld(mesh.vertices)
    faces = labels[mesh.faces]
    return faces, points, *residual_edge_lines(faces, points)


def test_a_closed_mesh_has_no_lines_even_when_unwelded():
    for mesh in (cube(), soup_of(cube())):
        _, _, edge_line, line_ends = lines_of(mesh)
        assert edge_line.shape == (0, 3)
        assert line_ends.shape == (0, 2)


def test_a_t_junction_has_one_line_from_end_to_end_for_all_its_pieces():
    mesh = with_t_junction(with_t_junction(cube(), 0, (0, 0, 0.5)), 12, (0, 0, 0.75))
    faces, points, edge_line, line_ends = lines_of(mesh)
    assert_array_equal(points[line_ends], [[(0, 0, 0), (0, 0, 1)]])
    f, e = np.nonzero(edge_line == 0)
    pieces = points[faces[f, e]], points[faces[f, (e + 1) % 3]]
    heights = sorted(tuple(sorted((p[2], q[2]))) for p, q in zip(*pieces, strict=True))
    assert heights == [(0, 0.5), (0, 1), (0.5, 0.75), (0.75, 1)]
    assert (edge_line == -1).sum() == edge_line.size - 4


def test_pieces_of_any_ratio_are_one_line_though_their_directions_round():
    rng = np.random.default_rng(12)
    for _ in range(100):
        direction = rng.uniform(-1, 1, 3)
        scales = -(2.0 ** rng.choice(np.arange(-30, 31), 3, replace=False))
        a, t, b = direction * np.sort(scales)[:, None]
        whole = make([a, b, *rng.normal(size=(2, 3))], [(0, 1, 2), (1, 0, 3), (2, 1, 3), (0, 2, 3)])
        mesh = with_t_junction(whole, 0, t)
        assert len(lines_of(mesh)[3]) == 1
        assert check(mesh).two_set


def test_every_line_is_a_line_and_its_ends_are_outermost():
    mesh = soup_of(without_faces(flipped(cube((0.1, 0.2, 0.3), 0.7), 0), 5, 8))
    faces, points, edge_line, line_ends = lines_of(mesh)
    assert edge_line.max() + 1 == len(line_ends) > 3
    for number, (first, last) in enumerate(line_ends):
        f, e = np.nonzero(edge_line == number)
        on_line = np.unique(np.concatenate([faces[f, e], faces[f, (e + 1) % 3]]))
        along = [tuple(points[v]) for v in on_line]
        assert tuple(points[first]) == min(along)
        assert tuple(points[last]) == max(along)
