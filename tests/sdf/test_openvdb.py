"""Bands beside OpenVDB's own, made by Debian's Python module in its own process."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from meshsdf.mesh.primitives import box_mesh
from meshsdf.mesh.tubes import torus, trefoil_tube
from meshsdf.sdf import mesh_to_band

SYSTEM_PYTHON = "/usr/bin/python3"
SCRIPT = """
import sys
import numpy as np
import pyopenvdb as vdb

data = np.load(sys.argv[1])
grid = vdb.FloatGrid.createLevelSetFromPolygons(
    data["points"].astype(np.float32),
    triangles=data["faces"].astype(np.uint32),
    transform=vdb.createLinearTransform(voxelSize=float(data["voxel_size"])),
    halfWidth=3.0,
)
values = np.empty(tuple(data["shape"]), np.float32)
grid.copyToArray(values, ijk=tuple(int(i) for i in data["first"]))
np.save(sys.argv[2], values)
"""


def has_openvdb() -> bool:
    """Whether the system's Python has Debian's OpenVDB module."""
    if not Path(SYSTEM_PYTHON).exists():
        return False
    command = [SYSTEM_PYTHON, "-c", "import pyopenvdb, numpy"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not has_openvdb(), reason="Debian's python3-openvdb is not installed")
@pytest.mark.parametrize(
    "mesh",
    [torus(1.0, 0.35), trefoil_tube(), box_mesh(size=(1.0, 0.7, 0.4))],
    ids=["torus", "trefoil", "box"],
)
def test_openvdb_agrees_on_signs_and_to_a_voxel_on_distances(mesh, tmp_path):
    band = mesh_to_band(mesh, resolution=60)
    low, high = band.active_box()
    first, shape = low - 8, high - low + 17
    np.savez(
        tmp_path / "mesh.npz",
        points=mesh.vertices,
        faces=mesh.faces,
        voxel_size=band.voxel_size,
        first=first,
        shape=shape,
    )
    command = [SYSTEM_PYTHON, "-c", SCRIPT, tmp_path / "mesh.npz", tmp_path / "values.npy"]
    subprocess.run(command, check=True, capture_output=True)
    theirs = np.load(tmp_path / "values.npy").ravel() / band.voxel_size
    ijk = np.indices(shape).reshape(3, -1).T + first
    ours = band.value_at(ijk) / band.voxel_size
    clear = np.abs(ours) > 0.1
    assert ((ours < 0) == (theirs < 0))[clear].all()
    # OpenVDB propagates the closest face and renormalises: off by up to a voxel, little on average
    assert np.abs(ours - theirs).max() < 1.0
    assert np.abs(ours - theirs)[np.abs(ours) < 3].mean() < 0.05
