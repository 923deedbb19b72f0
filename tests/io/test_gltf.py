"""meshsdf.io.gltf: scenes with their parts in place, and containers that lie about their size."""

import base64
import json
import struct
import tracemalloc

import numpy as np
import PIL.Image
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import IoError
from meshsdf.io import read_mesh
from tests.io.examples import TETRAHEDRON, TETRAHEDRON_FACES, signed_volume

DATA = TETRAHEDRON.astype("<f4").tobytes() + TETRAHEDRON_FACES.astype("<u2").tobytes()


def document(**changes):
    """A tetrahedron: 48 bytes of positions, 24 bytes of indices, one node."""
    uri = "data:application/octet-stream;base64," + base64.b64encode(DATA).decode()
    parts = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        ],
        "buffers": [{"byteLength": 72, "uri": uri}],
    }
    return parts | changes


def read(tmp_path, parts, notes=None):
    (tmp_path / "a.gltf").write_text(json.dumps(parts))
    return read_mesh(tmp_path / "a.gltf", warn=(notes if notes is not None else []).append)


def test_a_plain_part_is_read_as_it_is(tmp_path):
    mesh = read(tmp_path, document())
    assert_array_equal(mesh.vertices, TETRAHEDRON)
    assert_array_equal(mesh.faces, TETRAHEDRON_FACES)
    assert (mesh.uv, mesh.vertex_colors, mesh.material_index, mesh.materials) == (None,) * 3 + ((),)


def test_nodes_multiply_from_the_root_down_and_agree_with_another_reader(tmp_path):
    half = np.sqrt(0.5)
    nodes = [
        {"children": [1], "translation": [10, 0, 0], "rotation": [0, 0, half, half]},
        {"children": [2], "scale": [1, 2, 3]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]},
    ]
    mesh = read(tmp_path, document(nodes=nodes))
    # (x, y, z) -> (x + 5, 2 y + 12, 3 z + 21), a quarter turn about z, then 10 along x.
    x, y, z = (TETRAHEDRON * [1, 2, 3] + [5, 12, 21]).T
    assert_allclose(mesh.vertices, np.stack([10 - y, x, z], axis=1), atol=1e-14)
    assert signed_volume(mesh) == pytest.approx(1)
    other = trimesh.load(tmp_path / "a.gltf", force="mesh", process=False)
    assert_allclose(other.vertices, mesh.vertices, atol=1e-6)


@pytest.mark.parametrize("node", [{"scale": [-1, 1, 1]}, {"scale": [-1, -2, -3]}])
def test_a_mirror_turns_faces_round_so_that_outside_stays_outside(tmp_path, node):
    mesh = read(tmp_path, document(nodes=[{"mesh": 0} | node]))
    assert signed_volume(mesh) == pytest.approx(abs(np.prod(node["scale"])) / 6)


def test_a_mesh_that_two_nodes_show_appears_twice(tmp_path):
    nodes = [{"mesh": 0}, {"mesh": 0, "translation": [3, 0, 0]}, {"mesh": 0}]
    mesh = read(tmp_path, document(nodes=nodes, scenes=[{"nodes": [0, 1]}]))
    assert (mesh.n_vertices, mesh.n_faces) == (8, 8)  # node 2 is not in the scene
    assert_array_equal(mesh.vertices[4:], np.add(TETRAHEDRON, [3, 0, 0]))
    assert_array_equal(mesh.faces[4:], TETRAHEDRON_FACES + 4)


def triangles(mode, indices=None):
    """The four corners as a strip or a fan, with or without indices."""
    primitive = {"attributes": {"POSITION": 0}, "mode": mode}
    parts = document(meshes=[{"primitives": [primitive]}])
    if indices is not None:
        data = np.array(indices, "<u2").tobytes()
        uri = "data:;base64," + base64.b64encode(data).decode()
        parts["buffers"].append({"byteLength": len(data), "uri": uri})
        parts["bufferViews"][1] = {"buffer": 1, "byteLength": len(data)}
        parts["accessors"][1]["count"] = len(indices)
        primitive["indices"] = 1
    return parts


def turned(faces):
    """Each face from its smallest corner on."""
    return [np.roll(face, -int(np.argmin(face))).tolist() for face in faces]


def test_strips_keep_their_side_and_jump_without_leaving_faces(tmp_path):
    assert turned(read(tmp_path, triangles(5)).faces) == [[0, 1, 2], [1, 3, 2]]
    jump = [0, 1, 2, 2, 3, 3, 1, 0]  # 2 2 and 3 3 end one run and begin the next
    assert turned(read(tmp_path, triangles(5, jump)).faces) == [[0, 1, 2], [0, 1, 3]]


