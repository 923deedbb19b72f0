"""meshsdf.report.compare_report and its page: any two meshes, told like a round trip."""

import json
from functools import cache

import numpy as np
import pytest

from meshsdf.mesh import Mesh, check
from meshsdf.mesh.primitives import box_mesh
from meshsdf.report.compare import compare
from meshsdf.report.compare_report import (
    ComparedPair,
    ComparisonAsked,
    compare_data,
    edges_between,
    units_of,
)
from meshsdf.report.formats import render_comparison
from meshsdf.report.heat_maps import pair_scales
from meshsdf.report.html import compare_page
from meshsdf.report.notation import written
from meshsdf.report.pair_words import ROUND_TRIP, PairWords
from meshsdf.report.plots import shares_svg

from .pages import Reader, assert_figures_are_of_the_json, assert_whole_in_itself, parse_strictly
from .trips import open_ball

MOVE, VOXEL = 0.25, 0.5
NAMES = "first.obj", "second.ply"


def moved_box() -> Mesh:
    """The same box further along x, and a cube that stands off."""
    box, cube = box_mesh((2, 2, 2), center=(MOVE, 0, 0)), box_mesh(center=(5.0, 0.0, 0.0))
    faces = np.concatenate([box.faces, cube.faces + box.n_vertices])
    return Mesh(np.concatenate([box.vertices, cube.vertices]), faces)


def line() -> Mesh:
    """A face without area: nothing can be said of shares of it."""
    return Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]], np.int32))


PAIRS = {
    "moved": lambda: (box_mesh((2, 2, 2)), box_mesh((2, 2, 2), center=(MOVE, 0, 0))),
    "more": lambda: (box_mesh((2, 2, 2)), moved_box()),
    "open": lambda: (open_ball(), box_mesh()),
    "same": lambda: (box_mesh(), box_mesh()),
    "line": lambda: (box_mesh(), line()),
    "point": lambda: (Mesh(np.ones((1, 3)), np.zeros((1, 3), np.int32)), box_mesh()),
}


@cache
def pair(name: str, voxel_size: float | None = VOXEL, statistics: bool = True) -> ComparedPair:
    meshes = PAIRS[name]()
    found = compare(*meshes, voxel_size=voxel_size, statistics=statistics)
    checks = tuple(check(mesh, self_intersections=False) for mesh in meshes)
    return ComparedPair(meshes, found, checks, edges_between(*meshes, voxel_size))


def data_of(*options, names: tuple[str, str] = NAMES) -> dict:
    return compare_data(pair(*options), ComparisonAsked(*names, command="meshsdf compare"))


@pytest.fixture(scope="module")
def texts() -> dict[str, str]:
    """All formats of one comparison, pictures included."""
    asked = ComparisonAsked(*NAMES)
    return render_comparison(pair("moved"), asked, names=["a.html", "a.json", "a.md"])


