"""meshsdf.io.meshes: what was written comes back, and bad files are refused in one sentence."""

import copy
import resource
import struct
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_array_equal

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io import read_mesh, write_mesh
from meshsdf.io.npz import write_npz
from meshsdf.mesh import Mesh
from tests.io.examples import awkward_mesh, painted_tetrahedron, signed_volume, tetrahedron

SUFFIXES = (".obj", ".ply", ".stl", ".off", ".glb")
EXACT = (".obj", ".ply", ".off")


@pytest.mark.parametrize("suffix", EXACT)
def test_float64_positions_come_back_bit_equal(tmp_path, suffix):
    for seed in range(5):
        mesh = awkward_mesh(seed)
        write_mesh(tmp_path / f"{seed}{suffix}", mesh)
        back = read_mesh(tmp_path / f"{seed}{suffix}")
        assert back.vertices.tobytes() == mesh.vertices.tobytes()
        assert_array_equal(back.faces, mesh.faces)


@pytest.mark.parametrize("suffix", [".stl", ".glb"])
def test_float32_formats_round_each_position_once(tmp_path, suffix):
    mesh = Mesh(
        np.random.default_rng(0).normal(size=(12, 3)),
        np.arange(12, dtype=np.int32)[None].reshape(4, 3),
    )
    write_mesh(tmp_path / f"a{suffix}", mesh)
    back = read_mesh(tmp_path / f"a{suffix}")
    assert_array_equal(back.triangles, mesh.triangles.astype(np.float32))
    with pytest.raises(IoError, match=r"1e\+39 does not fit the float32"):
        write_mesh(tmp_path / f"b{suffix}", Mesh(mesh.vertices * 0 + 1e39, mesh.faces))
    assert not (tmp_path / f"b{suffix}").exists()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_another_reader_finds_the_same_shape(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    mesh = painted_tetrahedron()
    write_mesh(path, mesh)
    other = trimesh.load(path, force="mesh", process=False)
    assert len(other.faces) == 4
    assert other.volume == pytest.approx(1 / 6)  # positive: faces are counter-clockwise
    other.merge_vertices(merge_tex=True, merge_norm=True)  # some readers split by material
    assert other.is_volume
    assert signed_volume(read_mesh(path)) == pytest.approx(1 / 6)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_same_mesh_gives_the_same_bytes_and_is_left_alone(tmp_path, suffix):
    mesh = painted_tetrahedron()
    before = mesh.vertices.copy(), mesh.faces.copy(), mesh.uv.copy(), mesh.vertex_colors.copy()
    for folder in "ab":
        (tmp_path / folder).mkdir()
        write_mesh(tmp_path / folder / f"c{suffix}", mesh)
    files = sorted(file.name for file in (tmp_path / "a").iterdir())
    assert len(files) == (3 if suffix == ".obj" else 1)  # materials and an image beside it
    for name in files:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    after = mesh.vertices, mesh.faces, mesh.uv, mesh.vertex_colors
    for old, new in zip(before, after, strict=True):
        assert_array_equal(old, new)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_uv_and_colours_come_back(tmp_path, suffix):
    mesh = painted_tetrahedron()
    write_mesh(tmp_path / f"a{suffix}", mesh)
    back = read_mesh(tmp_path / f"a{suffix}")
    # glTF keeps uv as float32 and counts v from the top; the others keep float64.
    np.testing.assert_allclose(back.uv, mesh.uv, rtol=0, atol=0 if suffix != ".glb" else 6e-8)
    color, expected = back.vertex_colors, mesh.vertex_colors
    if suffix == ".glb":
        assert_array_equal(color, expected)
    elif suffix == ".obj":  # text keeps full precision, but has no alpha
        np.testing.assert_allclose(color[:, :3], expected[:, :3], rtol=3e-7, atol=1e-9)
        assert (color[:, 3] == 1).all()
    else:  # half a step of 8 bits, times the steepest slope of the sRGB curve, 2.275 at 1
        np.testing.assert_allclose(color, expected, rtol=0, atol=2.3 * 0.5 / 255)


def test_ply_and_obj_colours_are_srgb_and_gltf_colours_are_linear(tmp_path):
    half = np.full((4, 4), 0.5, np.float32)
    for suffix in (".ply", ".obj", ".glb"):
        write_mesh(tmp_path / f"a{suffix}", tetrahedron(vertex_colors=half))
    # sRGB of 0.5 is 0.735357 (IEC 61966-2-1), 187.5 of 255.
    assert trimesh.load(tmp_path / "a.ply").visual.vertex_colors[0].tolist() == [188, 188, 188, 128]
    first = (tmp_path / "a.obj").read_text().splitlines()[0].split()
    assert float(first[4]) == pytest.approx(0.735357, abs=1e-6)
    assert (
        trimesh.load(tmp_path / "a.glb", force="mesh").visual.vertex_colors[0].tolist() == [128] * 4
    )


def test_glb_keeps_materials_with_their_images_and_obj_keeps_their_names(tmp_path):
    mesh = painted_tetrahedron()
    write_mesh(tmp_path / "a.glb", mesh)
    back = read_mesh(tmp_path / "a.glb")
    assert_array_equal(back.material_index, mesh.material_index)
    for found, expected in zip(back.materials, mesh.materials, strict=True):
        assert (found.name, found.image_name) == (expected.name, expected.image_name)
        assert_array_equal(found.base_color, expected.base_color)
    assert_array_equal(back.materials[0].image, mesh.materials[0].image)
    assert back.materials[1].image is None
    write_mesh(tmp_path / "a.obj", mesh)
    back = read_mesh(tmp_path / "a.obj")
    assert [material.name for material in back.materials] == ["dark gold", "blue"]
    assert_array_equal(back.material_index, mesh.material_index)


def test_a_glb_groups_its_faces_by_material(tmp_path):
    mixed = painted_tetrahedron()
    mesh = Mesh(
        mixed.vertices, mixed.faces, None, None, np.array([1, -1, 0, 1], np.int32), mixed.materials
    )
    write_mesh(tmp_path / "a.glb", mesh)
    back = read_mesh(tmp_path / "a.glb")
    order = np.argsort(mesh.material_index, kind="stable")
    assert_array_equal(back.material_index, mesh.material_index[order])
    assert_array_equal(back.triangles, mesh.triangles[order].astype(np.float32))


def test_a_file_is_not_overwritten_unless_forced(tmp_path):
    write_mesh(tmp_path / "a.ply", tetrahedron())
    with pytest.raises(IoError, match="the output exists"):
        write_mesh(tmp_path / "a.ply", tetrahedron())
    write_mesh(tmp_path / "a.ply", tetrahedron(), force=True)


def test_a_mesh_without_faces_is_not_written(tmp_path):
    empty = Mesh(np.zeros((3, 3)), np.empty((0, 3), np.int32))
    with pytest.raises(IoError, match="the mesh has no faces"):
        write_mesh(tmp_path / "a.ply", empty)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".npz"])
