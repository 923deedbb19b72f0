"""meshsdf.report.report_data and markdown: what a report holds, in plain types and as text."""

import json
import re
from fractions import Fraction

import numpy as np
import pytest

from meshsdf.report.enclosure import Enclosure
from meshsdf.report.formats import render_reports
from meshsdf.report.markdown import markdown
from meshsdf.report.pointers import distance_pointers, look_up
from meshsdf.report.report_data import in_units
from meshsdf.report.sharp_edges import sharp_edges

from .trips import MESHES, data_of, facts


def test_the_dict_is_plain_and_any_reader_takes_it():
    for name in MESHES:
        data = data_of(name, (8,))
        assert json.loads(json.dumps(data, allow_nan=False)) == data
        assert data["schema"] == "meshsdf.roundtrip_report/1"


def test_numbers_are_those_of_the_round_trip():
    trip, mesh, found, choice, _ = facts("box")
    data = data_of("box")
    for row, told in zip(trip.rows, data["rows"], strict=True):
        distance = row.comparison.distance
        assert told["largest"]["world"] == {"lower": distance.lower, "upper": distance.upper}
        assert told["voxel_size"] == row.voxel_size
        assert told["forward"]["witness"] == row.comparison.forward.witness.tolist()
        assert told["measures"]["after"]["n_faces"] == row.surface.n_faces
        assert told["seconds"] is None
    assert data["orders"] == [{"method": "marching-cubes", "order": trip.order("marching-cubes")}]
    assert data["sign"]["method"] == choice.method
    assert data["two_set"]["two_set"] is found.two_set is True
    assert data["input"]["n_faces"] == mesh.n_faces
    assert data["input"]["diagonal"] == pytest.approx(mesh.box.diagonal)


def test_lengths_in_other_units_still_hold_the_truth():
    comparison = facts("box")[0].rows[0].comparison
    for length in np.random.default_rng(1).uniform(-3, 3, 200):
        told = in_units(Enclosure(length, length), comparison)
        for unit, factor in (("voxels", comparison.voxel_size), ("percent", comparison.diagonal)):
            exact = Fraction(length) / Fraction(factor) * (100 if unit == "percent" else 1)
            assert Fraction(told[unit]["lower"]) <= exact <= Fraction(told[unit]["upper"])
            assert told[unit]["upper"] - told[unit]["lower"] <= 1e-14 * abs(exact)
    assert in_units(Enclosure(0.0, 0.0), comparison)["voxels"] == {"lower": 0.0, "upper": 0.0}


def test_sharp_edges_are_part_of_the_details():
    row = facts("box")[0].rows[1]
    told = data_of("box")["rows"][1]["sharp_edges"]
    direct = sharp_edges(
        MESHES["box"](),
        row.surface,
        voxel_size=row.voxel_size,
        tolerance=0.01 * row.voxel_size,
    )
    assert told["n_edges"] == 12
    assert told["length"] == pytest.approx(4 * (2 + 1.5 + 1))
    farthest = row.comparison.forward.distance.upper  # of all of the mesh, edges included
    assert told["largest"]["world"]["upper"] == min(direct.distance.upper, farthest)
    assert data_of("box")["rows"][0]["sharp_edges"] is None
    assert data_of("open", (8,))["rows"][0]["sharp_edges"] is None


def test_a_mesh_that_does_not_come_back_has_no_distances():
    row = data_of("plate", (6, 7))["rows"][1]
    assert row["is_empty"] is True
    assert "largest" not in row
    assert "thinner than a voxel" in row["warnings"][0]


def test_pointers_lead_to_every_row_of_the_table():
    side = data_of("box")["rows"][1]["forward"]
    for at, label in distance_pointers(side):
        assert set(look_up(side, at)) == {"world", "voxels", "percent"}, label
    assert look_up({"a": None}, "/a/b/c") is None
    with pytest.raises(KeyError):
        look_up({"a": {}}, "/a/b")


def test_the_text_tells_the_same_and_names_cannot_break_it():
    data = data_of("box", file="a|b*_<c>.ply")
    text = markdown(data)
    assert text.startswith("# a\\|b\\*\\_\\<c\\>.ply: mesh to volume to mesh\n")
    upper = data["rows"][1]["largest"]["voxels"]["upper"]
    shown = re.search(r"nowhere farther than [^(]*\(([0-9.]+) voxels", text)[1]
    assert upper <= float(shown) <= 1.001 * upper
    for line in text.splitlines():
        if line.startswith("|"):
            assert line.endswith("|")
    tables = re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE)
    for table in tables:
        cells = {len(re.findall(r"(?<!\\)\|", line)) for line in table.splitlines()}
        assert len(cells) == 1
    assert "watertight" in text


@pytest.mark.parametrize("name", ["sheet", "plate", "open"])
def test_every_kind_of_round_trip_has_a_text(name):
    text = markdown(data_of(name, (8,)))
    assert "The two-set check" in text
    assert "None" not in text


def test_json_and_text_of_one_round_trip_are_made_at_once():
    made = render_reports(*facts("box"), names=["a.json", "b.md", "c.JSON"])
    assert json.loads(made["a.json"]) == data_of("box")
    assert made["a.json"] == made["c.JSON"]
    assert made["b.md"] == markdown(data_of("box"))
