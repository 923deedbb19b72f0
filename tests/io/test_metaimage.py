"""meshsdf.io.metaimage beside SimpleITK and VTK, and what others write."""

import zlib

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io.metaimage import probe_metaimage, read_metaimage, write_metaimage
from tests.io.dense_examples import WAYS, assert_centered, sphere_grid, written

META_WAYS = ["mha", "mha plain", "mhd", "mhd plain"]
VALUES = np.random.default_rng(0).integers(-99, 99, (3, 4, 5))
TYPES = {
    "i1": "MET_CHAR",
    "u1": "MET_UCHAR",
    "i2": "MET_SHORT",
    "u2": "MET_USHORT",
    "i4": "MET_LONG",
    "u4": "MET_UINT",
    "i8": "MET_LONG_LONG",
    "f4": "MET_FLOAT",
    "f8": "MET_DOUBLE",
}


def meta_bytes(data: bytes, **changes: str | None) -> bytes:
    """A file made by hand; keys may be replaced or (None) left out."""
    fields = {
        "ObjectType": "Image",
        "NDims": "3",
        "BinaryData": "True",
        "BinaryDataByteOrderMSB": "False",
        "TransformMatrix": "1 0 0 0 1 0 0 0 1",
        "Offset": "1 2 3",
        "ElementSpacing": "0.5 0.5 0.5",
        "DimSize": "3 4 5",
        "ElementType": "MET_FLOAT",
    }
    local = changes.pop("ElementDataFile", "LOCAL")
    fields = {k: v for k, v in (fields | changes).items() if v is not None}
    lines = [f"{name} = {text}\n" for name, text in fields.items()]
    return "".join([*lines, f"ElementDataFile = {local}\n"]).encode() + data


def packed(kind: str, values: np.ndarray = VALUES) -> bytes:
    """Bytes with x fastest."""
    return values.transpose(2, 1, 0).astype(kind).tobytes()


def read(path, data: bytes, notes: list | None = None) -> Grid:
    path.write_bytes(data)
    return read_metaimage(path, warn=[].append if notes is None else notes.append)


@pytest.mark.parametrize("name", META_WAYS)
def test_simpleitk_finds_the_sphere_where_it_is(tmp_path, name):
    sitk = pytest.importorskip("SimpleITK", reason="SimpleITK is not installed")
    grid = sphere_grid()
    image = sitk.ReadImage(str(written(WAYS[name], tmp_path, grid)))
    values = sitk.GetArrayFromImage(image).transpose(2, 1, 0)
    assert_array_equal(values, grid.values)
    assert image.GetSpacing() == (0.1, 0.1, 0.1)
    assert image.GetOrigin() == tuple(grid.origin.tolist())
    to_world = image.TransformIndexToPhysicalPoint
    first = np.array(to_world((0, 0, 0)))
    steps = np.array([to_world((1, 0, 0)), to_world((0, 1, 0)), to_world((0, 0, 1))]) - first
    assert_centered(values, first + np.stack(np.indices(values.shape), axis=-1) @ steps)
    assert image.GetMetaData("meshsdf_sign") == "parity"


@pytest.mark.parametrize("suffix", [".mha", ".mhd"])
@pytest.mark.parametrize("compressed", [False, True])
def test_what_simpleitk_writes_is_read(tmp_path, suffix, compressed):
    sitk = pytest.importorskip("SimpleITK", reason="SimpleITK is not installed")
    grid = sphere_grid()
    image = sitk.GetImageFromArray(grid.values.transpose(2, 1, 0))
    image.SetOrigin(grid.origin.tolist())
    image.SetSpacing([0.1] * 3)
    sitk.WriteImage(image, str(tmp_path / f"a{suffix}"), useCompression=compressed)
    back = read_metaimage(tmp_path / f"a{suffix}")
    assert_array_equal(back.values, grid.values)
    assert_allclose(back.origin, grid.origin, rtol=1e-14)
    assert back.voxel_size == pytest.approx(0.1, rel=1e-14)
    assert probe_metaimage(tmp_path / f"a{suffix}")["compressed"] is compressed


@pytest.mark.parametrize("name", META_WAYS)
def test_vtk_finds_the_sphere_where_it_is(tmp_path, name):
    image_module = pytest.importorskip("vtkmodules.vtkIOImage", reason="vtk is not installed")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    grid = sphere_grid()
    reader = image_module.vtkMetaImageReader()
    reader.SetFileName(str(written(WAYS[name], tmp_path, grid)))
    reader.Update()
    image = reader.GetOutput()
    values = vtk_to_numpy(image.GetPointData().GetScalars())
    assert_array_equal(values, grid.values.transpose(2, 1, 0).ravel())
    points = np.array([image.GetPoint(n) for n in range(image.GetNumberOfPoints())])
    assert_centered(values, points)


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("is_big", [False, True])
def test_every_type_and_byte_order_is_read(tmp_path, kind, is_big):
    values = np.abs(VALUES) if kind[0] == "u" else VALUES
    flag = {"ElementByteOrderMSB": "true", "BinaryDataByteOrderMSB": None} if is_big else {}
    notes = []
    data = meta_bytes(packed("<>"[is_big] + kind, values), ElementType=TYPES[kind], **flag)
    grid = read(tmp_path / "a.mha", data, notes)
    assert_array_equal(grid.values, values)
    assert bool(notes) == (kind[0] != "f")
    assert_array_equal(grid.origin, [1, 2, 3])
    assert grid.voxel_size == 0.5


