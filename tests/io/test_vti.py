"""meshsdf.io.vti beside VTK, and the many ways in which it is written."""

import base64
import struct
import zlib

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io.vti import probe_vti, read_vti, write_vti
from tests.io.dense_examples import WAYS, assert_centered, assert_same_grid, sphere_grid, written

VALUES = np.random.default_rng(0).integers(-99, 99, (3, 4, 5))
BYTES = VALUES.transpose(2, 1, 0).astype("<f4").tobytes()


def vtk_parts():
    """VTK's reader and writer of XML image data, its image, and arrays to and from NumPy."""
    xml = pytest.importorskip("vtkmodules.vtkIOXML", reason="vtk is not installed")
    from vtkmodules.util import numpy_support
    from vtkmodules.vtkCommonDataModel import vtkImageData

    return xml, vtkImageData, numpy_support


def read(path, data: bytes | str, notes: list | None = None, **options) -> Grid:
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return read_vti(path, warn=[].append if notes is None else notes.append, **options)


def vti_text(
    array: str = '<DataArray type="Float32" Name="d" format="ascii">{}</DataArray>',
    *,
    image: str = 'WholeExtent="0 2 0 3 0 4" Origin="1 2 3" Spacing="0.5 0.5 0.5"',
    head: str = 'type="ImageData" version="0.1" byte_order="LittleEndian"',
    section: str = "PointData",
    data: str = "",
) -> str:
    """A file made by hand."""
    values = " ".join(map(str, VALUES.transpose(2, 1, 0).ravel()))
    return (
        f'<?xml version="1.0"?>\n<VTKFile {head}>\n<ImageData {image}><Piece><{section}>'
        f"{array.replace('{}', values)}</{section}></Piece></ImageData>\n{data}</VTKFile>"
    )


@pytest.mark.parametrize("name", ["vti", "vti plain"])
def test_vtk_finds_the_sphere_where_it_is(tmp_path, name):
    xml, _, numpy_support = vtk_parts()
    grid = sphere_grid()
    reader = xml.vtkXMLImageDataReader()
    reader.SetFileName(str(written(WAYS[name], tmp_path, grid)))
    reader.Update()
    image = reader.GetOutput()
    scalars = image.GetPointData().GetScalars()
    assert scalars.GetName() == "distance"
    values = numpy_support.vtk_to_numpy(scalars)
    assert values.dtype == np.float32
    assert_array_equal(values, grid.values.transpose(2, 1, 0).ravel())
    assert_centered(values, np.array([image.GetPoint(n) for n in range(len(values))]))
    words = image.GetFieldData().GetAbstractArray("meshsdf_sign")
    assert words.GetValue(0) == "parity"


MODES = ("ascii", "binary", "appended raw", "appended base64")


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("compressor", [None, "vtkZLibDataCompressor"])
@pytest.mark.parametrize("header", [32, 64])
@pytest.mark.parametrize("is_big", [False, True])
def test_what_vtk_writes_is_read(tmp_path, mode, compressor, header, is_big):
    xml, vtk_image, numpy_support = vtk_parts()
    grid = sphere_grid()
    image = vtk_image()
    # An extent that does not begin at 0: the origin is that of node (0, 0, 0), which is not there
    image.SetExtent(2, 28, -3, 22, 5, 32)
    image.SetSpacing(0.1, 0.1, 0.1)
    image.SetOrigin(*(grid.origin - 0.1 * np.array([2, -3, 5])))
    scalars = numpy_support.numpy_to_vtk(grid.values.transpose(2, 1, 0).ravel(), deep=True)
    scalars.SetName("phi")
    image.GetPointData().SetScalars(scalars)
    writer = xml.vtkXMLImageDataWriter()
    writer.SetFileName(str(tmp_path / "a.vti"))
    writer.SetInputData(image)
    writer.SetDataMode({"ascii": 0, "binary": 1}.get(mode, 2))
    writer.SetEncodeAppendedData("base64" in mode)
    writer.SetHeaderType(header)
    writer.SetByteOrder(0 if is_big else 1)
    writer.SetBlockSize(1 << 12)
    if compressor is None:
        writer.SetCompressorTypeToNone()
    else:
        writer.SetCompressorTypeToZLib()
    assert writer.Write() == 1
    found = read_vti(tmp_path / "a.vti")
    assert_array_equal(found.values, grid.values)
    assert_allclose(found.origin, grid.origin, rtol=1e-12)
    assert found.voxel_size == 0.1
    assert probe_vti(tmp_path / "a.vti")["array"] == "phi"


