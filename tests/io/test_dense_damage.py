"""Formats of full grids: no bytes whatever can do harm.

Every reading ends in IoError or in a sound grid, of bounded size and after bounded time. Only
packed values have a checksum; a changed number elsewhere is another number.
"""

import os
import time

import numpy as np
import pytest

from meshsdf.errors import IoError
from meshsdf.io.unpacking import LEAST_UNPACKED
from meshsdf.io.volume_checks import check_volume
from tests.io.dense_examples import assert_same_grid, files_of

FAMILIES = {
    "NRRD": ("nrrd", "nrrd plain", "nhdr"),
    "MetaImage": ("mha", "mhd plain"),
    "VTI": ("vti", "vti plain"),
    "raw": ("raw",),
    "DDS": ("dds",),
    "vf": ("vf",),
    "SDFGen": ("sdf",),
}
KEYS = [key for family in FAMILIES.values() for key in family]


def outcome(way, path):
    """The grid, which must be sound, or None if the file is refused in a decent sentence."""
    start, refusal = time.perf_counter(), ""
    try:
        found = way.read(path)
    except IoError as error:
        found, refusal = None, str(error)
    else:
        check_volume(found)
        assert found.values.nbytes <= LEAST_UNPACKED
    assert len(refusal) < 3000
    assert "\x1b" not in refusal
    assert time.perf_counter() - start < 5
    return found


@pytest.mark.parametrize("key", KEYS)
def test_a_file_cut_anywhere_is_refused_or_whole(tmp_path, key):
    way, path, files = files_of(key, tmp_path)
    grid, random = way.read(path), np.random.default_rng(1)
    for file in files:
        whole = file.read_bytes()
        # Behind the last value nothing matters; the last digits of a text are a number, too
        least = {"vti": len(b"\n  </AppendedData>\n</VTKFile>\n"), "sdf": 12}.get(key.split()[0], 1)
        cuts = {*range(min(1024, len(whole))), *random.integers(0, len(whole), 200).tolist()}
        for cut in sorted(cuts, reverse=True):
            os.truncate(file, cut)
            found = outcome(way, path)
            if found is None:
                continue
            assert len(whole) - cut <= least, (cut, len(whole))
            if key != "sdf":
                assert_same_grid(found, grid)
        file.write_bytes(whole)
    assert_same_grid(way.read(path), grid)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_flipped_byte_is_refused_or_gives_a_sound_grid(tmp_path, family):
    random, n_refused, keys = np.random.default_rng(2), 0, FAMILIES[family]
    for key in keys:
        (tmp_path / key).mkdir()
        way, path, files = files_of(key, tmp_path / key)
        for number in range(2000 // len(keys) + 1):
            file = files[number % len(files)]
            size = file.stat().st_size
            # Half of them in the header, where every byte matters
            reach = min(size, 400) if number // len(files) % 2 else size
            at, change = int(random.integers(0, reach)), int(random.integers(1, 256))
            with open(file, "r+b") as opened:
                opened.seek(at)
                old = opened.read(1)
                opened.seek(at)
                opened.write(bytes([old[0] ^ change]))
                opened.flush()
                n_refused += outcome(way, path) is None
                opened.seek(at)
                opened.write(old)
    # A .vf file is nearly all values, and one number is as good as another
    assert n_refused > (20 if family == "vf" else 400)


@pytest.mark.parametrize("key", KEYS)
def test_noise_is_refused(tmp_path, key):
    way, path, files = files_of(key, tmp_path)
    random = np.random.default_rng(3)
    for file in files:
        whole = file.read_bytes()
        for size in (0, 1, 22, 300, 70_000):
            noise = random.bytes(size)
            file.write_bytes(noise)
            assert outcome(way, path) is None or file != path
            file.write_bytes(noise + whole[size:])
            outcome(way, path)
            file.write_bytes(whole[: len(whole) // 2] + noise + whole[len(whole) // 2 :])
            outcome(way, path)
        file.write_bytes(whole)
