"""meshsdf.io.obj_plain: the fast reader gives what exact arithmetic and the other reader give."""

import re
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.errors import IoError
from meshsdf.io import obj, obj_plain, read_mesh
from meshsdf.mesh.primitives import icosphere

FACES = "f 1 2 3\nf 3 2 1\n"
FAR = "v 0 0 0\n" * 3
TRICKS = [
    "v 1 0 0 1",
    "v 1 0",
    "v 1 0 x",
    "v 1 0 1e",
    "v 1 0 .",
    "v 1 0 nan",
    " v 1 0 0",
    "v 1 0 0 # here",
    "v 1 0 1_0",
    "v 1 0 --1",
    "v 1,0 0 0",
    "v 1 0 0x1",
    "v 1 0 1e999",
    "v 1 0 -1e-999",
    "v",
    "v1 0 0",
    "vp 1",
    "vt 0 0",
    "f",
    "f 1 2",
    "f 1 2 3 1",
    "f 1 2 -1",
    "f 0 1 2",
    "f 1 2 9",
    "f 1 2 3.0",
    "f 1 2 +3",
    "f 1/ 2/ 3/",
    "f 1/1 2/1 3/1",
    "f 1//x 2//1 3//1",
    "f 1//1/1 2 3",
    "f 1 2 99999999999999999999999",
    "l 1 2",
    "usemtl red",
    "hello",
    "o",
    "v 1 0 \\\n0",
    "v 1 0 0\x0b",
    "\x0b",
    "\x00",
    "f 1 2 3\r",
]
PASSED_OVER = [
    "# f 9 9 9\n",
    "#v 1\n",
    "\n",
    "vn 0 0 1\n",
    "o a name\n",
    "g\n",
    "g a b\n",
    "s off\n",
    "\r\n",
]


@pytest.fixture(autouse=True)
def _of_any_size(monkeypatch):
    monkeypatch.setattr(obj_plain, "SMALL", 0)


def plain(text, notes=None):
    data = text.encode() if isinstance(text, str) else text
    return obj_plain.read_plain_obj(data, (notes if notes is not None else []).append)


def told(path, monkeypatch, *, is_fast):
    """All that a reader says of a file: arrays and notes, or the refusal."""
    notes = []
    with monkeypatch.context() as patch:
        if not is_fast:
            patch.setattr(obj, "read_plain_obj", lambda text, warn: None)
        try:
            mesh = read_mesh(path, warn=notes.append)
        except IoError as error:
            return str(error)
    more = (mesh.uv, mesh.vertex_colors, mesh.material_index)
    arrays = [None if array is None else array.tobytes() for array in more]
    return mesh.vertices.tobytes(), mesh.faces.tobytes(), mesh.faces.dtype, arrays, notes


def spelled_numbers():
    """Decimals of all lengths and sizes, and some beside the middle of two floats."""
    rng = np.random.default_rng(0)
    words = [
        repr(x) for x in (rng.normal(size=4000) * 10.0 ** rng.integers(-30, 30, 4000)).tolist()
    ]
    words += [
        f"{x:.{k}f}" for x, k in zip(rng.normal(size=2000), rng.integers(0, 25, 2000), strict=True)
    ]
    words += [
        f"{x:.{k}E}" for x, k in zip(rng.normal(size=2000), rng.integers(0, 25, 2000), strict=True)
    ]
    for _ in range(2000):
        whole = str(rng.integers(0, 2**63)) + str(rng.integers(0, 10))
        words.append(whole[: rng.integers(1, 20)] + f"e{rng.integers(-70, 70)}")
    for x in rng.normal(size=1000) * 2.0 ** rng.integers(-8, 8, 1000):
        middle = (Fraction(x) + Fraction(float(np.nextafter(x, 9e9)))) / 2
        digits = f"{int(abs(middle) * 10**18):019d}"
        words += [f"{digits[:-18]}.{digits[-18:]}", f"-{digits[:-18]}.{digits[-18:]}01"]
    for x in rng.integers(2**53, 2**62, 1000).tolist():
        words.append(str(x | 1))
    words += ["0", "-0", "+0.0", "-.0e5", "5.", "+.5", "00012", "0.0000000000000000000000000000001"]
    words += [
        "0." + "0" * 80,
        "1" * 30,
        "4503599627370496.5",
        "9007199254740993",
        "1e22",
        "1e23",
        "1e-22",
    ]
    words += [
        "1e-23",
        "8.5e-65",
        "18446744073709551615",
        "9999999999999999999",
        "1e-400",
        "0e999",
    ]
    return words + ["0"] * (-len(words) % 3)


