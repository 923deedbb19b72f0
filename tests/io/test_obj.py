"""meshsdf.io.obj: the many ways of writing the same shape."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from meshsdf.errors import IoError
from meshsdf.io import read_mesh

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def read(tmp_path, text, notes=None):
    (tmp_path / "a.obj").write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_mesh(tmp_path / "a.obj", warn=(notes if notes is not None else []).append)


SPELLINGS = {
    "plain": SQUARE + "f 1 2 3\nf 1 3 4\n",
    "carriage returns": (SQUARE + "f 1 2 3\nf 1 3 4\n").replace("\n", "\r\n"),
    "old line ends": (SQUARE + "f 1 2 3\nf 1 3 4\n").replace("\n", "\r"),
    "no last newline": SQUARE + "f 1 2 3\nf 1 3 4",
    "indented, with tabs": SQUARE.replace("v ", "  v\t") + "\tf\t1  2 3 \n f 1 3 4\n",
    "comments": "# a\n" + SQUARE.replace("\n", " # corner\n") + "f 1 2 3 # first\nf 1 3 4\n",
    "continued line": SQUARE + "f 1 2 \\\n3\nf 1 3 4\n",
    "relative": SQUARE + "f -4 -3 -2\nf -4 -2 -1\n",
    "relative, each to what stands above": "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\n"
    "v 0 1 0\nf -4 -2 -1\n",
    "a quad": SQUARE + "f 1 2 3 4\n",
    "normals": SQUARE + "vn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n",
    "empty places": SQUARE + "f 1/ 2/ 3/\nf 1// 3// 4//\n",
    "groups and smoothing": "o a\ng b c\ns off\n" + SQUARE + "f 1 2 3\ng\ns 1\nf 1 3 4\n",
    "weights": SQUARE.replace(" 0\n", " 0 1.0\n") + "f 1 2 3\nf 1 3 4\n",
    "exponents": SQUARE.replace("1", "1.0e+00").replace(" 0", " -0E-3") + "f 1 2 3\nf 1 3 4\n",
}


@pytest.mark.parametrize("name", SPELLINGS)
def test_every_spelling_of_a_square_is_the_same_square(tmp_path, name):
    mesh = read(tmp_path, SPELLINGS[name])
    assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3]])
    assert mesh.uv is None


def test_a_polygon_becomes_a_fan_and_mixed_sizes_stay_in_order(tmp_path):
    points = "".join(f"v {np.cos(a)} {np.sin(a)} 0\n" for a in np.linspace(0, 5, 6))
    mesh = read(tmp_path, points + "f 1 2 3 4 5 6\nf 6 5 4\nf 1 3 5 6\n")
    fan = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
    assert_array_equal(mesh.faces, [*fan, [5, 4, 3], [0, 2, 4], [0, 4, 5]])


def test_a_seam_splits_only_the_vertices_on_it(tmp_path):
    text = SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\nf 1/1 2/2 3/3\nf 1/5 3/3 4/4\n"
    mesh = read(tmp_path, text)
    assert mesh.n_vertices == 5
    corner = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert_array_equal(mesh.triangles.reshape(-1, 3), corner)
    expected = [[0, 0], [1, 0], [1, 1], [0.5, 0.5], [1, 1], [0, 1]]
    assert_array_equal(mesh.uv[mesh.faces.ravel()], expected)


def test_relative_texture_coordinates_count_from_their_own_place(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt .1 .2\nvt .3 .4\nf -3/-2 -2/-1 -1/-1\nvt .9 .9\n"
    mesh = read(tmp_path, text)
    assert_array_equal(mesh.uv[mesh.faces[0]], [[0.1, 0.2], [0.3, 0.4], [0.3, 0.4]])


def test_what_is_left_out_is_said(tmp_path):
    notes = []
    mesh = read(tmp_path, SQUARE + "vt 0 0\nf 1/1 2/1 3\nf 1 2\n", notes)
    assert mesh.n_faces == 1
    assert notes == [
        "1 faces have fewer than three corners; left out",
        "1 of 4 positions are used by no face; left out",
        "1 vertices have no texture coordinate; set to (0, 0)",
    ]


def test_colours_behind_positions_are_srgb_from_0_to_1_or_to_255(tmp_path):
    for top in (1.0, 255.0):
        lines = [f"v {i} {i * i} 0 {top} {top / 2} 0\n" for i in range(3)]
        mesh = read(tmp_path, "".join(lines) + "f 1 2 3\n")
        # Linear light of sRGB 0.5 is 0.214041 (IEC 61966-2-1).
        assert_allclose(mesh.vertex_colors, [[1, 0.214041, 0, 1]] * 3, atol=1e-6)
    notes = []
    mesh = read(tmp_path, "v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", notes)
    assert mesh.vertex_colors is None
    assert notes == ["only 1 of 3 vertices have a colour; colours left out"]


BAD = {
    "v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n": "a vertex needs 3 numbers; number 1 has 2",
    "v 0 0 0\nv 1 zero 0\nv 0 1 0\nf 1 2 3\n": "vertex line 2 holds 'zero'",
    SQUARE + "f 0 1 2\n": "vertex 0, but OBJ counts from 1",
    SQUARE + "f 1 2 x\n": "holds 'x'",
    SQUARE + "f 1 2 2.5\n": "not whole",
    SQUARE + "f 1 2 -5\n": "1 of 1 triangles name vertices that are not among the 4",
    SQUARE + "f 1/1 2/1 3/1\n": "3 face corners name texture coordinates that are not among the 0",
    SQUARE + "vt 0 0\nf 1/1 2/2 3/-2\n": "2 face corners name texture coordinates",
    SQUARE + "f 1/1/1/1 2 3\n": "not of the form",
    SQUARE + "f 1 2\n": "no face has three corners",
    SQUARE + "f 1 2 nan\n": "not of the form",
}


@pytest.mark.parametrize("text", BAD)
def test_what_is_wrong_is_said(tmp_path, text):
    with pytest.raises(IoError) as caught:
        read(tmp_path, text)
    assert caught.value.what.startswith("a.obj is not a readable OBJ file: ")
    assert BAD[text] in caught.value.what


TEXTURED = SQUARE + "vt 0 0\nusemtl red paint\nf 1/1 2/1 3/1\nusemtl blue\nf 1/1 3/1 4/1\n"


def test_materials_and_images_with_spaces_in_their_names_are_found(tmp_path):
    pixels = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    Image.fromarray(pixels).save(tmp_path / "my image.png")
    (tmp_path / "my file.mtl").write_text(
        "newmtl red paint\nKd 0.5 0.25 0\nd 0.5\nmap_Kd -s 1 1 1 my image.png\n"
        "\nnewmtl blue\nKd 0 0 1\n"
    )
    mesh = read(tmp_path, "mtllib my file.mtl\n" + TEXTURED)
    assert_array_equal(mesh.material_index, [0, 1])
    red, blue = mesh.materials
    assert (red.name, red.image_name, blue.name) == ("red paint", "my image.png", "blue")
    assert_array_equal(red.image, pixels)
    assert_array_equal(red.base_color, np.float32([0.5, 0.25, 0, 0.5]))
    assert_array_equal(blue.base_color, np.float32([0, 0, 1, 1]))


def assert_geometry_survives(tmp_path, words, library="a.mtl"):
    notes = []
    mesh = read(tmp_path, f"mtllib {library}\n" + TEXTURED, notes)
    assert (mesh.n_faces, [m.name for m in mesh.materials]) == (2, ["red paint", "blue"])
    assert any(words in note for note in notes), notes
    return mesh


def test_a_missing_or_broken_material_file_or_image_costs_only_itself(tmp_path):
    assert_geometry_survives(tmp_path, "material file 'a.mtl' is missing")
    assert_geometry_survives(tmp_path, "is missing", library="x" * 300)
    assert_geometry_survives(tmp_path, "is missing", library="/dev/zero")
    (tmp_path / "a.mtl").write_bytes(b"\xff\xfe\0newmtl \0\nKd\n")
    assert_geometry_survives(tmp_path, "material 'blue' is in none of its material files")
    (tmp_path / "a.mtl").write_text("newmtl blue\nKd 1 x 0\nnewmtl red paint\nmap_Kd no.png\n")
    mesh = assert_geometry_survives(tmp_path, "image 'no.png' of material 'red paint' is missing")
    assert mesh.materials[0].image_name == "no.png"
    assert_geometry_survives(tmp_path, "material 'blue': 'kd' is followed by '1 x 0'; left out")
    (tmp_path / "no.png").write_bytes(b"\x89PNG\r\n\x1a\nbroken")
    assert_geometry_survives(tmp_path, "image 'no.png' cannot be read")


@pytest.mark.parametrize(
    ("mode", "channels"), [("L", 1), ("LA", 2), ("P", 3), ("1", 1), ("I;16", 1)]
)
def test_images_of_every_mode_become_bytes(tmp_path, mode, channels):
    Image.new(mode, (5, 3)).save(tmp_path / "i.png")
    (tmp_path / "a.mtl").write_text("newmtl blue\nmap_Kd i.png\n")
    mesh = read(tmp_path, "mtllib a.mtl\n" + TEXTURED)
    assert mesh.materials[1].image.shape == (3, 5, channels)
