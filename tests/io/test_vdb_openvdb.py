"""meshsdf.io.vdb beside OpenVDB itself, which reads our files and writes its own."""

import itertools
import json
import os
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io import read_mesh
from meshsdf.io.vdb import probe_vdb, read_vdb, read_vdb_grids, write_vdb, write_vdb_grids
from meshsdf.mesh import Mesh
from meshsdf.mesh.measures import volume
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report import hausdorff
from meshsdf.sdf import mesh_to_band
from meshsdf.surface import marching_cubes, surface_nets
from tests.io.examples import narrow_band
from tests.io.vdb_examples import (
    empty_band,
    entries,
    needs_openvdb,
    random_grid,
    run_openvdb,
    split,
)

pytestmark = needs_openvdb

MODELS = os.environ.get("MESHSDF_MODELS")
REAL = ["armadillo.obj", "fandisk.obj", "3holes.off"] if MODELS else []

AFFINE = np.array([[0.1, 0, 0, 7], [0.05, 0.2, 0, 8], [0, 0, 0.3, 9], [0, 0, 0, 1.0]])


def found_by_openvdb(path):
    """Of every grid of a file: words, entries, and the matrix from index to world."""
    with np.load(f"{path}.npz") as data:
        words = json.loads(str(data["words"]))
        for number, grid in enumerate(words["grids"]):
            grid["entries"] = split(data[f"entries{number}"], np.array(grid["background"]))
            corners = data[f"corners{number}"]
            grid["matrix"] = np.eye(4)
            grid["matrix"][:3] = np.column_stack([*(corners[1:] - corners[0]), corners[0]])
    return words


@pytest.fixture(scope="module")
def ours(tmp_path_factory):
    """Files that meshsdf wrote, read by OpenVDB in one process."""
    folder = tmp_path_factory.mktemp("ours")
    written = {}
    forms = itertools.product(["none", "active", "zip", "blosc"], [False, True])
    for number, (compression, half) in enumerate(forms):
        scalars = random_grid(
            number, is_half=half, matrix=AFFINE if half else np.diag([2.0, 2, 2, 1])
        )
        vectors = random_grid(
            number, "vec3s", name="Cd", is_half=half, metadata={"vector_type": "covariant", "n": 4}
        )
        path = folder / f"{compression}{half}.vdb"
        write_vdb_grids(path, [scalars, vectors], compression=compression, metadata={"a": "b"})
        written[path] = [scalars, vectors]
    run_openvdb("dump", *written)
    return {path.stem: (found_by_openvdb(path), grids) for path, grids in written.items()}


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("compression", ["none", "active", "zip", "blosc"])
def test_openvdb_finds_every_value_mask_tile_and_word_in_our_files(ours, compression, half):
    words, written = ours[f"{compression}{half}"]
    assert words["metadata"] == {"a": "b", "creator": "meshsdf"}
    # OpenVDB lists grids by name
    for found, grid in zip(words["grids"], sorted(written, key=lambda g: g.name), strict=True):
        expected = entries(grid)
        if half:
            # Tiles of the root alone keep their digits, in OpenVDB's own files too
            rounded = expected[:, 5:].astype(np.float16)
            close = np.abs(found["entries"][:, 5:] - expected[:, 5:]) <= 2**-11 * np.abs(
                expected[:, 5:]
            )
            assert ((found["entries"][:, 5:] == rounded) | close).all()
            expected[:, 5:] = found["entries"][:, 5:]
        assert_array_equal(found["entries"], expected)
        count, low, high = grid.active_extent()
        assert (found["n_active"], found["n_leaves"]) == (count, grid.index.n_bricks)
        assert found["box"] == [low.tolist(), high.tolist()]
        assert found["name"] == grid.name
        assert found["half"] is half
        assert found["type"] == grid.value_type
        assert found["metadata"]["file_voxel_count"] == count
        assert found["metadata"]["file_bbox_min"] == low.tolist()
        assert found["metadata"]["file_bbox_max"] == high.tolist()
        assert found["metadata"]["file_mem_bytes"] > 2048 * grid.index.n_bricks
        background = grid.background.astype(np.float16) if half else grid.background
        assert_array_equal(np.float32(found["background"]), background.astype(np.float32))
        # Corners are computed from the map, so the last bits may differ
        assert np.abs(found["matrix"] - grid.matrix).max() < 1e-14
    assert words["grids"][0]["vector_type"] == "covariant"
    assert words["grids"][0]["metadata"]["n"] == 4


