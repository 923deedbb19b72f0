"""Close a surface flush with the border of a grid.

Surrounded by infinitely large values, a grid's surface closes in the border planes: an edge that
leaves the grid from an inside node is crossed at that node. A node on a border line has two such
edges and a corner three, with degenerate triangles between. Here they become one vertex.

A triangle lies in a border plane, and is a cap face, if and only if one of its vertices is such a
node: three edges within a border plane never share a triangle, as no diagonal lies in a cube face.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int64

from ..arrays import FaceLabels
from ..mesh import Material

SURFACE, CAP = 0, 1
MATERIALS = (Material("surface", np.ones(4, np.float32)), Material("cap", np.ones(4, np.float32)))
"""What the material index of a capped mesh points to."""


@dataclass(frozen=True, eq=False)
class Naming:
    """Numbers for vertices, of which those at one border node share one.

    Attributes
    ----------
    number : (n,) int64
        Of every vertex.
    is_new : (n,) bool
        Whether it is the first with its number.
    at_border : (n,) bool
        Whether it lies at a border node.
    nodes : (b,) int64
        Those border nodes, rising, as places in the grid in C order.
    node_number : (b,) int64
        The number of the vertex at each.
    """

    number: Int64[np.ndarray, " n"]
    is_new: Bool[np.ndarray, " n"]
    at_border: Bool[np.ndarray, " n"]
    nodes: Int64[np.ndarray, " b"]
    node_number: Int64[np.ndarray, " b"]

    def followed_by(self, other: "Naming") -> "Naming":
        """Those of both, one behind the other; border nodes are left out."""
        pairs = (
            (getattr(self, name), getattr(other, name))
            for name in ("number", "is_new", "at_border")
        )
        none = np.empty(0, np.int64)
        return Naming(*(np.concatenate(pair) for pair in pairs), none, none)

    def faces(self, corners: np.ndarray) -> tuple[Int64[np.ndarray, "m 3"], FaceLabels]:
        """Faces by number, without those that collapse; their places in `MATERIALS`."""
        faces = self.number[corners]
        a, b, c = faces.T
        is_whole = (a != b) & (b != c) & (c != a)
        is_cap = self.at_border[corners].any(axis=1)[is_whole]
        return faces[is_whole], np.where(is_cap, CAP, SURFACE).astype(np.int32)


def name_vertices(
    keys: Int64[np.ndarray, " n"],
    shape: tuple[int, ...],
    *,
    start: int = 0,
    before: Naming | None = None,
) -> Naming:
    """Number vertices from ``start`` on, and those at nodes seen ``before`` as they were then.

    ``keys`` are those of `PlaneSurface`, of a grid of the given shape.
    """
    index, node = _border_nodes(keys, shape)
    nodes, first, group = np.unique(node, return_index=True, return_inverse=True)
    is_new = np.ones(len(keys), bool)
    is_new[index] = False
    is_new[index[first]] = True
    is_known = np.zeros(len(nodes), bool)
    if before is not None and len(before.nodes):
        at = np.searchsorted(before.nodes, nodes).clip(max=len(before.nodes) - 1)
        is_known = before.nodes[at] == nodes
        is_new[index[first[is_known]]] = False
    number = start + np.cumsum(is_new) - 1
    node_number = number[index[first]]
    if is_known.any():
        node_number[is_known] = before.node_number[at[is_known]]
    number[index] = node_number[group]
    at_border = np.zeros(len(keys), bool)
    at_border[index] = True
    return Naming(number, is_new, at_border, nodes, node_number)


def _border_nodes(keys: np.ndarray, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Which vertices have edges that leave the grid, and the nodes that these leave."""
    place, axis = np.divmod(keys, 3)
    place, k = np.divmod(place, shape[2] + 2)
    node = np.stack([*np.divmod(place, shape[1] + 2), k]) - 1  # -1 is in the layer around the grid
    along = np.take_along_axis(node, axis[None], axis=0)[0]
    comes_in = along == -1
    index = np.flatnonzero((comes_in | (along == np.array(shape)[axis] - 1)) & (keys >= 0))
    node[axis[comes_in], np.flatnonzero(comes_in)] = 0
    i, j, k = node[:, index]
    return index, (i * shape[1] + j) * shape[2] + k
