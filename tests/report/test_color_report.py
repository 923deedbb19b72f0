"""Colours on the report of a round trip: page, Markdown and JSON tell the same."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from meshsdf.mesh import check
from meshsdf.mesh.primitives import icosphere
from meshsdf.report.html import page
from meshsdf.report.markdown import markdown
from meshsdf.report.notation import written
from meshsdf.report.report_data import Asked, report_data
from meshsdf.report.roundtrip import roundtrip
from meshsdf.sdf import choose_sign

from .pages import Reader, assert_figures_are_of_the_json, assert_whole_in_itself, parse_strictly
from .trips import data_of


@cache
def colored(*methods: str) -> dict:
    """The dict of a painted sphere, without what takes long."""
    ball = icosphere(subdivisions=2)
    rgba = np.ones((ball.n_vertices, 4), np.float32)
    rgba[:, :3] = (ball.vertices + 1) / 2
    mesh = replace(ball, vertex_colors=rgba)
    found = check(mesh, self_intersections=False)
    trip = roundtrip(mesh, (8, 16), methods=methods, report=found, carry_texture=True)
    return report_data(trip, mesh, found, choose_sign(found), Asked("ball.glb"))


KINDS = [("marching-cubes",), ("marching-cubes", "dual-contouring")]


@pytest.mark.parametrize("methods", KINDS)
def test_the_page_has_a_table_of_colours_with_the_numbers_of_its_json(methods):
    data = colored(*methods)
    text = page(data)
    parse_strictly(text)
    assert_whole_in_itself(text)
    reader = Reader(text)
    assert "colors" in reader.ids
    assert reader.json == json.loads(json.dumps(data, allow_nan=False))
    assert_figures_are_of_the_json(reader)
    shown = {at for at, _, _ in reader.figures}
    for row in range(2 * len(methods)):
        for kind in ("sharp", "filtered"):
            for name in ("mean", "percentile_95", "largest", "where/0", "where/2"):
                assert f"/rows/{row}/colors/{kind}/{name}" in shown
    worst = data["rows"][-1]["colors"]["sharp"]
    assert f'fill="{worst["expected"]}"' in text
    assert f'fill="{worst["found"]}"' in text


@pytest.mark.parametrize("methods", KINDS)
def test_the_text_tells_the_same_numbers(methods):
    data = colored(*methods)
    text = markdown(data)
    (section,) = [part for part in text.split("\n## ") if part.startswith("Colours")]
    lines = [line for line in section.splitlines() if line.startswith("| ")]
    assert len(lines) == 2 + 2 * len(data["rows"])
    assert len({line.count("|") for line in lines}) == 1
    for row, line in zip(data["rows"], lines[2::2], strict=True):
        found = row["colors"]["sharp"]
        for name in ("mean", "percentile_95", "largest"):
            assert f"≈ {written(found[name], digits=3)} |" in line
        assert found["expected"] in line


def test_without_colours_no_report_speaks_of_them():
    data = data_of("box", (8,))
    assert "colors" not in data["rows"][0]
    assert "colors" not in Reader(page(data)).ids
    assert "ΔE" not in markdown(data)


def test_what_did_not_come_back_leaves_its_line_out():
    data = json.loads(json.dumps(colored("marching-cubes")))
    data["rows"][0]["colors"] = None
    assert not [at for at, *_ in Reader(page(data)).figures if at.startswith("/rows/0/colors")]
    assert markdown(data).count("the mesh, averaged |") == 1
    data["rows"][1]["colors"] = None
    assert "colors" not in Reader(page(data)).ids