def test_fans_are_refused_rather_than_left_out(tmp_path):
    with pytest.raises(IoError, match="triangle fans, which are not read"):
        read(tmp_path, triangles(6))


def test_parts_that_draw_on_the_same_arrays_keep_their_common_vertices(tmp_path):
    parts = document(materials=[{"name": "a"}, {"name": "b"}])
    first = {"attributes": {"POSITION": 0}, "indices": 1, "material": 0}
    parts["meshes"] = [{"primitives": [first, first | {"mode": 5, "material": 1}]}]
    mesh = read(tmp_path, parts)
    assert mesh.n_vertices == 4
    assert mesh.material_index.tolist() == [0] * 4 + [1] * (mesh.n_faces - 4)


def test_parts_are_not_lost_when_frames_get_the_same_name_by_chance(tmp_path, monkeypatch):
    monkeypatch.setattr(trimesh.util, "unique_id", lambda length: "same")
    primitive = {"attributes": {"POSITION": 0}, "indices": 1}
    mesh = read(tmp_path, document(meshes=[{"primitives": [primitive] * 3}]))
    assert_array_equal(mesh.faces, np.tile(TETRAHEDRON_FACES, (3, 1)))


def test_lines_and_points_are_refused_alone_and_said_beside_faces(tmp_path):
    lines = {"attributes": {"POSITION": 0}, "mode": 1}
    with pytest.raises(IoError, match="1 sets of lines or points, but no faces"):
        read(tmp_path, document(meshes=[{"primitives": [lines]}]))
    faces = {"attributes": {"POSITION": 0}, "indices": 1}
    notes = []
    assert read(tmp_path, document(meshes=[{"primitives": [lines, faces]}]), notes).n_faces == 4
    assert notes == ["1 sets of lines or points; left out"]


