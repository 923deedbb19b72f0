"""meshsdf.io.vdb: what goes out comes in bit by bit, in every form the format has."""

import dataclasses
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from meshsdf.errors import IoError
from meshsdf.grid import BrickIndex, Grid, NarrowBand
from meshsdf.grid.hermite import Hermite
from meshsdf.io import read_volume, write_volume
from meshsdf.io.half import halved
from meshsdf.io.vdb import probe_vdb, read_vdb, read_vdb_grids, write_vdb, write_vdb_grids
from meshsdf.io.vdb_grid import VALUE_TYPES, VdbGrid
from tests.io.examples import narrow_band
from tests.io.vdb_examples import (
    assert_same_band,
    empty_band,
    entries,
    random_grid,
    text,
    vdb_bytes,
)

few = settings(max_examples=15, deadline=None)
seeds = st.integers(0, 2**32 - 1)
compressions = st.sampled_from(["none", "active", "zip", "blosc"])


@few
@given(seeds, st.integers(0, 12), compressions, st.booleans())
def test_a_band_comes_back_bit_equal(tmp_path_factory, seed, n_bricks, compression, with_faces):
    path = tmp_path_factory.mktemp("band") / "a.vdb"
    band = empty_band()
    if n_bricks:
        band = narrow_band(seed, n_bricks=n_bricks, with_faces=with_faces)
        band = dataclasses.replace(band, uncertain=band.active // 3 if seed % 2 else None)
    write_vdb(path, band, compression=compression)
    assert_same_band(read_vdb(path), band)


@few
@given(seeds, st.sampled_from(sorted(VALUE_TYPES)), compressions)
def test_a_grid_of_any_type_comes_back_with_all_tiles_and_states(
    tmp_path_factory, seed, value_type, compression
):
    path = tmp_path_factory.mktemp("grid") / "a.vdb"
    grid = random_grid(seed, value_type)
    write_vdb_grids(path, [grid], compression=compression)
    (back,) = read_vdb_grids(path)
    assert (back.value_type, back.value_type) == (value_type, grid.value_type)
    for name in ("values", "active", "background", "matrix"):
        assert getattr(back, name).tobytes() == getattr(grid, name).tobytes()
    assert_array_equal(entries(back), entries(grid))
    assert back.active_extent()[0] == grid.active_extent()[0]
    # And once more, now from an index that the reader made
    write_vdb_grids(path, [back], compression=compression, force=True)
    (again,) = read_vdb_grids(path)
    for name in ("coordinates", "page_origin", "root", "pages"):
        assert_array_equal(getattr(again.index, name), getattr(back.index, name))


def test_half_rounds_each_value_to_the_nearest_float16_and_nothing_else(tmp_path):
    band = dataclasses.replace(narrow_band(3), sign="parity")
    band.values[0, 0, 0] = -(2.0**-126)  # an inner node on the surface
    write_vdb(tmp_path / "a.vdb", band, half=True)
    back = read_vdb(tmp_path / "a.vdb")
    mask = band.active_mask()
    assert_array_equal(back.values[mask], halved(band.values[mask]).astype(np.float32))
    assert (back.values[0, 0, 0] < 0).all()
    assert (back.half_width, back.background) == (band.half_width, band.background)
    assert_same_band(dataclasses.replace(back, values=band.values), band)


def test_half_refuses_distances_that_float16_cannot_hold(tmp_path):
    for scale, shown in [(1e6, "e.06"), (1e-6, "e-06")]:
        grid = Grid(np.full((2, 2, 2), scale), 1.0, np.zeros(3))
        with pytest.raises(IoError, match=rf"values up to 1{shown} do not fit float16"):
            write_vdb(tmp_path / "a.vdb", grid, half=True)
    assert not (tmp_path / "a.vdb").exists()


def test_equal_volumes_give_equal_bytes_and_others_another_uuid(tmp_path):
    band = narrow_band(1)
    other = dataclasses.replace(band, values=band.values.copy())
    for name, volume in [("a", band), ("b", other)]:
        write_vdb(tmp_path / f"{name}.vdb", volume)
    first = (tmp_path / "a.vdb").read_bytes()
    assert first == (tmp_path / "b.vdb").read_bytes()
    other.values[2, 3, 4, 5] += 1
    write_vdb(tmp_path / "b.vdb", other, force=True)
    second = (tmp_path / "b.vdb").read_bytes()
    assert len(first) == len(second)
    assert first[21:57] != second[21:57]
    assert first[:21] == second[:21] == b" BDV\0\0\0\0\xe0\0\0\0\x0a\0\0\0\0\0\0\0\1"


# The layout itself


def test_a_file_made_by_hand_from_the_description_is_read(tmp_path):
    (tmp_path / "a.vdb").write_bytes(vdb_bytes())
    band = read_vdb(tmp_path / "a.vdb")
    assert (band.voxel_size, band.half_width, band.n_active) == (1.0, 3.0, 1)
    assert_array_equal(band.values.ravel(), np.arange(512))
    assert_array_equal(band.active_ijk(), [[0, 0, 0]])
    # z runs fastest
    assert_array_equal(band.value_at(np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0]])), [1, 8, 64])


