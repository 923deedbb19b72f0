"""meshsdf.io.ply: every layout a header may declare."""

import struct
import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from meshsdf.errors import IoError
from meshsdf.io import read_mesh

POINTS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0]]
CODES = {"float": "f", "double": "d", "uchar": "B", "int": "i", "ushort": "H", "uint": "I"}


def header(form, vertex_lines, n_faces, list_type="uchar int", extra="", n_vertices=5):
    lines = ["ply", f"format {form} 1.0", "comment made by hand", f"element vertex {n_vertices}"]
    lines += vertex_lines
    lines += [f"element face {n_faces}", f"property list {list_type} vertex_indices"]
    return ("\n".join([*lines, *extra.splitlines(), "end_header"]) + "\n").encode()


def ply(form, faces, *, kind="float", list_type="uchar int"):
    """The five points and some faces, as text or binary."""
    head = header(form, [f"property {kind} {axis}" for axis in "xyz"], len(faces), list_type)
    if form == "ascii":
        lines = [" ".join(map(str, point)) for point in POINTS]
        lines += [" ".join(map(str, [len(face), *face])) for face in faces]
        return head + "\n".join(lines).encode() + b"\n"
    order = ">" if "big" in form else "<"
    size, index = (CODES[word] for word in list_type.split())
    body = b"".join(struct.pack(f"{order}3{CODES[kind]}", *point) for point in POINTS)
    for face in faces:
        body += struct.pack(f"{order}{size}{len(face)}{index}", len(face), *face)
    return head + body


def read(tmp_path, data, notes=None):
    (tmp_path / "a.ply").write_bytes(data)
    return read_mesh(tmp_path / "a.ply", warn=(notes if notes is not None else []).append)


FORMS = ("ascii", "binary_little_endian", "binary_big_endian")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", ["float", "double"])
@pytest.mark.parametrize("list_type", ["uchar int", "int uint", "ushort ushort", "uchar uchar"])
def test_every_byte_order_and_type_holds_the_same_faces(tmp_path, form, kind, list_type):
    mesh = read(tmp_path, ply(form, [[0, 1, 2], [0, 2, 3]], kind=kind, list_type=list_type))
    assert_array_equal(mesh.vertices, POINTS)
    assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize("form", FORMS)
def test_faces_of_mixed_sizes_become_fans_in_order(tmp_path, form):
    notes = []
    mesh = read(tmp_path, ply(form, [[0, 1, 2], [0, 1, 2, 4, 3], [1, 2], [3, 2, 1, 0]]), notes)
    fan = [[0, 1, 2], [0, 2, 4], [0, 4, 3]]
    assert_array_equal(mesh.faces, [[0, 1, 2], *fan, [3, 2, 1], [3, 1, 0]])
    assert notes == ["1 faces have fewer than three corners; left out"]


def test_colours_are_srgb_bytes_or_fractions_and_uv_has_many_names(tmp_path):
    for uv in ("s t", "u v", "texture_u texture_v"):
        for kind, value in (("uchar", "188 0 255"), ("float", "0.735357 0 1")):
            lines = [f"property float {axis}" for axis in "xyz"]
            lines += [f"property float {name}" for name in uv.split()]
            lines += [f"property {kind} {name}" for name in ("red", "green", "blue")]
            body = "".join(f"{x} {y} {z} 0.25 0.75 {value}\n" for x, y, z in POINTS)
            mesh = read(tmp_path, header("ascii", lines, 1) + body.encode() + b"3 0 1 2\n")
            assert_array_equal(mesh.uv, [[0.25, 0.75]] * 5)
            # sRGB 188 / 255 is 0.502886 in linear light.
            expected = 0.502886 if kind == "uchar" else 0.5
            assert_allclose(mesh.vertex_colors, [[expected, 0, 1, 1]] * 5, atol=1e-6)


