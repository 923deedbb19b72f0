"""The commands of meshsdf on small sound meshes: words, JSON, exit codes, files."""

import itertools

import numpy as np
import pytest

from meshsdf.io import read_mesh, read_volume, write_mesh
from meshsdf.mesh import Mesh
from meshsdf.mesh.measures import is_watertight
from meshsdf.mesh.primitives import box_mesh

from .examples import ball, box_without_lid

CHECK_KEYS = """two_set two_set_by_index oriented n_vertices n_faces n_components n_open_edges holes
n_degenerate_faces n_duplicate_faces recommended_sign"""
CONVERT_KEYS = "output voxel_size shape active_voxels n_bricks sign seconds warnings"
ROW_KEYS = "resolution voxel_size hausdorff forward backward seconds"


def assert_contract(facts: dict, command: str, keys: str) -> None:
    assert next(iter(facts.items())) == ("schema", f"meshsdf.{command}/1")
    assert set(keys.split()) <= set(facts)


def test_check_answers_yes_by_0_and_no_by_1(cli, tmp_path):
    outcome = cli("check", ball(tmp_path / "a.ply"), "--json")
    assert outcome.code == 0
    assert_contract(outcome.json, "check", CHECK_KEYS)
    assert (outcome.json["two_set"], outcome.json["n_components"]) == (True, 1)
    path = box_without_lid(tmp_path / "b.ply")
    outcome = cli("check", path, "--json")
    assert outcome.code == 1
    assert_contract(outcome.json, "check", CHECK_KEYS)
    (hole,) = outcome.json["holes"]
    assert (hole["n_edges"], hole["length"]) == (4, pytest.approx(4))
    outcome = cli("check", path)
    assert outcome.code == 1
    assert outcome.out.startswith(f"{path}: not two-set: 1 hole")


def test_convert_writes_a_band_and_tells_its_facts(cli, tmp_path):
    mesh, out = ball(tmp_path / "a.ply"), tmp_path / "a.npz"
    outcome = cli("convert", mesh, out, "--resolution", "16", "--json")
    assert outcome.code == 0
    facts, band = outcome.json, read_volume(out)
    assert_contract(facts, "convert", CONVERT_KEYS)
    assert set(facts["seconds"]) == {"load", "check", "distance", "sign", "write", "total"}
    assert facts["output"] == str(out)
    assert facts["voxel_size"] == band.voxel_size == pytest.approx(2 / 16)
    assert (facts["active_voxels"], facts["sign"]) == (band.n_active, "winding")
    outcome = cli("convert", mesh, out, "--force", "--voxel-size", "0.25", "--half-width", "2")
    assert outcome.out.splitlines()[0] == f"{mesh}: 162 vertices, 320 faces"
    assert outcome.out.count("\n") == 3
    band = read_volume(out)
    assert (band.voxel_size, band.half_width) == (0.25, 2)


def test_a_flat_mesh_gets_a_shell_and_is_told_so(cli, tmp_path):
    mesh, out = tmp_path / "flat.ply", tmp_path / "flat.npz"
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]])
    fan = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], np.int32)
    write_mesh(mesh, Mesh(corners, fan))
    outcome = cli("check", mesh)
    assert "convert will write unsigned distances: all faces lie in one plane" in outcome.out
    outcome = cli("convert", mesh, out, "--resolution", 16, "--json")
    assert outcome.code == 0
    assert outcome.json["sign"] == "unsigned"
    (warning,) = outcome.json["warnings"]
    assert warning.startswith("all faces lie in one plane: the mesh has no thickness")
    surface = tmp_path / "shell.ply"
    assert cli("mesh", out, surface).code == 0
    box = read_mesh(surface).box  # a voxel around the square
    assert box.size == pytest.approx([1 + 2 / 16, 1 + 2 / 16, 2 / 16], abs=0.01)
    signed = cli("convert", mesh, out, "--sign", "winding", "--json", "--force").json
    assert "unsigned distances, which keep a shell" in signed["warnings"][0]


def test_a_mesh_smaller_than_a_voxel_is_told_with_the_size_to_take(cli, tmp_path):
    plate, out = tmp_path / "plate.ply", tmp_path / "plate.npz"
    write_mesh(plate, box_mesh((1.0, 1.0, 0.02)))

    def warned(*options) -> list[str]:
        return cli("convert", plate, out, *options, "--force", "--json").json["warnings"]

    (words,) = warned("--resolution", 8)
    assert words.startswith("the mesh is 1 x 1 x 0.02, in part thinner than a voxel of 0.125")
    assert "take voxels of 0.005 or less" in words
    assert warned("--resolution", 200) == []
    assert "smaller than a voxel of 1e+03" in " ".join(
        warned("--voxel-size", 1000, "--sign", "unsigned")
    )
    assert len(warned("--resolution", 8, "--sign", "unsigned")) == 1  # a shell, as asked


