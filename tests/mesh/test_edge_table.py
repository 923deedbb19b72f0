"""Edges, read off the stars of vertices, against a dictionary of half-edges."""

from collections import defaultdict

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from meshsdf.mesh.components import component_labels
from meshsdf.mesh.edge_table import edge_table
from meshsdf.mesh.primitives import box_mesh

any_faces = st.integers(1, 9).flatmap(
    lambda n: st.tuples(
        st.just(n),
        arrays(np.int32, st.tuples(st.integers(0, 25), st.just(3)), elements=st.integers(0, n - 1)),
    )
)


def half_edges_by_edge(faces):
    """{(low, high): [(half-edge, +1 from low to high or -1), ...]}; repeated corners left out."""
    uses = defaultdict(list)
    for f, corners in enumerate(faces.tolist()):
        if len(set(corners)) == 3:
            for e in range(3):
                p, q = corners[e], corners[(e + 1) % 3]
                uses[min(p, q), max(p, q)].append((3 * f + e, 1 if p < q else -1))
    return dict(sorted(uses.items()))


def n_fans(faces, v):
    """Sets of faces around v that edges at v connect, and whether an edge has over two faces."""
    around = [set(c) - {v} for c in faces.tolist() if v in c and len(set(c)) == 3]
    sets = []
    for ends in around:
        touching = [s for s in sets if s & ends]
        sets = [s for s in sets if not s & ends] + [set.union(ends, *touching)]
    crowded = any(sum(w in ends for ends in around) > 2 for ends in around for w in ends)
    return len(sets), crowded


@given(any_faces)
def test_the_table_is_that_of_a_dictionary(given_faces):
    n, faces = given_faces
    table, uses = edge_table(faces, n), half_edges_by_edge(faces)
    nets = [sum(sign for _, sign in each) for each in uses.values()]
    counts = [len(each) for each in uses.values()]
    assert table.edges.tolist() == [list(edge) for edge in uses]
    assert table.half_edges.tolist() == [h for each in uses.values() for h, _ in each]
    assert table.n_uses.tolist() == counts
    assert table.net_uses.tolist() == nets
    assert table.n_odd == sum(count % 2 for count in counts)
    assert table.n_unbalanced == sum(net != 0 for net in nets)
    assert table.n_conflicts == sum(
        net != 0 and count % 2 == 0 for net, count in zip(nets, counts, strict=True)
    )
    assert table.n_nonmanifold == sum(count > 2 for count in counts)
    for e, edge in enumerate(uses.values()):
        assert all(table.edge_of_corner.ravel()[h] == e for h, _ in edge)
    sheets = [tuple(sorted(c)) for c in faces.tolist() if len(set(c)) == 3]
    if len(set(sheets)) < len(sheets):
        assert table.may_have_twins
    fans = [n_fans(faces, v) for v in range(n)]
    assert table.is_branching.tolist() == [crowded or number > 1 for number, crowded in fans]


def test_a_needle_fan_and_a_crowded_edge():
    rim = np.arange(1, 5001, dtype=np.int32)
    fan = np.stack([np.zeros_like(rim), rim, np.roll(rim, -1)], axis=1)
    table = edge_table(fan, 5001)
    assert table.n_edges == 10000
    assert not table.is_branching.any()
    assert (table.n_odd, table.may_have_twins) == (5000, False)
    book = np.stack([np.zeros_like(rim), np.ones_like(rim), rim + 1], axis=1)
    table = edge_table(book, 5002)
    assert table.n_uses.max() == 5000
    assert np.flatnonzero(table.is_branching).tolist() == [0, 1]
    assert component_labels(table)[1] == 1


def test_many_faces_are_cut_into_ranges_that_agree_with_one(monkeypatch):
    mesh = box_mesh()
    n = 3000
    faces = (mesh.faces + 8 * np.arange(n, dtype=np.int32)[:, None, None]).reshape(-1, 3)
    tables, labels = [], []
    for threads in (1, 4):
        for module in ("edge_table", "components"):
            monkeypatch.setattr(f"meshsdf.mesh.{module}.n_threads", lambda threads=threads: threads)
        tables.append(edge_table(faces, 8 * n))
        labels.append(component_labels(tables[-1]))
    assert (tables[0].edges == tables[1].edges).all()
    assert (tables[0].half_edges == tables[1].half_edges).all()
    assert labels[0][1] == labels[1][1] == n
    assert (labels[0][0] == np.repeat(np.arange(n), 12)).all()
    assert (labels[0][0] == labels[1][0]).all()
