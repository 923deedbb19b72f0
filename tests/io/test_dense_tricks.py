"""Formats of full grids: files made to deceive, by what they claim or name."""

import bz2
import struct
import time
import tracemalloc
import zlib

import numpy as np
import pytest

from meshsdf.errors import IoError
from meshsdf.io.unpacking import LARGEST_RATIO, Inflater
from tests.io.dense_examples import WAYS, files_of

KEYS = [
    "nrrd",
    "nrrd plain",
    "nhdr",
    "mha",
    "mhd plain",
    "vti",
    "vti plain",
    "raw",
    "dds",
    "vf",
    "sdf",
]


def refuse(way, path, data, words):
    """A file is refused in these words, and takes next to no memory."""
    path.write_bytes(data)
    tracemalloc.start()
    try:
        with pytest.raises(IoError, match=words):
            way.read(path)
        assert tracemalloc.get_traced_memory()[1] < 8e6
    finally:
        tracemalloc.stop()


HUGE = ["99999 99999 99999", "999999999999 999999999999 9", "9" * 18 + " 1 1"]


def test_counts_of_terabytes_are_refused_without_taking_memory(tmp_path):
    for key in KEYS:
        way, path, files = files_of(key, tmp_path)
        header = next((file for file in files if file.suffix == ".json"), path)
        data = header.read_bytes()
        for counts in HUGE:
            if key == "vf":
                huge = data[:4] + struct.pack("<3H", 65535, 65535, 65535) + data[10:]
            elif key == "dds":
                header = path
                huge = data = path.read_bytes()
                numbers = [min(int(n), 2**32 - 1) for n in counts.split()]
                huge = data[:12] + struct.pack("<2I", *numbers[:2]) + data[20:]
                huge = huge[:24] + struct.pack("<I", numbers[2]) + huge[28:]
            elif key == "raw":
                numbers = ", ".join(counts.split()).encode()
                old = data[data.index(b'"shape": [') : data.index(b"]") + 1]
                huge = data.replace(old, b'"shape": [' + numbers + b"]")
            elif key.startswith("vti"):
                extent = " ".join(f"0 {int(n) - 1}" for n in counts.split()).encode()
                huge = data.replace(b"0 3 0 4 0 5", extent)
            else:
                huge = data.replace(b"4 5 6", counts.encode())
            assert huge != data
            path = header if key != "raw" else path
            header.write_bytes(huge)
            refuse(way, path, path.read_bytes(), "values take|claims .* nodes")
        for file in files:
            file.unlink()


def test_compression_bombs_are_refused(tmp_path):
    n = 1 << 25  # float32, so 128 MiB of zeros
    header = "NRRD0005\ntype: float\ndimension: 3\nsizes: {} 1 1\nencoding: {}\nendian: little\n\n"
    zeros = bytes(4 * n)
    deflated = zlib.compress(zeros, 9)
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    gzipped = packer.compress(zeros) + packer.flush()
    assert len(gzipped) * LARGEST_RATIO < len(zeros)
    del zeros
    nrrd, path = WAYS["nrrd"], tmp_path / "a.nrrd"
    for encoding, data in [("gzip", gzipped), ("bzip2", bz2.compress(bytes(1 << 20)))]:
        refuse(nrrd, path, header.format(n, encoding).encode() + data, "are allowed for")
    # What says less than it holds stops where it should
    refuse(nrrd, path, header.format(9, "gzip").encode() + gzipped, "more values than it says")
    mha = (
        "NDims = 3\nDimSize = {} 1 1\nElementType = MET_FLOAT\nCompressedData = True\n"
        "ElementDataFile = LOCAL\n"
    )
    path = tmp_path / "a.mha"
    refuse(WAYS["mha"], path, mha.format(n).encode() + deflated, "are allowed for")
    refuse(WAYS["mha"], path, mha.format(9).encode() + deflated, "more values than it says")
    way, path, _ = files_of("vti", tmp_path)
    whole = path.read_bytes()
    at = whole.index(b"   _") + 4
    cases = [
        ((1, 480, 480, len(deflated)), "does not give its 480"),
        ((1, 1 << 40, 480, len(deflated)), "does not give its 480"),
        ((2, 1 << 40, 480, 9, 9), "1 blocks give|2 blocks give"),
        ((1 << 60, 1, 0), "its values take"),
        ((1, 480, 480, 1 << 60), "1 blocks give"),
        ((0, 480, 0), "0 blocks give 0 bytes"),
    ]
    for numbers, words in cases:
        start = whole[:at] + struct.pack(f"<{len(numbers)}Q", *numbers)
        refuse(way, path, start + deflated, words)


def test_many_empty_frames_do_not_last(tmp_path):
    header = b"NRRD0005\ntype: float\ndimension: 3\nsizes: 9 1 1\nencoding: gz\nendian: little\n\n"
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    empty = packer.flush()
    start = time.perf_counter()
    refuse(WAYS["nrrd"], tmp_path / "a.nrrd", header + empty * 100_000, "more than 4096 frames")
    assert time.perf_counter() - start < 5