def test_openvdb_sees_every_node_of_a_band_as_it_is_far_and_near(tmp_path):
    box = mesh_to_band(box_mesh(size=(1.0, 0.8, 0.9)), voxel_size=0.004, translation=np.ones(3) / 7)
    bands = {"box": box, "random": narrow_band(5, n_bricks=9), "empty": empty_band()}
    random = np.random.default_rng(0)
    for name, band in bands.items():
        write_vdb(tmp_path / f"{name}.vdb", band)
        near = box.active_ijk()[::40] if name == "box" else random.integers(-330, 330, (9000, 3))
        far = [random.integers(-reach, reach, (3000, 3)) for reach in (150, 3000, 20000)]
        np.save(tmp_path / f"{name}.vdb.npy", np.concatenate([near, *far]))
    run_openvdb("probe", *(tmp_path / f"{name}.vdb" for name in bands))
    for name, band in bands.items():
        ijk = np.load(tmp_path / f"{name}.vdb.npy")
        with np.load(tmp_path / f"{name}.vdb.npz") as found:
            assert_array_equal(found["values"], band.value_at(ijk).astype(np.float32))
            assert_array_equal(found["active"], is_active(band, ijk))
            signs = np.unique(np.sign(found["values"]))
            assert signs.tolist() == ([1] if name == "empty" else [-1, 1])


