"""meshsdf.io.zarr_volume: what is written is Zarr 3 and OME-Zarr 0.5, and comes back bit by bit."""

import dataclasses
import errno
import json
import os
import shutil
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf import mesh_to_band, read_volume, write_volume
from meshsdf.errors import IoError
from meshsdf.grid import BrickIndex, Grid, NarrowBand
from meshsdf.io.atomic import atomic_folder, make_folder
from meshsdf.io.zarr_volume import probe_zarr, read_zarr, write_zarr
from meshsdf.mesh.primitives import box_mesh
from meshsdf.surface import sample_hermite
from tests.io.examples import narrow_band
from tests.io.exr_examples import ball, center_of
from tests.io.zarr_examples import assert_equal, foreign

few = settings(max_examples=8, deadline=None)
seeds = st.integers(0, 2**32 - 1)


def opened(path):
    """The values as the package zarr reads them, and the group's attributes."""
    zarr = pytest.importorskip("zarr", reason="the package zarr is not installed")
    group = zarr.open_group(str(path), mode="r", zarr_format=3)
    return group["0"], dict(group.attrs)


def chunk_files(path):
    """The numbers of the chunks of the values that are there."""
    files = [file for file in (path / "0" / "c").rglob("*") if file.is_file()]
    return sorted(tuple(map(int, file.relative_to(path / "0" / "c").parts)) for file in files)


@few
@given(seeds, st.integers(0, 12), st.booleans())
def test_a_band_comes_back_bit_equal(tmp_path_factory, seed, n_bricks, with_faces):
    path = tmp_path_factory.mktemp("band") / "a.zarr"
    if n_bricks == 0:
        index = BrickIndex.from_coordinates(np.empty((0, 3), np.int64))
        empty = np.empty((0, 8, 8, 8), np.float32)
        masks = np.empty((0, 8), np.uint64)
        band = NarrowBand(index, empty, masks, 0.1, np.zeros(3), 3.0, "unsigned")
    else:
        band = narrow_band(seed, n_bricks=n_bricks, with_faces=with_faces)
        uncertain = band.active // 3 if seed % 2 else None
        band = dataclasses.replace(band, uncertain=uncertain, n_inner_faces=seed % 3)
    write_zarr(path, band)
    assert_equal(read_zarr(path), band)


@few
@given(seeds, st.sampled_from([np.float32, np.float64]))
def test_a_grid_comes_back_bit_equal_with_its_gaps(tmp_path_factory, seed, dtype):
    path = tmp_path_factory.mktemp("grid") / "a.zarr"
    random = np.random.default_rng(seed)
    shape = random.integers(0, 6, 3)
    shape[random.integers(3)] *= 25
    values = random.normal(size=shape).astype(dtype)
    values[values > 1] = np.nan if seed % 3 else -0.0
    doubts = int(random.integers(9)) if seed % 2 else None
    size = float(random.uniform(1e-9, 1e9))
    grid = Grid(values, size, random.normal(size=3), "winding", doubts, seed % 5, 2.5)
    write_zarr(path, grid)
    assert_equal(read_zarr(path), grid)


def test_a_band_with_all_it_can_carry_comes_back(tmp_path):
    mesh = box_mesh(size=(1.0, 0.7, 1.3))
    band = mesh_to_band(mesh, voxel_size=0.03, closest=True)
    band = dataclasses.replace(band, hermite=sample_hermite(mesh, band))
    write_volume(tmp_path / "a.zarr", band)
    assert_equal(read_volume(tmp_path / "a.zarr"), band)


def test_half_rounds_each_value_to_the_nearest_float16_and_nothing_else(tmp_path):
    band = narrow_band(3, with_faces=True)
    write_zarr(tmp_path / "a.zarr", band, half=True)
    back = read_zarr(tmp_path / "a.zarr")
    assert_array_equal(back.values, band.values.astype(np.float16).astype(np.float32))
    assert_equal(dataclasses.replace(back, values=band.values), band)
    assert probe_zarr(tmp_path / "a.zarr")["dtype"] == "float16"
    grid, _ = ball()
    write_zarr(tmp_path / "b.zarr", grid, half=True)
    assert_array_equal(read_zarr(tmp_path / "b.zarr").values, grid.values.astype(np.float16))
    for scale, shown in [(1e6, "e.06"), (1e-6, "e-06")]:
        with pytest.raises(IoError, match=rf"values up to 1{shown} do not fit float16"):
            write_zarr(
                tmp_path / "c.zarr", Grid(np.full((2, 2, 2), scale), 1.0, np.zeros(3)), half=True
            )
    wide = dataclasses.replace(band, half_width=1e6)
    with pytest.raises(IoError, match="do not fit float16"):
        write_zarr(tmp_path / "c.zarr", wide, half=True)


