"""meshsdf.io.exr: no bytes whatever can do harm. Chunks that are packed have a checksum; all else
has none, so damage ends in IoError or in a sound grid, of bounded size."""

import json
import struct
import tracemalloc
import zlib

import numpy as np
import pytest

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io.exr import probe_exr, read_exr, write_exr
from meshsdf.io.volume_checks import check_volume
from tests.io.exr_examples import attribute, ball, exr_bytes


def small_files(folder) -> dict[str, bytes]:
    """Bytes of small files of every kind."""
    grid, _ = ball((6, 5, 4))
    write_exr(folder / "atlas.exr", grid)
    write_exr(folder / "parts.exr", grid, layout="parts")
    write_exr(folder / "half.exr", grid, half=True, remap="range", up="y")
    return {path.stem: path.read_bytes() for path in sorted(folder.glob("*.exr"))}


def is_refused(path, data: bytes, read) -> bool:
    """Whether reading fails as it should; whatever is read must be sound."""
    path.write_bytes(data)
    refusal = ""
    try:
        found = read(path)
    except IoError as error:
        refusal = str(error)
    else:
        if read is read_exr:
            check_volume(found)
    assert len(refusal) < 1500
    assert "\x1b" not in refusal
    return bool(refusal)


def test_a_file_cut_anywhere_is_refused(tmp_path):
    random = np.random.default_rng(4)
    files = small_files(tmp_path)
    cuts = [("parts", cut) for cut in (*range(1024), *random.integers(0, len(files["parts"]), 160))]
    for name, data in files.items():
        assert not is_refused(tmp_path / "whole", data, read_exr)
        cuts += [(name, cut) for cut in (*random.integers(0, len(data), 40), len(data) - 1)]
    for name, cut in cuts:
        assert is_refused(tmp_path / "cut", files[name][:cut], read_exr), (name, cut)


def test_a_flipped_byte_is_refused_or_gives_a_sound_grid(tmp_path):
    random = np.random.default_rng(5)
    files = small_files(tmp_path)
    names = sorted(files)
    n_refused = 0
    for number in range(2000):
        data = bytearray(files[names[number % len(names)]])
        # Half of them in the first header, where every byte matters
        reach = 1200 if number // len(names) % 2 else len(data)
        data[random.integers(0, reach)] ^= random.integers(1, 256)
        n_refused += is_refused(tmp_path / "flip", bytes(data), (read_exr, probe_exr)[number % 2])
    assert 200 < n_refused < 1999


def test_random_bytes_are_refused(tmp_path):
    random = np.random.default_rng(6)
    data = small_files(tmp_path)["atlas"]
    for size in (0, 1, 4, 8, 100, 5000):
        noise = random.bytes(size)
        for mixed in (noise, data[:4] + noise, data[:8] + noise, data[:900] + noise):
            assert is_refused(tmp_path / "noise", mixed, read_exr)


FACTS = {
    "format": "meshsdf.exr/1",
    "layout": "atlas",
    "shape": [2, 2, 2],
    "voxel_size": 0.5,
    "origin": [0.0, 0.0, 0.0],
    "lower": [-0.25, -0.25, -0.25],
    "upper": [0.75, 0.75, 0.75],
    "up": "z",
    "columns_along": "+x",
    "rows_along": "+y",
    "slices_along": "+z",
    "slice_size": [2, 2],
    "n_slices": 2,
    "columns": 2,
    "rows": 1,
    "dtype": "float32",
    "remap": None,
    "n_clamped": 0,
    "value_scale": 1.0,
    "value_offset": 0.0,
    "value_range": [0.0, 0.0],
    "background": 0.0,
    "sign": "parity",
    "uncertain_voxels": None,
    "n_inner_faces": 0,
    "half_width": None,
}


def texts(**changes) -> dict[str, str]:
    """The attributes of a sound file, some of them replaced."""
    return {f"meshsdf:{key}": json.dumps(value) for key, value in (FACTS | changes).items()}


def refuse(path, words, read=read_exr, facts=None, **changes):
    """A file made by hand is refused, and takes next to no memory."""
    path.write_bytes(exr_bytes(texts() if facts is None else facts, **changes))
    tracemalloc.start()
    try:
        with pytest.raises(IoError, match=words):
            read(path)
        assert tracemalloc.get_traced_memory()[1] < 8e6
    finally:
        tracemalloc.stop()


