"""The check on models made by others; skipped unless MESHSDF_MODELS names their folder."""

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from meshsdf.mesh import Mesh, check

FOLDER = os.environ.get("MESHSDF_MODELS")
pytestmark = pytest.mark.skipif(not FOLDER, reason="MESHSDF_MODELS is not set")

CLOSED = [
    *("1002_tray_bottom.STL", "3holes.off", "armadillo.obj", "busted.STL", "cheburashka.obj"),
    *("cow.obj", "decimated-knight.off", "Duck.glb", "fandisk.obj", "fuze.obj", "multibody.stl"),
    *("spot.obj", "boolean.glb"),
]
CRACKED = ["featuretype.STL", "octagonal_pocket.stl"]  # closed but for the rounding of corners
OPEN = {"alligator.obj": 1, "camelhead.off": 1, "stanford-bunny.obj": 5, "suzanne.obj": 4}


def load(name: str) -> Mesh:
    path = Path(FOLDER) / name
    if path.suffix == ".glb":
        loaded = trimesh.load_scene(path, process=False).to_mesh()
    else:
        loaded = trimesh.load(path, process=False, force="mesh")
    return Mesh(np.array(loaded.vertices, dtype=float), np.array(loaded.faces, dtype=np.int32))


@pytest.mark.parametrize("name", CLOSED)
def test_closed_models_are_two_set(name):
    report = check(load(name), self_intersections=False)
    assert report.two_set
    assert report.oriented == (name != "multibody.stl")
    assert all(part.closed for part in report.components)


@pytest.mark.parametrize("name", CRACKED)
def test_models_with_rounded_corners_are_open_by_cracks_too_thin_to_see(name):
    mesh = load(name)
    report = check(mesh, self_intersections=False)
    assert not report.two_set
    assert report.crack_width is not None
    assert 0 < report.crack_width < 2**-48 * mesh.box.longest_side  # 16 steps of float64
    assert "only cracks" in report.describe()


@pytest.mark.parametrize("name", OPEN)
def test_open_models_have_their_holes(name):
    report = check(load(name), self_intersections=False)
    assert not report.two_set
    assert len(report.holes) == OPEN[name]
    assert report.crack_width is None
    assert report.recommended_sign == ("unsigned" if name == "alligator.obj" else "winding")
    assert report.flat == (name == "alligator.obj")  # drawn in one plane


def test_loose_triangles_get_no_sign():
    report = check(load("soup.stl"))
    assert report.n_components == len(report.holes) == 100
    assert report.recommended_sign == "unsigned"
