"""meshsdf.mesh.flatness: a mesh whose faces all lie in one plane has no thickness."""

import numpy as np
import pytest

from meshsdf.mesh import Mesh, check
from meshsdf.mesh.primitives import icosphere

from .shapes import cube, joined, without_faces


def sheet(turn: np.ndarray | None = None, *, at: float = 0.0, n: int = 9) -> Mesh:
    """A square of side 1 in z = 0, in squares, turned and moved."""
    x, y = (axis.ravel() / (n - 1) for axis in np.indices((n, n)))
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    square = np.stack([corner, corner + n, corner + n + 1, corner + 1], axis=1)
    faces = np.concatenate([square[:, [0, 1, 2]], square[:, [0, 2, 3]]]).astype(np.int32)
    points = np.stack([x, y, np.zeros(n * n)], axis=1)
    return Mesh((points if turn is None else points @ turn.T) + at, faces)


def turned(seed: int) -> np.ndarray:
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]


@pytest.mark.parametrize("seed", range(8))
def test_a_sheet_is_flat_whichever_way_it_lies_and_a_bump_of_a_thousandth_is_seen(seed):
    flat = sheet(turned(seed))
    assert check(flat, self_intersections=False).flat
    as_stored = Mesh(flat.vertices.astype(np.float32).astype(np.float64), flat.faces)
    assert check(as_stored, self_intersections=False).flat
    bump = np.zeros_like(flat.vertices)
    bump[40] = 1e-3 * turned(seed)[:, 2]
    assert not check(Mesh(flat.vertices + bump, flat.faces), self_intersections=False).flat


def test_a_flat_mesh_is_measured_without_a_sign_and_says_why():
    for mesh in (sheet(), sheet(at=1e6), joined(sheet(), sheet())):
        report = check(mesh)
        assert report.flat
        assert report.recommended_sign == "unsigned"
        assert "all faces lie in one plane: the mesh has no thickness" in report.describe()
        assert report.to_json()["flat"] is True


@pytest.mark.parametrize("thickness", [1e-3, 1e-7, 1e-12])
def test_a_closed_plate_has_an_inside_however_thin(thickness):
    plate = cube()
    report = check(Mesh(plate.vertices * [1.0, 1.0, thickness], plate.faces))
    assert not report.flat
    assert report.recommended_sign == "winding"


def test_solids_and_open_solids_are_not_flat():
    for mesh in (icosphere(subdivisions=5), without_faces(cube(), 0, 1), joined(sheet(), cube())):
        assert not check(mesh, self_intersections=False).flat


def test_a_closed_cube_pressed_to_nothing_is_flat():
    pressed = cube()
    report = check(Mesh(pressed.vertices * [1.0, 1.0, 0.0], pressed.faces))
    assert report.two_set
    assert report.flat
    assert report.recommended_sign == "unsigned"
