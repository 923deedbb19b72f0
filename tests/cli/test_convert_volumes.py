"""meshsdf convert on volumes: between all formats, with every loss told."""

from dataclasses import replace

import numpy as np
import pytest

from meshsdf.grid import Grid, NarrowBand
from meshsdf.io import read_mesh, read_volume, write_mesh, write_volume
from meshsdf.io.vdb import read_vdb_grids, write_vdb, write_vdb_grids
from meshsdf.mesh import Mesh, box_mesh, icosphere
from meshsdf.sdf import mesh_to_band, mesh_to_grid
from meshsdf.surface import sample_hermite

from .examples import ball

SPARSE = ("npz", "vdb", "zarr")
WORDY = ("npz", "vdb", "zarr", "nrrd", "nhdr", "mha", "mhd", "vti", "raw", "exr", "dds")
BARE = ("sdf", "vf")


def ball_band(**options) -> NarrowBand:
    return mesh_to_band(icosphere(subdivisions=2), voxel_size=0.25, **options)


def ball_grid(dtype=np.float32) -> Grid:
    grid = mesh_to_grid(icosphere(subdivisions=2), voxel_size=0.25)
    return replace(grid, values=grid.values.astype(dtype))


def assert_same(one, two):
    """Every fact is equal, and every number bit by bit."""
    assert type(one) is type(two)
    assert one.facts() == two.facts()
    names = ["values"]
    if isinstance(one, NarrowBand):
        names += ["active", "closest_face", "barycentric", "uncertain", "translation"]
        assert one.index.coordinates.tobytes() == two.index.coordinates.tobytes()
        ijk = np.random.default_rng(0).integers(-30, 30, (2000, 3))
        np.testing.assert_array_equal(one.value_at(ijk), two.value_at(ijk))
    for name in names:
        first, second = getattr(one, name), getattr(two, name)
        if first is None:
            assert second is None
        elif name == "barycentric":  # of nodes that are not active they mean nothing
            active = one.active_mask()
            np.testing.assert_array_equal(first[active], second[active])
        else:
            assert (first.dtype, first.tobytes()) == (second.dtype, second.tobytes()), name


@pytest.mark.parametrize("suffix", WORDY)
def test_full_grids_go_to_every_wordy_format_and_back_bit_equal(cli, tmp_path, suffix):
    grid = replace(ball_grid(), uncertain_voxels=3, n_inner_faces=5)
    start, one = tmp_path / "start.npz", tmp_path / f"one.{suffix}"
    write_volume(start, grid)
    outcome = cli("convert", start, one, "--json")
    assert (outcome.code, outcome.json["losses"]) == (0, []), outcome.err
    for other in WORDY:
        two = tmp_path / f"two_{other}.{other}"
        outcome = cli("convert", one, two, "--json")
        assert outcome.code == 0, outcome.err
        assert (outcome.json["losses"], outcome.json["warnings"]) == ([], [])
        assert (outcome.json["kind"], outcome.json["sign"]) == ("grid", "winding")
        assert set(outcome.json["seconds"]) == {"load", "convert", "write", "total"}
        assert_same(read_volume(two), grid)


@pytest.mark.parametrize("suffix", BARE)
def test_bare_formats_keep_the_values_and_refuse_what_they_lose(cli, tmp_path, suffix):
    grid, out = ball_grid(), tmp_path / f"a.{suffix}"
    write_volume(tmp_path / "a.npz", grid)
    outcome = cli("convert", tmp_path / "a.npz", out)
    assert outcome.code == 3
    assert "has no place for how inside was told (winding)" in outcome.err
    assert "--force" in outcome.err
    assert not out.exists()
    assert ("the voxel size 0.25" in outcome.err) == (suffix == "vf")
    outcome = cli("convert", tmp_path / "a.npz", out, "--force", "--json")
    assert outcome.code == 0
    assert set(outcome.json["losses"]) <= set(outcome.json["warnings"])
    assert read_volume(out).values.tobytes() == grid.values.tobytes()
    for other in WORDY:
        back = tmp_path / f"back_{other}.{other}"
        outcome = cli("convert", out, back, "--json")
        assert (outcome.code, outcome.json["losses"]) == (0, []), outcome.err
        assert read_volume(back).values.tobytes() == grid.values.tobytes()


