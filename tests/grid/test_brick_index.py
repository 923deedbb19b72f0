"""meshsdf.grid: the page table and the band that stands on it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from meshsdf.errors import GridError
from meshsdf.grid import BrickIndex, Grid, NarrowBand
from meshsdf.grid.brick_index import INSIDE, OUTSIDE, without_uniform_pages
from meshsdf.mesh.primitives import box_mesh
from meshsdf.sdf import mesh_to_band


def some_bricks(seed: int, n: int, spread: int, offset: int = 0) -> np.ndarray:
    """Different bricks in lexicographic order."""
    rng = np.random.default_rng(seed)
    return np.unique(rng.integers(-spread, spread, (n, 3)) + offset, axis=0)


@given(
    st.integers(0, 1000),
    st.integers(1, 60),
    st.sampled_from([2, 20, 200, 3000]),
    st.sampled_from([0, -7, 10**9, -(10**9)]),
)
def test_lookup_gives_every_brick_its_slot_and_nothing_else(seed, n, spread, offset):
    bricks = some_bricks(seed, n, spread, offset)
    index = BrickIndex.from_coordinates(bricks)
    assert_array_equal(index.lookup(bricks), np.arange(len(bricks)))
    slot_of = {tuple(brick): slot for slot, brick in enumerate(bricks.tolist())}
    asked = some_bricks(seed + 1, 200, 2 * spread, offset)
    expected = [slot_of.get(tuple(brick), OUTSIDE) for brick in asked.tolist()]
    assert_array_equal(index.lookup(asked), expected)


def test_inner_bricks_are_inside_and_so_is_a_page_without_bricks():
    shell = np.array([[0, 0, 0], [0, 0, 4], [40, 0, 0]])
    inner = np.array([[0, 0, 2], [0, 0, 3], [20, 3, 5]])
    index = BrickIndex.from_coordinates(shell, np.array([[0, 0, 2, 4], [20, 3, 5, 6]]))
    assert_array_equal(index.lookup(inner), [INSIDE, INSIDE, INSIDE])
    assert_array_equal(index.lookup(np.array([[0, 0, 1], [21, 3, 5]])), [OUTSIDE, INSIDE])
    assert_array_equal(index.lookup(shell), [0, 1, 2])


def test_a_run_of_inner_bricks_passes_through_stored_and_missing_pages():
    ends = np.array([[0, 0, 0], [0, 0, 20], [0, 0, 1000]])
    index = BrickIndex.from_coordinates(ends, np.array([[0, 0, 21, 1000], [5, 5, -9, 2000]]))
    asked = np.array([[0, 0, z] for z in (1, 19, 21, 32, 300, 999, 1001)])
    assert_array_equal(index.lookup(asked), [OUTSIDE, OUTSIDE, *[INSIDE] * 4, OUTSIDE])
    assert_array_equal(index.lookup(ends), [0, 1, 2])


def test_the_table_of_a_long_diagonal_stays_small():
    step = np.arange(20000)
    index = BrickIndex.from_coordinates(np.stack([step] * 3, axis=1))
    assert index.root.nbytes + index.pages.nbytes < 30e6  # a dense table of pages: 7.8e9
    assert_array_equal(index.lookup(np.array([[7, 7, 7], [19999] * 3, [7, 7, 8]])), [7, 19999, -1])


@pytest.mark.parametrize("seed", range(5))
def test_pages_of_one_code_are_dropped_and_no_answer_changes(seed):
    rng = np.random.default_rng(seed)
    bricks = some_bricks(seed, 60, 400)
    runs = np.array([[3, 4, -500, 500], [-100, 90, -30, 700], [350, -350, 0, 9]])
    index = BrickIndex.from_coordinates(bricks, runs)
    asked = np.concatenate([rng.integers(-420, 420, (3000, 3)), bricks + rng.integers(-9, 9, 3)])
    before = index.lookup(asked)
    # Forget most bricks, as a band does that finds nothing near in them; the pages are still there
    keep = rng.random(len(bricks)) < 0.2
    code = np.where(keep, np.cumsum(keep) - 1, np.where(rng.random(len(bricks)) < 0.5, -1, -2))
    expected = np.where(before >= 0, code[before], before)
    pages = index.pages.copy()
    lower = pages[np.count_nonzero(index.root >= 0) :]
    lower[lower >= 0] = code[lower[lower >= 0]]
    root, small = without_uniform_pages(index.root.copy(), pages)
    assert len(small) < len(pages)
    fewer = BrickIndex(bricks[keep], index.page_origin, root, small)
    assert_array_equal(fewer.lookup(asked), expected)
    again = without_uniform_pages(root.copy(), small.copy())
    assert_array_equal(again[0], root)
    assert_array_equal(again[1], small)


def test_a_band_keeps_no_page_without_bricks_that_one_code_stands_for():
    band = mesh_to_band(box_mesh((1.0, 0.9, 0.8)), resolution=400)
    pages = band.index.pages[np.count_nonzero(band.index.root >= 0) :].reshape(-1, 4096)
    assert ((pages >= 0).any(axis=1) | (pages != pages[:, :1]).any(axis=1)).all()
    assert_array_equal(band.index.lookup(band.index.coordinates), np.arange(band.index.n_bricks))


def test_bricks_out_of_order_or_twice_are_refused():
    for bricks in ([[0, 0, 1], [0, 0, 0]], [[1, 2, 3], [1, 2, 3]]):
        with pytest.raises(GridError, match=r"comes after"):
            BrickIndex.from_coordinates(np.array(bricks))


def test_an_empty_index_is_outside_everywhere():
    index = BrickIndex.from_coordinates(np.empty((0, 3), np.int64))
    assert index.n_bricks == 0
    assert_array_equal(index.lookup(np.array([[0, 0, 0], [5, -3, 10**12]])), [OUTSIDE] * 2)


def small_band() -> NarrowBand:
    """Two bricks with a few active nodes of known values."""
    index = BrickIndex.from_coordinates(np.array([[-1, 0, 0], [0, 0, 2]]), np.array([[0, 0, 1, 2]]))
    values = np.full((2, 8, 8, 8), 3.0, np.float32)
    active = np.zeros((2, 8), np.uint64)
    for slot, (i, j, k), value in ((0, (7, 1, 2), -1.5), (1, (0, 7, 7), 0.5), (1, (3, 0, 1), 0.0)):
        values[slot, i, j, k] = value
        active[slot, i] |= np.uint64(1) << np.uint64(8 * j + k)
    return NarrowBand(index, values, active, 0.5, np.array([1.0, 0, 0]), 6.0, "parity")


def test_a_band_tells_its_active_nodes_in_order():
    band = small_band()
    assert_array_equal(band.active_ijk(), [[-1, 1, 2], [0, 7, 23], [3, 0, 17]])
    assert_array_equal(band.active_values(), [-1.5, 0.5, 0.0])
    assert band.n_active == 3
    low, high = band.active_box()
    assert_array_equal([low, high], [[-1, 0, 2], [3, 7, 23]])
    assert_array_equal(band.to_world(np.array([[-1, 1, 2]])), [[0.5, 0.5, 1.0]])


def test_a_band_reads_values_anywhere():
    ijk = np.array([[-1, 1, 2], [0, 0, 8], [0, 0, 0], [10**12, 0, 0]])
    assert_array_equal(small_band().value_at(ijk), [-1.5, -3.0, 3.0, 3.0])


def test_a_band_with_too_few_bricks_is_refused():
    band = small_band()
    short = object.__new__(NarrowBand)  # past the tests' own type check, which would be first
    vars(short).update(vars(band) | {"values": band.values[:1]})
    with pytest.raises(GridError, match="values holds 1 bricks, the index 2"):
        short.__post_init__()


def test_a_grid_needs_a_positive_voxel_size():
    for size in (0.0, -1.0, float("nan")):
        with pytest.raises(GridError, match="voxel_size is"):
            Grid(np.zeros((2, 2, 2), np.float32), size, np.zeros(3))
