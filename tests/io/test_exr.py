"""meshsdf.io.exr: pixels lie where the header says, and grids come back bit by bit."""

import dataclasses
import errno
import json
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf import mesh_to_band, read_volume, write_volume
from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io.exr import probe_exr, read_exr, write_exr, write_images
from meshsdf.io.exr_layout import ALONG, nearly_square
from meshsdf.mesh.primitives import box_mesh
from tests.io.exr_examples import (
    ball,
    center_of,
    facts_beside,
    header_of,
    images_of,
    random_grid,
)

few = settings(max_examples=25, deadline=None)
seeds = st.integers(0, 2**32 - 1)
ups = st.sampled_from(["y", "z"])
layouts = st.sampled_from(["atlas", "parts"])


def assert_same_grid(a, b):
    """Every field has the same bits."""
    assert a.values.dtype == b.values.dtype
    assert a.values.shape == b.values.shape
    assert a.values.tobytes() == np.ascontiguousarray(b.values).tobytes()
    assert a.origin.tobytes() == b.origin.tobytes()
    for field in dataclasses.fields(a):
        if field.name not in ("values", "origin"):
            assert getattr(a, field.name) == getattr(b, field.name), field.name


@few
@given(seeds, layouts, ups)
def test_a_float32_grid_comes_back_bit_equal_with_its_gaps(tmp_path_factory, seed, layout, up):
    path = tmp_path_factory.mktemp("exr") / "a.exr"
    grid = random_grid(seed, gaps=True)
    write_exr(path, grid, layout=layout, up=up)
    assert_same_grid(read_exr(path), grid)
    plain = dataclasses.replace(grid, uncertain_voxels=None, half_width=None, n_inner_faces=0)
    write_exr(path, plain, layout=layout, up=up, force=True)
    assert_same_grid(read_exr(path), plain)


