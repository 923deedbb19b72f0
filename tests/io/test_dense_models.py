"""Formats of full grids: real meshes go through every one of them."""

import pytest

from meshsdf import mesh_to_band, mesh_to_grid
from meshsdf.grid import NarrowBand
from meshsdf.io import read_mesh
from meshsdf.io.dense_form import full_grid
from tests.io.dense_examples import WAYS, WORDY, assert_same_grid
from tests.models import all_models, model, needs_models


@needs_models
@pytest.mark.parametrize("name", all_models())
def test_every_model_goes_through_every_format(tmp_path, name):
    mesh = read_mesh(model(name))
    for volume in (mesh_to_grid(mesh, resolution=32), mesh_to_band(mesh, resolution=32)):
        grid = full_grid(volume) if isinstance(volume, NarrowBand) else volume
        for key, way in WAYS.items():
            path = tmp_path / f"a{way.suffix}"
            way.write(path, volume, force=True, **way.options)
            back = way.read(path)
            assert back.values.tobytes() == grid.values.tobytes(), key
            if key in WORDY:
                assert_same_grid(back, grid)