def test_bands_go_between_sparse_formats_bit_equal_with_all_they_have(cli, tmp_path):
    ball_mesh = icosphere(subdivisions=2)
    open_ball = Mesh(ball_mesh.vertices, ball_mesh.faces[:-30])
    band = mesh_to_band(open_ball, voxel_size=0.25, closest=True)
    band = replace(band, n_inner_faces=7)
    assert band.uncertain is not None
    write_volume(tmp_path / "start.npz", band)
    for suffix in SPARSE:
        one = tmp_path / f"one.{suffix}"
        outcome = cli("convert", tmp_path / "start.npz", one, "--json")
        assert (outcome.code, outcome.json["losses"]) == (0, []), outcome.err
        assert outcome.json["kind"] == "narrow_band"
        for other in SPARSE:
            two = tmp_path / f"two_{suffix}.{other}"
            outcome = cli("convert", one, two, "--json")
            assert (outcome.code, outcome.json["warnings"]) == (0, []), outcome.err
            assert_same(read_volume(two), band)


def test_hermite_data_go_where_they_can_and_are_not_lost_unsaid(cli, tmp_path):
    mesh = box_mesh()
    band = mesh_to_band(mesh, voxel_size=0.1)
    write_volume(tmp_path / "a.npz", replace(band, hermite=sample_hermite(mesh, band)))
    assert cli("convert", tmp_path / "a.npz", tmp_path / "a.zarr").code == 0
    assert read_volume(tmp_path / "a.zarr").hermite.n_crossings > 0
    outcome = cli("convert", tmp_path / "a.zarr", tmp_path / "a.vdb")
    assert outcome.code == 3
    assert "OpenVDB has no place for crossings, normals and features" in outcome.err
    outcome = cli("convert", tmp_path / "a.zarr", tmp_path / "a.vdb", "--force")
    assert outcome.code == 0, outcome.err
    assert_same(read_volume(tmp_path / "a.vdb"), band)


@pytest.mark.parametrize("suffix", [*WORDY[3:], "npz", "vdb", "zarr"])
def test_a_band_is_filled_and_comes_back_by_sparse(cli, tmp_path, suffix):
    band, dense = ball_band(), tmp_path / f"dense.{suffix}"
    write_volume(tmp_path / "start.npz", band)
    options = ["--dense"] if suffix in SPARSE else []
    outcome = cli("convert", tmp_path / "start.npz", dense, *options, "--json")
    assert (outcome.code, outcome.json["losses"]) == (0, []), outcome.err
    assert outcome.json["warnings"] == [
        "written as a full grid of 13 x 13 x 13 nodes, clipped to +-0.75 beyond 3 voxels"
    ]
    grid = read_volume(dense)
    assert isinstance(grid, Grid)
    assert (np.abs(grid.values) <= 0.75).all()
    for other in SPARSE:
        again = tmp_path / f"again.{other}"
        outcome = cli("convert", dense, again, "--sparse", "--json", "--force")
        assert outcome.code == 0, outcome.err
        assert_same(read_volume(again), band)


def test_sparse_cuts_a_full_grid_and_says_what_is_dropped(cli, tmp_path):
    grid, out = ball_grid(), tmp_path / "a.vdb"
    write_volume(tmp_path / "a.nrrd", grid)
    outcome = cli("convert", tmp_path / "a.nrrd", out, "--sparse", "--half-width", 2, "--json")
    assert outcome.code == 0
    band = read_volume(out)
    n = grid.values.size - band.n_active
    words = f"{n:,}".replace(",", " ")
    assert outcome.json["warnings"] == [f"beyond 2 voxels only the side is kept, of {words} nodes"]
    near = np.abs(grid.values) < 0.5
    assert band.n_active == near.sum()
    np.testing.assert_array_equal(np.sort(band.active_values()), np.sort(grid.values[near]))
    outcome = cli("convert", out, tmp_path / "b.npz", "--sparse", "--json")
    assert outcome.json["warnings"] == ["it is a narrow band already; written as it is"]
    outcome = cli("convert", tmp_path / "a.nrrd", tmp_path / "b.mha", "--sparse")
    assert outcome.code == 3
    assert "MetaImage has no narrow bands" in outcome.err


def test_closest_faces_and_doubts_are_told_where_they_end(cli, tmp_path):
    mesh = icosphere(subdivisions=2)
    mesh = Mesh(mesh.vertices, mesh.faces[:-30])
    band = mesh_to_band(mesh, voxel_size=0.25, closest=True)
    write_volume(tmp_path / "a.npz", band)
    for out, options, holder in (
        (tmp_path / "a.nrrd", [], "NRRD"),
        (tmp_path / "d.npz", ["--dense"], "a full grid"),
    ):
        outcome = cli("convert", tmp_path / "a.npz", out, *options)
        assert outcome.code == 3
        assert f"{holder} has no place for closest faces and barycentrics" in outcome.err
        n = band.uncertain_voxels
        assert f"{holder} has no place for which nodes have no certain side ({n} of" in outcome.err
        outcome = cli("convert", tmp_path / "a.npz", out, *options, "--force", "--json")
        assert (outcome.code, len(outcome.json["losses"])) == (0, 2)
        assert read_volume(out).uncertain_voxels == n
    outcome = cli("convert", tmp_path / "d.npz", tmp_path / "b.npz", "--sparse")
    assert outcome.code == 3
    assert f"the bare count of uncertain nodes ({n})" in outcome.err


