"""meshsdf.report.hausdorff beside another program that bounds the distance from both sides.

`cascading_upper_bounds` is the code of L. Sacht and A. Jacobson 2024, doi:10.1111/cgf.15129.
"""

import numpy as np
import pytest

from meshsdf.mesh import Mesh
from meshsdf.report.hausdorff import one_sided_hausdorff

from .mesh_pairs import mesh_pair

cascading = pytest.importorskip(
    "cascading_upper_bounds", reason="needs pip install cascading_upper_bounds"
)
WIDTH = 1e-6
ROUNDING = 1e-12


def folded_quads() -> tuple[Mesh, Mesh]:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0]])
    one, two = [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]
    return tuple(Mesh(vertices, np.array(faces, np.int32)) for faces in (one, two))


PAIRS = {"fold": folded_quads(), "dented spheres": mesh_pair(0), "open sheets": mesh_pair(39)}


def theirs(source: Mesh, target: Mesh) -> tuple[float, float]:
    arrays = [a.copy() for mesh in (source, target) for a in (mesh.vertices, mesh.faces)]
    return cascading.pompeiu_hausdorff(*arrays, WIDTH, 1e4, False)[:2]


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("is_forward", [True, False])
def test_both_intervals_hold_the_same_number(name, is_forward):
    source, target = PAIRS[name] if is_forward else PAIRS[name][::-1]
    lower, upper = theirs(source, target)
    assert lower > 0.05
    assert upper - lower <= WIDTH
    found = one_sided_hausdorff(source, target, tolerance=WIDTH).distance
    assert found.width <= WIDTH
    assert found.lower <= upper + ROUNDING
    assert lower <= found.upper + ROUNDING
