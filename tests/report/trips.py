"""Small round trips that the tests of reports share."""

from functools import cache

import numpy as np

from meshsdf.mesh import Mesh, check
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report.report_data import Asked, report_data
from meshsdf.report.roundtrip import roundtrip
from meshsdf.sdf import choose_sign

TURN = np.array([[2.0, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3  # a rotation


def turned_box() -> Mesh:
    """A box that no lattice plane meets at a right angle: its edges are cut off on the way."""
    box = box_mesh((2.0, 1.5, 1.0))
    return Mesh(box.vertices @ TURN.T, box.faces)


def open_ball() -> Mesh:
    """A sphere that lacks the faces around one vertex."""
    ball = icosphere(subdivisions=2)
    return Mesh(ball.vertices, ball.faces[(ball.faces != 0).all(axis=1)])


def sheet() -> Mesh:
    """Two triangles without an inside."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]], float)
    return Mesh(corners, np.array([[0, 1, 2], [1, 3, 2]], np.int32))


def thin_plate() -> Mesh:
    """Between two layers of nodes: nothing of it comes back."""
    plate = box_mesh((2.0, 2.0, 0.01))
    return Mesh(plate.vertices + 0.06, plate.faces)


MESHES = {"box": turned_box, "open": open_ball, "sheet": sheet, "plate": thin_plate}


@cache
def facts(
    name: str, resolutions: tuple = (6, 12), methods: tuple = ("marching-cubes",), file: str = ""
) -> tuple:
    """The arguments of `render_reports` for one of the meshes above."""
    mesh = MESHES[name]()
    found = check(mesh, self_intersections=False)
    choice = choose_sign(found)
    trip = roundtrip(mesh, resolutions, methods=methods, report=found, details=True)
    asked = Asked(file or f"{name}.ply", command=f"meshsdf roundtrip {name}.ply")
    return trip, mesh, found, choice, asked


def data_of(*arguments, **options) -> dict:
    """The dict of such a report."""
    return report_data(*facts(*arguments, **options))