def test_a_file_made_by_hand_is_read(tmp_path):
    pixels = np.arange(8, dtype="<f4")
    (tmp_path / "a.exr").write_bytes(exr_bytes(texts(), chunks=[(0, pixels.tobytes())]))
    values = read_exr(tmp_path / "a.exr").values
    assert values[1, 0, 0] == 1  # the next pixel of the first line
    assert values[0, 0, 1] == 2  # the next cell of the atlas
    assert values[0, 1, 0] == 4  # the next line


def test_claims_of_terabytes_are_refused_without_taking_memory(tmp_path):
    path = tmp_path / "a.exr"
    size, side = (1 << 20, 1 << 20), 1 << 30
    refuse(path, "more than .* can hold", size=size, chunks=[])
    window = attribute("dataWindow", "box2i", struct.pack("<4i", 0, 0, 2**31 - 1, 2**31 - 1))
    refuse(path, "more than .* can hold", dataWindow=window)
    window = attribute("dataWindow", "box2i", struct.pack("<4i", 0, 0, -5, 3))
    refuse(path, "its data window is", dataWindow=window)
    window = attribute("dataWindow", "box2i", struct.pack("<4i", -(2**31), 0, 2**31 - 1, 3))
    refuse(path, "its data window is", dataWindow=window)
    facts = texts(layout="parts", columns=None, rows=None, shape=[2, 2, side], n_slices=side)
    facts["meshsdf:upper"] = json.dumps([0.75, 0.75, 0.5 * (side - 0.5)])
    refuse(path, f"it has 1 parts, not {side}", facts=facts)
    long = b"long\0string\0" + struct.pack("<i", 2**31 - 1)
    refuse(path, "bytes are missing after byte", channels=long)
    refuse(path, "takes -1 bytes", channels=b"long\0string\0" + struct.pack("<i", -1))
    refuse(path, "at byte 8 is cut off, or its name has no end", channels=b"n" * 600)


def test_compression_bombs_are_refused_unopened(tmp_path):
    bomb = zlib.compress(bytes(1 << 26), 9)
    refuse(tmp_path / "a.exr", "a chunk of 32 bytes claims to take", chunks=[(0, bomb)])
    short = zlib.compress(bytes(1 << 10), 9)
    assert len(short) < 32
    refuse(tmp_path / "a.exr", "does not give the 32 bytes", chunks=[(0, short)])
    short = zlib.compress(bytes(31), 9)
    refuse(tmp_path / "a.exr", "does not give the 32 bytes", chunks=[(0, short)])
    short = zlib.compress(bytes(32), 9)
    refuse(tmp_path / "a.exr", "does not give the 32 bytes", chunks=[(0, short + b"more")])


def test_chunks_that_are_elsewhere_or_of_another_line_are_refused(tmp_path):
    path = tmp_path / "a.exr"
    for place in (0, 1, 2**62, 2**64 - 1):
        refuse(path, "a chunk at byte|it points to byte|cut off", places=[place])
    refuse(path, "begins with line 1, not 0", chunks=[(1, bytes(32))])
    refuse(path, "claims to take 33", chunks=[(0, bytes(33))])
    refuse(path, "claims to take 0", chunks=[(0, b"")])
    none = attribute("compression", "compression", b"\0")
    refuse(
        path, "a chunk of 16 bytes claims to take 32", compression=none, chunks=[(0, bytes(32))] * 2
    )
    refuse(path, "takes 8 bytes, not 16", compression=none, chunks=[(0, bytes(8))] * 2)
    count = attribute("chunkCount", "int", struct.pack("<i", 2))
    refuse(path, "claims 2 chunks, not 1", chunkCount=count)