def test_frames_in_a_row_are_one_stream(tmp_path):
    data = np.random.default_rng(4).bytes(200_000)
    path = tmp_path / "a.gz"
    pieces = [data[:7], data[7:70_000], b"", data[70_000:]]
    packed = b"".join(
        packer.compress(piece) + packer.flush()
        for piece in pieces
        for packer in [zlib.compressobj(1, zlib.DEFLATED, 31)]
    )
    path.write_bytes(packed)
    for size in (1000, 65_536, 200_000):
        with open(path, "rb") as file:
            stream = Inflater(file)
            found = b"".join(stream.read(size) for _ in range(-(-len(data) // size)))
            stream.finish()
        assert found == data


def test_xml_that_plays_tricks_is_refused(tmp_path):
    way, path, _ = files_of("vti plain", tmp_path)
    whole = path.read_bytes()
    declared, rest = whole.split(b"\n", 1)
    laughs = b'<!DOCTYPE a [<!ENTITY b "ha"><!ENTITY c "&b;&b;&b;&b;">]>\n'
    refuse(way, path, declared + laughs + rest, "declares a document type")
    refuse(way, path, declared + b"<!--" + b"x" * (3 << 20), "longer than|damaged")
    refuse(way, path, declared + b"<VTKFile>" + b"<a>" * 20_000, "more than 10000 elements")
    refuse(way, path, b'<?xml version="1.0" encoding="nonsense"?>' + rest, "XML is damaged")
    refuse(way, path, b'<?xml version="1.0" encoding="rot13"?>' + rest, "XML is damaged")
    refuse(
        way,
        path,
        whole.replace(b"<VTKFile", b"<Other").replace(b"</VTKFile", b"</Other"),
        "it is the XML of 'Other'",
    )
    refuse(way, path, whole.replace(b"ImageData", b"PolyData"), "PolyData, not ImageData")
    refuse(way, path, whole.replace(b"</Piece>", b"</Piece><Piece></Piece>"), "into 2 pieces")
    refuse(way, path, whole.replace(b'offset="0"', b'offset="99999"'), "beyond the end")
    refuse(way, path, whole.replace(b'offset="0"', b'offset="-9"'), "beyond the end")


@pytest.mark.parametrize("name", ["../a.raw", "/dev/zero", "C:\\a.raw", "b\\..\\..\\a.raw", "\\a"])
def test_a_header_cannot_name_a_file_elsewhere(tmp_path, name):
    for key in ("nhdr plain", "mhd plain"):
        way, path, _ = files_of(key, tmp_path)
        header = path.read_bytes().replace(b"a.raw", name.encode())
        refuse(way, path, header, "which is not in its folder")


def test_a_header_cannot_name_a_folder_or_nothing(tmp_path):
    (tmp_path / "b").mkdir()
    for key, there in (("nhdr plain", "a.raw"), ("mhd plain", "a.raw")):
        way, path, _ = files_of(key, tmp_path)
        whole = path.read_bytes()
        refuse(way, path, whole.replace(there.encode(), b"b"), "this is a folder")
        refuse(way, path, whole.replace(there.encode(), b"c.raw"), "no such file")
        refuse(way, path, whole.replace(there.encode(), b"LIST"), "in several files")
        refuse(way, path, whole.replace(there.encode(), b"\x1b[31m"), "names the data file")


def test_deep_brackets_and_long_numbers_are_no_json_of_ours(tmp_path):
    way, path, _ = files_of("raw", tmp_path)
    header = path.with_suffix(".raw.json")
    whole = header.read_bytes()
    cases = [
        (b"[" * 200_000, "nested too deeply"),
        (b"[1, 2]", "no JSON object"),
        (whole + b" " * (1 << 20), "longer than"),
        (whole.replace(b'"voxel_size": 0.5', b'"voxel_size": NaN'), "spacings are nan"),
        (whole.replace(b'"voxel_size": 0.5', b'"voxel_size": -1'), "spacings are -1"),
        (whole.replace(b'"voxel_size": 0.5', b'"voxel_size": ' + b"9" * 400), "too large"),
        (whole.replace(b'"voxel_size": 0.5', b'"voxel_size": true'), "its voxel_size is true"),
        (whole.replace(b'"float32"', b'"object"'), 'its dtype is "object"'),
        (whole.replace(b'"parity"', b'"\\u001b[31m"'), "its meshsdf_sign is"),
        (whole.replace(b"meshsdf.raw/1", b"meshsdf.raw/2"), "its format is .*raw/2"),
        (
            whole.replace(b'"half_width": 2.5', b'"half_width": -2.5'),
            "meshsdf_half_width is '-2.5'",
        ),
        (whole.replace(b'"half_width": 2.5', b'"half_width": {}'), "half_width is '{}'"),
    ]
    for data, words in cases:
        assert data != whole
        header.write_bytes(data)
        with pytest.raises(IoError, match=words):
            way.read(path)
    header.write_bytes(whole)
    path.write_bytes(path.read_bytes() + b"more")
    with pytest.raises(IoError, match=r"it has 484 bytes, its \.json tells 480"):
        way.read(path)