def is_active(band, ijk):
    """Whether nodes are active."""
    slots = band.index.lookup(ijk // 8)
    i, j, k = (ijk % 8).T
    mask = band.active_mask()
    return np.array(
        [s >= 0 and mask[s, a, b, c] for s, a, b, c in zip(slots, i, j, k, strict=True)]
    )


def test_openvdb_measures_fog_and_level_sets_of_full_grids_as_we_do(tmp_path):
    dense = np.random.default_rng(0).normal(size=(19, 8, 31)).astype(np.float32)
    dense[:16, :, 8:24] = 0.25
    volumes = {
        "fog": Grid(np.maximum(dense, 0), 0.5, np.array([1.0, 2, 3])),
        "level": Grid(np.where(dense > 2, np.nan, dense).astype(np.float32), 0.5, np.zeros(3)),
    }
    for name, grid in volumes.items():
        kind = "fog volume" if name == "fog" else "level set"
        write_vdb(tmp_path / f"{name}.vdb", grid, grid_class=kind)
    run_openvdb("dump", *(tmp_path / f"{name}.vdb" for name in volumes))
    for name, grid in volumes.items():
        found = found_by_openvdb(tmp_path / f"{name}.vdb")["grids"][0]
        is_there = grid.values > 0 if name == "fog" else np.isfinite(grid.values)
        rows = found["entries"][found["entries"][:, 4] == 1]
        # Six bricks are constant: three along the first 16 nodes, each 8 wide, twice
        assert sorted(rows[:, 3].astype(int).tolist())[-4:] == [8] * 4
        values = np.zeros_like(grid.values)
        for row in rows:
            i, j, k, side = row[:4].astype(int)
            values[i : i + side, j : j + side, k : k + side] = row[5]
        assert_array_equal(values, np.where(is_there, grid.values, 0))
        assert found["n_active"] == is_there.sum()
        assert found["class"] == ("fog volume" if name == "fog" else "level set")
        assert found["name"] == ("density" if name == "fog" else "surface")
        assert_array_equal(found["matrix"][:3, 3], grid.origin)


# The other way


@pytest.fixture(scope="module")
def theirs(tmp_path_factory):
    """A folder of files that OpenVDB wrote, and beside them what it found in them."""
    folder = tmp_path_factory.mktemp("theirs")
    run_openvdb("make", folder)
    files = sorted(folder.glob("*.vdb"))
    run_openvdb("dump", *(file for file in files if file.stem != "tiled_sphere"))
    return folder


@pytest.mark.parametrize("name", ["sphere", "sphere_half", "fog", "many", "stream", "empty"])
def test_every_value_mask_tile_and_word_that_openvdb_wrote_comes_in(theirs, name):
    path, notes = theirs / f"{name}.vdb", []
    words = found_by_openvdb(path)
    grids = read_vdb_grids(path, warn=notes.append)
    kept = [found for found in words["grids"] if found["type"] != "bool"]
    assert len(grids) == len(kept)
    for found, grid in zip(kept, sorted(grids, key=lambda g: g.name), strict=True):
        assert_array_equal(entries(grid), found["entries"])
        assert (grid.name, grid.grid_class) == (found["name"], found["class"])
        assert (grid.value_type, grid.is_half) == (found["type"], found["half"])
        assert_array_equal(grid.background.astype(float), found["background"])
        assert grid.active_extent()[0] == found["n_active"]
        assert np.abs(grid.matrix - found["matrix"]).max() < 1e-14
        assert grid.metadata.get("vector_type", "invariant") == found["vector_type"]
    if name == "many":
        assert notes == [
            "the grid 'mask' is left out: grids of type 'Tree_bool_5_4_3' cannot be read"
        ]
        assert [g.value_type for g in grids] == ["vec3s", "float", "vec3s", "float", "float"]
        # Inactive values of all kinds, so every code of a node occurs
        assert_array_equal(grids[1].matrix, AFFINE)
        assert grids[1].values is grids[3].values
    else:
        assert not notes


def test_a_level_set_of_openvdb_is_a_band_with_its_inside_tiles(theirs):
    band = read_vdb(theirs / "tiled_sphere.vdb")
    assert (band.voxel_size, band.half_width, band.sign) == (0.5, 6.0, "winding")
    assert_array_equal(band.translation, [3, -2, 1])
    ijk = np.random.default_rng(0).integers(-60, 60, (20000, 3))
    # OpenVDB's sphere has radius 45 and spacing 1; only its transform was changed afterwards
    distance = np.clip(np.linalg.norm(ijk, axis=1) - 45, -3, 3)
    assert np.abs(band.value_at(ijk) - distance).max() < 1e-5


def test_the_names_in_a_file_are_offered_when_another_is_asked_for(theirs):
    path = theirs / "many.vdb"
    with pytest.raises(IoError, match=r"no grid 'surface'") as error:
        read_vdb(path, grid="surface")
    for name in ("'mask' (bool", "'Cd' (vec3s", "'odd[0]' (float", "'shared' (float", "'odd[1]'"):
        assert name in error.value.fix
    with pytest.raises(IoError, match=r"'Cd' holds vec3s values, not one number per voxel"):
        read_vdb(path, grid="Cd")
    with pytest.raises(IoError, match=r"'mask' cannot be read: grids of type 'Tree_bool_5_4_3'"):
        read_vdb(path, grid="mask")
    with pytest.raises(IoError, match=r"voxels of the grid 'odd' are no cubes.*0\.05 0\.2 0"):
        read_vdb(path, grid="odd[1]")


def test_probing_tells_what_openvdb_tells_without_reading_values(theirs):
    facts = probe_vdb(theirs / "many.vdb")
    words = {found["name"]: found for found in found_by_openvdb(theirs / "many.vdb")["grids"]}
    assert facts["default_grid"] == "odd[0]"
    for grid in facts["grids"]:
        found = words[grid["name"].partition("[")[0]]
        assert grid["type"] == found["type"]
        if "active_voxels" in grid:  # a grid that shares a tree does not say so
            assert grid["active_voxels"] == found["n_active"]
            assert [grid["first_node"], grid["last_node"]] == found["box"]
    assert facts["grids"][2]["compression"] == "blosc + active values"
    assert probe_vdb(theirs / "sphere_half.vdb")["grids"][0]["dtype"] == "float16"
    assert probe_vdb(theirs / "stream.vdb")["grids"][0]["name"] == "odd"


def quads_of_openvdb(path):
    """Points (n, 3) and quads (q, 4), counter-clockwise seen from outside."""
    run_openvdb("quads", path)
    with np.load(f"{path}.npz") as data:
        return data["points"].astype(np.float64), data["quads"].astype(np.int32)[:, ::-1]


def places_of(tree, radius):
    """(n,) int32: the same number for points that are closer together than the radius."""
    pairs = tree.query_pairs(radius, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(tree.n, tree.n))
    return connected_components(links, directed=False)[1].astype(np.int32)


def cut_as(quads, ours):
    """Quads in triangles, by the diagonals that faces of ours have (vertices alike)."""
    edges = ours.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    known = np.unique(edges.min(axis=1) * ours.n_vertices + edges.max(axis=1))
    ends = quads[:, [0, 2]].astype(np.int64)
    first = np.isin(ends.min(axis=1) * ours.n_vertices + ends.max(axis=1), known)
    turned = np.where(first[:, None], quads, np.roll(quads, -1, axis=1))
    return np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


@pytest.mark.parametrize("name", ["ball", *REAL])
def test_openvdb_extracts_the_surface_that_we_extract(name, tmp_path):
    mesh = icosphere(1.0, subdivisions=5) if name == "ball" else read_mesh(Path(MODELS) / name)
    band = mesh_to_band(mesh, resolution=128)
    write_vdb(tmp_path / "level_set.vdb", band)
    points, quads = quads_of_openvdb(tmp_path / "level_set.vdb")
    found = surface_nets(band)
    tree = cKDTree(found.vertices)
    apart, vertex = tree.query(points)
    assert len(points) == found.n_vertices
    assert apart.max() < 1e-4 * band.voxel_size
    # Vertices of several cells are one where the surface passes through a node
    place = places_of(tree, 1e-3 * band.voxel_size)
    ours = Mesh(found.vertices, place[found.faces])
    theirs = Mesh(found.vertices, cut_as(place[vertex][quads], ours))
    # Polygons that are cut alike are the same surface
    distance = hausdorff(ours, theirs, tolerance=1e-3 * band.voxel_size).distance
    assert distance.upper < 0.01 * band.voxel_size
    assert volume(theirs) == pytest.approx(volume(ours))  # and the same way round


def test_the_surface_of_a_ball_is_that_of_marching_cubes_too(tmp_path):
    band = mesh_to_band(icosphere(1.0, subdivisions=5), resolution=128)
    write_vdb(tmp_path / "ball.vdb", band)
    points, quads = quads_of_openvdb(tmp_path / "ball.vdb")
    theirs = Mesh(points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))
    apart = hausdorff(marching_cubes(band), theirs, tolerance=1e-3 * band.voxel_size).distance
    assert apart.upper < 0.02 * band.voxel_size
    assert volume(theirs) == pytest.approx(4.18, rel=0.01)
