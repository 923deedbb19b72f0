"""meshsdf.surface.marching_squares: complete, oriented curves, whatever the values."""

import importlib
import weakref

import numpy as np
import pytest

from meshsdf.errors import SurfaceError
from meshsdf.surface import marching_squares, marching_squares_rows
from meshsdf.surface.square_rows import SquareRows
from tests.surface.squares_oracle import (
    cleaned,
    contourpy_curves,
    curves_of,
    measures,
    pieces_of,
    place_of,
    tiled,
)

RULES = ("bilinear", "mean", "diagonal", "antidiagonal")
ZEROS = ("outside", "nudge", "snap")
SHAPE = (6, 7)
ROUNDING = 1e-11  # sums of some hundred products of coordinates below 1000, each to 1e-16 of it


def random_grids(rng, n, kind, border=None):
    """(n, 6, 7) floats; or integers without zero, with ties; or with zeros."""
    if kind == "floats":
        grids = rng.normal(size=(n, *SHAPE))
    else:
        choices = [-3, -2, -1, 1, 2, 3] if kind == "ties" else [-2, -1, 0, 1, 2]
        grids = rng.choice(choices, (n, *SHAPE)).astype(float)
    if border is not None:
        grids[:, [0, -1]] = grids[:, :, [0, -1]] = border
    return grids


def ours_measured(curves, grids):
    return measures(curves.points, curves.offsets, curves.is_closed, grids)


def named_pieces(curves):
    """Sorted pairs of names that the curves join."""
    found = []
    for curve in curves:
        names = [tuple(name) for name in curve.edges.tolist()]
        found += list(zip(names, names[1:] + names[:1], strict=True))[
            : None if curve.is_closed else -1
        ]
    return sorted(found)


@pytest.mark.parametrize("kind", ["floats", "ties", "zeros"])
def test_ten_thousand_random_grids_have_the_curves_that_contourpy_finds(kind):
    grids = random_grids(np.random.default_rng(1), 10_000, kind, border=1.0)
    values = tiled(grids)
    ours = ours_measured(marching_squares(values, alternating="mean"), grids)
    theirs = measures(*contourpy_curves(values, 0.0), grids)
    np.testing.assert_array_equal(ours[:, :2], theirs[:, :2])
    np.testing.assert_allclose(ours[:, 2:], theirs[:, 2:], atol=ROUNDING)
    assert ours[:, 0].sum() > 20_000
    assert not ours[:, 1].any()


@pytest.mark.parametrize("kind", ["floats", "ties", "zeros"])
@pytest.mark.parametrize("level", [0.0, 1.0, -0.75])
def test_with_open_borders_and_missing_data_too(kind, level):
    rng = np.random.default_rng(2)
    grids = random_grids(rng, 900, kind)
    grids[:450][rng.random((450, *SHAPE)) < 0.1] = np.nan
    values = tiled(grids)
    curves = marching_squares(values, level=level, alternating="mean")
    ours = ours_measured(curves, grids)
    theirs = measures(*contourpy_curves(values, level), grids)
    np.testing.assert_allclose(ours[:, 2:], theirs[:, 2:], atol=ROUNDING)
    np.testing.assert_array_equal(ours[:, :2].sum(axis=1), theirs[:, :2].sum(axis=1))
    if not (grids == level).any():
        np.testing.assert_array_equal(ours[:, :2], theirs[:, :2])


@pytest.mark.parametrize("rule", RULES)
def test_without_zeros_the_pieces_are_those_of_a_plain_walk_in_fractions(rule):
    rng = np.random.default_rng(3)
    grids = np.concatenate([random_grids(rng, 50, "floats"), random_grids(rng, 50, "ties")])
    grids[::3][rng.random((34, *SHAPE)) < 0.1] = np.nan
    values = tiled(grids)
    for level in (0.0, 0.3):
        curves = marching_squares(values, level=level, alternating=rule)
        assert named_pieces(curves) == sorted(pieces_of(values, level, rule))
        names = [tuple(name) for name in curves.edges.tolist()]
        places = np.array([place_of(name, values, level) for name in names])
        np.testing.assert_allclose(curves.points, places, atol=1e-13)
        assert len(set(names)) == len(names)


@pytest.mark.parametrize("rule", RULES)
def test_with_zeros_the_curves_are_those_of_a_plain_walk_less_its_zero_length_pieces(rule):
    grids = random_grids(np.random.default_rng(4), 100, "zeros")
    values = tiled(grids)
    plain = curves_of(values, 0.0, rule)
    points = np.array([place_of(name, values, 0.0) for names in plain for name in names])
    offsets = np.cumsum([0] + [len(names) for names in plain])
    is_closed = np.array([names[0] == names[-1] for names in plain])
    expected = measures(*cleaned(points, offsets, is_closed), grids)
    ours = ours_measured(marching_squares(values, alternating=rule), grids)
    np.testing.assert_allclose(ours, expected, atol=ROUNDING)
    assert ours[:, 0].sum() > 20


