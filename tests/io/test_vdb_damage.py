"""meshsdf.io.vdb: no bytes whatever can do harm. Nothing in a ``.vdb`` file is checksummed, so
damage ends in IoError or in a sound volume, of bounded size and after bounded time."""

import struct
import tracemalloc
import zlib

import numpy as np
import pytest

from meshsdf.errors import IoError
from meshsdf.grid import BrickIndex, Grid, NarrowBand
from meshsdf.io.vdb import probe_vdb, read_vdb, read_vdb_grids, write_vdb, write_vdb_grids
from meshsdf.io.vdb_grid import VdbGrid
from meshsdf.io.volume_checks import check_index, check_volume
from tests.io.vdb_examples import text, vdb_bytes


def small_band() -> NarrowBand:
    """Four bricks, some nodes active; three bricks beside them are inside."""
    coordinates = np.array([[0, 0, 0], [0, 0, 1], [0, 3, 0], [1, 0, 0]])
    index = BrickIndex.from_coordinates(coordinates, np.array([[0, 1, 0, 3]]))
    random = np.random.default_rng(0)
    values = np.where(random.random((4, 8, 8, 8)) < 0.5, np.float32(-1.5), np.float32(1.5))
    active = random.integers(0, 2**64, (4, 8), np.uint64) & random.integers(
        0, 2**64, (4, 8), np.uint64
    )
    return NarrowBand(index, values.astype(np.float32), active, 0.5, np.zeros(3), 3.0, "parity")


def small_files(folder):
    """Bytes of small files of every kind."""
    band = small_band()
    fog = Grid(np.random.default_rng(1).random((9, 9, 5), np.float32), 0.5, np.ones(3))
    fog.values[:, 4:] = 0
    for name in ("none", "active", "zip", "blosc"):
        write_vdb(folder / f"{name}.vdb", band, compression=name)
    write_vdb(folder / "half.vdb", band, compression="zip", half=True)
    write_vdb(folder / "fog.vdb", fog, grid_class="fog volume")
    vectors = VdbGrid(
        "Cd",
        band.index,
        np.random.default_rng(2).random((4, 8, 8, 8, 3), np.float32),
        band.active,
        np.zeros(3, np.float32),
        np.eye(4),
    )
    write_vdb_grids(folder / "vectors.vdb", [vectors])
    return {path.stem: path.read_bytes() for path in sorted(folder.glob("*.vdb"))}


READERS = (read_vdb, read_vdb_grids, probe_vdb)


def is_refused(path, data: bytes, read) -> bool:
    """Whether reading fails as it should; whatever is read must be sound."""
    path.write_bytes(data)
    try:
        found = read(path)
    except IoError as error:
        refusal = str(error)
    else:
        refusal = None
        if read is read_vdb:
            check_volume(found)
        elif read is read_vdb_grids:
            for grid in found:
                check_index(grid.index)
    assert refusal is None or (len(refusal) < 3000 and "\x1b" not in refusal)
    return refusal is not None


def refuse(path, words, read=read_vdb_grids, **parts):
    """A file made by hand, some parts replaced, is refused, and takes next to no memory."""
    path.write_bytes(vdb_bytes(**parts))
    tracemalloc.start()
    try:
        with pytest.raises(IoError, match=words):
            read(path)
        assert tracemalloc.get_traced_memory()[1] < 8e6
    finally:
        tracemalloc.stop()


def test_a_file_cut_anywhere_is_refused(tmp_path):
    random = np.random.default_rng(4)
    files = small_files(tmp_path)
    whole = files.pop("active")
    cuts = [("active", cut) for cut in (*range(1024), *random.integers(0, len(whole), 200))]
    for name, data in files.items():
        assert not is_refused(tmp_path / "whole", data, read_vdb_grids)
        cuts += [(name, cut) for cut in (*random.integers(0, len(data), 40), len(data) - 1)]
    files["active"] = whole
    for number, (name, cut) in enumerate(cuts):
        read = READERS[number % 3]
        assert is_refused(tmp_path / "cut", files[name][:cut], read), (name, cut, read)


