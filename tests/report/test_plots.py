"""meshsdf.report.plots: SVG that fits into a page, twice the same."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from meshsdf.report.plots import NAMES, bars, distribution_svg, errors_svg

from .trips import data_of

BOTH = ("marching-cubes", "dual-contouring")


def identifiers(svg: str) -> list[str]:
    return re.findall(r'\bid="([^"]*)"', svg)


def test_errors_are_drawn_for_every_method_with_the_fitted_order():
    data = data_of("box", methods=BOTH)
    svg = errors_svg(data)
    tree = ElementTree.fromstring(svg)
    words = "".join(tree.itertext())
    for text in ("marching cubes, largest", "dual contouring, mean", "one voxel", "6", "12"):
        assert text in words
    assert re.search(r"order [0-9.]+", words)
    assert "resolution" in words


def test_every_method_has_its_line():
    data = data_of("box", methods=(*BOTH, "surface-nets"))
    svg = errors_svg(data)
    words = "".join(ElementTree.fromstring(svg).itertext())
    for method in ("marching cubes", "dual contouring", "surface nets"):
        for line in ("largest", "mean"):
            assert f"{method}, {line}" in words
    for color in ("first", "second", "third"):
        assert f"var(--{color})" in svg


def test_nothing_is_drawn_where_there_is_nothing_to_see():
    assert errors_svg(data_of("box", resolutions=(8,))) == ""
    empty = data_of("plate", resolutions=(6, 7))
    assert errors_svg(empty) == ""
    assert distribution_svg(empty, 1) == ""


def test_plots_take_colours_and_letters_from_the_page():
    svg = errors_svg(data_of("box"))
    assert svg.startswith("<svg ")
    assert svg.endswith("</svg>")
    assert "var(--first)" in svg
    assert "var(--ink)" in svg
    assert not any(stand_in in svg for stand_in in NAMES)
    assert "font-family" not in svg
    assert "<metadata" not in svg
    assert "<style" not in svg
    assert "DejaVu" not in svg


def test_two_plots_on_a_page_share_no_identifier():
    data = data_of("box")
    plots = [errors_svg(data), distribution_svg(data, 1), distribution_svg(data, 0)]
    found = [name for svg in plots for name in identifiers(svg)]
    assert len(found) == len(set(found))
    for svg in plots:
        named = set(identifiers(svg))
        assert set(re.findall(r"url\(#([^)]*)\)", svg)) <= named
        assert set(re.findall(r'href="#([^"]*)"', svg)) <= named


@pytest.mark.parametrize("n", [1, 4, 5, 64])
def test_bars_hold_the_histogram_of_any_distances_between_the_bounds(n):
    rng = np.random.default_rng(n)
    distances = np.sort(rng.gamma(2.0, size=1000))
    lengths = np.geomspace(0.01, distances[-1], n)
    true = np.searchsorted(distances, lengths, side="right") / 10.0
    lower = np.maximum.accumulate(np.maximum(true - 0.5, 0.0))
    upper = np.maximum.accumulate(np.minimum(true + 0.5, 100.0))
    edges, least, most = bars(lengths, lower, upper)
    assert len(edges) == len(least) + 1 == len(most) + 1
    assert (np.diff(edges) > 0).all() or n == 1
    inner = np.append(-np.inf, edges[1:])
    counts = np.diff(np.searchsorted(distances, inner, side="right")) / 10.0
    assert (least <= counts).all()
    assert (counts <= most).all()


@pytest.mark.parametrize("draw", [errors_svg, lambda data: distribution_svg(data, 1)])
def test_the_same_numbers_give_the_same_bytes(draw):
    data = data_of("box")
    assert draw(data) == draw(data)