@pytest.mark.parametrize("zeros", ZEROS)
@pytest.mark.parametrize("rule", RULES)
def test_no_piece_has_length_zero_and_open_ends_lie_on_the_border_or_at_missing_data(rule, zeros):
    rng = np.random.default_rng(5)
    values = rng.integers(-1, 2, (120, 130)).astype(float)
    values[rng.random(values.shape) < 0.02] = np.nan
    values[:4] = 0.0  # whole rows at the level too
    curves = marching_squares(values, alternating=rule, zeros=zeros, voxel_size=0.7)
    assert curves.is_closed.any()
    assert not curves.is_closed.all()
    around = np.pad(values, 1, constant_values=np.nan)
    for curve in curves:
        ends = np.roll(curve.points, -1, axis=0) if curve.is_closed else curve.points[1:]
        assert (ends != curve.points[: len(ends)]).any(axis=1).all()
        if not curve.is_closed:
            for i, j, axis in curve.edges[[0, -1]]:
                # Corners of the two squares beside the edge; `around` is shifted by one
                across = around[i + 1 : i + 3, j : j + 3], around[i : i + 3, j + 1 : j + 3]
                assert np.isnan(across[axis]).any()


def test_values_that_round_a_crossing_onto_a_node_give_no_zero_length_piece():
    values = np.array([[1.0, 1, 1], [1, 1e-20, -1], [1, -1, -1]])
    (curve,) = marching_squares(values)
    assert (np.diff(curve.points, axis=0) != 0).any(axis=1).all()
    lone = np.full((3, 3), -1.0)
    lone[1, 1] = 1e-20
    assert len(marching_squares(lone)) == 0  # a curve around one place


@pytest.mark.parametrize("zeros", ZEROS)
def test_rows_one_at_a_time_give_the_same_curves_in_the_same_order(zeros):
    rng = np.random.default_rng(6)
    for kind in ("floats", "zeros"):
        values = tiled(random_grids(rng, 100, kind))
        choices = {"level": 0.0, "voxel_size": 0.3, "origin": np.array([5.0, -7.0]), "zeros": zeros}
        whole = marching_squares(values, **choices)
        rows = list(marching_squares_rows(iter(values), **choices))
        assert len(whole) == len(rows) > 100
        for a, b in zip(whole, rows, strict=True):
            np.testing.assert_array_equal(a.points, b.points)
            np.testing.assert_array_equal(a.edges, b.edges)
            assert a.is_closed == b.is_closed


def test_the_size_of_the_blocks_changes_no_bit(monkeypatch):
    values = tiled(random_grids(np.random.default_rng(7), 100, "zeros"))
    whole = marching_squares(values)
    module = importlib.import_module("meshsdf.surface.marching_squares")
    monkeypatch.setattr(module, "NODES_PER_BLOCK", 5 * values.shape[1])
    parts = marching_squares(values)
    for name in ("points", "edges", "offsets", "is_closed"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))


def test_a_curve_is_given_as_soon_as_the_row_that_closes_it_is_read_and_two_rows_are_held():
    taken, alive = [], []

    def rows():
        for i in range(12):
            row = np.ones(8)
            if i in (2, 6):
                row[3] = -1.0
            elif i >= 8:
                row[5] = -1.0
            taken.append(i)
            alive.append(weakref.ref(row))
            yield row
            del row

    seen = []
    for curve in marching_squares_rows(rows()):
        seen.append((taken[-1], curve.is_closed))
        assert sum(ref() is not None for ref in alive) <= 2
    # Dots in rows 2 and 6 close with rows 3 and 7; a bar runs into the border after row 11.
    assert seen == [(3, True), (7, True), (11, False)]


def test_between_rows_only_the_last_one_is_kept():
    state = SquareRows(
        500, level=0.0, voxel_size=1.0, origin=np.zeros(2), alternating="mean", zeros="snap"
    )
    for row in np.random.default_rng(12).normal(size=(4, 500)):
        state.feed(row[None])
        for kept in (state.values, state.sides, state.at_level):
            assert kept.shape == (1, 500)
            assert kept.base is None  # no view of more rows
    for row in np.ones((3, 500)):
        state.feed(row[None])
    assert state.counts[0] == len(state.after)  # all vertices are given back