def test_doubles_are_rounded_only_if_that_is_accepted(cli, tmp_path):
    grid = ball_grid(np.float64)
    grid = replace(grid, values=grid.values + 1e-9)
    write_volume(tmp_path / "a.nrrd", grid)
    for suffix in ("npz", "mha", "vti", "raw", "zarr"):
        out = tmp_path / f"whole_{suffix}.{suffix}"
        assert cli("convert", tmp_path / "a.nrrd", out).code == 0
        assert_same(read_volume(out), grid)
    for suffix, holder in (("vdb", "OpenVDB"), ("exr", "OpenEXR"), ("dds", "DDS texture")):
        out = tmp_path / f"rounded_{suffix}.{suffix}"
        outcome = cli("convert", tmp_path / "a.nrrd", out)
        assert outcome.code == 3
        assert f"{holder} holds 32-bit floats: the values are rounded" in outcome.err
        assert cli("convert", tmp_path / "a.nrrd", out, "--force").code == 0
        assert_same(read_volume(out), replace(grid, values=grid.values.astype(np.float32)))


def test_halves_are_stored_where_there_are_such(cli, tmp_path):
    write_volume(tmp_path / "a.npz", ball_band())
    for suffix in ("vdb", "zarr", "exr", "raw", "dds"):
        out = tmp_path / f"half_{suffix}.{suffix}"
        assert cli("convert", tmp_path / "a.npz", out, "--half").code == 0
        whole = tmp_path / f"whole_{suffix}.npz"
        assert cli("convert", out, whole).code == 0
        assert read_volume(whole).values.tobytes() == read_volume(out).values.tobytes()
        assert cli("info", whole, "--json").json["dtype"] == "float32"
    outcome = cli("convert", tmp_path / "a.npz", tmp_path / "half.nrrd", "--half")
    assert outcome.code == 3
    assert "NRRD has no 16-bit floats" in outcome.err


def two_grids(path):
    """The ball, and a larger one named 'torso'."""
    write_vdb(path, ball_band())
    (small,) = read_vdb_grids(path)
    large = {"name": "torso", "matrix": np.diag([2, 2, 2, 1]) @ small.matrix}
    large |= {"values": 2 * small.values, "background": np.array(2 * small.background, np.float32)}
    write_vdb_grids(path, [small, replace(small, **large)], force=True)


def test_of_several_grids_none_is_left_out_unsaid(cli, tmp_path):
    two_grids(tmp_path / "two.vdb")
    outcome = cli("convert", tmp_path / "two.vdb", tmp_path / "a.npz")
    assert outcome.code == 3
    assert "one grid is converted, so 'torso' (float) would be left out" in outcome.err
    outcome = cli("convert", tmp_path / "two.vdb", tmp_path / "a.npz", "--force", "--json")
    assert (outcome.code, len(outcome.json["warnings"])) == (0, 1)
    out = tmp_path / "torso.vdb"
    outcome = cli("convert", tmp_path / "two.vdb", out, "--grid", "torso", "--json")
    assert (outcome.code, outcome.json["losses"]) == (0, [])
    assert outcome.json["voxel_size"] == 0.5
    assert [grid.name for grid in read_vdb_grids(out)] == ["torso"]
    outcome = cli("convert", out, tmp_path / "torso.npz", "--json")
    assert outcome.json["warnings"] == ["NPZ volume has no names: 'torso' is not kept"]
    assert cli("convert", out, tmp_path / "torso.vti").code == 0
    assert cli("info", tmp_path / "torso.vti", "--json").json["array"] == "torso"
    assert cli("convert", out, tmp_path / "x.npz", "--grid", "leg").code == 3


def test_doubles_of_a_vdb_file_are_not_rounded_unsaid(cli, tmp_path):
    write_vdb(tmp_path / "a.vdb", ball_band())
    (grid,) = read_vdb_grids(tmp_path / "a.vdb")
    doubles = {"values": grid.values.astype(float), "background": np.array(0.75)}
    write_vdb_grids(tmp_path / "a.vdb", [replace(grid, **doubles)], force=True)
    outcome = cli("convert", tmp_path / "a.vdb", tmp_path / "a.npz")
    assert outcome.code == 3
    assert "the 64-bit values of the grid 'surface' are rounded to 32 bits" in outcome.err
    assert cli("convert", tmp_path / "a.vdb", tmp_path / "a.npz", "--force").code == 0


