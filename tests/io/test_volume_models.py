"""Volume formats: the band of every real mesh goes through all of them."""

from dataclasses import replace

import numpy as np
import pytest

from meshsdf import mesh_to_band
from meshsdf.grid import BrickIndex, Grid, NarrowBand
from meshsdf.io import probe_volume, read_mesh, read_volume, write_volume
from meshsdf.io.dense_form import full_grid
from meshsdf.io.registry import FORMATS
from tests.io.dense_examples import WAYS, WORDY, assert_same_grid
from tests.io.zarr_examples import assert_equal
from tests.models import all_models, model, needs_models

pytestmark = needs_models

RESOLUTION = 64

NAME = "left torso"

SPARSE = {".npz": {}, ".vdb": {"name": NAME}, ".zarr": {}, ".zarr.zip": {}}
"""Formats of bands, with options of their writers."""

IMAGES = {"atlas": {"up": "y"}, "parts": {"layout": "parts"}}


@pytest.fixture(scope="module", params=all_models())
def band(request) -> NarrowBand:
    """Of one model, for all tests of it."""
    return mesh_to_band(read_mesh(model(request.param)), resolution=RESOLUTION)


@pytest.fixture(scope="module")
def grid(band) -> Grid:
    """The band as a full grid."""
    return full_grid(band)


def assert_same_sides(a: BrickIndex, b: BrickIndex) -> None:
    """The same bricks have the same slots, and all others lie on the same side, far ones too."""
    assert_equal(a.coordinates, b.coordinates)
    low, high = b.coordinates.min(axis=0) - 20, b.coordinates.max(axis=0) + 20
    bricks = np.indices(tuple(high - low)).reshape(3, -1).T + low
    assert_equal(a.lookup(bricks), b.lookup(bricks))


def test_formats_of_bands_give_every_field_back(tmp_path, band):
    for suffix, options in SPARSE.items():
        path = tmp_path / f"a{suffix}"
        write_volume(path, band, options=options)
        back = read_volume(path)
        assert_same_sides(back.index, band.index)
        # A .vdb file has room around the bricks where a page table has none
        assert_equal(replace(back, index=band.index), band)
        assert (back.background, back.facts()) == (band.background, band.facts())
    assert probe_volume(tmp_path / "a.vdb")["default_grid"] == NAME


def test_formats_of_full_grids_give_the_values_and_all_they_have_room_for(tmp_path, grid):
    for key, way in WAYS.items():
        path = tmp_path / f"{way.suffix[1:]}{way.suffix}"
        name = {"name": NAME} if way.suffix == ".vti" else {}
        way.write(path, grid, force=True, **way.options, **name)
        back = way.read(path)
        assert back.values.tobytes() == grid.values.tobytes(), key
        if key in WORDY:
            assert_same_grid(back, grid)
            assert back.background == grid.background
        elif way.suffix == ".sdf":
            assert back.voxel_size == grid.voxel_size
            assert back.origin.tobytes() == grid.origin.tobytes()
        if name:
            assert probe_volume(path)["array"] == NAME


def test_formats_of_bands_give_full_grids_back_too(tmp_path, grid):
    for suffix, options in SPARSE.items():
        path = tmp_path / f"a{suffix}"
        write_volume(path, grid, options=options)
        assert_same_grid(read_volume(path), grid)


def test_images_give_the_grid_back_slice_by_slice(tmp_path, grid):
    for layout, options in IMAGES.items():
        path = tmp_path / f"{layout}.exr"
        write_volume(path, grid, options=options)
        back = read_volume(path)
        assert_same_grid(back, grid)
        assert back.background == grid.background


def test_a_grid_with_gaps_and_far_distances_comes_back(tmp_path, grid):
    """Distances that are clipped nowhere, and nodes without any."""
    values = grid.values * np.linspace(1, 40, grid.values.shape[0], dtype=np.float32)[:, None, None]
    values[::7, ::5, 3] = np.nan
    far = replace(grid, values=values, half_width=None)
    for suffix in (".npz", ".zarr", ".exr", ".nrrd"):
        write_volume(tmp_path / f"a{suffix}", far)
        assert_same_grid(read_volume(tmp_path / f"a{suffix}"), far)


def test_no_format_of_volumes_is_left_out():
    tried = {*SPARSE, ".exr", *(way.suffix for way in WAYS.values())}
    assert tried == {suffix for f in FORMATS if f.kind == "volume" for suffix in f.suffixes}
