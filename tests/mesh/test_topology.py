"""meshsdf.mesh.topology: by index and by position, in one sentence."""

import numpy as np

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere, tetrahedron
from meshsdf.mesh.topology import topology


def together(*meshes: Mesh) -> Mesh:
    """All of them as one mesh, no vertex joined."""
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)]).astype(np.int32)
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def moved(mesh: Mesh, by: tuple) -> Mesh:
    return Mesh(mesh.vertices + np.array(by, float), mesh.faces)


def test_parts_and_specks_are_counted():
    ball = icosphere(subdivisions=2)
    specks = moved(tetrahedron(), (9, 0, 0)), moved(tetrahedron(), (0, 9, 0))
    assert topology(ball).describe() == "closed, Euler number 2, 1 part"
    one, two = topology(together(ball, specks[0])), topology(together(ball, *specks))
    assert one.describe().endswith("2 parts, 1 of them a speck of at most 8 faces")
    assert two.describe() == (
        "closed, Euler number 6, 3 parts, 2 of them specks of at most 8 faces"
    )
    assert (two.n_parts, two.n_specks, two.euler_number) == (3, 2, 6)


def test_boxes_that_touch_along_an_edge_are_closed_by_index_alone():
    found = topology(together(box_mesh(), moved(box_mesh(), (1, 1, 0))))
    assert found.is_watertight
    assert not found.is_watertight_by_position
    assert (found.euler_number, found.euler_number_by_position) == (4, 3)  # they share an edge
    assert found.n_repeated_places == 2
    assert found.describe().endswith(
        "by index; 2 vertices share places: tools that merge them see Euler number 3, not closed"
    )


def test_faces_with_corners_of_their_own_are_closed_by_position_alone():
    box = box_mesh()
    loose = Mesh(box.triangles.reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(-1, 3))
    found = topology(loose)
    assert (found.is_watertight, found.is_watertight_by_position) == (False, True)
    assert found.describe("open here").startswith("open here, Euler number 12, 12 parts, 12 of ")


def test_a_mesh_without_faces_is_nothing():
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert topology(nothing).describe() == "not closed, Euler number 0, 0 parts"
