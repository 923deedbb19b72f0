"""meshsdf.io.exr: volumes that another program saved again, in packings that we do not write."""

import struct

import numpy as np
import OpenEXR
import pytest

from meshsdf.errors import IoError
from meshsdf.io import exr_process
from meshsdf.io.exr import read_exr, write_exr
from meshsdf.io.exr_header import COMPRESSIONS
from meshsdf.io.exr_process import LOSSY
from meshsdf.io.volume_checks import check_volume
from tests.io.exr_examples import attribute, ball, exr_bytes, images_of, random_grid
from tests.io.test_exr_damage import texts

PACKINGS = ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB")
APART = PACKINGS[4:]


def saved_again(path, packing):
    """The file as another program would save it: the same parts and words, packed otherwise."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        parts = []
        for part in file.parts:
            header = dict(part.header)
            header["compression"] = getattr(OpenEXR, f"{packing}_COMPRESSION")
            pixels = {"Y": np.array(part.channels["Y"].pixels)}
            parts.append(OpenEXR.Part(header, pixels, header.get("name", "one")))
    out = path.with_name(f"{packing}.exr")
    (OpenEXR.File(parts) if len(parts) > 1 else OpenEXR.File(parts[0].header, pixels)).write(
        str(out)
    )
    return out


@pytest.mark.parametrize("layout", ["atlas", "parts"])
@pytest.mark.parametrize("half", [False, True], ids=["float", "half"])
@pytest.mark.parametrize("packing", PACKINGS)
def test_every_packing_gives_the_pixels_that_openexr_finds(tmp_path, packing, half, layout):
    grid, _ = ball((37, 6, 35)) if layout == "atlas" else ball((37, 40, 3))
    write_exr(tmp_path / "a.exr", grid, layout=layout, half=half, columns=None)
    path, notes = saved_again(tmp_path / "a.exr", packing), []
    back = read_exr(path, warn=notes.append)
    images = images_of(path)
    if layout == "parts":
        found = np.stack(images)
    else:
        height = grid.values.shape[1]
        rows = images[0].reshape(-1, height, images[0].shape[1] // 37, 37).transpose(0, 2, 1, 3)
        found = rows.reshape(-1, height, 37)[:35]
    np.testing.assert_array_equal(back.values, found.transpose(2, 1, 0))
    whole = read_exr(tmp_path / "a.exr").values
    changes = ("float16" if half else "float32") in LOSSY.get(packing, ())
    assert notes == [f"its pixels are packed with {packing}, which changes values"] * changes
    assert np.array_equal(back.values, whole) or changes
    np.testing.assert_allclose(back.values, whole, rtol=0, atol=0.05 * np.abs(whole).max())
    assert (back.voxel_size, back.origin.tolist()) == (grid.voxel_size, grid.origin.tolist())


def test_numbers_of_every_size_come_through_packings_that_lose_nothing(tmp_path):
    grid = random_grid(6, (23, 19, 17), gaps=True)
    write_exr(tmp_path / "a.exr", grid)
    for packing in ("RLE", "PIZ", "B44", "B44A"):
        back = read_exr(saved_again(tmp_path / "a.exr", packing))
        assert back.values.tobytes() == grid.values.tobytes(), packing


# Damage


def refusal(path, data: bytes) -> str:
    """In which words a file is refused; whatever is read must be sound."""
    path.write_bytes(data)
    told = ""
    try:
        check_volume(read_exr(path))
    except IoError as error:
        told = error.what
    assert len(told) < 1000
    return told


@pytest.fixture
def packed(tmp_path):
    """Bytes of a small file in every packing."""
    grid, _ = ball((12, 11, 10))
    write_exr(tmp_path / "a.exr", grid)
    return {name: saved_again(tmp_path / "a.exr", name).read_bytes() for name in PACKINGS}


def test_a_file_cut_anywhere_is_refused(tmp_path, packed):
    random = np.random.default_rng(0)
    for packing, data in packed.items():
        cuts = [*range(1024), *random.integers(1024, len(data), 200)]
        for cut in cuts if packing in ("RLE", "PIZ") else cuts[::7]:
            assert refusal(tmp_path / "cut.exr", data[:cut]), (packing, cut)


def test_a_flipped_byte_in_runs_is_refused_or_gives_a_sound_grid(tmp_path, packed):
    random, data = np.random.default_rng(1), packed["RLE"]
    n_refused = 0
    for number in range(2000):
        flipped, reach = bytearray(data), 1200 if number % 2 else len(data)
        flipped[random.integers(0, reach)] ^= random.integers(1, 256)
        n_refused += bool(refusal(tmp_path / "flip.exr", bytes(flipped)))
    assert 200 < n_refused < 1999


@pytest.mark.parametrize("packing", APART)
def test_a_flipped_byte_in_other_packings_is_refused_or_gives_a_sound_grid(
    tmp_path, packed, packing
):
    random, data = np.random.default_rng(2), packed[packing]
    for number in range(40):
        # Most of them in the header, whose faults need no other process to be seen
        reach = len(data) if number % 8 == 0 else 1200
        flipped = bytearray(data)
        flipped[random.integers(0, reach)] ^= random.integers(1, 256)
        refusal(tmp_path / "flip.exr", bytes(flipped))


@pytest.mark.parametrize("packing", ["PIZ", "PXR24", "DWAA", "DWAB"])
def test_chunks_that_openexr_passes_over_with_a_word_are_refused(tmp_path, packing):
    number = COMPRESSIONS.index(packing)
    packed_so = attribute("compression", "compression", bytes([number]))
    for junk in (b"\xff" * 31, bytes(20), np.random.default_rng(0).bytes(30)):
        data = exr_bytes(texts(), compression=packed_so, chunks=[(0, junk)])
        words = refusal(tmp_path / "a.exr", data)
        assert "a chunk is damaged (OpenEXR cannot unpack it)" in words
    # A chunk as long as its lines is stored as it is
    pixels = np.arange(8, dtype="<f4")
    data = exr_bytes(texts(), compression=packed_so, chunks=[(0, pixels.tobytes())])
    assert not refusal(tmp_path / "a.exr", data)
    assert read_exr(tmp_path / "a.exr").values[0, 0, 1] == 2


def test_runs_that_end_within_or_give_too_much_or_too_little_are_refused(tmp_path):
    runs = attribute("compression", "compression", b"\x01")
    for line in (b"\x0e\0", b"\x10\0", b"\xf8abc", b"\x0f", b"\x0f\0\x0f"):
        data = exr_bytes(texts(), compression=runs, chunks=[(0, line), (1, line)])
        assert "does not give the 16 bytes" in refusal(tmp_path / "a.exr", data), line
    # Sixteen equal steps of 128, which is no step at all
    data = exr_bytes(
        texts(), compression=runs, chunks=[(0, b"\0\0\x0e\x80"), (1, b"\xfe\0\x80\x0d\x80")]
    )
    assert not refusal(tmp_path / "a.exr", data)
    assert (read_exr(tmp_path / "a.exr").values == 0).all()


def test_memory_and_time_of_the_other_process_are_bounded(tmp_path, packed, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setattr(exr_process, "ROOM", 1 << 24)
        assert "OpenEXR cannot unpack it" in refusal(tmp_path / "a.exr", packed["PIZ"])
    with monkeypatch.context() as patched:
        patched.setattr(exr_process, "LEAST_SECONDS", 0)
        assert "its pixels were not unpacked in 0 s" in refusal(tmp_path / "a.exr", packed["PIZ"])
    with monkeypatch.context() as patched:
        patched.setattr(exr_process.sys, "executable", str(tmp_path / "none"))
        assert "none can be started" in refusal(tmp_path / "a.exr", packed["PIZ"])
    assert not refusal(tmp_path / "a.exr", packed["PIZ"])


def test_chunks_that_overlap_are_refused(tmp_path):
    packed_so = attribute("compression", "compression", bytes([COMPRESSIONS.index("PIZ")]))
    n = 40
    facts = {"shape": [2, 32 * n, 2], "upper": [0.75, 0.5 * (32 * n - 0.5), 0.75]}
    facts = texts(**facts, slice_size=[2, 32 * n])
    options = {"size": (4, 32 * n), "compression": packed_so, "chunks": [(0, b"")] * n}
    start = len(exr_bytes(facts, **options))
    # Each chunk holds the heads of those behind it
    heads = b"".join(struct.pack("<ii", 32 * number, 500) for number in range(n))
    options |= {"places": [start + 8 * number for number in range(n)], "tail": heads + bytes(500)}
    assert "its chunks overlap" in refusal(tmp_path / "a.exr", exr_bytes(facts, **options))