def test_a_texture_file_beside_it_is_kept(tmp_path):
    Image.new("RGB", (4, 2), (9, 8, 7)).save(tmp_path / "my skin.png")
    lines = [f"property float {name}" for name in ("x", "y", "z", "s", "t")]
    head = header("ascii", lines, 1).replace(b"made by hand", b"TextureFile my skin.png")
    body = "".join(f"{x} {y} {z} 0 1\n" for x, y, z in POINTS).encode() + b"3 0 1 2\n"
    mesh = read(tmp_path, head + body)
    assert mesh.materials[0].image.shape == (2, 4, 3)
    assert_array_equal(mesh.material_index, [0])
    (tmp_path / "my skin.png").unlink()
    notes = []
    assert read(tmp_path, head + body, notes).materials[0].image is None
    assert notes == ["image 'my skin.png' is missing"]


def test_elements_in_another_order_and_other_lists_are_stepped_over(tmp_path):
    head = (
        b"ply\nformat binary_little_endian 1.0\nelement camera 2\nproperty list uchar float k\n"
        b"property int id\nelement face 1\nproperty uchar flags\n"
        b"property list uchar int vertex_index\nproperty list uchar float texcoord\n"
        b"element vertex 3\nproperty list uchar short tags\nproperty double x\nproperty double y\n"
        b"property double z\nend_header\n"
    )
    body = struct.pack("<B2fi", 2, 1, 2, 7) + struct.pack("<Bi", 0, 8)
    body += struct.pack("<BB3iB2f", 9, 3, 0, 1, 2, 2, 0, 0)
    for tags, point in zip(([], [1], [2, 3]), POINTS, strict=False):
        body += struct.pack(f"<B{len(tags)}h3d", len(tags), *tags, *point)
    notes = []
    mesh = read(tmp_path, head + body, notes)
    assert_array_equal(mesh.vertices, POINTS[:3])
    assert_array_equal(mesh.faces, [[0, 1, 2]])
    assert notes == ["the property 'texcoord' of its faces is not read"]


@pytest.mark.parametrize("form", FORMS)
def test_headers_that_promise_billions_are_refused_without_taking_memory(tmp_path, form):
    data = ply(form, [[0, 1, 2]])
    tracemalloc.start()
    for word in (b"vertex 5", b"face 1"):
        for count in (b"4000000000", b"999999999999999"):
            claim = word.split()[0] + b" " + count
            with pytest.raises(IoError, match=f"promises {count.decode()}"):
                read(tmp_path, data.replace(b"element " + word, b"element " + claim))
    for length in (2**31 - 1, -1):
        bad = data[:-16] + struct.pack("<4i", length, 0, 1, 2)
        with pytest.raises(IoError, match=r"cut off|length -1|too short|not a number"):
            read(tmp_path, bad.replace(b"list uchar int", b"list int int"))
    assert tracemalloc.get_traced_memory()[1] < 8e6
    tracemalloc.stop()


BAD = {
    b"format ascii 2.0\nelement": "names no known format",
    b"property list uchar int vertex_indices": "no list of vertex indices",
    b"property float x": "no x, y and z",
    b"end_header": "no end_header",
    b"element vertex 5": "declares a property of no element",
    b"list uchar int": "its header says 'property list float what vertex_indices'",
    b"3 0 1 2": "is too short",
}


@pytest.mark.parametrize("part", BAD)
def test_what_is_wrong_is_said(tmp_path, part):
    change = {
        b"format ascii 2.0\nelement": (b"format ascii", b"format klingon"),
        b"property list uchar int vertex_indices": (b"vertex_indices", b"corners"),
        b"property float x": (b"float x", b"float w"),
        b"element vertex 5": (b"element vertex 5\n", b""),
        b"list uchar int": (b"list uchar int", b"list float what"),
        b"3 0 1 2": (b"3 0 1 2", b"3 0 1"),
    }.get(part, (part, b""))
    with pytest.raises(IoError) as caught:
        read(tmp_path, ply("ascii", [[0, 1, 2]]).replace(*change))
    assert BAD[part] in caught.value.what


def test_a_fraction_is_no_vertex(tmp_path):
    with pytest.raises(IoError, match="not whole"):
        read(tmp_path, ply("ascii", [[0, 1, 2.5]]))
    assert np.isfinite(read(tmp_path, ply("ascii", [[0, 1, 2.0]])).vertices).all()
