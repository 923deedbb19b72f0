"""Colours of mesh files as other programs read them: glTF linear, PLY and OBJ sRGB."""

import json
import struct

import numpy as np
import pytest
import trimesh

from meshsdf.io import read_mesh, write_mesh
from meshsdf.mesh import Material, Mesh

LINEAR = np.array(
    [[0, 0.001, 0.0031308, 1], [0.02, 0.18, 0.5, 0.25], [0.2140411, 0.75, 1, 0], [1, 0, 0.01, 1]],
    np.float32,
)
VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)


def encoded(linear):
    """The sRGB curve, written out once more (IEC 61966-2-1)."""
    linear = np.asarray(linear, float)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


@pytest.fixture
def painted():
    return Mesh(VERTICES, FACES, vertex_colors=LINEAR)


def test_ply_has_srgb_bytes(painted, tmp_path):
    path = tmp_path / "a.ply"
    write_mesh(path, painted)
    expected = np.rint(255 * np.column_stack([encoded(LINEAR[:, :3]), LINEAR[:, 3]]))
    header, body = path.read_bytes().split(b"end_header\n")
    assert b"property uchar red\nproperty uchar green\nproperty uchar blue\n" in header
    rows = [body[28 * i : 28 * (i + 1)] for i in range(4)]
    raw = [struct.unpack("<3d4B", row)[3:] for row in rows]
    np.testing.assert_array_equal(raw, expected)
    seen = trimesh.load_mesh(path, process=False).visual.vertex_colors
    np.testing.assert_array_equal(seen, expected)
    # 18 % grey is the middle of a picture: 118 of 255
    assert seen[1, 1] == 118


def test_obj_has_srgb_numbers(painted, tmp_path):
    path = tmp_path / "a.obj"
    write_mesh(path, painted)
    rows = [line.split() for line in path.read_text().splitlines() if line.startswith("v ")]
    raw = np.array([[float(word) for word in row[4:]] for row in rows])
    np.testing.assert_allclose(raw, encoded(LINEAR[:, :3]), rtol=0, atol=1e-12)
    seen = trimesh.load_mesh(path, process=False).visual.vertex_colors[:, :3]
    assert np.abs(seen - 255 * encoded(LINEAR[:, :3])).max() <= 1


def glb_parts(path):
    """The document and the binary chunk."""
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def glb_array(path, name):
    document, binary = glb_parts(path)
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    accessor = document["accessors"][attributes[name]]
    view = document["bufferViews"][accessor["bufferView"]]
    assert accessor["componentType"] == 5126  # float32
    width = {"VEC3": 3, "VEC4": 4}[accessor["type"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    flat = np.frombuffer(binary, "<f4", accessor["count"] * width, start)
    return flat.reshape(-1, width)


def test_glb_has_linear_floats(painted, tmp_path):
    path = tmp_path / "a.glb"
    write_mesh(path, painted)
    np.testing.assert_array_equal(glb_array(path, "COLOR_0"), LINEAR)
    # trimesh hands the numbers of the file on as bytes, and does not encode them
    seen = trimesh.load_mesh(path, process=False).visual.vertex_colors
    assert np.abs(seen - 255.0 * LINEAR).max() <= 1


def test_glb_has_linear_base_colours_and_srgb_images(tmp_path):
    image = np.arange(48, dtype=np.uint8).reshape(4, 4, 3) * 5
    gold = Material("gold", np.array([0.5, 0.2, 0.05, 1], np.float32), image)
    uv = np.ascontiguousarray(VERTICES[:, :2])
    mesh = Mesh(VERTICES, FACES, uv, None, np.zeros(4, np.int32), (gold,))
    path = tmp_path / "a.glb"
    write_mesh(path, mesh)
    (entry,) = glb_parts(path)[0]["materials"]
    factor = entry["pbrMetallicRoughness"]["baseColorFactor"]
    np.testing.assert_allclose(factor, [0.5, 0.2, 0.05, 1], rtol=1e-6)
    seen = trimesh.load_mesh(path, process=False).visual.material.baseColorTexture
    np.testing.assert_array_equal(np.asarray(seen.convert("RGB")), image)


@pytest.mark.parametrize(
    ("suffix", "error"), [(".glb", 0), (".obj", 1e-6), (".ply", 0.5 / 255 * 2.4 / 1.055 + 1e-6)]
)
def test_colours_come_back_linear(painted, tmp_path, suffix, error):
    # A byte is off by half a step, and the curve from sRGB is nowhere steeper than 2.4 / 1.055
    path = tmp_path / f"a{suffix}"
    write_mesh(path, painted)
    back = read_mesh(path).vertex_colors
    assert np.abs(back[:, :3] - LINEAR[:, :3]).max() <= error
