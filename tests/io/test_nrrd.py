"""meshsdf.io.nrrd beside pynrrd and SimpleITK, and the many ways in which others write NRRD."""

import bz2
import gzip

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io.nrrd import probe_nrrd, read_nrrd, write_nrrd
from tests.io.dense_examples import WAYS, assert_centered, assert_same_grid, sphere_grid, written

NRRD_WAYS = ["nrrd", "nrrd plain", "nhdr", "nhdr plain"]
VALUES = np.random.default_rng(0).integers(-99, 99, (3, 4, 5))
"""[i, j, k], small enough for every type."""

TYPES = {
    "i1": "signed char",
    "i2": "short",
    "u2": "unsigned short int",
    "i4": "INT",
    "u4": "uint32_t",
    "i8": "longlong",
    "u8": "unsigned long long",
    "f4": "float",
    "f8": "double",
}


def nrrd_bytes(data: bytes, *lines: str, **changes: str | None) -> bytes:
    """A file made by hand; fields may be replaced or (None) left out."""
    fields = {
        "type": "float",
        "dimension": "3",
        "sizes": "3 4 5",
        "space dimension": "3",
        "space directions": "(0.5,0,0) (0,0.5,0) (0,0,0.5)",
        "space origin": "(1,2,3)",
        "endian": "little",
        "encoding": "raw",
    } | {name.replace("_", " "): text for name, text in changes.items()}
    head = [f"{name}: {text}" for name, text in fields.items() if text is not None]
    return "\n".join(["NRRD0004", "# made by hand", *head, *lines, "", ""]).encode() + data


def packed(kind: str, values: np.ndarray = VALUES) -> bytes:
    """Bytes with x fastest."""
    return values.transpose(2, 1, 0).astype(kind).tobytes()


def read(path, data: bytes, notes: list | None = None) -> Grid:
    path.write_bytes(data)
    return read_nrrd(path, warn=[].append if notes is None else notes.append)


@pytest.mark.parametrize("name", NRRD_WAYS)
def test_pynrrd_finds_the_sphere_where_it_is(tmp_path, name):
    nrrd = pytest.importorskip("nrrd", reason="pynrrd is not installed")
    grid = sphere_grid()
    values, header = nrrd.read(str(written(WAYS[name], tmp_path, grid)))
    assert values.dtype == np.float32
    assert_array_equal(values, grid.values)
    assert_array_equal(header["space origin"], grid.origin)
    assert_array_equal(header["space directions"], 0.1 * np.eye(3))
    assert header["centerings"] == ["node"] * 3
    ijk = np.stack(np.indices(values.shape), axis=-1)
    assert_centered(values, header["space origin"] + ijk @ header["space directions"])


@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2", "ascii"])
@pytest.mark.parametrize("suffix", [".nrrd", ".nhdr"])
def test_what_pynrrd_writes_is_read(tmp_path, encoding, suffix):
    nrrd = pytest.importorskip("nrrd", reason="pynrrd is not installed")
    grid, path = sphere_grid(), tmp_path / f"a{suffix}"
    header = {
        "space": "left-posterior-superior",
        "space directions": 0.1 * np.eye(3),
        "space origin": grid.origin,
        "encoding": encoding,
        "meshsdf_sign": "parity",
    }
    nrrd.write(str(path), grid.values, header)
    back = read_nrrd(path)
    # pynrrd writes text with %.9g of a float32, which tells it from its neighbours
    assert_same_grid(back, grid)


@pytest.mark.parametrize("name", NRRD_WAYS)
def test_simpleitk_finds_the_sphere_where_it_is(tmp_path, name):
    sitk = pytest.importorskip("SimpleITK", reason="SimpleITK is not installed")
    grid = sphere_grid()
    image = sitk.ReadImage(str(written(WAYS[name], tmp_path, grid)))
    values = sitk.GetArrayFromImage(image).transpose(2, 1, 0)
    assert_array_equal(values, grid.values)
    to_world = image.TransformIndexToPhysicalPoint
    first = np.array(to_world((0, 0, 0)))
    steps = np.array([to_world((1, 0, 0)), to_world((0, 1, 0)), to_world((0, 0, 1))]) - first
    ijk = np.stack(np.indices(values.shape), axis=-1)
    assert_centered(values, first + ijk @ steps)
    assert image.GetMetaData("meshsdf_sign") == "parity"


