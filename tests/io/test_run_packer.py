"""meshsdf.io.run_packer: any gzip reader gets the chunk back."""

import gzip
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshsdf import mesh_to_band
from meshsdf.io.run_packer import RunPacker
from meshsdf.io.zarr_array import read_spec
from meshsdf.io.zarr_values import read_band_values, write_band_values
from meshsdf.mesh.primitives import icosphere

few = settings(max_examples=60, deadline=None)


def noise(seed: int, n: int) -> np.ndarray:
    """Words of runs of all lengths, of few values or many, in any order."""
    random = np.random.default_rng(seed)
    values = random.integers(0, 2**32, random.choice([1, 3, 1000]), dtype=np.uint32)
    lengths = random.choice([1, 2, 3, 63, 64, 65, 66, 129, 1000], n)
    runs = np.repeat(random.choice(values, n), lengths)
    return runs[:n].copy()


@few
@given(st.integers(0, 2**32 - 1), st.integers(1, 3000), st.booleans())
def test_every_chunk_comes_back_through_gzip_whatever_the_code_was_made_from(seed, n, is_own):
    words = noise(seed, n)
    samples = [words] if is_own else [noise(seed + 1, 50)]
    packed = RunPacker(samples).pack(words)
    assert gzip.decompress(packed) == words.tobytes()
    stream = zlib.decompressobj(31)
    assert stream.decompress(packed) == words.tobytes()
    assert stream.eof
    assert stream.unused_data == b""
    assert packed[4:8] == bytes(4)  # no date, so equal chunks are equal files


@pytest.mark.parametrize("kind", [np.float32, np.float16, np.float64])
def test_numbers_of_every_size_come_back(kind):
    random = np.random.default_rng(0)
    chunk = np.full((16, 8, 24), -0.25, kind)
    chunk[3:9, :, 5:] = random.normal(size=(6, 8, 19))
    turned = np.ascontiguousarray(chunk.transpose(2, 1, 0)).transpose(2, 1, 0)
    for each in (chunk, turned):
        assert gzip.decompress(RunPacker([]).pack(each)) == chunk.tobytes()


def test_no_code_is_longer_than_the_format_allows_however_rare_a_byte_is():
    # Each byte as often as all rarer ones together, which makes the longest codes
    counts = [1 << min(number, 16) for number in range(256)]
    data = np.repeat(np.arange(256, dtype=np.uint8), counts)[-(1 << 22) :]
    words = np.random.default_rng(0).permutation(data)[: len(data) // 4 * 4].view(np.uint32)
    fibonacci = np.repeat(np.arange(24, dtype=np.uint8), [_fibonacci(n) for n in range(24)])
    mixed = np.random.default_rng(0).permutation(fibonacci)
    mixed = mixed[: len(mixed) // 4 * 4].view(np.uint32)
    for sample in (words, mixed):
        packer = RunPacker([sample])
        assert gzip.decompress(packer.pack(sample)) == sample.tobytes()
        assert len(packer.pack(sample)) < 1.1 * len(zlib.compress(sample.tobytes(), 1))


def _fibonacci(n: int) -> int:
    one, two = 1, 1
    for _ in range(n):
        one, two = two, one + two
    return one


def test_runs_pack_as_zlib_packs_them_and_noise_does_not_grow():
    constant = np.full((64, 64, 64), 1.5, np.float32)
    assert len(RunPacker([constant]).pack(constant)) < len(zlib.compress(constant.tobytes(), 1))
    noise = np.random.default_rng(0).integers(0, 2**32, 1 << 18, dtype=np.uint32)
    assert len(RunPacker([noise]).pack(noise)) < 1.01 * noise.nbytes


def test_a_chunk_unlike_the_samples_never_outgrows_its_values(tmp_path):
    band = mesh_to_band(icosphere(1.0, subdivisions=2), voxel_size=0.02)
    values = band.values.copy()
    # Chunks that no sample saw: other bytes, of every value alike
    odd = np.random.default_rng(0).integers(0x3F000000, 0x40000000, values.shape, dtype=np.uint32)
    values[::3] = odd.view(np.float32)[::3]
    band = replace(band, values=values)
    write_band_values(tmp_path / "0", band, np.dtype("<f4"))
    spec = read_spec(tmp_path / "0")
    chunks = [file for file in (tmp_path / "0" / "c").rglob("*") if file.is_file()]
    assert len(chunks) > 4
    assert all(file.stat().st_size <= spec.chunk_bytes for file in chunks)
    back = read_band_values(tmp_path / "0", spec, band.index.coordinates)
    assert back.tobytes() == values.tobytes()


def test_the_package_zarr_reads_every_node_of_a_band(tmp_path):
    zarr = pytest.importorskip("zarr", reason="the package zarr is not installed")
    band = mesh_to_band(icosphere(1.0, subdivisions=3), voxel_size=0.015)
    for kind in ("<f4", "<f2"):
        write_band_values(tmp_path / kind[1:], band, np.dtype(kind))
        found = zarr.open_array(str(tmp_path / kind[1:]), mode="r")[...].transpose(2, 1, 0)
        first = band.index.coordinates.min(axis=0) * 8
        ijk = np.indices(found.shape).reshape(3, -1).T + first
        # Beyond the active nodes of a brick its values are what is stored there
        inside = band.index.lookup(ijk // 8) >= 0
        expected = band.value_at(ijk)
        slots = band.index.lookup(ijk[inside] // 8)
        expected[inside] = band.values[slots, *(ijk[inside] % 8).T]
        assert (found.ravel() == expected.astype(kind)).all()