def test_a_write_that_fails_half_way_leaves_the_old_file(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"old")
    vertices = np.random.default_rng(9).normal(size=(3000, 3))
    big = Mesh(vertices, np.arange(3000, dtype=np.int32).reshape(-1, 3))

    def write(path):
        if suffix == ".npz":
            write_npz(path, Grid(np.ones((20, 20, 20)), 1.0, np.zeros(3)), force=True)
        else:
            write_mesh(path, big, force=True)

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(IoError, match=r"writing failed .*the old file, if any, is intact"):
            write(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_attributes_that_do_not_match_are_refused_before_writing(tmp_path):
    paint = painted_tetrahedron()
    wrong = np.array([0, 1, 2, -1], np.int32)
    mesh = Mesh(paint.vertices, paint.faces, material_index=wrong, materials=paint.materials)
    for suffix in SUFFIXES:
        with pytest.raises(IoError, match="material_index runs from -1 to 2 for 2 materials"):
            write_mesh(tmp_path / f"a{suffix}", mesh)
    with pytest.raises(IoError, match="uv has 3 entries where 4 are needed"):
        write_mesh(tmp_path / "a.obj", replace_unchecked(paint, uv=paint.uv[:3]))
    assert list(tmp_path.iterdir()) == []


def replace_unchecked(mesh, **changes):
    """A copy with other attributes, as a caller without type checks could make it."""
    copied = copy.copy(mesh)
    for name, value in changes.items():
        object.__setattr__(copied, name, value)
    return copied


def test_faces_without_material_come_first_bare_and_later_as_none(tmp_path):
    paint = painted_tetrahedron()
    index = np.array([-1, 1, 1, -1], np.int32)
    mesh = Mesh(paint.vertices, paint.faces, material_index=index, materials=paint.materials)
    write_mesh(tmp_path / "a.obj", mesh)
    back = read_mesh(tmp_path / "a.obj")
    assert back.material_index.tolist() == [-1, 0, 0, 1]
    assert [material.name for material in back.materials] == ["blue", "none"]


# Refusals


def refusal(path) -> str:
    with pytest.raises(IoError) as caught:
        read_mesh(path)
    assert str(path) in caught.value.where
    assert caught.value.fix
    assert "Type-check" not in caught.value.what
    return caught.value.what


def test_missing_files_folders_and_unknown_suffixes_are_said(tmp_path):
    (tmp_path / "folder.obj").mkdir()
    (tmp_path / "a.obk").write_text("")
    assert refusal(tmp_path / "missing.obj") == "no such file"
    assert refusal(tmp_path / "folder.obj") == "this is a folder, not a file"
    assert "'.obk' cannot be read" in refusal(tmp_path / "a.obk")
    with pytest.raises(IoError, match=r"did you mean \.obj"):
        read_mesh(tmp_path / "a.obk")
    with pytest.raises(IoError, match="no suffix"):
        read_mesh(tmp_path / "a")
    with pytest.raises(IoError, match=r"one of \.obj, \.ply, \.stl, \.off, \.glb$"):
        write_mesh(tmp_path / "a.gltf", tetrahedron())
    assert "not a regular file" in refusal_of_device(tmp_path)


def refusal_of_device(tmp_path):
    (tmp_path / "zero.obj").symlink_to("/dev/zero")
    return refusal(tmp_path / "zero.obj")


EMPTY = {
    ".obj": (b"# nothing\n", "holds no faces"),
    ".stl": (b"solid Empty\nendsolid Empty", "holds no triangles"),
    ".off": (b"OFF\n0 0 0\n", "no faces"),
    ".ply": (b"ply\nformat ascii 1.0\nend_header\n", "no vertices"),
    ".gltf": (b'{"asset":{"version":"2.0"}}', "no faces"),
}


@pytest.mark.parametrize("suffix", EMPTY)
def test_files_without_faces_are_refused(tmp_path, suffix):
    content, words = EMPTY[suffix]
    (tmp_path / f"a{suffix}").write_bytes(content)
    assert words in refusal(tmp_path / f"a{suffix}")
    (tmp_path / f"b{suffix}").write_bytes(b"")
    assert (
        f"b{suffix} is not a readable {suffix[1:].upper()}".lower()
        in refusal(tmp_path / f"b{suffix}").lower()
    )


POINTS = {
    ".obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "3 points, but no faces"),
    ".off": (b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "3 points, but no faces"),
    ".ply": (
        b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
        b"property float z\nend_header\n0 0 0\n1 1 1\n",
        "2 points, but no faces",
    ),
}


@pytest.mark.parametrize("suffix", POINTS)
def test_point_clouds_are_refused(tmp_path, suffix):
    content, words = POINTS[suffix]
    (tmp_path / f"a{suffix}").write_bytes(content)
    assert words in refusal(tmp_path / f"a{suffix}")


def test_lines_are_refused_and_beside_faces_they_are_left_out_and_said(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nl 2 3\n")
    assert "2 lines or points, but no faces" in refusal(tmp_path / "a.obj")
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nf 1 2 3\n")
    notes = []
    assert read_mesh(tmp_path / "a.obj", warn=notes.append).n_faces == 1
    assert notes == ["1 lines or points; left out"]


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e999"])
@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl"])
def test_positions_that_are_not_finite_are_counted(tmp_path, suffix, number):
    v = ["0 0 0", f"1 {number} 0", "0 1 0"]
    text = {
        ".obj": "".join(f"v {line}\n" for line in v) + "f 1 2 3\n",
        ".off": "OFF\n3 1 0\n" + "\n".join(v) + "\n3 0 1 2\n",
        ".ply": "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
        "property double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        + "\n".join(v)
        + "\n3 0 1 2\n",
        ".stl": "solid a\nfacet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {line}\n" for line in v)
        + "endloop\nendfacet\nendsolid\n",
    }[suffix]
    (tmp_path / f"a{suffix}").write_text(text)
    assert "1 of 3 vertices are NaN or infinite (first: vertex 1" in refusal(
        tmp_path / f"a{suffix}"
    )


@pytest.mark.parametrize("index", [4, 99, -4, 2**31, 2**32, 2**40])
def test_faces_that_name_no_vertex_are_refused_and_never_wrap(tmp_path, index):
    (tmp_path / "a.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n")
    assert "not among the 3" in refusal(tmp_path / "a.obj")
    (tmp_path / "a.off").write_text(f"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 {index}\n")
    assert "not among the 3" in refusal(tmp_path / "a.off")
    if 0 <= index < 2**32:
        write_mesh(tmp_path / "a.ply", tetrahedron(), force=True)
        data = (tmp_path / "a.ply").read_bytes().replace(b"uchar int", b"uchar uint")
        (tmp_path / "a.ply").write_bytes(data[:-4] + struct.pack("<I", index))
        assert "not among the 4" in refusal(tmp_path / "a.ply")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_file_cut_off_is_refused_or_reads_as_the_smaller_mesh_it_is(tmp_path, suffix):
    mesh = painted_tetrahedron()
    whole, cut = tmp_path / f"whole{suffix}", tmp_path / f"cut{suffix}"
    write_mesh(whole, mesh)
    data = whole.read_bytes()
    n_read = 0
    for length in range(len(data)):
        cut.write_bytes(data[:length])
        try:
            found = read_mesh(cut)
        except IoError:
            continue
        n_read += 1
        assert found.n_faces <= mesh.n_faces
    # Text says its length nowhere (OBJ) or not to the last digit (OFF); the others know.
    assert n_read == 0 or suffix in (".obj", ".off")


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".gltf"])
def test_random_bytes_are_refused_whatever_they_are_called(tmp_path, suffix):
    random = np.random.default_rng(7)
    heads = (b"", b"ply\n", b"OFF\n", b"glTF\x02\0\0\0", b"solid \n", b"v 1 2 3\nf 1 1 1\nf ", b"{")
    for head in heads:
        for size in (1, 10, 100, 3000):
            (tmp_path / f"a{suffix}").write_bytes(head + random.bytes(size))
            refusal(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_flipped_bits_give_a_mesh_or_a_sentence(tmp_path, suffix):
    random = np.random.default_rng(8)
    write_mesh(tmp_path / f"whole{suffix}", painted_tetrahedron())
    data = (tmp_path / f"whole{suffix}").read_bytes()
    n_refused = 0
    for place in random.integers(0, len(data), 300).tolist():
        flipped = bytearray(data)
        flipped[place] ^= 1 << int(random.integers(8))
        (tmp_path / f"a{suffix}").write_bytes(flipped)
        try:
            read_mesh(tmp_path / f"a{suffix}")
        except IoError:
            n_refused += 1
    assert n_refused > 0


def test_another_format_under_a_wrong_suffix_is_refused(tmp_path):
    for suffix in SUFFIXES:
        write_mesh(tmp_path / f"right{suffix}", tetrahedron())
        data = (tmp_path / f"right{suffix}").read_bytes()
        for wrong in SUFFIXES:
            if wrong != suffix:
                (tmp_path / f"wrong{wrong}").write_bytes(data)
                refusal(tmp_path / f"wrong{wrong}")


def test_asking_for_the_readers_imports_nothing_heavy():
    code = (
        "import sys, meshsdf.io.registry, meshsdf.io.atomic; "
        "print({'trimesh', 'scipy', 'PIL', 'numba', 'OpenEXR'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