@pytest.mark.parametrize(
    ("matrix", "name", "n_doubles"),
    [
        (np.diag([0.1, 0.1, 0.1, 1]), "UniformScaleMap", 15),
        (np.diag([0.1, 0.1, 0.3, 1]), "ScaleMap", 15),
        (
            [[0.1, 0, 0, 7], [0, 0.1, 0, -0.0], [0, 0, 0.1, 1 / 3], [0, 0, 0, 1]],
            "UniformScaleTranslateMap",
            18,
        ),
        (
            [[0.1, 0, 0, -0.0], [0, 0.1, 0, 0], [0, 0, 0.1, 0], [0, 0, 0, 1]],
            "UniformScaleTranslateMap",
            18,
        ),
        ([[0.1, 0, 0, 1], [0, -0.2, 0, 2], [0, 0, 0.3, 3], [0, 0, 0, 1]], "ScaleTranslateMap", 18),
        ([[0.1, 0.2, 0, 1], [0, 0.2, 0, 2], [0.3, 0, 0.3, 3], [0, 0, 0, 1]], "AffineMap", 16),
        ([[0, 0.1, 0, 0], [0, 0, 0.1, 0], [0.1, 0, 0, 0], [0, 0, 0, 1]], "AffineMap", 16),
    ],
)
def test_transforms_come_back_bit_equal_as_the_plainest_map(tmp_path, matrix, name, n_doubles):
    grid = random_grid(0, n_bricks=1, matrix=np.array(matrix, float))
    write_vdb_grids(tmp_path / "a.vdb", [grid])
    data = (tmp_path / "a.vdb").read_bytes()
    at = data.index(text(name)) + len(text(name))
    assert data[at + 8 * n_doubles :][:4] == b"\1\0\0\0"  # the tree follows
    assert read_vdb_grids(tmp_path / "a.vdb")[0].matrix.tobytes() == grid.matrix.tobytes()


def test_metadata_comes_back_and_what_cannot_be_written_is_named(tmp_path):
    words = {"a": True, "b": -3, "c": 0.1, "d": "é\x1b", "e": (1, 2, 3), "f": (0.5, 1.0)}
    grid = random_grid(0, n_bricks=1, metadata=words)
    write_vdb_grids(tmp_path / "a.vdb", [grid])
    found = read_vdb_grids(tmp_path / "a.vdb")[0].metadata
    assert {name: found[name] for name in words} == words
    assert found["class"] == "unknown"
    for bad in ({"": 1}, {"a": 2**63}, {"a": (1,)}, {"a": (2**31, 0, 0)}):
        with pytest.raises(IoError, match="metadata"):
            write_vdb_grids(tmp_path / "b.vdb", [dataclasses.replace(grid, metadata=bad)])


# Full grids


