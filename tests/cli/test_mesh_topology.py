"""`meshsdf mesh --topology`: the choice reaches the surface."""

import numpy as np

from meshsdf.grid import Grid
from meshsdf.io import read_mesh, write_volume


def test_mesh_joins_inside_corners_only_where_asked(cli, tmp_path):
    values = np.ones((9, 9, 9), np.float32)
    for n in range(2, 7):
        values[n, n, 4] = -3.0  # a bar along a diagonal, for the interpolant
    grid = tmp_path / "a.npz"
    write_volume(grid, Grid(values, 1.0, np.zeros(3)))
    euler = {}
    for topology in ("manifold", "trilinear"):
        out = tmp_path / f"{topology}.ply"
        told = cli("mesh", grid, out, "--topology", topology, "--json").json
        assert told["is_watertight"]
        assert read_mesh(out).n_faces == told["n_faces"]
        euler[topology] = told["euler_number"]
    assert euler == {"manifold": 10, "trilinear": 2}
    assert cli("mesh", grid, tmp_path / "c.ply", "--json").json["euler_number"] == 10


def test_mesh_refuses_a_topology_of_another_name(cli, tmp_path):
    outcome = cli("mesh", tmp_path / "a.npz", tmp_path / "b.ply", "--topology", "exact")
    assert outcome.code == 2
    assert "'manifold', 'trilinear'" in outcome.err
