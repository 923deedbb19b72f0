"""meshsdf.sdf.memory: the estimate comes before the work and is true."""

import subprocess
import sys

import numpy as np
import pytest

from meshsdf.errors import MemoryLimitError
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import torus, trefoil_tube
from meshsdf.sdf import mesh_to_band
from meshsdf.sdf.memory import estimate_bricks, require_memory

WITHIN = 0.25

# A box along the axes has all bricks of a side in or out together; turned, they average
TURN = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
TURNED_BOX = Mesh(box_mesh(size=(1.0, 0.7, 0.3)).vertices @ TURN.T, box_mesh().faces)

PEAK = """
from meshsdf import mesh_to_band
from meshsdf.mesh.primitives import icosphere
from meshsdf.sdf.memory import band_bytes, estimate_bricks

def status(key):
    with open("/proc/self/status") as file:
        return 1024 * int(next(line for line in file if line.startswith(key)).split()[1])

mesh = icosphere(1.0, subdivisions=5)
mesh_to_band(mesh, resolution=16)
with open("/proc/self/clear_refs", "w") as file:
    file.write("5")  # forget the peak of compiling
before = status("VmRSS")
band = mesh_to_band(mesh, resolution=900)
n_bricks = estimate_bricks(mesh, band.voxel_size, 3.0)
print(band_bytes(n_bricks, mesh.n_faces, closest=False) / (status("VmHWM") - before))
"""


@pytest.mark.parametrize(
    "mesh",
    [icosphere(1.0), torus(1.0, 0.3), trefoil_tube(), TURNED_BOX],
    ids=["sphere", "torus", "trefoil", "box"],
)
@pytest.mark.parametrize("half_width", [2.0, 3.0, 6.0])
def test_the_number_of_bricks_is_foreseen(mesh, half_width):
    band = mesh_to_band(mesh, resolution=200, half_width=half_width)
    foreseen = estimate_bricks(mesh, band.voxel_size, half_width)
    assert abs(foreseen / band.index.n_bricks - 1) < WITHIN


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_the_peak_is_foreseen():
    told = subprocess.run([sys.executable, "-c", PEAK], check=True, capture_output=True, text=True)
    assert abs(float(told.stdout) - 1) < WITHIN


def test_what_does_not_fit_is_refused_with_both_numbers():
    with pytest.raises(MemoryLimitError, match=r"about 3 GB would be needed, 2 GB are allowed"):
        require_memory(3e9, 2e9, where="test")
    with pytest.raises(MemoryLimitError, match=r"EB would be needed, .* are free"):
        require_memory(4e18, None, where="test")
    require_memory(3e9, 4e9, where="test")


def test_absurd_resolutions_are_foreseen_without_overflow():
    assert estimate_bricks(icosphere(1.0), 1e-200, 3.0) == np.inf
