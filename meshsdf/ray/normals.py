"""Normals that a mesh is shaded with: of its faces, or smooth with creases kept."""

from math import cos, radians

import numpy as np
from jaxtyping import Float64

from ..arrays import Number
from ..kernels.corner_normals import corner_angles, corner_normals, corners_by_vertex
from ..kernels.parallel import even_ranges, run_pieces
from ..mesh import Mesh
from ..mesh.measures import face_areas, face_normals
from ..mesh.weld import weld

FaceNormals = Float64[np.ndarray, "m 3"]

FACES_PER_PIECE = 16384
CREASE = 40.0  # degrees; faces that meet at more keep their edge
COARSE = 0.04  # of the box's diagonal: faces with longer sides are shown as they are


def smooth_normals(
    mesh: Mesh, *, crease: Number = CREASE, of_faces: FaceNormals | None = None
) -> Float64[np.ndarray, "m 3 3"]:
    """Return unit normals at the three corners of every face.

    Parameters
    ----------
    mesh : Mesh
        Equal positions count as one vertex.
    crease : float
        Degrees; faces around a vertex are averaged, weighted by their angles there, if they meet
        the corner's own face at no more.
    of_faces : (m, 3) float64, optional
        What `face_normals` returned, if that is known.

    Returns
    -------
    normals : (m, 3, 3) float64
        On the side of the face's own normal; zero for faces without area.

    Notes
    -----
    Limits: around a vertex of more than 256 faces all are averaged, and where that is not within
    the crease angle of the face's own normal, that one is taken.
    """
    labels, points = weld(mesh.vertices)
    faces, m = labels[mesh.faces], mesh.n_faces
    starts, corners = np.empty(len(points) + 1, np.int64), np.empty(3 * m, np.int64)
    corners_by_vertex(faces, starts, corners)
    angles = np.empty((m, 3))
    normals = face_normals(mesh) if of_faces is None else of_faces
    result = np.empty((m, 3, 3))
    pieces = even_ranges(m, m // FACES_PER_PIECE + 1)
    run_pieces(lambda piece: corner_angles(points, faces, *pieces[piece], angles), len(pieces))

    def work(piece: int) -> None:
        corner_normals(
            *(faces, normals, angles, starts, corners, cos(radians(crease))),
            *(*pieces[piece], result),
        )

    run_pieces(work, len(pieces))
    return result


def is_fine(mesh: Mesh) -> bool:
    """Tell whether faces are so small that their edges are better not seen."""
    side = np.sqrt(2.0 * np.median(face_areas(mesh)))
    return bool(side < COARSE * mesh.box.diagonal)