@pytest.mark.parametrize("compressed", [False, True])
def test_what_simpleitk_writes_is_read(tmp_path, compressed):
    sitk = pytest.importorskip("SimpleITK", reason="SimpleITK is not installed")
    grid = sphere_grid()
    image = sitk.GetImageFromArray(grid.values.transpose(2, 1, 0))
    image.SetOrigin(grid.origin.tolist())
    image.SetSpacing([0.1] * 3)
    sitk.WriteImage(image, str(tmp_path / "a.nrrd"), useCompression=compressed)
    back = read_nrrd(tmp_path / "a.nrrd")
    assert_array_equal(back.values, grid.values)
    assert_allclose(back.origin, grid.origin, rtol=1e-14)
    assert back.voxel_size == pytest.approx(0.1, rel=1e-14)
    assert back.sign == "winding"  # nobody told, and there are values below 0


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("order", "<>")
def test_every_type_and_byte_order_is_read(tmp_path, kind, order):
    values = np.abs(VALUES) if kind[0] == "u" else VALUES
    endian = {"<": "Little", ">": "big"}[order]
    notes = []
    data = nrrd_bytes(packed(order + kind, values), type=TYPES[kind], endian=endian)
    grid = read(tmp_path / "a.nrrd", data, notes)
    assert_array_equal(grid.values, values)
    is_large = kind in ("i4", "u4", "i8", "u8", "f8")
    assert grid.values.dtype == (np.float64 if is_large else np.float32)
    name = np.dtype(kind).name
    expected = [f"its {name} values are read as {grid.values.dtype}"] if kind[0] != "f" else []
    assert notes == expected
    assert grid.sign == ("unsigned" if kind[0] == "u" else "winding")
    assert probe_nrrd(tmp_path / "a.nrrd")["dtype"] == name


def test_every_encoding_is_read(tmp_path):
    data = packed("<f4")
    text = " ".join(map(str, VALUES.transpose(2, 1, 0).ravel()))
    wrapped = "\n".join(text.replace(" ", "\t", 7).split(" "))
    cases = {
        "raw": data,
        "gzip": gzip.compress(data),
        "gz": gzip.compress(data[:100]) + gzip.compress(data[100:]),
        "BZIP2": bz2.compress(data),
        "bz2": bz2.compress(data),
        "text": text.encode(),
        "txt": wrapped.encode(),
        "ascii": (text + "\n\n").encode(),
        "hex": data.hex().encode(),
    }
    for encoding, content in cases.items():
        grid = read(tmp_path / "a.nrrd", nrrd_bytes(content, encoding=encoding))
        assert_array_equal(grid.values, VALUES, err_msg=encoding)
        # The same beside the header, after two lines and three bytes
        if encoding in ("raw", "gzip", "bz2"):
            pack = {"raw": bytes, "gzip": gzip.compress, "bz2": bz2.compress}[encoding]
            (tmp_path / "a.dat").write_bytes(b"one\ntwo\n" + pack(b"abc" + data))
            beside = ["data file: a.dat", "line skip: 2", "byteskip: 3"]
            grid = read(tmp_path / "b.nhdr", nrrd_bytes(b"", *beside, encoding=encoding))
            assert_array_equal(grid.values, VALUES)
    (tmp_path / "a.dat").write_bytes(b"anything" + data)
    grid = read(tmp_path / "b.nhdr", nrrd_bytes(b"", "datafile: a.dat", "byte skip: -1"))
    assert_array_equal(grid.values, VALUES)


def test_lines_may_end_as_on_windows(tmp_path):
    head = nrrd_bytes(b"").replace(b"\n", b"\r\n")
    grid = read(tmp_path / "a.nrrd", head + packed("<f4"))
    assert_array_equal(grid.values, VALUES)
    assert_array_equal(grid.origin, [1, 2, 3])


@pytest.mark.parametrize(
    ("fields", "size", "origin", "n_notes"),
    [
        ({"spacings": "0.5 0.5 0.5"}, 0.5, [0, 0, 0], 1),
        ({"spacings": "0.5 0.5 0.5", "axis_mins": "1 2 3"}, 0.5, [1, 2, 3], 0),
        (
            {"spacings": "0.5 0.5 0.5", "axismins": "1 2 3", "centers": "node node node"},
            0.5,
            [1, 2, 3],
            0,
        ),
        (
            {"spacings": "0.5 0.5 0.5", "axis_mins": "1 2 3", "centerings": "cell cell cell"},
            0.5,
            [1.25, 2.25, 3.25],
            0,
        ),
        ({"axis_mins": "0 0 0", "axis_maxs": "1 1.5 2"}, 0.5, [0, 0, 0], 0),
        (
            {"axis_mins": "0 0 0", "axis_maxs": "1.5 2 2.5", "centerings": "cell cell cell"},
            0.5,
            [0.25, 0.25, 0.25],
            0,
        ),
        ({"space_origin": "( 4 , 5, 6 )", "spacings": "2 2 2"}, 2, [4, 5, 6], 0),
        ({}, 1, [0, 0, 0], 2),
    ],
)
def test_place_and_spacing_are_found_however_they_are_told(tmp_path, fields, size, origin, n_notes):
    fields = {"space_directions": None, "space_origin": None, "space_dimension": None} | fields
    notes = []
    grid = read(tmp_path / "a.nrrd", nrrd_bytes(packed("<f4"), **fields), notes)
    assert grid.voxel_size == size
    assert_array_equal(grid.origin, origin)
    assert len(notes) == n_notes