@pytest.mark.parametrize("mode", MODES)
def test_what_is_ours_survives_a_pass_through_vtk(tmp_path, mode):
    xml, _, _ = vtk_parts()
    plain = sphere_grid()
    grid = Grid(plain.values, plain.voxel_size, plain.origin, "parity", 7, 3, 2.75)
    write_vti(tmp_path / "a.vti", grid)
    reader = xml.vtkXMLImageDataReader()
    reader.SetFileName(str(tmp_path / "a.vti"))
    writer = xml.vtkXMLImageDataWriter()
    writer.SetInputConnection(reader.GetOutputPort())
    writer.SetFileName(str(tmp_path / "b.vti"))
    writer.SetDataMode({"ascii": 0, "binary": 1}.get(mode, 2))
    writer.SetEncodeAppendedData("base64" in mode)
    assert writer.Write() == 1
    assert_same_grid(read_vti(tmp_path / "b.vti"), grid)


def test_every_layout_of_data_is_read(tmp_path):
    sizes = [len(BYTES[:100]), len(BYTES[100:200]), len(BYTES[200:])]
    blocks = [zlib.compress(BYTES[at : at + 100]) for at in (0, 100, 200)]
    assert sizes == [100, 100, 40]
    array = '<DataArray type="Float32" Name="d" format="appended" offset="{at}"/>'
    for letter, name in [("I", "UInt32"), ("Q", "UInt64")]:
        plain = struct.pack(f"<{letter}", len(BYTES)) + BYTES
        header = struct.pack(f"<6{letter}", 3, 100, 40, *map(len, blocks))
        whole = struct.pack(f"<4{letter}", 1, 240, 240, len(zlib.compress(BYTES)))
        base = 'type="ImageData" version="1.0" byte_order="LittleEndian"'
        head = f'{base} header_type="{name}"'
        squeezed = f'{head} compressor="vtkZLibDataCompressor"'
        apart = base64.b64encode(header) + base64.b64encode(b"".join(blocks))
        cases = [
            (head, "raw", plain),
            (head, "base64", base64.b64encode(plain)),
            (head, "base64", base64.b64encode(plain[: -len(BYTES)]) + base64.b64encode(BYTES)),
            (squeezed, "raw", header + b"".join(blocks)),
            (squeezed, "raw", whole + zlib.compress(BYTES)),
            (squeezed, "base64", apart),
        ]
        for at in (0, 8):
            for head_text, encoding, data in cases:
                start, end = f'<AppendedData encoding="{encoding}">\n  _', "\n</AppendedData>"
                text = vti_text(array.replace("{at}", str(at)), head=head_text, data="@")
                before, after = text.split("@")
                content = start.encode() + b"AAAAAAAA"[:at] + data + end.encode()
                grid = read(tmp_path / "a.vti", before.encode() + content + after.encode())
                assert_array_equal(grid.values, VALUES, err_msg=f"{name} {encoding}")
                inline = '<DataArray type="Float32" Name="d" format="binary">\n {}\n</DataArray>'
                if encoding == "base64":
                    text = vti_text(inline.replace("{}", data.decode()), head=head_text)
                    assert_array_equal(read(tmp_path / "a.vti", text).values, VALUES)


def test_values_in_cells_lie_half_a_voxel_further_in(tmp_path):
    notes = []
    image = 'WholeExtent="0 3 0 4 0 5" Origin="1 2 3" Spacing="0.5 0.5 0.5"'
    grid = read(tmp_path / "a.vti", vti_text(image=image, section="CellData"), notes)
    assert_array_equal(grid.values, VALUES)
    assert_array_equal(grid.origin, [1.25, 2.25, 3.25])
    assert notes == ["its values stand in cells; their middles become nodes"]