def test_every_decimal_becomes_the_nearest_float():
    words = spelled_numbers()
    lines = ["v {} {}\t{}".format(*words[k : k + 3]) for k in range(0, len(words), 3)]
    lines += [f"f {k} {k} {k}" for k in range(1, len(lines) + 1)]
    # The room for numbers that need exact arithmetic is for one in 16; these are of the worst
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(obj_plain, "ROOM", 1)
        mesh = plain("\n".join(lines))
    expected = np.array([float(word) for word in words])
    assert_array_equal(mesh.vertices.ravel().view(np.int64), expected.view(np.int64))


def test_most_decimals_need_no_exact_arithmetic():
    rng = np.random.default_rng(1)
    lines = ["v {!r} {!r} {!r}\n".format(*row) for row in rng.normal(size=(20000, 3)).tolist()]
    mesh = plain("".join(lines) + "f 1 2 3\n" + "f 20000 1 2\n", notes := [])
    assert mesh.n_vertices == 4
    assert notes == ["19996 of 20000 positions are used by no face; left out"]
    # All those of more digits than a machine word holds do: more than there is room for
    long = "".join(f"v 1.{k:025d}1 0 0\n" for k in range(10, 1000)) + "f 1 2 3\n"
    assert plain(long) is None


def test_what_is_between_positions_and_triangles_is_passed_over():
    sphere = icosphere(subdivisions=3)
    lines = ["v {!r} {!r} {!r}\n".format(*row) for row in sphere.vertices.tolist()]
    corners = (sphere.faces + 1).tolist()
    lines += ["f {} {} {}\n".format(*row) for row in corners[::2]]
    lines += ["f {}//7 {}//8  {}//9 \r\n".format(*row) for row in corners[1::2]]
    rng = np.random.default_rng(2)
    for place in rng.integers(0, len(sphere.vertices), 200):
        lines[place] = str(rng.choice(PASSED_OVER)) + lines[place]
    mesh = plain("".join(lines).removesuffix("\r\n"))
    assert_array_equal(mesh.vertices, sphere.vertices)
    assert_array_equal(mesh.faces, np.concatenate([sphere.faces[::2], sphere.faces[1::2]]))


@pytest.mark.parametrize("trick", TRICKS)
def test_what_is_not_plain_is_left_to_the_other_reader(tmp_path, monkeypatch, trick):
    path = tmp_path / "a.obj"
    for text in (FAR + trick + "\n" + FACES, FAR + FACES + trick, trick + "\n" + FAR + FACES):
        path.write_bytes(text.encode())
        said = told(path, monkeypatch, is_fast=True)
        assert said == told(path, monkeypatch, is_fast=False)


def test_damage_at_any_byte_changes_nothing_that_is_said(tmp_path, monkeypatch):
    text = "# a\nv 0.25 -1.5 .5\nv 12345678901234567890 3e-2 0\nv 1.1 2.2 3.3\nv 7 8 9\n"
    text += "f 1 2 3\nvn 0 0 1\nf 2//1 4//1 3//1\n"
    rng, path, n_read = np.random.default_rng(3), tmp_path / "a.obj", 0
    cases = [text[:end].encode() for end in range(len(text))]
    letters = np.frombuffer(b"0123456789 \t\r\n.-+eEvfnx/#\\\0\xff", np.uint8)
    for _ in range(250):
        damaged = np.frombuffer(text.encode(), np.uint8).copy()
        damaged[rng.integers(0, len(text), rng.integers(1, 3))] = rng.choice(letters)
        cases.append(damaged.tobytes())
    for case in cases:
        path.write_bytes(case)
        said = told(path, monkeypatch, is_fast=True)
        assert said == told(path, monkeypatch, is_fast=False)
        n_read += isinstance(said, tuple) and plain(case) is not None
    assert 50 < n_read < len(cases)


def test_the_same_mesh_with_any_number_of_threads(monkeypatch):
    sphere = icosphere(subdivisions=2)
    text = "".join("v {!r} {!r} {!r}\n".format(*row) for row in sphere.vertices.tolist())
    text += "".join("f {} {} {}\n".format(*row) for row in (sphere.faces + 1).tolist())
    assert len(re.findall("\n", text)) > 64
    for n in (1, 2, 3, 7, 64):
        monkeypatch.setattr(obj_plain, "n_threads", lambda n=n: n)
        mesh = plain(text)
        assert_array_equal(mesh.vertices, sphere.vertices)
        assert_array_equal(mesh.faces, sphere.faces)


def test_small_files_do_not_wait_for_a_kernel(monkeypatch):
    monkeypatch.undo()
    assert plain(FAR + FACES) is None
