"""The nodes of a ``.vdb`` file: the code that says inactive values, and how values are packed."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.errors import IoError
from meshsdf.io.vdb import read_vdb, read_vdb_grids, write_vdb, write_vdb_grids
from meshsdf.io.vdb_decode import decode_nodes, scan_nodes
from meshsdf.io.vdb_encode import encode_nodes
from meshsdf.io.vdb_values import ACTIVE_MASK, ValueLayout
from meshsdf.kernels.vdb_read import END
from tests.io.examples import narrow_band
from tests.io.vdb_examples import assert_same_band, random_grid, vdb_bytes

BG = np.float32(3)
NODES = {  # what the inactive values of a node are, and the code and size this makes
    "background": (0, [BG], 1),
    "inside": (1, [-BG], 1),
    "another": (2, [0.5], 1 + 4),
    "both sides": (3, [BG, -BG], 1 + 64),
    "another and background": (4, [0.5, BG], 1 + 4 + 64),
    "another and inside": (5, [0.5, -BG], 1 + 8 + 64),
    "two others": (5, [0.5, 0.25], 1 + 8 + 64),
    "three": (6, [0.5, BG, -BG], 1),
    "none": (0, [], 1),
}


@pytest.mark.parametrize("kind", NODES)
def test_inactive_values_become_the_code_that_says_them_shortest(kind):
    code, pool, head_size = NODES[kind]
    random = np.random.default_rng(0)
    active = random.random((3, 512)) < 0.4 if pool else np.ones((3, 512), bool)
    values = random.normal(size=(3, 512)).astype(np.float32)
    values[~active] = np.resize(np.array(pool, np.float32), np.count_nonzero(~active))
    layout = ValueLayout(np.array(BG), False, ACTIVE_MASK)
    nodes = encoded(values, active, layout)
    for node in range(3):
        mask = np.packbits(active[node], bitorder="little").tobytes()
        n_stored = 512 if code == 6 else np.count_nonzero(active[node])
        assert nodes[node][:64] == mask
        assert (nodes[node][64], len(nodes[node])) == (code, 64 + head_size + 4 * n_stored)
        found, states = decoded(nodes[node], layout)
        assert found.tobytes() == values[node].tobytes()
        assert states.tobytes() == mask


def encoded(values: np.ndarray, active: np.ndarray, layout: ValueLayout) -> list[bytes]:
    """The bytes of each node, its active mask first."""
    heads = np.packbits(active, axis=1, bitorder="little")
    words, rows = heads.view(np.uint64), np.arange(len(values), dtype=np.int32)
    data, ends = encode_nodes(values, rows, words, None, heads, layout)
    return [part.tobytes() for part in np.split(data, ends[:-1])]


def decoded(node: bytes, layout: ValueLayout) -> tuple[np.ndarray, np.ndarray]:
    """Values and active mask of one node, which its bytes must end with."""
    window = np.frombuffer(bytearray(node), np.uint8)
    records = scan_nodes(window, 512, 1, 0, layout)
    assert records[0, END] == len(node)
    values, active = np.empty((1, 512), np.float32), np.empty((1, 8), np.uint64)
    decode_nodes(window, records, layout, values, active, np.zeros(1, np.int32))
    return values, active


def test_negative_zero_and_nan_are_kept_apart_from_zero():
    layout = ValueLayout(np.array(0, np.float32), False, ACTIVE_MASK)
    active = np.zeros((1, 512), bool)
    for pool, code, head_size in [
        ([0.0], 0, 1),
        ([-0.0], 1, 1),
        ([-0.0, 0.0], 3, 65),
        ([np.nan], 2, 5),
        ([np.nan, 0.0], 4, 69),
        ([0.0, np.nan], 4, 69),
    ]:
        values = np.resize(np.array(pool, np.float32), (1, 512))
        (node,) = encoded(values, active, layout)
        assert (node[64], len(node)) == (code, 64 + head_size)
        assert decoded(node, layout)[0].tobytes() == values.tobytes()


@pytest.mark.parametrize("value_type", ["float", "vec3s"])
def test_blosc_packs_and_opens_every_value(tmp_path, value_type):
    for half in (False, True):
        grid = random_grid(1, value_type, is_half=half)
        # Long runs, so that some leaves do pack
        grid.values[3:6] = 0.5
        write_vdb_grids(tmp_path / "a.vdb", [grid], compression="blosc", force=True)
        write_vdb_grids(tmp_path / "b.vdb", [grid], compression="active", force=True)
        packed, plain = (read_vdb_grids(tmp_path / f"{name}.vdb")[0] for name in "ab")
        assert packed.values.tobytes() == plain.values.tobytes()
        assert (tmp_path / "a.vdb").stat().st_size < (tmp_path / "b.vdb").stat().st_size


def test_without_numcodecs_blosc_is_written_and_read_but_for_other_codecs(tmp_path, monkeypatch):
    pytest.importorskip("numcodecs")
    import numcodecs.blosc

    band = narrow_band(0)
    frame = numcodecs.blosc.compress(np.arange(512, dtype="<f4"), b"zstd", 5, 1)
    packed = {"flags": 4, "leaf_size": len(frame).to_bytes(8, "little"), "leaf_values": frame}
    (tmp_path / "zstd.vdb").write_bytes(vdb_bytes(**packed))
    assert_array_equal(read_vdb(tmp_path / "zstd.vdb").values.ravel(), np.arange(512))
    monkeypatch.setitem(sys.modules, "numcodecs.blosc", None)
    monkeypatch.setitem(sys.modules, "numcodecs", None)
    write_vdb(tmp_path / "a.vdb", band, compression="blosc")
    assert_same_band(read_vdb(tmp_path / "a.vdb"), band)
    with pytest.raises(IoError, match="packed with Blosc, which needs the package") as error:
        read_vdb(tmp_path / "zstd.vdb")
    assert error.value.fix.startswith("pip install '.[blosc]'")
