"""meshsdf.report.verdict: one sentence that says how far, where, and what became of topology."""

from dataclasses import asdict

import pytest

from meshsdf.mesh.topology import Topology
from meshsdf.report.verdict import sentence, topology_words

from .trips import data_of

CLOSED = {"euler_number": 2, "n_components": 1, "genus": 0, "n_boundary_loops": 0}
OPEN = {"euler_number": 1, "n_components": 1, "genus": None, "n_boundary_loops": 1}
BY_INDEX = Topology(True, 2, 1, 0, 12, False, 3)
PINCHED = CLOSED | {"euler_number": 3, "genus": None, "topology": asdict(BY_INDEX)}


def words(before: dict, after: dict, n: int = 0) -> tuple[bool, str]:
    found = topology_words({"before": before, "after": after, "n_repeated_places": n})
    return found["is_kept"], found["sentence"]


def test_the_same_counts_keep_the_topology():
    assert words(CLOSED, CLOSED) == (
        True,
        "the topology is kept (Euler number 2, 1 component, no boundary loops)",
    )
    assert words(OPEN, OPEN, n=7)[0] is True


@pytest.mark.parametrize(
    ("after", "n", "told"),
    [
        (CLOSED | {"euler_number": 0, "genus": 1}, 0, "Euler number 2 → 0, genus 0 → 1"),
        (CLOSED | {"n_components": 3}, 0, "components 1 → 3"),
        (OPEN, 0, "Euler number 2 → 1, boundary loops 0 → 1"),
        (PINCHED, 0, "Euler number 2 → 3, counted by position); what came back is closed, Euler "),
        (PINCHED, 0, "12 vertices share places: tools that merge them see Euler number 3, not clo"),
    ],
)
def test_every_count_that_changed_is_told(after, n, told):
    is_kept, text = words(CLOSED, after, n)
    assert is_kept is False
    assert text.startswith("the topology is not kept (")
    assert told in text


def test_sharp_edges_are_told_where_there_are_some():
    row = data_of("box")["rows"][1]
    assert "its 12 sharp edges come back within" in sentence("a", row)
    assert "sharp" not in sentence("a", row | {"sharp_edges": None})
    one = row | {"sharp_edges": row["sharp_edges"] | {"n_edges": 1}}
    assert "its one sharp edge comes back within" in sentence("a", one)


def test_the_worst_place_is_that_of_the_farther_side():
    row = data_of("box")["rows"][1]
    assert f"face {row['forward']['source_face']} of the mesh" in sentence("a", row)
    turned = sentence("a", row | {"worst": "backward"})
    assert f"face {row['backward']['source_face']} of what came back" in turned