def test_spacings_that_differ_by_rounding_are_one(tmp_path):
    directions = "(0.3333333,0,0) (0,0.3333334,0) (0,1e-9,0.3333333)"
    grid = read(tmp_path / "a.nrrd", nrrd_bytes(packed("<f4"), space_directions=directions))
    assert grid.voxel_size == pytest.approx(0.33333333, rel=2e-7)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"space_directions": "(1,0,0) (0,1,0) (0,0,2)"},
            r"no cubes, but 1 x 1 x 2\n(.|\n)*resamp",
        ),
        ({"space_directions": "(1,0,0) (0,1,0) (0,0,1.00001)"}, "no cubes"),
        ({"space_directions": "(0,1,0) (1,0,0) (0,0,1)"}, r"turned or flipped: \(0 1 0\), \(1 0 0"),
        ({"space_directions": "(-1,0,0) (0,-1,0) (0,0,1)"}, "turned or flipped"),
        ({"space_directions": "none (0,1,0) (0,0,1)"}, "axes run along 'none"),
        ({"space_directions": "(1,0,0) (0,1,0)"}, "axes run along"),
        ({"space_directions": "(1,0,nan) (0,1,0) (0,0,1)"}, "NaN or infinite"),
        ({"space_directions": "(1,0) (0,1,0) (0,0,1)"}, "a direction is '1 0', not 3 numbers"),
        ({"space_origin": "(1,2,nan)"}, "its origin is"),
        ({"space_origin": "1,2,3"}, "its space origin is '1,2,3'"),
        ({"dimension": "4", "sizes": "3 3 4 5"}, "it has 4 axes"),
        ({"dimension": "2", "sizes": "3 4"}, "it has 2 axes"),
        ({"sizes": "3 4"}, "sizes is '3 4', not 3 whole numbers"),
        ({"sizes": "3 4 0"}, "claims 3 x 4 0? ?x? ?0? ?nodes|claims 3 x 4 x 0 nodes"),
        ({"sizes": "3 4 -5"}, "claims 3 x 4 x -5 nodes"),
        ({"sizes": "3 4 6"}, "its values take 288 bytes, but 240 are there"),
        ({"sizes": None}, "lacks 'sizes'"),
        ({"type": "block"}, "values are of type 'block'"),
        ({"endian": None}, "its byte order is ''"),
        ({"encoding": "zstd"}, "its encoding is 'zstd'"),
        ({"encoding": "gzip"}, "while decompressing"),
        ({"encoding": "bz2"}, "[Ii]nvalid data stream"),
        ({"encoding": "hex"}, "hexadecimal|ascii"),
        ({"encoding": "text"}, "not a number|ascii"),
        ({"byte_skip": "-1", "encoding": "gzip"}, "skips 0 lines and -1 bytes"),
        ({"byte_skip": "1"}, "240 bytes, but 239 are there"),
        ({"line_skip": "9999999"}, "no 9999999 lines to skip"),
    ],
)
def test_what_makes_no_grid_is_refused_in_words(tmp_path, changes, words):
    with pytest.raises(IoError, match=words):
        read(tmp_path / "a.nrrd", nrrd_bytes(packed("<f4"), **changes))


def test_odd_headers_are_refused(tmp_path):
    path, whole = tmp_path / "a.nrrd", nrrd_bytes(packed("<f4"))
    assert_array_equal(read(path, whole).values, VALUES)
    with pytest.raises(IoError, match="does not begin with NRRD0001"):
        read(path, whole.replace(b"NRRD0004", b"NRRD0009"))
    with pytest.raises(IoError, match="says 'sizes' twice"):
        read(path, nrrd_bytes(packed("<f4"), "sizes: 3 4 5"))
    with pytest.raises(IoError, match="holds the line 'what'"):
        read(path, nrrd_bytes(packed("<f4"), "what"))
    with pytest.raises(IoError, match="header does not end"):
        read(path, whole[:60] + b"# " + b"x" * (2 << 20))
    inf = VALUES.astype("<f4")
    inf[0, 0, 0] = np.inf
    with pytest.raises(IoError, match="values are infinite"):
        read(path, nrrd_bytes(packed("<f4", inf)))


def test_entries_that_are_not_kept_are_named(tmp_path):
    path = tmp_path / "noted.nrrd"
    write_nrrd(path, Grid(np.zeros((3, 4, 5), np.float32), 0.5, np.zeros(3)))
    data = path.read_bytes().replace(
        b"\nendian:", b'\nunits: "mm" "mm" "mm"\npatient:=nobody\nendian:', 1
    )
    path.write_bytes(data.replace(b"content: distance", b"content: a scan", 1))
    said = []
    read_nrrd(path, warn=said.append)
    assert said == ["entries of its header are not kept: content, patient, units"]