def test_convert_without_a_size_takes_128_voxels(cli, tmp_path):
    facts = cli("convert", ball(tmp_path / "a.ply"), tmp_path / "a.npz", "--json").json
    assert facts["voxel_size"] == pytest.approx(2 / 128)


def test_convert_writes_a_full_grid_halves_and_closest_faces(cli, tmp_path):
    mesh = ball(tmp_path / "a.ply")
    options = ["--resolution", "12", "--json"]
    dense = cli("convert", mesh, tmp_path / "d.npz", "--dense", *options).json
    grid = read_volume(tmp_path / "d.npz")
    assert dense["shape"] == list(grid.values.shape)
    assert dense["n_bricks"] is None
    assert np.isfinite(grid.values).all()
    cli("convert", mesh, tmp_path / "h.npz", "--half", *options)
    assert cli("info", tmp_path / "h.npz", "--json").json["dtype"] == "float16"
    closest = cli("convert", mesh, tmp_path / "c.npz", "--closest", *options).json
    assert closest["has_closest_face"] is True
    assert read_volume(tmp_path / "c.npz").closest_face.max() < 320


def test_convert_says_what_an_open_mesh_means_for_the_sign(cli, tmp_path):
    mesh = box_without_lid(tmp_path / "a.ply")
    outcome = cli("convert", mesh, tmp_path / "a.npz", "--resolution", "16", "--json")
    assert outcome.code == 0
    assert outcome.json["sign"] == "winding"
    assert any("1 hole" in warning for warning in outcome.json["warnings"])
    assert "warning: 1 hole" in outcome.err


def test_info_describes_what_every_command_wrote(cli, tmp_path):
    mesh, band = ball(tmp_path / "a.obj"), tmp_path / "b.npz"
    cli("convert", mesh, band, "--resolution", "8")
    cli("convert", mesh, tmp_path / "d.npz", "--resolution", "8", "--dense")
    cli("mesh", band, tmp_path / "m.glb")
    kinds = {}
    for name in ("a.obj", "b.npz", "d.npz", "m.glb"):
        facts = cli("info", tmp_path / name, "--json").json
        assert_contract(facts, "info", "input bytes kind")
        kinds[name] = facts["kind"]
        assert cli("info", tmp_path / name).out.startswith(str(tmp_path / name))
    assert kinds == {"a.obj": "mesh", "b.npz": "narrow_band", "d.npz": "grid", "m.glb": "mesh"}


def test_mesh_brings_back_a_watertight_surface(cli, tmp_path):
    band, out = tmp_path / "a.npz", tmp_path / "b.obj"
    cli("convert", ball(tmp_path / "a.ply"), band, "--resolution", "16")
    outcome = cli("mesh", band, out, "--json")
    assert outcome.code == 0
    assert_contract(outcome.json, "mesh", "n_vertices n_faces is_watertight euler_number")
    assert (outcome.json["is_watertight"], outcome.json["euler_number"]) == (True, 2)
    surface = read_mesh(out)
    assert surface.n_faces == outcome.json["n_faces"]
    assert is_watertight(surface)
    cli("mesh", band, tmp_path / "c.ply", "--level", "0.1")
    radii = np.linalg.norm(read_mesh(tmp_path / "c.ply").vertices, axis=1)
    assert np.median(radii) == pytest.approx(1.1, abs=0.05)


def test_mesh_closes_a_grid_at_its_border_when_asked(cli, tmp_path):
    grid = tmp_path / "a.npz"
    cli("convert", ball(tmp_path / "a.ply"), grid, "--resolution", "8", "--dense")
    closed = {}
    for border in ("open", "cap", "pad"):
        out = tmp_path / f"{border}.ply"
        # 4 voxels out, the ball's surface leaves a grid that goes on for 3
        options = ["--level", "1.0", "--border", border, "--json"]
        closed[border] = cli("mesh", grid, out, *options).json["is_watertight"]
    assert closed == {"open": False, "cap": True, "pad": True}


def test_mesh_of_unsigned_distances_is_a_shell_and_says_so(cli, tmp_path):
    band = tmp_path / "a.npz"
    options = ["--resolution", "16", "--sign", "unsigned"]
    cli("convert", ball(tmp_path / "a.ply"), band, *options)
    outcome = cli("mesh", band, tmp_path / "b.ply", "--json")
    assert outcome.json["level"] == pytest.approx(2 / 16)
    assert "(one voxel) off every sheet" in outcome.json["warnings"][0]
    assert "warning: unsigned distances" in outcome.err