@few
@given(seeds, st.booleans())
def test_a_full_grid_comes_back_bit_equal_with_its_gaps_and_margins(tmp_path_factory, seed, doubts):
    path = tmp_path_factory.mktemp("grid") / "a.vdb"
    random = np.random.default_rng(seed)
    values = random.normal(size=random.integers(0, 40, 3)).astype(np.float32)
    values[values > 1] = np.nan
    values[: random.integers(0, 30)] = random.choice([np.nan, 0.5, -0.0])
    sign = str(random.choice(["parity", "winding", "unsigned"]))
    grid = Grid(values, 0.3, random.normal(size=3), sign, 7 if doubts else None)
    write_volume(path, grid)
    back = read_volume(path)
    assert back.values.tobytes() == grid.values.tobytes()
    assert back.values.shape == grid.values.shape
    assert back.origin.tobytes() == grid.origin.tobytes()
    assert (back.sign, back.voxel_size) == (grid.sign, 0.3)
    assert back.uncertain_voxels == grid.uncertain_voxels


def test_fog_keeps_its_values_and_is_sparse_where_it_is_constant(tmp_path):
    values = np.zeros((300, 40, 300), np.float32)
    values[:256] = 1.0
    values[280, 20, 100:110] = np.linspace(0.1, 1, 10)
    grid = Grid(values, 0.5, np.array([1.0, 2.0, 3.0]))
    write_vdb(tmp_path / "a.vdb", grid, grid_class="fog volume")
    back = read_vdb(tmp_path / "a.vdb")
    assert back.values.tobytes() == values.tobytes()
    (tree,) = read_vdb_grids(tmp_path / "a.vdb")
    # Of 32 x 5 x 38 bricks of 1 the last along z are not whole; the line is in two bricks
    assert tree.index.n_bricks == 32 * 5 + 2
    assert tree.active_extent()[0] == np.count_nonzero(values)
    assert (tree.name, tree.grid_class, float(tree.background)) == ("density", "fog volume", 0.0)
    assert (tmp_path / "a.vdb").stat().st_size < values.nbytes / 20


def test_float64_is_rounded_and_what_does_not_fit_is_refused(tmp_path):
    values = np.random.default_rng(0).normal(size=(5, 6, 7))
    write_vdb(tmp_path / "a.vdb", Grid(values, 1.0, np.zeros(3)))
    assert_array_equal(read_vdb(tmp_path / "a.vdb").values, values.astype(np.float32))
    with pytest.raises(IoError, match=r"values up to 1e\+39 do not fit float32"):
        write_vdb(tmp_path / "b.vdb", Grid(values * 0 + 1e39, 1.0, np.zeros(3)))
    fog = Grid(np.full((2, 2, 2), np.nan), 1.0, np.zeros(3))
    with pytest.raises(IoError, match="no place for NaN"):
        write_vdb(tmp_path / "b.vdb", fog, grid_class="fog volume")
    with pytest.raises(IoError, match="a narrow band is a level set"):
        write_vdb(tmp_path / "b.vdb", narrow_band(0), grid_class="fog volume")
    none, points = np.empty(0), np.empty((0, 3))
    arcs, loops = np.empty(0, np.int64), np.empty(0, np.int32)
    data = Hermite(none, points, loops, points, arcs, points)
    with pytest.raises(IoError, match="crossings and normals have no place"):
        write_vdb(tmp_path / "b.vdb", dataclasses.replace(narrow_band(0), hermite=data))
    assert not (tmp_path / "b.vdb").exists()


# Grids of other programs


def foreign(index, values, *, background=1.5, **changes):
    """A level set without the words that only our own files have."""
    n = index.n_bricks
    active = np.full((n, 8), ~np.uint64(0))
    matrix = np.diag([0.5, 0.5, 0.5, 1.0])
    background = np.array(background, np.float32)
    return VdbGrid("ball", index, values, active, background, matrix, "level set", **changes)