KINDS = {
    "in voxels": ("more",),
    "in world units": ("more", None),
    "no statistics": ("moved", VOXEL, False),
    "neither": ("moved", None, False),
    "open": ("open", None),
    "coincide": ("same", None),
    "of no area": ("line", None),
    "without a diagonal": ("point", None),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_comparison_has_a_valid_page_with_the_figures_of_its_json(kind):
    data = data_of(*KINDS[kind])
    assert data["schema"] == "meshsdf.compare_report/1"
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    text = compare_page(data)
    parse_strictly(text)
    assert_whole_in_itself(text)
    reader = Reader(text)
    assert len(reader.ids) == len(set(reader.ids))
    assert reader.json == data
    assert len(reader.figures) > 30
    assert_figures_are_of_the_json(reader)


def test_the_whole_page_holds_pictures_and_the_dict_of_the_json(texts):
    page = texts["a.html"]
    parse_strictly(page)
    assert_whole_in_itself(page)
    assert page.count("<img ") == 16  # six views and two close-ups of each surface
    reader = Reader(page)
    assert reader.json == json.loads(texts["a.json"])
    assert {"distances", "where-0", "lost-0", "added-0", "measures-0", "check", "made"} <= set(
        reader.ids
    )
    again = render_comparison(pair("moved"), ComparisonAsked(*NAMES), names=["b.html"])
    assert again["b.html"] == page


def test_numbers_are_those_of_the_comparison_and_hold_the_truth():
    told, found = data_of("moved")["comparison"], pair("moved").comparison
    distance = found.distance
    assert told["largest"]["world"] == {"lower": distance.lower, "upper": distance.upper}
    assert told["largest"]["voxels"]["lower"] <= MOVE / VOXEL <= told["largest"]["voxels"]["upper"]
    mean = told["forward"]["mean"]["world"]
    left = 4 * MOVE  # the face that stays behind, area 4
    sides = 4 * 2 * MOVE**2 / 2  # a strip of each side stays behind with it, by 0 to MOVE
    # The face that dives in is MOVE from that opposite, but nearer to a side along its rim: over
    # it the distance is a cut pyramid
    right = MOVE / 3 * (2**2 + 2 * (2 - 2 * MOVE) + (2 - 2 * MOVE) ** 2)
    truth = (left + sides + right) / 24
    assert mean["lower"] <= truth <= mean["upper"]
    edges = told["sharp_edges"]
    assert edges["n_edges"] == 12
    assert edges["largest"]["world"]["lower"] <= MOVE <= edges["largest"]["world"]["upper"]


def test_what_only_one_of_both_has_is_told_with_a_voxel_size_alone():
    data = data_of("more")
    assert data["comparison"]["forward"]["n_lost_parts"] == 0
    (part,) = data["comparison"]["backward"]["lost_parts"]
    assert part["n_faces"] == 12
    assert part["center"] == pytest.approx([5.0, 0.0, 0.0])
    words = Reader(compare_page(data)).texts["main"]
    assert "1 part of second.ply" in " ".join(words.split())
    asked = ComparisonAsked(*NAMES)
    markdown = render_comparison(pair("more"), asked, names=["a.md"])["a.md"]
    assert "1 part of second.ply is missing from first.obj:" in markdown
    without = Reader(compare_page(data_of("more", None)))
    assert not {"lost-0", "added-0"} & set(without.ids)


def test_voxels_are_told_only_where_their_size_is_known():
    assert [unit for unit, _ in units_of(data_of("moved"))] == ["world", "voxels", "percent"]
    data = data_of("moved", None)
    assert [unit for unit, _ in units_of(data)] == ["world", "percent"]
    assert data["comparison"]["sharp_edges"]["kept_percent"] is None
    reader = Reader(compare_page(data))
    assert not [at for at, _, _ in reader.figures if "voxel" in at]
    assert "voxels" not in reader.texts["main"]
    assert "voxels" not in data["verdict"]["sentence"]
    assert (
        "voxels"
        not in render_comparison(pair("moved", None), ComparisonAsked(*NAMES), names=["a.md"])[
            "a.md"
        ]
    )


def test_scales_are_in_voxels_or_in_units_of_length():
    found = pair("moved").comparison, pair("moved", None).comparison
    (_, in_voxels), (_, in_units) = (pair_scales(one) for one in found)
    assert in_voxels.top == pytest.approx(MOVE / VOXEL)
    assert in_units.top == pytest.approx(MOVE)
    assert "voxels" in in_voxels.bar("a")
    assert "voxels" not in in_units.bar("a")
    # Rounding errors of surfaces that coincide do not shine
    assert (
        min(s.top for s in pair_scales(pair("same", None).comparison)) > 1e3 * np.finfo(float).eps
    )


def test_without_statistics_means_are_estimates_and_the_rest_is_absent():
    data = data_of("moved", VOXEL, False)
    side = data["comparison"]["forward"]
    assert set(side["mean"]["world"]) == {"estimate"}
    assert side["percentiles"] == []
    assert side["shares"] is None
    assert shares_svg(data["comparison"], "shares", ("a", "b"), VOXEL) == ""
    page = compare_page(data)
    assert "of the area within" not in page
    assert "Not measured." in page


def test_the_verdict_names_both_files_and_what_differs():
    data = data_of("moved")
    sentence = data["verdict"]["sentence"]
    upper = written(data["comparison"]["largest"]["world"]["upper"], "up")
    assert sentence.startswith(f"No point of first.obj or second.ply is farther than {upper} (")
    assert "the topology is the same (Euler number 2, 1 component" in sentence
    assert "the 12 sharp edges of first.obj are within" in sentence
    assert sentence in Reader(compare_page(data)).texts["header"]
    more = data_of("more")["verdict"]
    assert "the topology differs (Euler number 2 → 4, components 1 → 2)" in more["sentence"]
    assert "of second.ply, at least" in more["sentence"]
    assert more["topology"]["is_kept"] is False


def test_the_holes_of_both_are_told():
    data = data_of("open", None)
    assert data["two_set"]["a"]["n_holes"] == 1
    assert data["two_set"]["b"]["n_holes"] == 0
    shown = {at: text for at, _, text in Reader(compare_page(data)).figures}
    assert shown["/two_set/a/holes/0/n_edges"] == str(data["two_set"]["a"]["holes"][0]["n_edges"])


def test_names_cannot_break_the_page_or_the_text():
    names = '</script><b onload="x">&amp;\'$a_b$.ply', "| `x` _y_.obj"
    data = data_of("moved", names=names)
    page = compare_page(data)
    parse_strictly(page)
    reader = Reader(page)
    assert reader.texts["h1"] == f"{names[0]} and {names[1]}"
    assert reader.json["a"]["name"] == names[0]
    assert "<b onload" not in page
    text = render_comparison(pair("moved"), ComparisonAsked(*names), names=["a.md"])["a.md"]
    assert r"# \</script\>\<b onload" in text
    assert r"| \| \`x\` \_y\_.obj → " in text


def test_equal_names_are_told_apart():
    says = PairWords.of_files("part.obj", "part.obj")
    assert (says.a, says.b) == ("part.obj (A)", "part.obj (B)")
    assert PairWords.of_files(*NAMES).starts == NAMES
    assert ROUND_TRIP.starts == ("The mesh", "What came back")
    assert "part.obj (B) → part.obj (A)" in compare_page(data_of("moved", names=("part.obj",) * 2))


def test_limits_are_told_whether_they_are_kept_or_missed():
    missed = ComparisonAsked(*NAMES, max_error="0.1vox", missed=("The meshes are far apart",))
    kept = ComparisonAsked(*NAMES, max_error="2vox", tolerance="0.5")
    pages = [compare_page(compare_data(pair("moved"), asked)) for asked in (missed, kept)]
    headers = [" ".join(Reader(page).texts["header"].split()) for page in pages]
    assert "Failed. The meshes are far apart." in headers[0]
    assert (
        "Passed: the distance is at most 0.5, as asked; the distance is at most 2vox" in headers[1]
    )
