"""What holds for every format of full grids: NRRD, MetaImage, VTI, raw, DDS, .vf, SDFGen."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf import mesh_to_band
from meshsdf.errors import IoError, MemoryLimitError
from meshsdf.grid import Grid, NarrowBand
from meshsdf.io import read_volume, write_volume
from meshsdf.io.dense_form import full_grid
from meshsdf.io.detached import written_together
from meshsdf.io.registry import FORMATS, format_of
from meshsdf.io.volumes import probe_volume
from meshsdf.mesh.primitives import icosphere
from meshsdf.surface import sample_hermite
from tests.io.dense_examples import DOUBLE, WAYS, WORDY, assert_same_grid, sphere_grid, written

few = settings(max_examples=8, deadline=None)
seeds = st.integers(0, 2**32 - 1)
all_ways = pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)


def random_grid(seed, dtype=np.float32) -> Grid:
    """Any numbers and gaps, on a few nodes; one axis may be a single node."""
    random = np.random.default_rng(seed)
    shape = random.integers(1, 20, 3)
    values = (random.normal(size=shape) * 10.0 ** random.integers(-30, 30, shape)).astype(dtype)
    values[random.random(shape) < 0.1] = np.nan
    values[random.random(shape) < 0.1] = -0.0
    return Grid(
        values,
        float(random.uniform(1e-9, 1e9)),
        random.normal(size=3) * 10.0 ** random.integers(-9, 9),
        str(random.choice(["parity", "winding", "unsigned"])),
        int(random.integers(9)) if seed % 2 else None,
        int(random.integers(3)),
        float(random.uniform(1, 9)) if seed % 3 else None,
    )


@pytest.mark.parametrize("name", WORDY)
@few
@given(seeds, st.sampled_from([np.float32, np.float64]))
def test_a_grid_comes_back_bit_equal_with_all_it_says(tmp_path_factory, name, seed, dtype):
    grid = random_grid(seed, dtype if name in DOUBLE else np.float32)
    path = written(WAYS[name], tmp_path_factory.mktemp("a"), grid)
    assert_same_grid(read_volume(path), grid)


@few
@given(seeds)
def test_text_and_textures_keep_values_and_what_else_they_have_room_for(tmp_path_factory, seed):
    folder, grid = tmp_path_factory.mktemp("a"), random_grid(seed)
    back = read_volume(written(WAYS["vf"], folder, grid))
    assert back.values.tobytes() == grid.values.tobytes()
    plain = dataclasses.replace(grid, values=np.nan_to_num(grid.values))
    back = read_volume(written(WAYS["sdf"], folder, plain))
    assert back.values.tobytes() == plain.values.tobytes()
    assert back.origin.tobytes() == plain.origin.tobytes()
    assert back.voxel_size == plain.voxel_size


@all_ways
def test_a_header_alone_tells_what_is_in_the_file(tmp_path, way):
    grid = dataclasses.replace(sphere_grid(), half_width=9.5, uncertain_voxels=4)
    path = written(way, tmp_path, grid)
    found, facts = way.read(path), probe_volume(path)
    told = found.facts()
    assert (facts["kind"], facts["shape"], facts["dtype"]) == ("grid", [27, 26, 28], "float32")
    shared = facts.keys() & told.keys()
    assert {name: facts[name] for name in shared} == {name: told[name] for name in shared}
    if "half_width" in format_of(path).holds:
        assert shared >= {"voxel_size", "origin", "sign", "half_width", "uncertain_voxels"}
        assert facts["background"] == np.float32(0.95)


@all_ways
def test_the_same_grid_gives_the_same_bytes_whatever_its_memory_order(tmp_path, way):
    grid = sphere_grid()
    turned = dataclasses.replace(grid, values=np.asfortranarray(grid.values))
    found = []
    for each in (grid, turned):
        written(way, tmp_path, each)
        found.append({file.name: file.read_bytes() for file in tmp_path.iterdir()})
    assert found[0] == found[1]


@all_ways
def test_files_that_exist_are_left_alone(tmp_path, way):
    path = written(way, tmp_path, sphere_grid())
    files = {file: file.read_bytes() for file in tmp_path.iterdir()}
    assert len(files) == 1 + bool(way.beside)
    with pytest.raises(IoError, match="the output exists"):
        way.write(path, sphere_grid())
    if way.beside:
        # The second file alone stands in the way, too
        path.unlink()
        with pytest.raises(IoError, match=r"the output exists\n.*" + way.beside):
            way.write(path, sphere_grid(), **way.options)
        path.write_bytes(files[path])
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == files


@pytest.mark.parametrize("name", [name for name in WAYS if WAYS[name].beside])
def test_of_two_files_the_one_that_names_the_other_comes_last(tmp_path, name):
    path = written(WAYS[name], tmp_path, sphere_grid())
    header = path.with_suffix(WAYS[name].beside) if "json" in WAYS[name].beside else path
    (data,) = set(tmp_path.iterdir()) - {header}
    assert data.name in header.read_text() or header.suffix == ".json"
    # Taking its name is the last thing that happens to a file
    assert data.stat().st_ctime_ns <= header.stat().st_ctime_ns


def test_a_stop_between_leaves_neither_file(tmp_path):
    def stopped():
        pair = (tmp_path / "a.nhdr", tmp_path / "a.raw")
        with written_together(*pair, False) as (header, body):
            header.write_text("half")
            body.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert list(tmp_path.iterdir()) == []


@all_ways
def test_a_volume_without_sense_is_not_written(tmp_path, way):
    path = tmp_path / f"a{way.suffix}"
    cases = [
        (np.full((2, 2, 2), np.inf), "values are infinite"),
        (np.zeros((2, 0, 2)), "a grid of 2 x 0 x 2 nodes has no place"),
    ]
    for values, words in cases:
        with pytest.raises(IoError, match=words):
            way.write(path, Grid(values, 1.0, np.zeros(3)))
    with pytest.raises(IoError, match="origin are NaN"):
        way.write(path, Grid(np.zeros((2, 2, 2)), 1.0, np.array([0, np.nan, 0])))
    assert list(tmp_path.iterdir()) == []


def test_numbers_that_a_format_cannot_hold_are_refused_or_told(tmp_path):
    gaps = Grid(np.array([[[1.0, np.nan]]], np.float32), 1.0, np.zeros(3))
    with pytest.raises(IoError, match="no place for NaN, of which there are 1"):
        write_volume(tmp_path / "a.sdf", gaps)
    for suffix in ("sdf", "vf"):
        with pytest.raises(IoError, match=r"values up to 1e\+39 do not fit float32"):
            write_volume(tmp_path / f"a.{suffix}", Grid(np.full((1, 1, 1), 1e39), 1.0, np.zeros(3)))
        notes = []
        third = Grid(np.full((1, 1, 1), 1 / 3), 1.0, np.zeros(3))
        write_volume(tmp_path / f"a.{suffix}", third, warn=notes.append)
        assert notes[0].endswith("holds 32-bit floats: the values are rounded")
        assert read_volume(tmp_path / f"a.{suffix}").values[0, 0, 0] == np.float32(1 / 3)
    wide = Grid(np.zeros((65536, 1, 1), np.float32), 1.0, np.zeros(3))
    with pytest.raises(IoError, match=r"65536 x 1 x 1 nodes; a \.vf file has 1 to 65535"):
        write_volume(tmp_path / "b.vf", wide)


def test_raw_files_and_textures_hold_16_bits_and_the_others_say_so(tmp_path):
    grid = sphere_grid()
    for way in WAYS.values():
        notes, path = [], tmp_path / f"{way.suffix[1:]}{way.suffix}"
        write_volume(path, grid, half=True, force=True, warn=notes.append)
        if way.suffix in (".raw", ".dds"):
            assert notes == []
            assert probe_volume(path)["dtype"] == "float16"
            rounded = grid.values.astype(np.float16).astype(np.float32)
            assert_array_equal(read_volume(path).values, rounded)
        else:
            assert any("has no 16-bit floats" in note for note in notes)
            assert read_volume(path).values.tobytes() == grid.values.tobytes()


# What the registry says of formats


def test_words_of_a_format_are_those_of_the_registry():
    known = {"band", "grid", "half", "double", "gaps", "transform", "sign", "half_width"}
    known |= {"closest", "hermite", "uncertain", "vectors", "metadata"}
    for format in FORMATS:
        assert format.holds <= known
        assert format.kind == "volume" or not format.holds, format.name


@pytest.mark.parametrize("format", [f for f in FORMATS if f.holds], ids=lambda f: f.name)
def test_a_format_holds_of_a_grid_what_the_registry_says(tmp_path, format):
    path, values = tmp_path / f"a{format.suffixes[0]}", np.full((3, 4, 5), 1 / 3)
    values[0, 0, 0] = -1 / 3
    grid = Grid(values, 0.7, np.array([0.1, 0.2, 0.3]), "parity", half_width=2.5)
    write_volume(path, grid)
    back = read_volume(path)
    assert isinstance(back, Grid)
    if "double" in format.holds:
        assert back.values.tobytes() == values.tobytes()
    else:
        assert_array_equal(back.values, values.astype(np.float32))
    is_placed = back.voxel_size == 0.7 and np.array_equal(back.origin, grid.origin)
    assert is_placed == ("transform" in format.holds)
    assert (back.sign == "parity") == ("sign" in format.holds)
    assert (back.half_width == 2.5) == ("half_width" in format.holds)
    write_volume(path, grid, half=True, force=True)
    is_half = np.array_equal(read_volume(path).values, values.astype(np.float16))
    assert is_half == ("half" in format.holds)
    values[1, 1, 1] = np.nan
    if "gaps" in format.holds:
        write_volume(path, grid, force=True)
        assert np.argwhere(np.isnan(read_volume(path).values)).tolist() == [[1, 1, 1]]
    else:
        with pytest.raises(IoError, match="NaN"):
            write_volume(path, grid, force=True)


@pytest.mark.parametrize("format", [f for f in FORMATS if f.holds], ids=lambda f: f.name)
def test_a_format_holds_of_a_band_what_the_registry_says(tmp_path, format):
    ball = icosphere(3.5, subdivisions=2)
    band = mesh_to_band(ball, voxel_size=1.0, half_width=1.5, closest=True)
    band = dataclasses.replace(band, uncertain=band.active // 3)
    path = tmp_path / f"a{format.suffixes[0]}"
    write_volume(path, band)
    back = read_volume(path)
    assert isinstance(back, NarrowBand) == ("band" in format.holds)
    for word, name in [("closest", "closest_face"), ("uncertain", "uncertain")]:
        assert (getattr(back, name, None) is not None) == (word in format.holds)
    hermite = dataclasses.replace(band, hermite=sample_hermite(ball, band))
    notes, refusal = [], ""
    try:
        write_volume(path, hermite, force=True, warn=notes.append)
    except IoError as error:
        refusal = str(error)
    if "hermite" in format.holds:
        assert read_volume(path).hermite is not None
    else:
        assert "crossings" in refusal or "crossings" in " ".join(notes)


# Narrow bands


@pytest.fixture(scope="module")
def band() -> NarrowBand:
    """A sphere of 9.5 voxels; bricks inside, outside and in between."""
    shift = np.array([0.3, -0.2, 0.7])
    return mesh_to_band(
        icosphere(9.5, subdivisions=3), voxel_size=1.0, half_width=2.5, translation=shift
    )


def test_a_band_as_a_full_grid_has_its_values_at_every_node(band):
    grid = full_grid(band)
    low, high = band.active_box()
    assert grid.values.shape == tuple(high - low + 1)
    ijk = np.indices(grid.values.shape).reshape(3, -1).T
    positions = grid.origin + grid.voxel_size * ijk
    nodes = np.rint((positions - band.translation) / band.voxel_size).astype(np.int64)
    assert_allclose(band.to_world(nodes), positions, rtol=0, atol=1e-14 * 20)  # its rounding
    assert_array_equal(band.value_at(nodes), grid.values.ravel())
    assert {-2.5, 2.5} < set(np.unique(grid.values).tolist())  # inside, outside, and between
    assert (grid.half_width, grid.background, grid.sign) == (2.5, 2.5, band.sign)


def test_a_band_that_would_fill_the_memory_is_refused_with_the_number(band):
    words = r"about 5\d\.\d kB would be needed, 1 kB are allowed\n.*full grid of 2\d x .* nodes"
    with pytest.raises(MemoryLimitError, match=words) as refusal:
        full_grid(band, max_memory=1000)
    assert "keep bands sparse" in str(refusal.value)


@all_ways
def test_a_band_is_written_as_a_full_grid_and_says_that_it_is_clipped(tmp_path, way, band):
    notes, path = [], tmp_path / f"a{way.suffix}"
    doubtful = dataclasses.replace(band, uncertain=band.active // 3, n_inner_faces=2)
    write_volume(path, doubtful, warn=notes.append)
    assert "clipped to +-2.5 beyond 2.5 voxels" in notes[0]
    assert "which nodes have no certain side; left out" in notes[1]
    back, expected = read_volume(path), full_grid(doubtful)
    assert back.values.tobytes() == expected.values.tobytes()
    if "half_width" in format_of(path).holds:
        assert_same_grid(back, expected)
        assert (back.facts()["half_width"], back.facts()["background"]) == (2.5, 2.5)
        assert back.uncertain_voxels == doubtful.uncertain_voxels


@pytest.mark.parametrize("suffix", [".npz", ".vdb"])
def test_sparse_formats_keep_a_clipped_grid_as_it_is(tmp_path, band, suffix):
    grid = full_grid(band)
    write_volume(tmp_path / f"a{suffix}", grid)
    assert_same_grid(read_volume(tmp_path / f"a{suffix}"), grid)