def test_active_tiles_of_a_level_set_become_bricks_and_others_keep_their_sign(tmp_path):
    index = BrickIndex.from_coordinates(np.array([[0, 0, 0], [3, 3, 20]]))
    lower = index.pages[1:]
    lower[0, 1, 0, 0], lower[0, 2, 0, 0], lower[1, 0, 0, 0] = -3, -4, -2
    index.pages[0, 5, 0, 0], index.pages[0, 6, 0, 0], index.pages[0, 7, 0, 0] = -3, -5, -2
    tiles = {
        "tile_values": np.array([-0.25, 1.0, -0.75], np.float32),
        "tile_active": np.array([True, False, False]),
    }
    grid = foreign(index, np.ones((2, 8, 8, 8), np.float32), **tiles)
    write_vdb_grids(tmp_path / "a.vdb", [grid])
    notes = []
    band = read_vdb(tmp_path / "a.vdb", warn=notes.append)
    assert notes == [
        "2 tiles of the grid 'ball' hold other values than its background; "
        "of them only the sign is kept"
    ]
    assert band.index.n_bricks == 2 + 1 + 4096
    nodes = {
        (8, 0, 0): -0.25,
        (16, 0, 0): 1.5,  # was 1
        (0, 0, 128): -1.5,
        (5 * 128 + 127, 127, 127): -0.25,
        (6 * 128, 0, 0): -1.5,  # was -0.75
        (7 * 128 + 9, 100, 3): -1.5,
        (7, 7, 7): 1.0,
        (26, 25, 163): 1.0,
        (-1, 0, 0): 1.5,
    }
    assert_array_equal(band.value_at(np.array(list(nodes))), list(nodes.values()))
    assert (band.half_width, band.sign) == (3.0, "winding")
    assert band.n_active == 512 * band.index.n_bricks


def test_the_half_width_of_foreign_level_sets_is_a_round_number_if_that_is_exact(tmp_path):
    index = BrickIndex.from_coordinates(np.array([[0, 0, 0]]))
    for background, expected in [(1.5, 3.0), (2.0, 4.0), (1.2345678, 1.2345678 * 2)]:
        values = np.ones((1, 8, 8, 8), np.float32)
        grid = foreign(index, values, background=background)
        write_vdb_grids(tmp_path / "a.vdb", [grid], force=True)
        band = read_vdb(tmp_path / "a.vdb")
        assert band.background == np.float32(background)
        assert band.half_width == pytest.approx(expected, rel=1e-7)
    # A stale word of ours is not believed
    grid = foreign(index, values, metadata={"meshsdf_half_width": 7.0, "meshsdf_sign": "\x1b"})
    write_vdb_grids(tmp_path / "a.vdb", [grid], force=True)
    band = read_vdb(tmp_path / "a.vdb")
    assert (band.half_width, band.sign) == (3.0, "winding")


def test_a_level_set_of_doubles_is_rounded_unless_it_does_not_fit(tmp_path):
    index = BrickIndex.from_coordinates(np.array([[0, 0, 0]]))
    values = np.random.default_rng(0).normal(size=(1, 8, 8, 8))
    grid = dataclasses.replace(foreign(index, values), background=np.array(1.5))
    write_vdb_grids(tmp_path / "a.vdb", [grid])
    assert_array_equal(read_vdb(tmp_path / "a.vdb").values, values.astype(np.float32))
    for kind in ("level set", "fog volume"):
        huge = dataclasses.replace(grid, values=values * 1e300, grid_class=kind)
        write_vdb_grids(tmp_path / "a.vdb", [huge], force=True)
        with pytest.raises(IoError, match="infinite"):
            read_vdb(tmp_path / "a.vdb")


def test_the_first_level_set_is_read_unless_another_grid_is_asked_for(tmp_path):
    index = BrickIndex.from_coordinates(np.array([[0, 0, 0]]))
    ones = np.ones((1, 8, 8, 8), np.float32)
    ball = foreign(index, ones)
    fog = dataclasses.replace(ball, name="density", grid_class="fog volume", values=ones * 2)
    colors = random_grid(0, "vec3s", n_bricks=1, name="Cd")
    twin = dataclasses.replace(ball, values=ones / 2)
    path, notes = tmp_path / "a.vdb", []
    write_vdb_grids(path, [colors, fog, ball, twin])
    assert read_volume(path, warn=notes.append).values[0, 0, 0, 0] == 1
    assert notes == [
        "read the grid 'ball[0]'; there are also 'density' (float, fog volume), "
        "'ball[1]' (float, level set)"
    ]
    assert isinstance(read_volume(path, grid="density"), Grid)
    assert read_volume(path, grid="ball[1]").values[0, 0, 0, 0] == 0.5
    assert read_volume(path, grid="ball").values[0, 0, 0, 0] == 1
    assert [g.name for g in read_vdb_grids(path, ["ball[1]", "Cd"])] == ["ball", "Cd"]
    with pytest.raises(IoError, match="no grid 'bal'") as error:
        read_volume(path, grid="bal")
    assert "'Cd' (vec3s, unknown), 'density' (float, fog volume), 'ball[0]'" in error.value.fix
    write_vdb_grids(path, [colors], force=True)
    with pytest.raises(IoError, match=r"no grid of one number per voxel; there are 'Cd' \(vec3s"):
        read_volume(path)
    with pytest.raises(IoError, match="holds one volume, without a name"):
        read_volume(tmp_path / "a.npz", grid="density")


