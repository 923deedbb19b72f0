"""meshsdf.mesh.two_set_words: the verdict for people and for machines."""

import json

import numpy as np
import pytest

from meshsdf.mesh import check

from .shapes import (
    cube,
    flipped,
    joined,
    klein_bottle,
    make,
    soup_of,
    with_faces,
    with_t_junction,
    without_faces,
)

CONTRACT = {
    *("two_set", "two_set_by_index", "oriented", "n_vertices", "n_faces", "n_components"),
    *("n_open_edges", "holes", "n_degenerate_faces", "n_duplicate_faces", "recommended_sign"),
}

SENTENCES = [
    (cube(), "two-set: every edge has an even number of faces."),
    (soup_of(cube()), "closed once 28 vertices at repeated positions are merged"),
    (
        with_t_junction(cube(), 0, (0, 0, 0.5)),
        "3 edges cancel exactly on common lines (T-junctions)",
    ),
    (
        without_faces(cube(), 0, 1),
        "not two-set: 1 hole of 4 edges, 4 units long, near (0, 0.5, 0.5)",
    ),
    (without_faces(cube(), 0, 1), "further than 0.64 units from the rim"),  # 4 / 2π
    (without_faces(cube(), 0, 6), "not two-set: 2 holes, the largest of 3 edges, 3.41 units long"),
    (klein_bottle(), "convert will count crossings (parity)"),
    (flipped(cube(), 0), "not oriented: faces disagree about their front at 3 edges."),
    (flipped(cube(), *range(12)), "1 part is inside out"),
    (joined(cube(), cube((3, 0, 0))), "2 parts, 2 of them closed by themselves."),
    (joined(cube(), cube((1, 1, 1))), "1 vertex where sheets touch or branch"),
    (joined(cube(), cube((0.5, 0.4, 0.3))), "of faces cross (first near ("),
    (with_faces(cube(), (0, 0, 3)), "1 face of zero area"),
    (with_faces(cube(), (0, 1, 3)), "1 face with the same corners as another"),
    (make(np.eye(3), [(0, 1, 2)]), "convert will write unsigned distances: 100% of the edges"),
]


@pytest.mark.parametrize(("mesh", "sentence"), SENTENCES)
def test_the_words_say_what_where_and_what_follows(mesh, sentence):
    words = check(mesh).describe()
    assert sentence in words
    assert "\nconvert will " in words


@pytest.mark.parametrize("mesh", [mesh for mesh, _ in SENTENCES])
def test_json_is_plain_and_holds_what_scripts_rely_on(mesh):
    found = check(mesh).to_json()
    assert set(found) >= CONTRACT
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    for hole in found["holes"]:
        assert hole["length"] > 0
        assert hole["n_edges"] >= 2
