"""probe_volume: what every format's header tells, without reading the values."""

import os
from pathlib import Path

import numpy as np
import pytest

from meshsdf.grid import Grid
from meshsdf.io import probe_volume, write_volume
from meshsdf.io.registry import FORMATS, stored_bytes
from meshsdf.mesh import icosphere
from meshsdf.sdf import mesh_to_band

VOLUMES = [suffix for f in FORMATS if f.kind == "volume" for suffix in f.suffixes]
SPARSE = (".npz", ".vdb", ".zarr")
PLACELESS = (".vf",)
WORDLESS = (".vf", ".sdf")


def grid() -> Grid:
    values = np.random.default_rng(0).normal(size=(4, 5, 6)).astype(np.float32)
    return Grid(values, 0.5, np.array([1.0, 2, 3]), "parity", 3, 7, 2.5)


@pytest.mark.parametrize("suffix", VOLUMES)
def test_the_facts_of_a_full_grid_stand_in_its_header(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    write_volume(path, grid())
    facts = probe_volume(path)
    if suffix == ".vdb":
        (facts,) = facts["grids"]
        assert (facts["name"], facts["type"], facts["class"]) == ("surface", "float", "level set")
        assert (facts["voxel_size"], facts["translation"]) == (0.5, [1, 2, 3])
        assert facts["active_voxels"] == 120
        return
    assert (facts["kind"], facts["dtype"], facts["shape"]) == ("grid", "float32", [4, 5, 6])
    if suffix not in PLACELESS:
        assert (facts["voxel_size"], facts["origin"]) == (0.5, [1, 2, 3])
    if suffix not in WORDLESS:
        assert (facts["sign"], facts["half_width"]) == ("parity", 2.5)


@pytest.mark.parametrize("suffix", SPARSE)
def test_the_facts_of_a_band_stand_in_its_header(tmp_path, suffix):
    band = mesh_to_band(icosphere(subdivisions=2), voxel_size=0.25, closest=True)
    path = tmp_path / f"a{suffix}"
    write_volume(path, band, half=True)
    facts = probe_volume(path)
    if suffix == ".vdb":
        assert [one["name"] for one in facts["grids"]] == ["surface", "closest_face", "barycentric"]
        facts = facts["grids"][0]
        assert facts["active_voxels"] == band.n_active
    else:
        assert (facts["kind"], facts["n_bricks"]) == ("narrow_band", band.index.n_bricks)
        assert (facts["sign"], facts["half_width"]) == (band.sign, 3)
    assert (facts["voxel_size"], facts["translation"]) == (0.25, [0, 0, 0])
    assert facts["dtype"] == "float16"


def read_bytes() -> int:
    """What this process has read from files so far."""
    rows = dict(line.split(": ") for line in Path("/proc/self/io").read_text().splitlines())
    return int(rows["rchar"])


LONGEST = (1 << 20) + (1 << 16)
"""Bytes that a reader may take at once to find a header's end, and a little for its keys."""


@pytest.mark.skipif(not os.path.exists("/proc/self/io"), reason="the system does not count bytes")
@pytest.mark.parametrize("suffix", VOLUMES)
def test_values_are_not_read(tmp_path, suffix):
    values = np.random.default_rng(0).normal(size=(96, 96, 96)).astype(np.float32)
    path = tmp_path / f"a{suffix}"
    write_volume(path, Grid(values, 0.5, np.zeros(3)))
    assert sum(stored_bytes(file) for file in tmp_path.iterdir()) > 2 * LONGEST
    probe_volume(path)  # what is imported is read now
    before = read_bytes()
    probe_volume(path)
    assert read_bytes() - before < LONGEST