def test_headers_alone_tell_what_is_in_the_file(tmp_path):
    band = narrow_band(4, with_faces=True)
    write_vdb(tmp_path / "a.vdb", band, half=True)
    facts = probe_vdb(tmp_path / "a.vdb")
    assert (facts["kind"], facts["default_grid"]) == ("vdb", "surface")
    surface, faces, weights = facts["grids"]
    low, high = band.active_box()
    assert surface == {
        "name": "surface",
        "type": "float",
        "class": "level set" if band.is_signed else "unknown",
        "voxel_size": band.voxel_size,
        "translation": band.translation.tolist(),
        "background": float(np.float16(band.background)),
        "dtype": "float16",
        "compression": "active values",
        "active_voxels": band.n_active,
        "first_node": low.tolist(),
        "last_node": high.tolist(),
    }
    assert (faces["type"], faces["part_of"]) == ("int32", "surface")
    assert (weights["type"], weights["part_of"]) == ("vec3s", "surface")


# What cannot be written or read


def test_grids_that_the_format_cannot_say_are_refused_before_a_file_is_made(tmp_path):
    grid = random_grid(0, n_bricks=1)
    far = BrickIndex.from_coordinates(np.array([[2**28, 0, 0]]))
    one = {"values": np.zeros((1, 8, 8, 8), np.float32), "active": np.zeros((1, 8), np.uint64)}
    cases = [
        ({"index": far, **one}, "a brick lies beyond node 2147475456"),
        ({"values": grid.values[1:]}, "values are"),
        ({"values": grid.values.astype(np.float16)}, "values of float16"),
        ({"active": grid.active[1:]}, "active is"),
        ({"background": np.zeros(3, np.float32)}, "background is"),
        ({"tile_values": None}, "0 values and 5 states"),
        ({"tile_values": grid.tile_values[:1], "tile_active": grid.tile_active[:1]}, "for 5 tiles"),
        ({"matrix": np.eye(4) * np.nan}, "no affine transform"),
        ({"name": "a\x1eb"}, "cannot be named"),
        ({"grid_class": "cloud"}, "'cloud' is none of level set"),
    ]
    for change, words in cases:
        with pytest.raises(IoError, match=f"cannot be written: .*{words}"):
            write_vdb_grids(tmp_path / "a.vdb", [dataclasses.replace(grid, **change)])
    assert not list(tmp_path.iterdir())
    write_vdb_grids(tmp_path / "a.vdb", [grid])
    with pytest.raises(IoError, match="the output exists"):
        write_vdb(tmp_path / "a.vdb", narrow_band(0))


def test_the_memory_of_writing_and_reading_does_not_grow_with_the_band(tmp_path):
    beyond = []
    for n in (14, 19):
        box = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3)
        values = np.random.default_rng(0).random((n**3, 8, 8, 8), np.float32) - 0.5
        active = np.random.default_rng(1).integers(0, 2**64, (n**3, 8), np.uint64)
        index = BrickIndex.from_coordinates(box)
        band = NarrowBand(index, values, active, 1.0, np.zeros(3), 3.0, "parity")
        tracemalloc.start()
        write_vdb(tmp_path / "a.vdb", band, force=True)
        written = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        back = read_vdb(tmp_path / "a.vdb")
        beyond.append((written, tracemalloc.get_traced_memory()[1] - values.nbytes))
        tracemalloc.stop()
        assert_same_band(back, band)
    # 2.5 times the bricks of 2048 bytes: masks, coordinates and page tables may add up
    growth = np.subtract(beyond[1], beyond[0]) / (19**3 - 14**3)
    assert growth[0] < 1000
    assert growth[1] < 1600
    assert max(beyond[1]) < 30e6