def test_values_may_be_packed_or_text_or_beside(tmp_path):
    data, path = packed("<f4"), tmp_path / "a.mhd"
    text = " ".join(map(str, VALUES.transpose(2, 1, 0).ravel())).encode()
    cases = [
        (zlib.compress(data), {"CompressedData": "True"}),
        (zlib.compress(data), {"CompressedData": "1", "CompressedDataSize": "99"}),
        (text, {"BinaryData": "False"}),
    ]
    for content, flags in cases:
        assert_array_equal(read(path, meta_bytes(content, **flags)).values, VALUES)
        (tmp_path / "b.dat").write_bytes(content)
        beside = meta_bytes(b"", ElementDataFile="b.dat", **flags)
        assert_array_equal(read(path, beside).values, VALUES)
    for skip in ("8", "-1"):
        (tmp_path / "b.dat").write_bytes(b"anything" + data)
        beside = meta_bytes(b"", ElementDataFile="b.dat", HeaderSize=skip)
        assert_array_equal(read(path, beside).values, VALUES)


def test_what_is_not_told_is_assumed_and_said(tmp_path):
    notes = []
    plain = meta_bytes(packed("<f4"), Offset=None, ElementSpacing=None, TransformMatrix=None)
    grid = read(tmp_path / "a.mha", plain, notes)
    assert (grid.voxel_size, grid.origin.tolist()) == (1, [0, 0, 0])
    assert len(notes) == 2
    other = {"Position": "4 5 6", "Offset": None, "ElementSize": "2 2 2", "ElementSpacing": None}
    grid = read(tmp_path / "a.mha", meta_bytes(packed("<f4"), **other))
    assert (grid.voxel_size, grid.origin.tolist()) == (2, [4, 5, 6])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"ElementSpacing": "1 1 2"}, r"no cubes, but 1 x 1 x 2\n(.|\n)*resample"),
        ({"ElementSpacing": "1 1 0"}, "its spacings are 1 x 1 x 0"),
        ({"ElementSpacing": "1 1"}, "ElementSpacing is '1 1', not 3 numbers"),
        ({"TransformMatrix": "0 1 0 1 0 0 0 0 1"}, r"turned or flipped: \(0 1 0\)"),
        ({"Orientation": "-1 0 0 0 -1 0 0 0 1"}, "turned or flipped"),
        ({"TransformMatrix": "2 0 0 0 2 0 0 0 2"}, "TransformMatrix scales by 2"),
        ({"NDims": "2"}, "it has 2 axes and 1 numbers a node"),
        ({"ElementNumberOfChannels": "3"}, "it has 3 axes and 3 numbers a node"),
        ({"ElementType": "MET_STRING"}, "type 'MET_STRING'"),
        ({"ObjectType": "Tube"}, "holds the object 'Tube'"),
        ({"DimSize": "3 4 6"}, "take 288 bytes, but 240 are there"),
        ({"DimSize": None}, "lacks DimSize"),
        ({"CompressedData": "True"}, "while decompressing"),
        ({"BinaryData": "False"}, "not a number|ascii"),
        ({"ElementDataFile": "LIST"}, "several files"),
        ({"ElementDataFile": "a%03d.raw 1 9 1"}, "several files"),
        ({"ElementDataFile": ""}, "names the data file ''"),
        ({"meshsdf_uncertain_voxels": "-3"}, "its meshsdf_uncertain_voxels is '-3'"),
        ({"meshsdf_half_width": "three"}, "its meshsdf_half_width is 'three'"),
    ],
)
def test_what_makes_no_grid_is_refused_in_words(tmp_path, changes, words):
    assert_array_equal(read(tmp_path / "a.mha", meta_bytes(packed("<f4"))).values, VALUES)
    with pytest.raises(IoError, match=words):
        read(tmp_path / "a.mha", meta_bytes(packed("<f4"), **changes))


def test_odd_headers_are_refused(tmp_path):
    path, whole = tmp_path / "a.mha", meta_bytes(packed("<f4"))
    with pytest.raises(IoError, match="says 'NDims' twice"):
        read(path, b"NDims = 3\n" + whole)
    with pytest.raises(IoError, match="holds the line 'what'"):
        read(path, b"what\n" + whole)
    with pytest.raises(IoError, match="does not end with ElementDataFile"):
        read(path, b"NDims = 3\n")


def test_entries_that_are_not_kept_are_named(tmp_path):
    path = tmp_path / "noted.mha"
    write_metaimage(path, Grid(np.zeros((3, 4, 5), np.float32), 0.5, np.zeros(3)))
    path.write_bytes(path.read_bytes().replace(b"NDims", b"Comment = a scan\nNDims", 1))
    said = []
    read_metaimage(path, warn=said.append)
    assert said == ["entries of its header are not kept: Comment"]