@pytest.mark.parametrize("columns", range(1, 8))
def test_every_number_of_columns_gives_the_same_grid_back(tmp_path, columns):
    grid = random_grid(1, (5, 4, 7))
    write_exr(tmp_path / "a.exr", grid, columns=columns)
    assert images_of(tmp_path / "a.exr")[0].shape == (4 * -(-7 // columns), 5 * columns)
    assert_same_grid(read_exr(tmp_path / "a.exr"), grid)


def test_where_z_is_up_pixel_row_j_column_i_of_slice_k_is_node_ijk(tmp_path):
    grid = random_grid(2, (5, 4, 7))
    write_exr(tmp_path / "atlas.exr", grid, columns=3)
    write_exr(tmp_path / "parts.exr", grid, layout="parts")
    (atlas,), parts = images_of(tmp_path / "atlas.exr"), images_of(tmp_path / "parts.exr")
    for i, j, k in np.ndindex(5, 4, 7):
        assert atlas[k // 3 * 4 + j, k % 3 * 5 + i] == grid.values[i, j, k]
        assert parts[k][j, i] == grid.values[i, j, k]
    assert [header_of(tmp_path / "parts.exr", k)["name"] for k in (0, 6)] == [
        "slice.00000",
        "slice.00006",
    ]


def test_where_y_is_up_slices_climb_and_the_model_is_turned_not_mirrored(tmp_path):
    grid = random_grid(3, (5, 4, 7))
    write_exr(tmp_path / "atlas.exr", grid, columns=2, up="y")
    write_exr(tmp_path / "parts.exr", grid, layout="parts", up="y")
    (atlas,), parts = images_of(tmp_path / "atlas.exr"), images_of(tmp_path / "parts.exr")
    for i, j, k in np.ndindex(5, 4, 7):
        assert parts[j][6 - k, i] == grid.values[i, j, k]
        assert atlas[j // 2 * 7 + 6 - k, j % 2 * 5 + i] == grid.values[i, j, k]
    for along in ALONG.values():
        turn = [
            [(1 if step[0] == "+" else -1) * (step[1] == axis) for axis in "xyz"] for step in along
        ]
        assert np.linalg.det(turn) == 1


def test_unused_cells_hold_the_background(tmp_path):
    grid = dataclasses.replace(ball((4, 4, 5))[0], half_width=3.0)
    write_exr(tmp_path / "a.exr", grid, columns=3)
    (atlas,) = images_of(tmp_path / "a.exr")
    assert (atlas[4:, 8:] == np.float32(3 * 0.05)).all()
    assert facts_beside(tmp_path / "a.exr")["background"] == grid.background
    grid = dataclasses.replace(grid, half_width=None)
    write_exr(tmp_path / "a.exr", grid, columns=3, force=True)
    assert (images_of(tmp_path / "a.exr")[0][4:, 8:] == np.abs(grid.values).max()).all()


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("layout", ["atlas", "parts"])
@pytest.mark.parametrize("remap", [None, "range"])
def test_a_sphere_lies_where_another_reader_of_pixels_and_facts_finds_it(
    tmp_path, up, layout, remap
):
    grid, center = ball()
    write_exr(tmp_path / "a.exr", grid, up=up, layout=layout, remap=remap)
    facts = facts_beside(tmp_path / "a.exr")
    images = images_of(tmp_path / "a.exr")
    (width, height), n = facts["slice_size"], facts["n_slices"]
    if layout == "atlas":
        rows = np.split(images[0], facts["rows"], axis=0)
        images = [cell for row in rows for cell in np.split(row, facts["columns"], axis=1)][:n]
    volume = np.stack(images)
    assert volume.shape == (n, height, width)
    # A texel's coordinate is its middle: (number + 1/2) / how many, from the one face to the other
    places = np.empty((*volume.shape, 3))
    ways = (facts["slices_along"], facts["rows_along"], facts["columns_along"])
    for axis, (sign, letter) in enumerate(ways):
        t = (np.arange(volume.shape[axis]) + 0.5) / volume.shape[axis]
        t = t if sign == "+" else 1 - t
        one = "xyz".index(letter)
        low, high = facts["lower"][one], facts["upper"][one]
        shape = [-1 if a == axis else 1 for a in range(3)]
        places[..., one] = (low + t * (high - low)).reshape(shape)
    values = volume * facts["value_scale"] + facts["value_offset"]
    assert_allclose(center_of(values, places), center, atol=1e-4 * grid.voxel_size)


def test_remapped_values_lie_in_0_to_1_and_come_back_within_the_stated_error(tmp_path):
    random = np.random.default_rng(4)
    values = random.uniform(-2, 3, (8, 8, 8)).astype(np.float32)
    values[0, 0, :4] = [-1e-30, 1e-30, 0.0, -2.5]
    grid = Grid(values, 0.1, np.zeros(3))
    for half, exponent in ((False, -24), (True, -11)):
        write_exr(tmp_path / "a.exr", grid, remap="range", half=half, force=True)
        (atlas,), facts = images_of(tmp_path / "a.exr"), facts_beside(tmp_path / "a.exr")
        assert atlas.min() >= 0
        assert atlas.max() == 1
        assert facts["remap"] == np.abs(values).max()
        back = read_exr(tmp_path / "a.exr").values
        # And half a digit of float32 for the values themselves
        assert np.abs(back - values).max() <= facts["remap"] * (2.0**exponent + 2.0**-24)
        assert_array_equal(back < 0, values < 0)
        assert back[0, 0, 2] == 0


def test_a_remap_shorter_than_the_values_says_how_many_it_clamps(tmp_path):
    grid, _ = ball()
    warnings = []
    write_exr(tmp_path / "a.exr", grid, remap=0.2, warn=warnings.append)
    n = np.count_nonzero(np.abs(grid.values) > 0.2)
    assert warnings == [f"{n} values are beyond +-0.2, so they are stored as 0 or 1, and lost"]
    assert facts_beside(tmp_path / "a.exr")["n_clamped"] == n
    back = read_exr(tmp_path / "a.exr").values
    assert_allclose(back, np.clip(grid.values, -0.2, 0.2), atol=0.2 * 2.0**-23)
    for wrong in (0, -1.0, np.nan, np.inf):
        with pytest.raises(IoError, match=f"remap is {wrong}"):
            write_exr(tmp_path / "b.exr", grid, remap=wrong)


def test_half_rounds_each_value_to_the_nearest_float16(tmp_path):
    grid, _ = ball()
    write_exr(tmp_path / "a.exr", grid, half=True)
    expected = grid.values.astype(np.float16)
    assert images_of(tmp_path / "a.exr")[0].dtype == np.float16
    assert_array_equal(read_exr(tmp_path / "a.exr").values, expected.astype(np.float32))
    small = Grid(np.full((2, 2, 2), -1e-9), 1.0, np.zeros(3))
    small.values[0] = 1
    write_exr(tmp_path / "b.exr", small, half=True)
    assert (read_exr(tmp_path / "b.exr").values[1] < 0).all()
    with pytest.raises(IoError, match=r"values up to 1e\+06 do not fit float16"):
        write_exr(tmp_path / "c.exr", Grid(np.full((2, 2, 2), 1e6), 1.0, np.zeros(3)), half=True)


@few
@given(seeds)
def test_the_same_values_give_the_same_bytes_whatever_their_memory_order(tmp_path_factory, seed):
    folder = tmp_path_factory.mktemp("exr")
    grid = random_grid(seed)
    doubled = np.repeat(grid.values, 2, axis=1)[:, ::2]
    turned = np.ascontiguousarray(grid.values[::-1, :, ::-1])[::-1, :, ::-1]
    forms = [grid.values, np.asfortranarray(grid.values), doubled, turned]
    for up, layout in (("y", "atlas"), ("z", "parts")):
        for number, values in enumerate(forms):
            same = dataclasses.replace(grid, values=values)
            write_exr(folder / f"{number}.exr", same, up=up, layout=layout, force=True)
        assert len({(folder / f"{n}.exr").read_bytes() for n in range(len(forms))}) == 1


def test_the_header_and_the_json_beside_it_say_the_same(tmp_path):
    grid = random_grid(5, (5, 4, 7))
    write_exr(tmp_path / "a.exr", grid, remap=2.5)
    beside, header = facts_beside(tmp_path / "a.exr"), header_of(tmp_path / "a.exr")
    ours = {key: json.loads(text) for key, text in header.items() if key.startswith("meshsdf:")}
    assert ours == {f"meshsdf:{key}": value for key, value in beside.items()}
    assert probe_exr(tmp_path / "a.exr") == {"kind": "grid", **beside}
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    assert beside["voxel_size"] == grid.voxel_size
    assert beside["origin"] == grid.origin.tolist()
    assert beside["shape"] == [5, 4, 7]
    assert (beside["sign"], beside["dtype"]) == ("winding", "float32")
    assert beside["value_range"] == [grid.values.min(), grid.values.max()]
    assert_allclose(beside["lower"], grid.origin - grid.voxel_size / 2)
    assert_allclose(beside["upper"], grid.origin + grid.voxel_size * (np.array([5, 4, 7]) - 0.5))
    (tmp_path / "a.exr.json").unlink()
    assert read_exr(tmp_path / "a.exr").values.shape == (5, 4, 7)


def test_a_grid_without_any_value_is_kept(tmp_path):
    grid = Grid(np.full((2, 3, 4), np.nan, np.float32), 1.0, np.zeros(3))
    write_exr(tmp_path / "a.exr", grid, remap="range")
    assert np.isnan(read_exr(tmp_path / "a.exr").values).all()
    assert facts_beside(tmp_path / "a.exr")["value_range"] is None


def test_a_band_becomes_a_full_grid_clipped_beyond_it(tmp_path):
    band = mesh_to_band(box_mesh(size=(1.0, 0.7, 1.3)), voxel_size=0.05)
    warnings = []
    write_volume(tmp_path / "a.exr", band, warn=warnings.append)
    grid = read_volume(tmp_path / "a.exr")
    assert "clipped to +-0.15 beyond 3 voxels" in warnings[0]
    low, high = band.active_box()
    nodes = np.stack(np.meshgrid(*map(np.arange, low, high + 1), indexing="ij"), -1)
    assert_array_equal(grid.values.ravel(), band.value_at(nodes.reshape(-1, 3)))
    assert_array_equal(grid.origin, band.to_world(low[None])[0])
    assert (grid.half_width, grid.sign, grid.background) == (3.0, band.sign, band.background)


@given(st.integers(1, 60), st.integers(1, 60), st.integers(1, 60))
def test_no_other_number_of_columns_makes_a_smaller_square(width, height, n):
    def side(columns):
        return max(columns * width, -(-n // columns) * height)

    assert side(nearly_square(width, height, n)) == min(map(side, range(1, n + 1)))


def test_what_cannot_be_is_refused_and_nothing_is_left(tmp_path):
    grid, _ = ball((3, 4, 5))
    cases = [
        ({"columns": 0}, "there are 0 columns for 5 slices"),
        ({"columns": 6}, "there are 6 columns for 5 slices"),
        ({"columns": 2, "layout": "parts"}, "2 columns make no sense where every slice is a part"),
    ]
    for options, words in cases:
        with pytest.raises(IoError, match=words):
            write_exr(tmp_path / "a.exr", grid, **options)
    empty = Grid(np.zeros((3, 0, 4)), 1.0, np.zeros(3))
    with pytest.raises(IoError, match="a grid of 3 x 0 x 4 nodes"):
        write_exr(tmp_path / "a.exr", empty)
    large = Grid(np.full((2, 2, 2), 1e39), 1.0, np.zeros(3))
    with pytest.raises(IoError, match=r"values up to 1e\+39 do not fit float32"):
        write_exr(tmp_path / "a.exr", large)
    assert not list(tmp_path.iterdir())


def test_neither_file_is_replaced_unless_asked_and_a_strangers_json_never_is(tmp_path):
    grid, _ = ball((3, 4, 5))
    write_exr(tmp_path / "a.exr", grid)
    with pytest.raises(IoError, match=r"(?s)the output exists.*a\.exr\.json"):
        write_exr(tmp_path / "a.exr", grid)
    (tmp_path / "a.exr.json").unlink()
    with pytest.raises(IoError, match=r"(?s)the output exists.*a\.exr"):
        write_exr(tmp_path / "a.exr", grid)
    write_exr(tmp_path / "a.exr", grid, force=True)
    write_exr(tmp_path / "a.exr", grid, force=True)
    (tmp_path / "a.exr.json").write_text('{"mine": 1}')
    for force in (False, True):
        with pytest.raises(IoError, match=r"the output exists|does not belong to the \.exr volume"):
            write_exr(tmp_path / "a.exr", grid, force=force)
    assert (tmp_path / "a.exr.json").read_text() == '{"mine": 1}'
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.exr", "a.exr.json"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_what_openexr_says_of_a_full_disk_becomes_the_error_of_a_full_disk():
    noise = np.random.default_rng(0).random((64, 64), np.float32)
    for images in ([noise], [noise, noise]):
        with pytest.raises(OSError, match="No space left on device") as error:
            write_images(Path("/dev/full"), images, {})
        assert error.value.errno == errno.ENOSPC


def test_a_picture_is_told_from_a_volume(tmp_path):
    pixels = {"RGB": np.zeros((4, 5, 3), np.float32)}
    header = {"compression": OpenEXR.PIZ_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, pixels).write(str(tmp_path / "a.exr"))
    for read in (read_exr, probe_exr):
        with pytest.raises(IoError, match="this is a picture, not a volume") as error:
            read(tmp_path / "a.exr")
        assert "meshsdf convert MESH OUT.exr" in error.value.fix