def test_a_flipped_byte_is_refused_or_gives_a_sound_volume(tmp_path):
    random = np.random.default_rng(5)
    files = small_files(tmp_path)
    names = sorted(files)
    n_refused = 0
    for number in range(2000):
        data = bytearray(files[names[number % len(names)]])
        # Half of them before the masks of the first node, where every byte matters
        reach = 700 if number // len(names) % 2 else len(data)
        data[random.integers(0, reach)] ^= random.integers(1, 256)
        n_refused += is_refused(tmp_path / "flip", bytes(data), READERS[number // 12 % 3])
    assert 200 < n_refused < 1800


def test_claims_of_terabytes_are_refused_without_taking_memory(tmp_path):
    path, huge = tmp_path / "a.vdb", struct.pack("<I", 2**32 - 1)
    cases = [
        ({"n_grids": struct.pack("<i", 2**31 - 1)}, "2147483647 grids take"),
        ({"n_grids": struct.pack("<i", -5)}, "claims -5 grids"),
        ({"file_metadata": huge}, "4294967295 metadata entries take"),
        ({"grid_metadata": huge}, "4294967295 metadata entries take"),
        ({"name": huge}, "claims 4294967295 bytes"),
        ({"name": struct.pack("<I", 60000), "node": b""}, "60000 bytes are missing"),
        ({"grid_metadata": struct.pack("<I", 1) + text("a") + text("b") + huge}, "'a' take 42949"),
        ({"counts": huge + struct.pack("<I", 0)}, "4294967295 root tiles take"),
        ({"counts": struct.pack("<I", 0) + huge}, "4294967295 upper nodes take"),
        ({"upper_children": b"\xff" * 4096}, "32768 lower nodes take"),
        ({"lower_children": b"\xff" * 512}, "4096 leaves take"),
        ({"buffers": huge}, "4294967295 values per voxel"),
        ({"leaf_size": struct.pack("<q", 2**62), "flags": 1}, "claims 4611686018427387904 bytes"),
        ({"leaf_size": struct.pack("<q", -(2**62)), "flags": 1}, "claims -4611686018427387904"),
        ({"leaf_size": struct.pack("<q", -(2**63)), "flags": 1}, "claims -9223372036854775808"),
    ]
    for parts, words in cases:
        refuse(path, words, **parts)
    path.write_bytes(vdb_bytes())
    assert read_vdb_grids(path)[0].index.n_bricks == 1


def test_compression_bombs_are_refused_unopened(tmp_path):
    path = tmp_path / "a.vdb"
    bomb = zlib.compress(bytes(2**26), 9)  # 64 MiB in 65 kB
    size = struct.pack("<q", len(bomb))
    refuse(path, r"claims 65\d\d\d bytes for 2048", flags=1, leaf_size=size, leaf_values=bomb)
    # Short enough to be looked at, but it stops one byte behind what a leaf may hold
    bomb = zlib.compress(bytes(2**21), 9)[:2100]
    size = struct.pack("<q", len(bomb))
    refuse(path, "do not give the 2048 bytes", flags=1, leaf_size=size, leaf_values=bomb)
    # A Blosc frame that claims to be larger than a leaf; a sound one first, to compile the kernels
    plain = struct.pack("<BBBBIII", 2, 1, 2, 4, 2048, 2048, 2064) + bytes(2048)
    size = struct.pack("<q", len(plain))
    path.write_bytes(vdb_bytes(flags=4, leaf_size=size, leaf_values=plain))
    assert not read_vdb_grids(path)[0].values.any()
    frame = struct.pack("<BBBBIII", 2, 1, 0x21, 4, 2**30, 2**30, 32) + bytes(16)
    size = struct.pack("<q", len(frame))
    refuse(
        path, "Blosc frame for 2048 bytes is damaged", flags=4, leaf_size=size, leaf_values=frame
    )


def test_far_apart_nodes_do_not_make_a_huge_table_or_grid(tmp_path):
    far = np.array([[0, 0, 0], [2**24, 2**20, 0], [2**27, 2**27, 2**27]])
    tiles = b"".join(struct.pack("<3ifB", *(4096 * (place // 4096)), 0.5, 1) for place in far)
    counts = struct.pack("<2I", len(far), 0)
    refuse(
        tmp_path / "a.vdb",
        "4288 blocks of 2048.3 are allowed for so few",
        counts=counts,
        tiles=tiles,
        node=b"",
    )
    tile = struct.pack("<3ifB", 0, 0, 0, 0.5, 1)
    one = {
        "counts": struct.pack("<2I", 1, 0),
        "tiles": tile,
        "node": b"",
        "grid_class": "fog volume",
    }
    refuse(tmp_path / "a.vdb", "4096 x 4096 x 4096 voxels, 2.75e.11 bytes", read=read_vdb, **one)
    one["grid_class"] = "level set"
    words = "active tiles .* would become 134217728 bricks of 8.3; 16384 are allowed"
    refuse(tmp_path / "a.vdb", words, read=read_vdb, **one)


def test_misplaced_nodes_and_unknown_codes_are_refused(tmp_path):
    path = tmp_path / "a.vdb"
    refuse(path, "multiple of 4096", origin=struct.pack("<3i", 0, 8, 0))
    tile = struct.pack("<3ifB", 0, 0, 0, 0.5, 1)
    refuse(path, "the same place", counts=struct.pack("<2I", 1, 1), tiles=tile)
    refuse(path, "has the code 7", leaf_code=b"\x07")
    refuse(path, "has the code 255", leaf_code=b"\xff")
    refuse(path, "cut off within its values", leaf_values=bytes(2047))
    refuse(path, "does not begin as a .vdb file", magic=b" BDW")
    for version in (221, 226):
        refuse(path, f"version is {version}; known are 222 to 225", version=version)


def test_transforms_that_make_no_space_are_refused(tmp_path):
    for scale, words in [
        ([1.0, 1.0, 0.0], "flattens space"),
        ([1.0, np.nan, 1.0], "make no transform"),
        ([np.inf, 1.0, 1.0], "make no transform"),
    ]:
        parts = struct.pack("<15d", *scale, *[1.0] * 12)
        refuse(tmp_path / "a.vdb", words, transform=text("ScaleMap") + parts)
    # Whoever reads grids as they are may have these, but they make no band
    for scale in ([-1.0, -1.0, -1.0], [1.0, 1.0, 2.0]):
        transform = text("ScaleMap") + struct.pack("<15d", *scale, *[1.0] * 12)
        refuse(tmp_path / "a.vdb", "no cubes", read=read_vdb, transform=transform)
        assert np.diag(read_vdb_grids(tmp_path / "a.vdb")[0].matrix)[:3].tolist() == scale


def test_backgrounds_that_make_no_level_set_are_refused(tmp_path):
    for background in (0.0, -1.0, np.nan, np.inf):
        words = f"background {background:g}, not above 0"
        background = struct.pack("<f", background)
        refuse(tmp_path / "a.vdb", words, read=read_vdb, background=background)
    values = np.full(512, np.nan, np.float32).tobytes()
    refuse(tmp_path / "a.vdb", "512 of the numbers in values", read=read_vdb, leaf_values=values)


def test_offsets_that_lead_elsewhere_are_refused(tmp_path):
    length = len(vdb_bytes())
    for start, end in [(0, 1), (5, 100), (2**62, 2**62), (-1, -1), (None, length + 1), (None, 3)]:
        refuse(tmp_path / "a.vdb", "claims to lie at bytes", read=probe_vdb, offsets=(start, end))


def test_a_stream_of_many_small_claims_ends_soon(tmp_path):
    # Every grid claims to end where it began, so that all of them would be read from one place
    grid = vdb_bytes(n_grids=struct.pack("<i", 1))
    path = tmp_path / "a.vdb"
    path.write_bytes(vdb_bytes(n_grids=struct.pack("<i", len(grid) // 40)))
    with pytest.raises(IoError, match="not a readable volume"):
        probe_vdb(path)