def test_roundtrip_gives_a_row_for_every_resolution_and_the_order(cli, tmp_path):
    mesh = ball(tmp_path / "a.ply", subdivisions=4)
    outcome = cli("roundtrip", mesh, "--resolution", "8,16,32", "--json")
    assert outcome.code == 0
    assert_contract(outcome.json, "roundtrip", "rows")
    rows = outcome.json["rows"]
    assert [row["resolution"] for row in rows] == [8, 16, 32]
    for row in rows:
        assert set(ROW_KEYS.split()) <= set(row)
        assert set(row["forward"]) >= {"lower", "upper", "mean", "rms"}
        assert 0 < row["hausdorff"]["lower"] <= row["hausdorff"]["upper"]
    # Chords of a sphere: second order
    assert 1.5 < outcome.json["order"] < 2.5
    words = cli("roundtrip", mesh, "--resolution", "8,16").out
    assert "observed order" in words
    assert len(words.splitlines()) == 5


def test_roundtrip_holds_the_error_against_a_limit(cli, tmp_path):
    mesh = ball(tmp_path / "a.ply")
    row = cli("roundtrip", mesh, "--resolution", "16", "--json").json["rows"][0]
    worlds = row["hausdorff"]["upper"]
    voxels = worlds / row["voxel_size"]
    for limit, unit in ((worlds, ""), (voxels, "vox")):
        passing, failing = f"{limit * 1.01}{unit}", f"{limit * 0.99}{unit}"
        asked = ["roundtrip", mesh, "--resolution", "16", "--json", "--max-error"]
        outcome = cli(*asked, passing)
        assert (outcome.code, outcome.json["passed"]) == (0, True)
        outcome = cli(*asked, failing)
        assert (outcome.code, outcome.json["passed"]) == (1, False)
        assert "the error may exceed --max-error" in outcome.err


def test_roundtrip_refines_until_the_error_is_below(cli, tmp_path):
    mesh = ball(tmp_path / "a.ply")
    outcome = cli("roundtrip", mesh, "--resolution", "8", "--until", "0.03", "--json")
    assert outcome.code == 0
    rows = outcome.json["rows"]
    assert len(rows) > 1
    assert all(
        fine["resolution"] == 2 * coarse["resolution"] for coarse, fine in itertools.pairwise(rows)
    )
    assert [row["hausdorff"]["upper"] <= 0.03 for row in rows] == [False] * (len(rows) - 1) + [True]


def test_roundtrip_ends_when_memory_does_and_keeps_its_rows(cli, tmp_path):
    options = ["--resolution", "8", "--until", "1e-9", "--max-memory", "1M", "--json"]
    outcome = cli("roundtrip", ball(tmp_path / "a.ply"), *options)
    assert outcome.code == 1
    assert len(outcome.json["rows"]) >= 1
    assert outcome.json["passed"] is False
    assert "does not reach --until 1e-09" in outcome.err


def test_roundtrip_ends_when_finer_voxels_do_not_help(cli, tmp_path):
    outer, inner = box_mesh((4, 4, 4)), box_mesh((1.9, 1.9, 1.9))
    vertices = np.concatenate([outer.vertices, inner.vertices])
    nested = tmp_path / "nested.ply"  # the inner box is lost in a union, 1 away from the outer
    write_mesh(nested, Mesh(vertices, np.concatenate([outer.faces, inner.faces + np.int32(8)])))
    options = ["--sign", "winding", "--resolution", "8", "--until", "0.01", "--json"]
    outcome = cli("roundtrip", nested, *options)
    assert outcome.code == 1
    assert [row["resolution"] for row in outcome.json["rows"]] == [8, 16, 32]


def test_compare_measures_two_meshes_and_holds_them_against_a_tolerance(cli, tmp_path):
    a, b = tmp_path / "a.ply", tmp_path / "b.obj"
    write_mesh(a, box_mesh((2, 2, 2)))
    write_mesh(b, box_mesh((2, 2, 2), center=(0.25, 0, 0)))
    outcome = cli("compare", a, b, "--tolerance", "0.26", "--json")
    assert outcome.code == 0
    assert_contract(outcome.json, "compare", "hausdorff forward backward")
    found = outcome.json["hausdorff"]
    assert found["lower"] <= 0.25 <= found["upper"]
    assert set(outcome.json["forward"]) >= {"lower", "upper", "mean", "rms"}
    outcome = cli("compare", a, b, "--tolerance", "0.24", "--voxel-size", "0.5")
    assert outcome.code == 1
    assert "apart, above --tolerance 0.24" in outcome.err
    assert "voxels" in outcome.out


@pytest.mark.parametrize("options", [[], ["--dense"], ["--half", "--closest"]], ids=str)
def test_the_same_input_gives_the_same_bytes(cli, tmp_path, options):
    mesh = ball(tmp_path / "a.ply", subdivisions=3)
    files = []
    for run in ("first", "second"):
        volume = tmp_path / f"{run}.npz"
        cli("convert", mesh, volume, "--resolution", "20", *options)
        for suffix in (".ply", ".obj", ".stl", ".off", ".glb"):
            cli("mesh", volume, tmp_path / f"{run}{suffix}")
        files.append([p.read_bytes() for p in sorted(tmp_path.glob(f"{run}.*"))])
    assert len(files[0]) == 6
    assert files[0] == files[1]
