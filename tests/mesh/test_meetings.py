"""meshsdf.mesh.meetings and face_pieces: no meeting is missed, and cuts lose nothing."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from meshsdf.kernels.sheet_pairs import COPLANAR, CROSSING
from meshsdf.mesh import Mesh, icosphere, torus
from meshsdf.mesh.face_pieces import cut_met_faces
from meshsdf.mesh.face_tree import FaceTree
from meshsdf.mesh.meetings import find_meetings
from meshsdf.mesh.outer_boundary import NEAR

from .shapes import cube, joined
from .unions import lattice_boxes, moved, random_bodies, rotation


def minus(p, q):
    return tuple(a - b for a, b in zip(p, q, strict=True))


def dot(p, q):
    return sum(a * b for a, b in zip(p, q, strict=True))


def cross(p, q):
    return tuple(p[i - 2] * q[i - 1] - p[i - 1] * q[i - 2] for i in range(3))


def clipped(polygon, inward, origin):
    """The part of a convex polygon on the inner side of a plane, exactly."""
    heights = [dot(inward, minus(p, origin)) for p in polygon]
    part = []
    for i, (p, d) in enumerate(zip(polygon, heights, strict=True)):
        q, e = polygon[i - 1], heights[i - 1]
        if d * e < 0:
            part.append(tuple(a + (b - a) * e / (e - d) for a, b in zip(q, p, strict=True)))
        if d >= 0:
            part.append(p)
    return part


def common_points(f, g):
    """Corners of the intersection of two triangles, exactly."""
    normal = cross(minus(f[1], f[0]), minus(f[2], f[0]))
    part = clipped(clipped(g, normal, f[0]), tuple(-x for x in normal), f[0])
    for i in range(3):
        part = clipped(part, cross(normal, minus(f[(i + 1) % 3], f[i])), f[i])
    return part


def meet_beyond(f, g):
    """They meet elsewhere than in the corners and the edge that they share."""
    shared = [p for p in f if p in g]
    for p in common_points(f, g):
        if len(shared) == 2:
            if any(cross(minus(p, shared[0]), minus(shared[1], shared[0]))):
                return True
        elif p not in shared:
            return True
    return len(shared) == 3


def random_faces(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles on a small lattice, many with common corners and edges."""
    rng = np.random.default_rng(seed)
    points = np.unique(rng.integers(0, 4, (10, 3)), axis=0).astype(float)
    faces = np.array([rng.choice(len(points), 3, replace=False) for _ in range(14)], np.int32)
    a, b, c = points[faces].swapaxes(0, 1)
    return points, faces[np.cross(b - a, c - a).any(axis=1)]


def listed(points: np.ndarray, faces: np.ndarray) -> dict[tuple[int, int], int]:
    """The pairs that are found to meet, and how."""
    found = find_meetings(FaceTree.of(points, faces), NEAR)
    first = np.repeat(np.arange(len(faces)), np.diff(found.start))
    rows = np.column_stack([first, found.partners]).tolist()
    pairs = {(f, g): kind for f, g, kind in rows}
    assert len(pairs) == len(rows)
    assert all(pairs[g, f] == kind for (f, g), kind in pairs.items())
    return {(f, g): kind for (f, g), kind in pairs.items() if f < g}


def true_pairs(exact: list) -> set[tuple[int, int]]:
    """Which of the exact triangles meet beyond what they share."""
    n = len(exact)
    return {(i, j) for i in range(n) for j in range(i + 1, n) if meet_beyond(exact[i], exact[j])}


def exactly(points: np.ndarray, faces: np.ndarray) -> list:
    return [[tuple(Fraction(x) for x in p) for p in t] for t in points[faces].tolist()]


@settings(max_examples=12)
@given(st.integers(0, 10**6))
def test_exactly_the_triangles_that_meet_are_listed(seed):
    points, faces = random_faces(seed)
    found, exact = listed(points, faces), exactly(points, faces)
    assert true_pairs(exact) == set(found)
    for (i, j), kind in found.items():
        normal = cross(minus(exact[i][1], exact[i][0]), minus(exact[i][2], exact[i][0]))
        in_plane = all(dot(normal, minus(p, exact[i][0])) == 0 for p in exact[j])
        assert kind == (COPLANAR if in_plane else CROSSING)


@settings(max_examples=6)
@given(st.integers(0, 10**6))
def test_turned_off_the_lattice_no_pair_that_meets_is_missing(seed):
    points, faces = random_faces(seed)
    turned = points @ rotation(seed).T + [0.1, 0.2, 0.3]
    as_seen = FaceTree.of(turned, faces).points
    assert true_pairs(exactly(as_seen, faces)) <= set(listed(turned, faces))


def test_no_faces_of_a_sound_mesh_meet():
    flat = cube().triangles
    middles = (flat + np.roll(flat, -1, axis=1)) / 2
    corners = np.stack([flat, middles, np.roll(middles, 1, axis=1)], axis=2).reshape(-1, 3, 3)
    quarters = np.concatenate([corners, middles]).reshape(-1, 3)
    fine = Mesh(quarters, np.arange(len(quarters), dtype=np.int32).reshape(-1, 3)).welded
    shapes = [(fine.points, fine.faces)]
    shapes += [(m.vertices, m.faces) for m in (icosphere(1.0), torus(1.0, 0.4), cube())]
    for points, faces in shapes:
        for turn in (np.eye(3), rotation(3)):
            assert listed(np.array(points) @ turn.T, np.array(faces)) == {}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["bodies", "boxes", "turned boxes"])
def test_pieces_fill_their_face_and_nothing_passes_through_them(seed, kind):
    bodies = random_bodies(seed) if kind == "bodies" else lattice_boxes(seed)[0]
    if kind == "turned boxes":
        bodies = [moved(body, rotation(seed)) for body in bodies]
    welded = joined(*bodies).welded
    faces = np.array(welded.faces)
    tree = FaceTree.of(np.array(welded.points), faces)
    pieces = cut_met_faces(tree, faces, find_meetings(tree, NEAR), NEAR)
    fans, piece = pieces.fans()
    places = np.einsum(
        "cij,ci->cj",
        tree.points[faces[np.repeat(pieces.face, pieces.n_corners)]],
        pieces.corners,
    )
    a, b, c = places[fans].swapaxes(0, 1)
    double = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    filled = np.bincount(pieces.face[piece], double, minlength=len(faces))
    a, b, c = tree.points[faces].swapaxes(0, 1)
    whole = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert_allclose(filled[pieces.face], whole[pieces.face], rtol=1e-11)
    # Shrunk a little, pieces meet no face but those in their own plane
    ends = np.cumsum(pieces.n_corners)
    for n in np.random.default_rng(seed).choice(len(ends), min(60, len(ends)), replace=False):
        own = places[ends[n] - pieces.n_corners[n] : ends[n]]
        center = own.mean(axis=0)
        triangle = center + (1 - 1e-6) * (own[[0, 1, 2]] - center)
        if np.linalg.norm(np.cross(*(triangle[1:] - triangle[0]))) < 1e-9:
            continue
        points = np.vstack([tree.points, triangle])
        new = np.arange(len(tree.points), len(points), dtype=np.int32)[None]
        found = listed(points, np.vstack([faces, new]))
        assert all(kind == COPLANAR for (_, g), kind in found.items() if g == len(faces))
