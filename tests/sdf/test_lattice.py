"""meshsdf.sdf.lattice: which voxel sizes make sense."""

import pytest

from meshsdf.errors import MemoryLimitError, SdfError
from meshsdf.mesh.primitives import box_mesh
from meshsdf.sdf import mesh_to_band, mesh_to_grid, resolve_voxel_size

BOX = box_mesh((1.0, 2.0, 4.0))


def test_a_resolution_parts_the_longest_side():
    assert resolve_voxel_size(BOX, 8, None) == 0.5
    assert resolve_voxel_size(BOX, None, 0.3) == 0.3


@pytest.mark.parametrize("resolution", [1e300, 1e31])
def test_voxels_too_small_for_float32_are_refused(resolution):
    with pytest.raises(SdfError, match="float32 distances want 1e-30 to 1e"):
        resolve_voxel_size(BOX, resolution, None)


@pytest.mark.parametrize("resolution", [1e-5, 1e-20, 1e-300])
def test_a_mesh_that_vanishes_in_one_voxel_is_refused(resolution):
    with pytest.raises(SdfError, match="the mesh is 4 long"):
        mesh_to_band(BOX, resolution=resolution)


@pytest.mark.parametrize("convert", [mesh_to_band, mesh_to_grid])
@pytest.mark.parametrize("resolution", [1e7, 1e20, 1e29])
def test_too_fine_is_refused_before_the_work_with_the_memory_it_would_take(convert, resolution):
    def started(*_):
        raise AssertionError("the work has started")

    with pytest.raises(MemoryLimitError, match="would be needed"):
        convert(BOX, resolution=resolution, progress=started)
