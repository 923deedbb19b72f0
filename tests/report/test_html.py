"""meshsdf.report.html: the page is valid, whole in itself, and tells the numbers of its JSON."""

import re

import pytest

from meshsdf.errors import ReportError
from meshsdf.report.formats import render_reports
from meshsdf.report.html import page
from meshsdf.report.report_data import Asked, report_data

from .pages import Reader, assert_figures_are_of_the_json, assert_whole_in_itself, parse_strictly
from .trips import data_of, facts

BOTH = ("marching-cubes", "dual-contouring")
# Parts that a page of a mesh that came back has; those of one row end with its number
SECTIONS = "resolutions distances-1 where-1 lost-1 budget-1 measures-1 check made"


def page_of(*arguments, **options) -> str:
    """A page without pictures."""
    return page(data_of(*arguments, **options))


@pytest.fixture(scope="module")
def whole() -> str:
    """A page with everything."""
    return render_reports(*facts("box"), names=["a.html"])["a.html"]


PAGES = {
    "one resolution": ("box", (8,)),
    "both methods": ("box", (6, 12), BOTH),
    "open": ("open", (8,)),
    "without an inside": ("sheet", (8,)),
    "nothing came back": ("plate", (6, 7)),
}


@pytest.mark.parametrize("what", PAGES)
def test_every_kind_of_round_trip_has_a_valid_page(what):
    text = page_of(*PAGES[what])
    reader = Reader(text)
    assert len(reader.ids) == len(set(reader.ids))
    assert reader.json == data_of(*PAGES[what])
    parse_strictly(text)


def test_the_whole_page_is_valid_and_has_all_its_parts(whole):
    parse_strictly(whole)
    reader = Reader(whole)
    assert set(SECTIONS.split()) <= set(reader.ids)
    assert whole.count("<img ") == 16  # six views and two close-ups of each surface
    assert len(whole) < 5_000_000


def test_the_page_asks_for_nothing_but_itself(whole):
    assert_whole_in_itself(whole)


def test_every_figure_on_the_page_is_one_of_the_json(whole):
    reader = Reader(whole)
    assert len(reader.figures) > 100
    assert_figures_are_of_the_json(reader)


def test_the_verdict_is_said_first_and_holds_the_numbers(whole):
    data = Reader(whole).json
    (sentence,) = data["verdict"]["sentences"]
    words = Reader(whole).texts
    assert sentence in words["header"]
    row = data["rows"][-1]
    voxels = float(re.search(r"\(([0-9.]+) voxels", sentence)[1])
    upper = row["largest"]["voxels"]["upper"]
    assert upper <= voxels <= 1.001 * upper
    assert f"on face {row[row['worst']]['source_face']} of" in sentence
    assert "the topology is kept (Euler number 2, 1 component, no boundary loops)" in sentence
    assert "its 12 sharp edges come back within" in sentence


def test_names_cannot_break_the_page():
    name = '</script><b onload="x">&amp;\'.ply'
    data = data_of("box", (6, 12), file=name)
    reader = Reader(page(data))
    assert reader.texts["h1"] == name
    assert name in reader.texts["title"]
    assert reader.json["input"]["name"] == name
    assert "b" not in reader.open
    assert "<b onload" not in page(data)


def test_the_same_round_trip_gives_the_same_bytes(whole):
    assert render_reports(*facts("box"), names=["b.html"])["b.html"] == whole


def test_a_mesh_that_does_not_come_back_is_told_so():
    reader = Reader(page_of("plate", (6, 7)))
    assert "Nothing of plate.ply comes back from 7 voxels" in reader.texts["header"]
    assert "nothing came back" in reader.texts["table"]
    assert "distances-1" not in reader.ids


def test_holes_are_listed_with_their_places():
    reader = Reader(page_of("open", (8,)))
    (hole,) = reader.json["two_set"]["holes"]
    shown = {at: text for at, _, text in reader.figures}
    assert shown["/two_set/holes/0/n_edges"] == str(hole["n_edges"])
    assert "the topology is not kept" in reader.texts["header"]
    assert "boundary loops 1 → 0" in reader.texts["header"]


def test_both_methods_have_a_verdict_and_sections_of_their_own():
    data = data_of("box", (6, 12), BOTH)
    reader = Reader(page(data))
    assert data["last_rows"] == [2, 3]
    assert {"distances-2", "distances-3"} <= set(reader.ids)
    for words in ("by marching cubes", "by dual contouring"):
        assert words in reader.texts["header"]


def test_limits_are_told_whether_they_are_kept_or_missed():
    trip, mesh, found, choice, _ = facts("box")
    missed = Asked("a.ply", max_error="0.1vox", missed=("the error may exceed 0.1vox",))
    kept = Asked("a.ply", max_error="2vox", until="0.5")
    texts = [
        Reader(page(report_data(trip, mesh, found, choice, it))).texts for it in (missed, kept)
    ]
    assert "Failed. the error may exceed 0.1vox." in texts[0]["header"]
    assert "the error is at most 2vox, as asked; the error is at most 0.5" in texts[1]["header"]


def test_another_suffix_is_refused():
    with pytest.raises(ReportError, match=r"a report with suffix '\.pdf' cannot be written"):
        render_reports(*facts("box"), names=["a.pdf"])