def with_colors(values, component, kind, normalized):
    """The tetrahedron with COLOR_0 in a second buffer."""
    data = base64.b64encode(values.tobytes()).decode()
    parts = document()
    parts["buffers"].append({"byteLength": values.nbytes, "uri": f"data:;base64,{data}"})
    parts["bufferViews"].append({"buffer": 1, "byteLength": values.nbytes})
    accessor = {"bufferView": 2, "componentType": component, "count": 4, "type": kind}
    parts["accessors"].append(accessor | ({"normalized": True} if normalized else {}))
    parts["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 2
    return parts


def test_colours_are_linear_in_every_storage(tmp_path):
    floats = np.linspace(0, 1, 12, dtype="<f4").reshape(4, 3)
    mesh = read(tmp_path, with_colors(floats, 5126, "VEC3", False))
    assert_array_equal(mesh.vertex_colors[:, :3], floats)
    assert (mesh.vertex_colors[:, 3] == 1).all()
    for dtype, component in (("<u1", 5121), ("<u2", 5123)):
        top = np.iinfo(dtype).max
        values = np.full((4, 4), top // 5, dtype)
        mesh = read(tmp_path, with_colors(values, component, "VEC4", True))
        assert_allclose(mesh.vertex_colors, (top // 5) / top, rtol=1e-7)


def test_interleaved_arrays_are_followed(tmp_path):
    parts = document()
    table = np.zeros(4, [("x", "<f4", 3), ("pad", "<u4")])
    table["x"] = TETRAHEDRON
    uri = "data:;base64," + base64.b64encode(table.tobytes()).decode()
    parts["buffers"].append({"byteLength": table.nbytes, "uri": uri})
    parts["bufferViews"][0] = {"buffer": 1, "byteLength": 64, "byteStride": 16}
    assert_array_equal(read(tmp_path, parts).vertices, TETRAHEDRON)


def test_sparse_arrays_are_refused_where_they_matter_and_nowhere_else(tmp_path):
    sparse = {"count": 1, "values": {"bufferView": 0}, "indices": {"bufferView": 1}}
    parts = document()
    parts["accessors"].append(parts["accessors"][0] | {"sparse": sparse})
    assert read(tmp_path, parts).n_faces == 4
    parts["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 2
    with pytest.raises(IoError, match="sparse or compressed arrays, which are not read"):
        read(tmp_path, parts)


def test_quantized_positions_are_fractions(tmp_path):
    parts = document(extensionsRequired=["KHR_mesh_quantization"])
    table = np.zeros((4, 4), "<i2")
    table[:, :3] = TETRAHEDRON * 32767
    uri = "data:;base64," + base64.b64encode(table.tobytes()).decode()
    parts["buffers"].append({"byteLength": table.nbytes, "uri": uri})
    parts["bufferViews"][0] = {"buffer": 1, "byteLength": 32, "byteStride": 8}
    parts["accessors"][0] |= {"componentType": 5122, "normalized": True}
    assert_array_equal(read(tmp_path, parts).vertices, TETRAHEDRON)


def test_steps_and_turns_that_are_tiny_or_nearly_rigid_are_kept(tmp_path):
    nodes = [
        {"children": [1], "scale": [1 + 1e-6] * 3},
        {"children": [2], "translation": [1e-9, 0, 0]},
        {"mesh": 0, "scale": [1e-9] * 3},
    ]
    vertices = read(tmp_path, document(nodes=nodes)).vertices
    assert_allclose(vertices, (1 + 1e-6) * (TETRAHEDRON * 1e-9 + [1e-9, 0, 0]), rtol=1e-15)


def test_cameras_and_lines_do_not_take_the_place_of_their_children_away(tmp_path):
    parts = document(cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}])
    parts["meshes"].append({"primitives": [{"attributes": {"POSITION": 0}, "mode": 2}]})
    parts["nodes"] = [
        {"camera": 0, "children": [1], "translation": [1, 0, 0]},
        {"mesh": 1, "children": [2], "translation": [2, 0, 0]},
        {"mesh": 0},
    ]
    assert_array_equal(read(tmp_path, parts).vertices, np.add(TETRAHEDRON, [3, 0, 0]))


def test_what_is_not_applied_is_said(tmp_path):
    notes = []
    read(
        tmp_path, document(skins=[{"joints": [0]}], extensionsUsed=["KHR_texture_transform"]), notes
    )
    assert notes == ["its KHR_texture_transform are not applied", "its skins are not applied"]


def test_uv_need_no_material_and_come_from_the_set_that_the_image_uses(tmp_path):
    uv = np.arange(16, dtype="<u2").reshape(2, 4, 2) * 4369  # fifteenths of 65535
    uri = "data:;base64," + base64.b64encode(uv.tobytes()).decode()
    parts = document(materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"texCoord": 1}}}])
    parts["buffers"].append({"byteLength": 32, "uri": uri})
    parts["bufferViews"].append({"buffer": 1, "byteLength": 32})
    array = {"bufferView": 2, "componentType": 5123, "type": "VEC2", "normalized": True, "count": 4}
    parts["accessors"] += [array, array | {"byteOffset": 16}]
    primitive = parts["meshes"][0]["primitives"][0]
    primitive["attributes"] |= {"TEXCOORD_0": 2, "TEXCOORD_1": 3}
    plain = uv / 65535
    plain[:, :, 1] = 1 - plain[:, :, 1]  # glTF counts from the top
    assert_allclose(read(tmp_path, parts).uv, plain[0], rtol=1e-15)
    parts |= {"textures": [{"source": 0}], "images": [{"uri": "none.png"}]}
    parts["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0
    primitive["material"] = 0
    assert_allclose(read(tmp_path, parts).uv, plain[1], rtol=1e-15)


def test_buffers_and_images_beside_the_file_are_found_by_their_escaped_names(tmp_path):
    (tmp_path / "my data.bin").write_bytes(DATA)
    parts = document(buffers=[{"byteLength": 72, "uri": "my%20data.bin"}])
    parts["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    parts |= {"textures": [{"source": 0}], "images": [{"uri": "no%20such.png"}]}
    parts["meshes"][0]["primitives"][0]["material"] = 0
    notes = []
    mesh = read(tmp_path, parts, notes)
    assert mesh.n_faces == 4
    assert mesh.materials[0].image is None
    assert notes == ["image 0 'no%20such.png' is missing or cannot be read"]
    assert (mesh.materials[0].image_name, mesh.material_index.tolist()) == (
        "no%20such.png",
        [0] * 4,
    )
    pixels = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    PIL.Image.fromarray(pixels).save(tmp_path / "no such.png")
    notes.clear()
    assert_array_equal(read(tmp_path, parts, notes).materials[0].image, pixels)
    assert notes == []
    (tmp_path / "my data.bin").unlink()
    with pytest.raises(IoError, match=r"'my%20data\.bin' that it needs is missing"):
        read(tmp_path, parts)


def changed(path, value):
    parts = document()
    place = parts
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return parts


BAD = [
    (("accessors", 0, "count"), 10**12, "should end at byte"),
    (("accessors", 0, "count"), -1, "count of an array is -1"),
    (("accessors", 0, "byteOffset"), 40, "should end at byte 88, but there are 48"),
    (("accessors", 1, "count"), 11, "11 corners, not 3 for each"),
    (
        ("accessors", 0),
        {"componentType": 5126, "count": 10**12, "type": "VEC3"},
        "sparse or compressed arrays",
    ),
    (("bufferViews", 0, "byteLength"), 10**12, "view 0 should end at byte 1000000000000"),
    (("bufferViews", 0, "byteStride"), 10**12, "should end at byte"),
    (("buffers", 0, "byteLength"), 10**12, "promises 1000000000000 bytes, but has 72"),
    (("buffers", 0), {"byteLength": 72}, "buffer 0 has no data"),
    (("buffers", 0, "uri"), "data:;base64,!", "promises 72 bytes, but has 0"),
    (("nodes", 0, "children"), [0], "node 0 stands in the scene twice"),
    (("nodes", 0, "mesh"), 3, r"meshes\[3\], but there are 1"),
    (("nodes", 0, "matrix"), [1, 2], "GLTF"),
    (("nodes", 0, "scale"), [1, None, 1], "NoneType"),
    (("scenes", 0, "nodes"), ["x"], r"nodes\['x'\]"),
    (("asset", "version"), "1.0", "it is glTF version 1.0; only 2 is read"),
    (("asset", "version"), 1, "it is glTF version 1; only 2 is read"),
    (("asset", "version"), "one", "one"),
    (("extensionsRequired",), ["KHR_draco_mesh_compression"], "KHR_draco_mesh_compression"),
    (("meshes",), 7, "its meshes are not a list of objects"),
    (("nodes", 0), 7, "its nodes are not a list of objects"),
    (("buffers", 0, "uri"), 7, "buffer 0 has no data, but refers to 7"),
    (("buffers", 0, "byteLength"), None, "length of a buffer is None"),
    (("bufferViews", 0, "byteLength"), "x", "length of a view is 'x'"),
    (("meshes", 0, "primitives", 0, "material"), 0, r"materials\[0\], but there are 0"),
    (("meshes", 0, "primitives", 0, "attributes"), {}, "POSITION"),
]


@pytest.mark.parametrize(("path", "value", "words"), BAD)
def test_documents_that_lie_are_refused_without_taking_memory(tmp_path, path, value, words):
    tracemalloc.start()
    with pytest.raises(
        IoError, match=rf"(?i)readable gltf file: .*{words.replace('GLTF', '')}"
    ) as caught:
        read(tmp_path, changed(path, value))
    assert tracemalloc.get_traced_memory()[1] < 8e6
    tracemalloc.stop()
    assert "Type-check" not in caught.value.what


def test_nesting_without_end_is_refused(tmp_path):
    (tmp_path / "a.gltf").write_text('{"asset":' + "[" * 100_000)
    with pytest.raises(IoError, match="nested too deeply"):
        read_mesh(tmp_path / "a.gltf")


def test_a_thousand_nodes_deep_is_no_trouble(tmp_path):
    chain = [{"children": [i + 1], "translation": [1, 0, 0]} for i in range(1999)]
    mesh = read(tmp_path, document(nodes=[*chain, {"mesh": 0}]))
    assert_array_equal(mesh.vertices, np.add(TETRAHEDRON, [1999, 0, 0]))


def test_a_glb_that_lies_about_its_length_is_refused(tmp_path):
    text = json.dumps(document()).encode()
    text += b" " * (-len(text) % 4)
    chunk = struct.pack("<I4s", len(text), b"JSON") + text

    right = 12 + len(chunk)

    def glb(length=right, version=2, body=chunk):
        (tmp_path / "a.glb").write_bytes(struct.pack("<4s2I", b"glTF", version, length) + body)
        return read_mesh(tmp_path / "a.glb")

    assert glb().n_faces == 4
    with pytest.raises(IoError, match="promises 4294967295 bytes"):
        glb(length=2**32 - 1)
    with pytest.raises(IoError, match="GLB version 1"):
        glb(version=1)
    with pytest.raises(IoError, match="promises 4294967315 bytes"):
        glb(body=struct.pack("<I4s", 2**32 - 1, b"JSON") + text)
    with pytest.raises(IoError, match="no JSON chunk"):
        glb(body=struct.pack("<I4s", len(text), b"JUNK") + text)