def test_an_open_curve_is_given_when_its_second_end_leaves_the_last_row():
    values = np.ones((6, 5))
    values[1:3, 0] = -1.0  # a bay at the side border: ends in rows 1 and 3
    values[4, 2:] = np.nan
    values[4, 1] = -1.0
    taken = []

    def rows():
        for i, row in enumerate(values):
            taken.append(i)
            yield row

    seen = [(taken[-1], curve.is_closed) for curve in marching_squares_rows(rows())]
    assert seen[0] == (3, False)
    assert len(seen) == 2


def test_float32_values_are_compared_with_the_level_as_it_is():
    third = np.float32(1 / 3)  # a little above 1/3
    values = np.full((3, 3), 1, np.float32)
    values[1, 1] = third
    assert len(marching_squares(values, level=1 / 3)) == 0
    assert len(marching_squares(values, level=1 / 3 + 2e-8)) == 1  # float32(level) is third
    rng = np.random.default_rng(8)
    single = rng.normal(size=(20, 30)).astype(np.float32)
    a, b = marching_squares(single, level=0.1), marching_squares(single.astype(float), level=0.1)
    np.testing.assert_array_equal(a.points, b.points)


def test_infinite_and_huge_values_give_points_on_their_edges():
    rng = np.random.default_rng(9)
    values = rng.choice([-np.inf, -1.7e308, -1.0, 5e-324, 1.7e308, np.inf], (30, 30))
    for rule in RULES:
        for zeros in ZEROS:
            curves = marching_squares(values, alternating=rule, zeros=zeros)
            low = curves.edges[:, :2]
            high = low + np.eye(2, dtype=int)[curves.edges[:, 2]]
            assert ((curves.points >= low) & (curves.points <= high)).all()
            assert np.array_equal(named_pieces(curves), sorted(named_pieces(curves)))


def test_scaling_values_by_a_power_of_two_changes_no_bit():
    values = np.random.default_rng(10).normal(size=(40, 30))
    expected = marching_squares(values)
    for power in (-400, -30, 400):
        other = marching_squares(values * 2.0**power)
        np.testing.assert_array_equal(other.points, expected.points)
        np.testing.assert_array_equal(other.offsets, expected.offsets)


def test_the_input_is_not_changed():
    values = np.zeros((4, 5))
    values[1, 2] = -1
    before = values.copy()
    marching_squares(values, zeros="nudge")
    np.testing.assert_array_equal(values, before)


def test_a_grid_without_a_change_of_sign_has_no_curve():
    for values in (np.ones((4, 4)), np.full((5, 3), -1.0), np.full((3, 3), np.nan)):
        assert len(marching_squares(values)) == 0
        assert list(marching_squares_rows(values)) == []


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"level": np.nan}, "level is nan"),
        ({"level": np.inf}, "level is inf"),
        ({"voxel_size": 0}, "voxel_size is 0"),
        ({"origin": np.array([0, np.inf])}, r"origin is \[ 0\. inf\]"),
        ({"values": np.ones((1, 5))}, "the grid has 1 x 5 nodes"),
        ({"values": np.ones((5, 1))}, "the grid has any x 1 nodes"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_numbers(choices, message):
    choices = {"values": np.ones((3, 3)), **choices}
    with pytest.raises(SurfaceError, match=message):
        marching_squares(choices.pop("values"), **choices)


def test_a_choice_that_is_none_is_refused():
    start = importlib.import_module("meshsdf.surface.marching_squares")._start
    for name in ("alternating", "zeros"):
        choices = {"alternating": "mean", "zeros": "snap", name: "both"}
        with pytest.raises(SurfaceError, match=f"{name} is 'both'"):
            start(3, 0.0, 1.0, None, **choices)


def test_rows_that_do_not_fit_are_refused_by_number():
    with pytest.raises(SurfaceError, match="level is nan"):
        marching_squares_rows(iter(np.ones((3, 3))), level=np.nan)  # before any row is taken
    for rows, message in (
        ([np.ones(3), np.ones(4)], r"row 1 has the shape \(4,\), expected \(3,\)"),
        ([np.ones((3, 3))], r"row 0 has the shape \(3, 3\), expected \(n,\)"),
        ([np.ones(3), np.ones(3, int)], "row 1 holds int64"),
        ([], "the grid has 0 x 0 nodes"),
        ([np.ones(3)], "the grid has 1 x 3 nodes"),
    ):
        with pytest.raises(SurfaceError, match=message):
            list(marching_squares_rows(rows))


def test_curves_are_counted_and_taken_by_number():
    curves = marching_squares(tiled(random_grids(np.random.default_rng(11), 9, "floats")))
    assert len(list(curves)) == len(curves) == len(curves.is_closed)
    np.testing.assert_array_equal(curves[-1].points, list(curves)[-1].points)
    with pytest.raises(SurfaceError, match=f"there is no curve {len(curves)} among"):
        curves[len(curves)]