def test_an_array_is_chosen_by_name_or_as_the_file_says(tmp_path):
    one = '<DataArray type="Float32" Name="{n}" format="ascii">{}</DataArray>'
    three = '<DataArray type="Float32" Name="v" NumberOfComponents="3" format="ascii"/>'
    arrays = three + one.replace("{n}", "a") + one.replace("{n}", "b").replace("Float32", "Int16")
    notes, text = [], vti_text(arrays)
    assert read(tmp_path / "a.vti", text, notes).values.dtype == np.float32
    assert notes == ["read the array 'a'; there are 'v' (3), 'a' (1), 'b' (1)"]
    notes = []
    read(tmp_path / "a.vti", text.replace("<PointData", '<PointData Scalars="b"'), notes)
    assert notes[-1] == "its int16 values are read as float32"
    assert read(tmp_path / "a.vti", text, grid="b").values.shape == (3, 4, 5)
    with pytest.raises(IoError, match="there is no array 'c'"):
        read(tmp_path / "a.vti", text, grid="c")
    with pytest.raises(IoError, match="'v' holds 3 numbers a node"):
        read(tmp_path / "a.vti", text, grid="v")
    with pytest.raises(IoError, match=r"one number a node; there are 'v' \(3\)"):
        read(tmp_path / "a.vti", vti_text(three))
    with pytest.raises(IoError, match="one number a node"):
        probe_vti(tmp_path / "a.vti")


def test_a_name_of_any_letters_is_kept(tmp_path):
    grid = sphere_grid()
    name = "<dïs\"tän'ce> & more"
    write_vti(tmp_path / "a.vti", grid, name=name)
    assert probe_vti(tmp_path / "a.vti")["array"] == name
    assert_same_grid(read_vti(tmp_path / "a.vti", grid=name), grid)
    with pytest.raises(IoError, match="cannot have the name"):
        write_vti(tmp_path / "b.vti", grid, name="a\nb")


def test_values_of_several_blocks_come_back(tmp_path):
    values = np.random.default_rng(1).normal(size=(70, 90, 110))
    grid = Grid(values, 1.0, np.zeros(3))
    write_vti(tmp_path / "a.vti", grid)
    assert_same_grid(read_vti(tmp_path / "a.vti"), grid)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"image": 'WholeExtent="0 2 0 3 0 4" Origin="0 0 0" Spacing="1 1 2"'}, "but 1 x 1 x 2"),
        ({"image": 'WholeExtent="0 2 0 3 0 4" Origin="0 0 0"'}, "lacks Spacing"),
        ({"image": 'WholeExtent="0 2 0 3" Origin="0 0 0" Spacing="1 1 1"'}, "not 6 whole numbers"),
        (
            {
                "image": 'WholeExtent="0 2 0 3 0 4" Origin="0 0 0" Spacing="1 1 1" '
                'Direction="0 1 0 1 0 0 0 0 1"'
            },
            "turned or flipped: 0 1 0 1",
        ),
        (
            {"image": 'WholeExtent="0 2 0 3 0 5" Origin="0 0 0" Spacing="1 1 1"'},
            "holds 60|values take|not a number",
        ),
        ({"image": 'WholeExtent="0 2 0 3 4 0" Origin="0 0 0" Spacing="1 1 1"'}, "x -3 nodes"),
        ({"head": 'type="ImageData" byte_order="Middle"'}, "byte order is 'Middle'"),
        ({"array": '<DataArray type="String" Name="d" format="ascii">{}</DataArray>'}, "'String'"),
        ({"array": '<DataArray type="Float32" Name="d" format="odd"/>'}, "is 'odd'"),
        ({"array": '<DataArray type="Float32" Name="d" format="appended"/>'}, "is 'appended'"),
        ({"array": '<DataArray type="Float32" format="binary">!</DataArray>'}, "are there|cut off"),
        ({"array": ""}, "there are none"),
        ({"array": '<DataArray type="Float32" format="ascii">{} 1</DataArray>'}, "not a number"),
        (
            {"array": f'<DataArray type="Float32">{"1e99 " * 60}</DataArray>'},
            "values are infinite",
        ),
    ],
)
def test_what_makes_no_grid_is_refused_in_words(tmp_path, changes, words):
    assert_array_equal(read(tmp_path / "a.vti", vti_text()).values, VALUES)
    with pytest.raises(IoError, match=words):
        read(tmp_path / "a.vti", vti_text(**changes))


def test_pieces_and_packers_that_are_not_known_are_named(tmp_path):
    cut = vti_text().replace("<Piece>", '<Piece Extent="0 1 0 3 0 4">')
    with pytest.raises(IoError, match=r"holds only the piece \(0, 1, 0, 3, 0, 4\)"):
        read(tmp_path / "a.vti", cut)
    lz4 = vti_text(
        '<DataArray type="Float32" Name="d" format="binary">AAAA</DataArray>',
        head='type="ImageData" compressor="vtkLZ4DataCompressor"',
    )
    with pytest.raises(IoError, match=r"packed by vtkLZ4DataCompressor\n(.|\n)*vtkZLibData"):
        read(tmp_path / "a.vti", lz4)
