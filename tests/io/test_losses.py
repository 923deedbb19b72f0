"""meshsdf.io.losses: what a volume would lose elsewhere, in one sentence each."""

from dataclasses import replace

import numpy as np
import pytest

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io.losses import asked_losses, file_losses, require_accepted, volume_losses
from meshsdf.io.registry import FORMATS, format_of

from .examples import narrow_band

VOLUME_FORMATS = [format for format in FORMATS if format.kind == "volume"]


def grid(**facts) -> Grid:
    return Grid(np.zeros((2, 2, 2), facts.pop("dtype", np.float32)), 0.5, np.ones(3), **facts)


def test_npz_and_zarr_hold_all_that_there_is():
    full = grid(dtype=np.float64, uncertain_voxels=3, n_inner_faces=4, half_width=2.0)
    band = replace(narrow_band(0, with_faces=True), n_inner_faces=4)
    band = replace(band, uncertain=band.active)
    for name in ("a.npz", "a.zarr"):
        assert volume_losses(full, format_of(name), is_dense=True, half=True) == []
        assert volume_losses(band, format_of(name), is_dense=False, half=True) == []


@pytest.mark.parametrize("format", VOLUME_FORMATS, ids=lambda format: format.name)
def test_a_sentence_stands_for_every_word_that_a_format_lacks(format):
    full = grid(dtype=np.float64, uncertain_voxels=3, n_inner_faces=4, half_width=2.0)
    told = " ; ".join(volume_losses(full, format, is_dense=True, half=True))
    words = {
        "sign": "how inside was told (parity)",
        "half_width": "the half width at which distances end (2 voxels)",
        "double": "holds 32-bit floats: the values are rounded",
        "transform": "the voxel size 0.5, nor for 1, 1, 1",
        "half": "has no 16-bit floats",
    }
    for word, text in words.items():
        assert (text in told) == (word not in format.holds)
    for text in ("inner faces (4)", "uncertain nodes (3)"):
        assert (text in told) == ("sign" not in format.holds)


@pytest.mark.parametrize("format", VOLUME_FORMATS, ids=lambda format: format.name)
def test_what_stands_beside_a_band_is_lost_by_full_grids(format):
    band = narrow_band(0, with_faces=True)
    band = replace(band, uncertain=band.active)
    told = " ; ".join(volume_losses(band, format, is_dense=True))
    holder = "a full grid" if "closest" in format.holds else format.name
    assert f"{holder} has no place for closest faces and barycentrics" in told
    assert f"certain side ({band.uncertain_voxels} of them)" in told
    plain = replace(band, closest_face=None, barycentric=None, uncertain=None)
    if "sign" in format.holds:
        assert volume_losses(plain, format, is_dense=True) == []


def test_a_full_grid_cut_to_a_band_loses_its_digits_and_counts():
    full = grid(dtype=np.float64, uncertain_voxels=3)
    assert volume_losses(full, format_of("a.npz"), is_dense=False) == [
        "a narrow band has no place for the bare count of uncertain nodes (3)",
        "a narrow band holds 32-bit floats: the values are rounded",
    ]


def test_things_asked_for_are_held_against_the_format():
    assert asked_losses("a.vdb", closest=True, half=True) == {}
    assert list(asked_losses("a.nrrd", closest=True, half=True)) == ["closest", "half"]
    assert asked_losses("a.nrrd", closest=False, half=False) == {}
    assert list(asked_losses("a.exr", closest=True, half=True)) == ["closest"]


def test_other_grids_of_a_file_are_named_unless_one_was_chosen():
    grids = [
        {"name": "surface", "type": "float"},
        {"name": "closest_face", "type": "int32", "part_of": "surface"},
        {"name": "v", "type": "vec3s"},
    ]
    facts = {"grids": grids, "default_grid": "surface"}
    (told,) = file_losses(facts, None, is_named=False)
    assert "so 'v' (vec3s) would be left out" in told
    assert file_losses(facts, "surface", is_named=True) == []
    assert file_losses({"grids": grids[:2], "default_grid": "surface"}, None, is_named=False) == []
    (told,) = file_losses({"arrays": ["a", "b"], "array": "b"}, None, is_named=False)
    assert "so 'a' would be left out" in told
    assert file_losses({"kind": "grid"}, None, is_named=False) == []


def test_losses_are_refused_or_told():
    notes = []
    require_accepted([], "a.vf", force=False, warn=notes.append)
    with pytest.raises(IoError, match="one; two") as told:
        require_accepted(["one", "two"], "a.vf", force=False, warn=notes.append)
    assert "--force" in told.value.fix
    assert notes == []
    require_accepted(["one", "two"], "a.vf", force=True, warn=notes.append)
    assert notes == ["one", "two"]