def test_an_empty_level_set_is_refused_before_it_is_written(cli, tmp_path):
    band = ball_band()
    write_volume(tmp_path / "a.npz", replace(band, active=np.zeros_like(band.active)))
    for out in (tmp_path / "a.vdb", tmp_path / "a.nrrd"):
        outcome = cli("convert", tmp_path / "a.npz", out)
        assert outcome.code == 3
        assert "no node is active" in outcome.err
        assert not out.exists()


def test_fog_stays_fog_in_vdb_and_is_told_elsewhere(cli, tmp_path):
    values = np.zeros((8, 8, 8), np.float32)
    values[2:6, 2:6, 2:6] = np.random.default_rng(0).random((4, 4, 4))
    write_vdb(tmp_path / "fog.vdb", Grid(values, 0.5, np.zeros(3)), grid_class="fog volume")
    assert cli("convert", tmp_path / "fog.vdb", tmp_path / "same.vdb", "--half").code == 0
    (grid,) = read_vdb_grids(tmp_path / "same.vdb")
    assert (grid.name, grid.grid_class) == ("density", "fog volume")
    outcome = cli("convert", tmp_path / "fog.vdb", tmp_path / "a.nrrd", "--json")
    assert outcome.code == 0
    assert any("densities of a fog volume" in words for words in outcome.json["warnings"])
    outcome = cli("convert", tmp_path / "fog.vdb", tmp_path / "b.vdb", "--sparse")
    assert outcome.code == 3
    assert "a fog volume holds densities" in outcome.err


@pytest.mark.parametrize(
    "options",
    [
        ["--resolution", "9"],
        ["--voxel-size", "1"],
        ["--sign", "winding"],
        ["--closest"],
        ["--hermite"],
        ["--grids", "surface,Cd"],
    ],
    ids=" ".join,
)
def test_what_measures_a_mesh_is_no_option_for_a_volume(cli, tmp_path, options):
    write_volume(tmp_path / "a.npz", ball_grid())
    outcome = cli("convert", tmp_path / "a.npz", tmp_path / "b.vdb", *options)
    assert outcome.code == 2
    assert f"{options[0]} is for meshes; distances of a volume are copied" in outcome.err


def test_other_options_go_only_where_they_mean_something(cli, tmp_path):
    mesh, volume = ball(tmp_path / "a.ply"), tmp_path / "a.npz"
    write_volume(volume, ball_grid())
    for source, out, options, words in (
        (mesh, "b.npz", ["--sparse"], "--sparse is for volumes"),
        (mesh, "b.npz", ["--grid", "x"], "--grid is for volumes"),
        (mesh, "b.npz", ["--grids", "surface"], "--grids is for narrow bands in .vdb files"),
        (mesh, "b.vdb", ["--grids", "surface", "--dense"], "--grids is for narrow bands"),
        (mesh, "b.npz", ["--compression", "zip"], "--compression is for .vdb files"),
        (volume, "b.npz", ["--half-width", "2"], "--half-width is for meshes, or for --sparse"),
        (volume, "b.npz", ["--sparse", "--dense"], "give --sparse or --dense, not both"),
        (volume, "b.npz", ["--columns", "2"], "--columns is for .exr files"),
    ):
        outcome = cli("convert", source, tmp_path / out, *options)
        assert (outcome.code, words in " ".join(outcome.err.split())) == (2, True), outcome.err


def test_what_a_format_cannot_hold_is_refused_for_meshes_too(cli, tmp_path, monkeypatch):
    mesh, out = ball(tmp_path / "a.ply"), tmp_path / "a.nrrd"
    with monkeypatch.context() as patched:

        def load(*_, **__):
            raise AssertionError("the mesh was loaded first")

        patched.setattr("meshsdf.io.meshes.read_mesh", load)
        outcome = cli("convert", mesh, out, "--closest", "--half")
        assert outcome.code == 3
        words = "NRRD has no place for closest faces and barycentrics; NRRD has no place for 16-bit"
        assert words in outcome.err
        (tmp_path / "b.raw.json").write_text("{}")
        assert cli("convert", mesh, tmp_path / "b.raw").code == 2
    outcome = cli("convert", mesh, out, "--closest", "--force", "--resolution", 8, "--json")
    assert outcome.code == 0
    assert "NRRD has no place for closest faces and barycentrics" in outcome.json["warnings"]


