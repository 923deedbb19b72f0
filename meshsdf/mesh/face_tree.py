"""A tree of boxes over faces in normalised coordinates, for searches among the faces themselves.

Coordinates are centred and scaled by a power of two, so that the largest is between 1/2 and 1:
tolerances are plain numbers, and nothing overflows whatever the units.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Int32

from ..arrays import FaceLabels, Faces, Points
from ..box import Box
from ..kernels.bvh import PAD, build_tree, triangle_boxes


@dataclass(frozen=True, eq=False)
class FaceTree:
    """Faces, and the tree over them.

    Attributes
    ----------
    points : (u, 3) float64
        Normalised.
    order : (m,) int32
        The face in each slot of the tree.
    faces : (m, 3) int32
        In the order of the slots.
    children, child_boxes : (k, 2) int32, (k, 12) float32
        See `kernels.bvh`.
    """

    points: Points
    order: FaceLabels
    faces: Faces
    children: Int32[np.ndarray, "k 2"]
    child_boxes: Float32[np.ndarray, "k 12"]

    @classmethod
    def of(cls, points: Points, faces: Faces) -> "FaceTree":
        """Build the tree. O(m log m)."""
        m = len(faces)
        used = np.zeros(len(points), np.bool_)
        used[faces] = True
        box = Box.around(points[used])
        _, exponent = np.frexp(0.5 * box.longest_side)
        normal = np.ldexp(points - box.center, -exponent)
        boxes = np.empty((m, 6), np.float32)
        triangle_boxes(normal[faces], PAD, boxes)
        order = np.empty(m, np.int32)
        children, child_boxes = np.empty((m + 1, 2), np.int32), np.empty((m + 1, 12), np.float32)
        n = build_tree(boxes, order, children, child_boxes)
        return cls(normal, order, faces[order], children[:n].copy(), child_boxes[:n].copy())

    def turned(self, axis: int) -> "FaceTree":
        """The same with ``axis`` in the place of z; the turn is a rotation."""
        if axis == 2:
            return self
        axes = [(axis + 1) % 3, (axis + 2) % 3, axis]
        boxes = self.child_boxes.reshape(-1, 4, 3)[..., axes].reshape(-1, 12)
        points = np.ascontiguousarray(self.points[:, axes])
        boxes = np.ascontiguousarray(boxes)
        return FaceTree(points, self.order, self.faces, self.children, boxes)
