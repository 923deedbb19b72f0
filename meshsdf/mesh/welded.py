"""The shape of a mesh with equal positions made one vertex, and its edges."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Faces, Points, writable_alias
from .edge_table import EdgeTable, edge_table
from .weld import weld


@dataclass(frozen=True, eq=False)
class Welded:
    """What the two-set check and the distance transform both start from.

    Attributes
    ----------
    points : (u, 3) float64
        Different positions, in order of first appearance; world units.
    faces : (m, 3) int32
        The faces of the mesh in terms of them.
    table : EdgeTable
        Their edges.
    """

    points: Points
    faces: Faces
    table: EdgeTable


def weld_mesh(vertices: Points, faces: Faces) -> Welded:
    """Join equal positions and list the edges. O(n + m)."""
    labels, points = weld(vertices)
    if len(points) == len(vertices):
        joined = writable_alias(faces)
    else:
        joined = labels[faces] if len(faces) else np.empty((0, 3), np.int32)
    return Welded(points, joined, edge_table(joined, len(points)))
