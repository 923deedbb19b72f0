"""meshsdf convert: it says when distances are to a union."""

import numpy as np

from meshsdf.io import write_mesh
from meshsdf.mesh.primitives import box_mesh
from tests.mesh.shapes import joined


def test_convert_says_that_bodies_became_one(cli, tmp_path):
    path = tmp_path / "two.ply"
    write_mesh(path, joined(box_mesh(), box_mesh(center=(0.5, 0.25, 0.25))))
    words = "2 parts overlap or touch: distances are to the union; 12 of 24 faces lie inside it"
    for dense in ([], ["--dense"]):
        options = ["--resolution", "16", "--force", "--json", *dense]
        outcome = cli("convert", path, tmp_path / "two.npz", *options)
        assert outcome.code == 0
        assert [w for w in outcome.json["warnings"] if words in w]
        assert words in outcome.err
        assert outcome.json["n_inner_faces"] == 12
        parity = cli("convert", path, tmp_path / "two.npz", *options, "--sign", "parity")
        assert parity.json["warnings"] == []
        assert "n_inner_faces" not in parity.json


def test_convert_says_nothing_of_bodies_apart(cli, tmp_path):
    path = tmp_path / "two.ply"
    write_mesh(path, joined(box_mesh(), box_mesh(center=(1.5, 0.25, 0.25))))
    outcome = cli("convert", path, tmp_path / "two.npz", "--resolution", "16", "--json")
    assert outcome.json["warnings"] == []
    assert np.isfinite(outcome.json["seconds"]["distance"])