def test_plain_zarr_shows_a_band_as_a_full_array(tmp_path):
    band = mesh_to_band(box_mesh(size=(1.0, 0.7, 1.3)), voxel_size=0.01)
    write_zarr(tmp_path / "a.zarr", band)
    array, attributes = opened(tmp_path / "a.zarr")
    values = array[...]
    first = np.array(attributes["meshsdf"]["first_node"])
    nodes = first + np.stack(np.indices(values.shape[::-1]), -1)
    assert_array_equal(values.T.ravel(), band.value_at(nodes.reshape(-1, 3)))
    # The centre of the box is inside, far from the band: its chunks are written, not filled
    assert array.fill_value == np.float32(band.background)
    assert values[tuple(n // 2 for n in values.shape)] == np.float32(-band.background)
    assert array.metadata.dimension_names == ("z", "y", "x")


def test_chunks_without_a_brick_may_be_inside_in_part(tmp_path):
    coordinates = np.array([[0, 0, 0], [1, 4, 20]])
    index = BrickIndex.from_coordinates(coordinates, np.array([[1, 1, 3, 12], [1, 2, 9, 11]]))
    values = np.random.default_rng(0).normal(size=(2, 8, 8, 8)).astype(np.float32)
    masks = np.zeros((2, 8), np.uint64)
    band = NarrowBand(index, values, masks, 0.1, np.zeros(3), 3.0, "parity")
    write_zarr(tmp_path / "a.zarr", band)
    assert chunk_files(tmp_path / "a.zarr") == [(0, 0, 0), (1, 0, 0), (2, 0, 0)]
    array, _ = opened(tmp_path / "a.zarr")
    nodes = np.moveaxis(np.indices(array.shape[::-1]), 0, -1).reshape(-1, 3)
    assert_array_equal(array[...].T.ravel(), band.value_at(nodes))


def test_only_chunks_near_the_surface_or_inside_are_written(tmp_path):
    band = mesh_to_band(box_mesh(size=(1.0, 1.0, 1.0)), voxel_size=0.004)
    write_zarr(tmp_path / "a.zarr", band)
    array, attributes = opened(tmp_path / "a.zarr")
    first = np.array(attributes["meshsdf"]["first_node"])
    expected = []
    for at in np.ndindex(*(-(-n // 64) for n in array.shape)):
        start = first + 64 * np.array(at[::-1])
        nodes = start + np.moveaxis(np.indices((64, 64, 64))[:, ::4, ::4, ::4], 0, -1).reshape(
            -1, 3
        )
        bricks = band.index.lookup(nodes // 8)
        if (bricks != -1).any():
            expected.append(at)
    assert chunk_files(tmp_path / "a.zarr") == expected
    # Bricks far apart leave nearly all chunks between them out
    far = np.array([[0, 0, 0], [0, 0, 200], [90, 90, 0]])
    index = BrickIndex.from_coordinates(far)
    values = np.ones((3, 8, 8, 8), np.float32)
    lone = NarrowBand(index, values, np.zeros((3, 8), np.uint64), 1.0, np.zeros(3), 3.0, "parity")
    write_zarr(tmp_path / "b.zarr", lone)
    assert chunk_files(tmp_path / "b.zarr") == [(0, 0, 0), (0, 11, 11), (25, 0, 0)]


def test_the_same_volume_gives_the_same_files(tmp_path):
    grid, _ = ball((70, 40, 30))
    write_zarr(tmp_path / "a.zarr", grid)
    write_zarr(
        tmp_path / "b.zarr", dataclasses.replace(grid, values=np.asfortranarray(grid.values))
    )
    one, two = (
        {
            file.relative_to(tmp_path / name): file.read_bytes()
            for file in (tmp_path / name).rglob("*.*")
        }
        for name in ("a.zarr", "b.zarr")
    )
    assert one == two


@pytest.mark.parametrize("kind", ["grid", "band"])
def test_a_sphere_lies_where_plain_zarr_and_its_ome_attributes_put_it(tmp_path, kind):
    grid, center = ball()
    volume = grid
    if kind == "band":
        volume = band_of_ball(center)
    write_zarr(tmp_path / "a.zarr", volume)
    array, attributes = opened(tmp_path / "a.zarr")
    (image,) = attributes["ome"]["multiscales"]
    assert [axis["name"] for axis in image["axes"]] == ["z", "y", "x"]
    scale, translation = image["datasets"][0]["coordinateTransformations"]
    assert (scale["type"], translation["type"]) == ("scale", "translation")
    values = array[...]
    index = np.moveaxis(np.indices(values.shape), 0, -1)
    places = index * np.array(scale["scale"]) + np.array(translation["translation"])
    assert_allclose(center_of(values, places)[::-1], center, atol=1e-4 * grid.voxel_size)


def band_of_ball(center, radius=0.35, size=0.05) -> NarrowBand:
    """A band so wide that every node of its bricks has the distance to a sphere."""
    bricks = np.moveaxis(np.indices((6, 6, 6)) - 3, 0, -1).reshape(-1, 3)
    nodes = (bricks[:, None] * 8 + np.indices((8, 8, 8)).reshape(3, -1).T) * size + [0.01, 0, -0.02]
    values = np.linalg.norm(nodes - center, axis=2) - radius
    values = values.astype(np.float32).reshape(-1, 8, 8, 8)
    active = np.full((len(bricks), 8), 2**64 - 1, np.uint64)
    index = BrickIndex.from_coordinates(bricks)
    return NarrowBand(index, values, active, size, np.array([0.01, 0, -0.02]), 30.0, "parity")


def test_ome_zarr_models_accepts_the_attributes(tmp_path):
    models = pytest.importorskip("ome_zarr_models.v05", reason="ome-zarr-models is not installed")
    import zarr

    write_zarr(tmp_path / "a.zarr", narrow_band(0))
    image = models.Image.from_zarr(zarr.open_group(str(tmp_path / "a.zarr"), mode="r"))
    assert image.attributes.ome.version == "0.5"


def test_the_headers_alone_tell_what_is_in_the_folder(tmp_path):
    band = narrow_band(2, with_faces=True)
    write_zarr(tmp_path / "a.zarr", band)
    shutil.rmtree(tmp_path / "a.zarr" / "0" / "c")
    facts = probe_zarr(tmp_path / "a.zarr")
    extent = (np.ptp(band.index.coordinates, axis=0) + 1) * 8
    assert facts == {
        "kind": "narrow_band",
        "format": "meshsdf.narrow_band/2",
        "voxel_size": band.voxel_size,
        "translation": band.translation.tolist(),
        "half_width": band.half_width,
        "sign": band.sign,
        "n_bricks": band.index.n_bricks,
        "has_closest_face": True,
        "has_hermite": False,
        "shape": extent.tolist(),
        "dtype": "float32",
    }
    write_zarr(tmp_path / "g.zarr", Grid(np.zeros((2, 3, 4)), 0.5, np.ones(3)))
    facts = probe_zarr(tmp_path / "g.zarr")
    assert (facts["kind"], facts["shape"], facts["dtype"]) == ("grid", [2, 3, 4], "float64")


def test_the_memory_of_writing_does_not_grow_with_the_band(tmp_path):
    beyond = []
    for n in (16, 24):
        box = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3)
        values = np.random.default_rng(0).random((n**3, 8, 8, 8), np.float32)
        index = BrickIndex.from_coordinates(box)
        active = np.zeros((n**3, 8), np.uint64)
        band = NarrowBand(index, values, active, 1.0, np.zeros(3), 3.0, "parity")
        tracemalloc.start()
        write_zarr(tmp_path / f"{n}.zarr", band)
        beyond.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    # The masks and coordinates of 10 000 more bricks, and one chunk for each thread
    assert beyond[1] < beyond[0] + 10_000 * 200
    assert beyond[1] < 40e6


def test_a_folder_is_replaced_only_if_asked_and_only_if_it_is_zarr(tmp_path):
    grid, _ = ball((4, 4, 4))
    path = tmp_path / "a.zarr"
    write_zarr(path, grid)
    with pytest.raises(IoError, match="the output exists"):
        write_zarr(path, grid)
    other = dataclasses.replace(grid, values=-grid.values)
    write_zarr(path, other, force=True)
    assert_equal(read_zarr(path), other)
    (path / "zarr.json").unlink()
    with pytest.raises(IoError, match=r"a folder without zarr\.json, so no volume"):
        write_zarr(path, grid, force=True)
    assert (path / "0" / "zarr.json").exists()
    (tmp_path / "b.zarr").write_text("a file")
    write_zarr(tmp_path / "b.zarr", grid, force=True)
    assert_equal(read_zarr(tmp_path / "b.zarr"), grid)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.zarr", "b.zarr"]


def test_whatever_stops_the_writing_leaves_the_old_folder_and_no_scraps(tmp_path, monkeypatch):
    grid, _ = ball((4, 4, 4))
    path = tmp_path / "a.zarr"
    write_zarr(path, grid)

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("meshsdf.io.zarr_values.store", stop)
    with pytest.raises(KeyboardInterrupt):
        write_zarr(path, grid, force=True)
    with pytest.raises(KeyboardInterrupt):
        write_zarr(tmp_path / "b.zarr", grid)
    assert_equal(read_zarr(path), grid)
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]


def test_a_folder_that_cannot_take_its_place_leaves_the_old_one(tmp_path, monkeypatch):
    grid, _ = ball((4, 4, 4))
    path = tmp_path / "a.zarr"
    write_zarr(path, grid)
    rename = os.rename

    def refuse_the_new_one(source, target):
        if Path(source).name != "a.zarr" and not str(source).endswith("-old"):
            raise OSError(errno.EIO, "Input/output error")
        rename(source, target)

    monkeypatch.setattr(os, "rename", refuse_the_new_one)
    with pytest.raises(IoError, match="the old file, if any, is intact"):
        write_zarr(path, grid, force=True)
    monkeypatch.undo()
    assert_equal(read_zarr(path), grid)
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]


def test_a_folder_that_appears_meanwhile_is_not_replaced_without_being_asked(tmp_path):
    theirs = tmp_path / "a.zarr" / "theirs"
    with pytest.raises(IoError, match="the output exists"), atomic_folder(tmp_path / "a.zarr"):
        make_folder(theirs)
    assert [p.name for p in (tmp_path / "a.zarr").iterdir()] == ["theirs"]
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]


# What others wrote


@pytest.mark.parametrize("packing", ["none", "gzip", "zstd", "shards", "big-endian"])
def test_images_of_other_programs_come_in_as_grids(tmp_path, packing):
    codecs = pytest.importorskip("zarr.codecs", reason="the package zarr is not installed")
    values = np.random.default_rng(0).normal(size=(5, 6, 7)).astype(np.float32)
    options = {
        "none": {"compressors": None, "chunks": (3, 4, 2)},
        "gzip": {"compressors": [codecs.GzipCodec(level=5)], "chunks": (3, 4, 2)},
        "zstd": {"chunks": (3, 4, 2)},
        "shards": {"chunks": (3, 3, 2), "shards": (6, 6, 4)},
        "big-endian": {"serializer": codecs.BytesCodec(endian="big"), "compressors": None},
    }[packing]
    moves = [
        {"type": "scale", "scale": [0.5, 0.5, 0.5]},
        {"type": "translation", "translation": [3.0, 2.0, 1.0]},
    ]
    path = foreign(tmp_path / "a.zarr", values, transformations=moves, **options)
    if packing == "big-endian":
        with pytest.raises(IoError, match="big-endian"):
            read_zarr(path)
        return
    grid = read_zarr(path)
    assert_array_equal(grid.values, values.T)
    assert grid.origin.tolist() == [1.0, 2.0, 3.0]
    assert (grid.voxel_size, grid.sign) == (0.5, "winding")
    assert probe_zarr(path)["shape"] == [7, 6, 5]


def test_without_the_package_other_codecs_are_named_with_the_way_to_get_it(tmp_path, monkeypatch):
    path = foreign(tmp_path / "a.zarr", np.ones((2, 2, 2), np.float32))
    band = narrow_band(0)
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(IoError, match="packed with bytes, zstd, which needs the package") as error:
        read_zarr(path)
    assert error.value.fix.startswith("pip install '.[scale]'")
    write_zarr(tmp_path / "b.zarr", band)
    assert_equal(read_zarr(tmp_path / "b.zarr"), band)


def test_images_that_make_no_grid_are_refused_with_a_reason(tmp_path):
    values = np.ones((2, 2, 2), np.float32)
    path = tmp_path / "a.zarr"
    squeezed = [{"type": "scale", "scale": [0.5, 0.5, 0.6]}]
    cases = [
        ({"values": np.ones((1, 2, 2, 2), np.float32), "axes": "czyx"}, "its axes are c, z, y, x"),
        ({"values": values, "axes": "xyz"}, "its axes are x, y, z"),
        ({"values": values.astype(np.uint16)}, "holds uint16"),
        ({"values": values.astype(np.int32)}, "its values are int32"),
        ({"values": values, "transformations": squeezed}, "no cubes, but 0.6 x 0.5 x 0.5"),
        ({"values": values, "transformations": [{"type": "rotation"}]}, "placed by rotation"),
        ({"values": values, "transformations": [{"type": "scale"}]}, "no sound 'scale'"),
    ]
    for options, words in cases:
        with pytest.raises(IoError, match=words):
            read_zarr(foreign(path, **options))


def test_attributes_that_are_not_kept_are_named(tmp_path):
    path = tmp_path / "noted.zarr"
    write_zarr(path, Grid(np.zeros((3, 4, 5), np.float32), 0.5, np.zeros(3)))
    head = path / "zarr.json"
    told = json.loads(head.read_text())
    told["attributes"] |= {"microscope": "none", "author": "nobody"}
    head.write_text(json.dumps(told))
    said = []
    read_zarr(path, warn=said.append)
    assert said == ["attributes are not kept: author, microscope"]
