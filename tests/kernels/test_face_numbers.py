"""meshsdf.kernels.face_numbers: parts in conflict have no number in common."""

import numpy as np
import pytest

from meshsdf.kernels.face_numbers import number_faces
from meshsdf.mesh.primitives import icosphere

SURFACE = icosphere(subdivisions=3)


def numbered(patches, conflicts):
    """Numbers of faces and of parts: ``patches`` are lists of faces, ``conflicts`` of pairs."""
    table = SURFACE.welded.table
    members = [(face, part) for part, patch in enumerate(patches) for face in patch]
    members.sort()
    counts = np.bincount([face for face, _ in members], minlength=SURFACE.n_faces)
    clash = np.zeros(32 * -(-len(patches) // 32), np.uint32)
    for a, b in conflicts:
        clash[a] |= np.uint32(1 << (b % 32))
        clash[b] |= np.uint32(1 << (a % 32))
    numbers, used = np.empty(SURFACE.n_faces, np.uint8), np.zeros(len(clash), np.uint32)
    number_faces(
        table.edge_of_corner, table.half_edges, table.first,
        np.concatenate([[0], np.cumsum(counts)]), np.array([part for _, part in members]), clash,
        used, numbers,
    )  # fmt: skip
    return numbers, used


@pytest.mark.parametrize("seed", range(4))
def test_parts_in_conflict_have_none_in_common(seed):
    random = np.random.default_rng(seed)
    patches = [random.choice(SURFACE.n_faces, 12, replace=False) for _ in range(96)]
    conflicts = []
    for brick in range(3):
        for a, b in random.integers(0, 32, (12, 2)):
            apart = not set(patches[32 * brick + a]) & set(patches[32 * brick + b])
            if a != b and apart:
                conflicts.append((32 * brick + a, 32 * brick + b))
    numbers, _ = numbered(patches, conflicts)
    assert len(conflicts) > 20
    assert 0 < numbers.max() < 32
    for a, b in conflicts:
        assert not set(numbers[patches[a]]) & set(numbers[patches[b]])


def test_without_conflicts_all_faces_have_the_number_0():
    assert not numbered([[0, 1, 2]], [])[0].any()


def test_numbers_change_no_more_often_than_they_must():
    far = SURFACE.triangles.mean(axis=1) @ np.array([0, 0, 1.0])
    top, bottom = np.flatnonzero(far > 0.8), np.flatnonzero(far < -0.8)
    numbers, used = numbered([top, bottom], [(0, 1)])
    assert set(np.unique(numbers)) == {0, 1}
    assert {int(used[0]), int(used[1])} == {1, 2}


def test_where_no_number_is_left_the_rest_get_0():
    # 32 faces of one brick against one another, and in two more bricks against one face more
    patches = [[face] for face in range(32)] + [[100]] + [[face] for face in range(31)]
    patches += [[100], [31]]
    conflicts = [(a, b) for a in range(32) for b in range(a)]
    conflicts += [(32, b) for b in range(33, 64)] + [(64, 65)]
    numbers, _ = numbered(patches, conflicts)
    # 33 faces, each in conflict with all others: one must do without a number of its own
    assert sorted(numbers[[*range(32), 100]].tolist()) == [0, *range(32)]