def test_what_is_no_plain_image_of_one_channel_is_refused(tmp_path):
    path = tmp_path / "a.exr"
    refuse(path, "does not begin as an .exr file", head=b"PNG\0" + struct.pack("<I", 2))
    for version in (1, 3, 2 | 0x2000):
        refuse(
            path, f"version and flags are {version:#x}", head=struct.pack("<II", 20000630, version)
        )
    for flag in (0x200, 0x800):
        refuse(path, "it is tiled or deep", head=struct.pack("<II", 20000630, 2 | flag))
    refuse(path, "it is tiled or deep", facts=texts() | {"type": "deepscanline"})
    for number, name in ((10, "method 10"), (77, "method 77")):
        packing = attribute("compression", "compression", bytes([number]))
        refuse(path, f"packed with {name}", compression=packing)
    for channels in (
        b"Z\0" + struct.pack("<4i", 2, 0, 1, 1) + b"\0",
        b"Y\0" + struct.pack("<4i", 0, 0, 1, 1) + b"\0",
        b"Y\0" + struct.pack("<4i", 2, 0, 2, 1) + b"\0",
        b"A\0" + struct.pack("<4i", 2, 0, 1, 1) + b"Y\0" + struct.pack("<4i", 2, 0, 1, 1) + b"\0",
        b"",
    ):
        channels = attribute("channels", "chlist", channels)
        refuse(path, "its channels are not the one, Y", channels=channels)
    refuse(path, "has no sound channels", channels=b"")
    refuse(path, "has no sound compression", compression=attribute("compression", "int", bytes(4)))
    twice = attribute("dataWindow", "box2i", bytes(16)) * 2
    refuse(path, "has the attribute dataWindow twice", dataWindow=twice)


def test_facts_that_make_no_grid_are_refused(tmp_path):
    cases = [
        ({"format": "meshsdf.exr/9"}, "its format contradicts"),
        ({"layout": "pile"}, "its layout contradicts"),
        ({"shape": [2, 2, 3]}, "contradicts the rest"),
        ({"shape": [2, 2]}, "its shape is"),
        ({"shape": [2, 2, 0]}, "its shape is"),
        ({"shape": [2, 2, True]}, "its shape is"),
        ({"shape": [2, 2, -2]}, "its shape is"),
        ({"shape": [2, 2, 2.0]}, "its shape is"),
        ({"shape": None}, "its shape is"),
        ({"voxel_size": "1"}, "its voxel_size is 1"),
        ({"voxel_size": -0.5, "lower": [0.25] * 3, "upper": [-0.75] * 3}, "voxel_size is -0.5"),
        ({"voxel_size": float("nan")}, "its voxel_size is nan"),
        ({"origin": [0, 0, float("inf")]}, "its origin is"),
        ({"up": "x"}, "its up x"),
        ({"up": ["z"]}, "its up is"),
        ({"up": "y"}, "its rows_along contradicts|its columns_along contradicts"),
        ({"columns": 0}, "its shape is"),
        ({"columns": 1}, "its rows contradicts"),
        ({"columns": None}, "its layout contradicts"),
        ({"dtype": "float16"}, "it has float32 pixels"),
        ({"remap": -1.0}, "its remap is -1.0, not a length"),
        ({"remap": 1.0}, "its value_scale contradicts"),
        ({"lower": [0, 0, 0]}, "its lower contradicts"),
        ({"sign": ""}, "sign is ''"),
        ({"sign": "\x1b[31m"}, "sign is"),
        ({"half_width": 0}, "half_width is 0.0"),
        ({"uncertain_voxels": -1}, "its uncertain_voxels is -1"),
        ({"n_inner_faces": 1.5}, "its n_inner_faces is 1.5"),
    ]
    for change, words in cases:
        refuse(tmp_path / "a.exr", words, facts=texts(**change))
    facts = texts()
    del facts["meshsdf:up"]
    refuse(tmp_path / "a.exr", "lacks meshsdf:up", facts=facts)
    for text in ("{", "[" * 900, "1" * 5000, ""):
        refuse(tmp_path / "a.exr", "its shape is", facts=texts() | {"meshsdf:shape": text})
    infinite = np.full(8, np.inf, "<f4").tobytes()
    refuse(tmp_path / "a.exr", "values are infinite", chunks=[(0, infinite)])


def test_a_multi_part_file_of_the_wrong_parts_is_refused(tmp_path):
    grid = Grid(np.zeros((3, 4, 5), np.float32), 1.0, np.zeros(3))
    write_exr(tmp_path / "a.exr", grid, layout="parts")
    data = (tmp_path / "a.exr").read_bytes()
    assert is_refused(tmp_path / "b.exr", data.replace(b"[3, 4, 5]", b"[3, 5, 4]"), read_exr)
    # The chunk of the second part claims to be of the third
    second = struct.pack("<ii", 1, 0)
    at = data.rindex(second)
    swapped = data[:at] + struct.pack("<ii", 2, 0) + data[at + 8 :]
    (tmp_path / "b.exr").write_bytes(swapped)
    with pytest.raises(IoError, match="is of part 2, not 1"):
        read_exr(tmp_path / "b.exr")