def test_a_band_that_would_not_fit_as_a_full_grid_is_refused_before(cli, tmp_path):
    write_volume(tmp_path / "a.npz", ball_band())
    outcome = cli("convert", tmp_path / "a.npz", tmp_path / "a.nrrd", "--max-memory", "1k")
    assert outcome.code == 3
    assert "MemoryLimitError: about 8.79 kB would be needed, 1 kB are allowed" in outcome.err
    assert not (tmp_path / "a.nrrd").exists()


def test_a_vdb_file_packs_as_asked(cli, tmp_path):
    pytest.importorskip("numcodecs")
    mesh = ball(tmp_path / "a.ply")
    cli("convert", mesh, tmp_path / "plain.npz", "--resolution", 16)
    volume = read_volume(tmp_path / "plain.npz")
    told = {"none": "none", "active": "active values"}
    told |= {name: f"{name} + active values" for name in ("zip", "blosc")}
    for source in (mesh, tmp_path / "plain.npz"):
        size = ["--resolution", 16] if source == mesh else []
        for compression, words in told.items():
            out = tmp_path / f"{compression}.vdb"
            options = [*size, "--compression", compression, "--force"]
            assert cli("convert", source, out, *options).code == 0
            facts = cli("info", out, "--json").json["grids"][0]
            assert facts["compression"] == words
            assert_same(read_volume(out), volume)


def test_companions_stand_on_the_active_voxels_of_the_surface(cli, tmp_path):
    shape = icosphere(subdivisions=3)
    colors = np.ones((shape.n_vertices, 4), np.float32)
    colors[:, :3] = np.clip(0.5 + 0.4 * shape.vertices, 0, 1)
    uv = np.ascontiguousarray(shape.vertices[:, :2])
    write_mesh(tmp_path / "a.glb", replace(shape, vertex_colors=colors, uv=uv))
    out = tmp_path / "a.vdb"
    options = ["--grids", "Cd,closest,uv", "--resolution", 16]
    outcome = cli("convert", tmp_path / "a.glb", out, *options, "--json")
    assert outcome.code == 0, outcome.err
    assert outcome.json["grids"] == ["surface", "closest", "uv", "Cd"]
    assert outcome.json["has_closest_face"] is False
    mesh = read_mesh(tmp_path / "a.glb")
    surface, *beside = read_vdb_grids(out)
    assert (surface.name, surface.grid_class) == ("surface", "level set")
    band = read_volume(out)
    assert band.closest_face is None
    active = band.active_mask()
    import igl

    nodes = band.to_world(band.active_ijk())
    squares, _, closest = igl.point_mesh_squared_distance(
        nodes, mesh.vertices, mesh.faces.astype(np.int64)
    )
    # Near the ball's middle several places are as near; there only the distance is sure
    found = {grid.name: grid.values[active] for grid in beside}
    apart = np.linalg.norm(found["closest"] - nodes, axis=1)
    np.testing.assert_allclose(apart, np.sqrt(squares), rtol=0, atol=1e-6)
    sure = np.linalg.norm(found["closest"] - closest, axis=1) < 1e-5
    assert sure.mean() > 0.9
    # Both are linear in the place, so they are on the facets, too
    np.testing.assert_allclose(found["Cd"], 0.5 + 0.4 * found["closest"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(found["uv"][:, :2], found["closest"][:, :2], rtol=0, atol=1e-6)
    for grid in beside:
        assert (grid.value_type, grid.metadata["vector_type"]) == (
            "vec3s",
            {"closest": "contravariant absolute"}.get(grid.name, "invariant"),
        )
        assert grid.active.tobytes() == surface.active.tobytes()
        assert (grid.values[~active] == 0).all()
    assert (found["uv"][:, 2] == 0).all()
    outcome = cli("convert", out, tmp_path / "b.npz")
    assert outcome.code == 3
    assert "'closest' (vec3s), 'uv' (vec3s), 'Cd' (vec3s) would be left out" in outcome.err


def test_companions_that_a_mesh_does_not_have_are_refused_before_the_work(cli, tmp_path):
    mesh = ball(tmp_path / "a.ply")
    for name, words in (("uv", "no texture coordinates"), ("Cd", "no colours")):
        outcome = cli("convert", mesh, tmp_path / "a.vdb", "--grids", f"surface,{name}")
        assert outcome.code == 3
        assert f"the mesh has {words}" in outcome.err
    assert not (tmp_path / "a.vdb").exists()
