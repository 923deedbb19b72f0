"""Cracks: rims that meet but for rounding, and how far vertices must move to close them.

Files written by CAD programs often repeat a corner with slightly different numbers. Exactly read,
such a mesh is open: the crack is real, only its width is not worth a sign. Here the vertices of
open edges are welded within a distance that gives each of them a partner, as long as that is less
than half of every open edge, or within rounding: cracks are zipped, but no hole is collapsed.

Certificate. Let two repairs each move no vertex by more than w and close the mesh. The prism
between them stays within w of the mesh, and what the open edges sweep stays within w of the open
edges. If space without the 2 w-neighbourhood of the welded rims is connected (`rim_graph`), the
two repairs therefore agree on inside and outside at every point further than 3 w from the mesh.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Faces, Indices, Points
from .edge_chain import residual_lines
from .edge_table import edge_table
from .pieces import connected_labels
from .rim_graph import complement_is_connected

HALF = 0.49  # of the shortest open edge: below one half, so that no edge collapses
MORE = 1 + 1e-9  # so that pairs at the very distance are found
ROUNDING = 10.0 ** np.arange(-15, -6)  # of the mesh's size: edges this short may collapse


@dataclass(frozen=True, eq=False)
class CrackRepair:
    """A weld of nearby vertices that closes a mesh.

    Attributes
    ----------
    labels : (u,) int32
        For each welded vertex, the one that stands for it.
    width : float
        World units; no vertex moves further, and no smaller weld of this kind closes the mesh.
    certain_beyond : float or None
        World units; further than this from the mesh every sign is proved: it is the same for all
        repairs that move no vertex by more than the width. None if the proof fails.
    oriented : bool
        The closed mesh is oriented.
    """

    labels: Indices
    width: float
    certain_beyond: float | None
    oriented: bool


def close_cracks(points: Points, faces: Faces, segments: np.ndarray) -> CrackRepair | None:
    """Weld the ends of open segments within a small distance; None unless that closes the mesh.

    Parameters
    ----------
    points, faces
        Welded at equal positions.
    segments : (s, 2) int
        What is left of the boundary, as vertices.
    """
    from scipy.spatial import cKDTree  # closed meshes never come here, and need not wait for it

    rim = np.unique(segments)
    tree = cKDTree(points[rim])
    shortest = np.linalg.norm(points[segments[:, 0]] - points[segments[:, 1]], axis=1).min()
    partner = tree.query(points[rim], k=2)[0][:, 1].max()
    size = np.ptp(points[rim], axis=0).max()
    widths = [width for width in (partner,) if width < HALF * shortest]
    for width in sorted([*widths, *(ROUNDING * size)]):
        if _weld_within(width, tree, rim, points, faces, segments) is not None:
            return _smallest_weld(width, tree, rim, points, faces, segments)
    return None


def _smallest_weld(
    width: float, tree, rim: np.ndarray, points: Points, faces: Faces, segments: np.ndarray
) -> CrackRepair:
    """Bisect the distances between rim vertices up to ``width``, which closes the mesh."""
    pairs = tree.query_pairs(width * MORE, output_type="ndarray")
    apart = np.linalg.norm(points[rim[pairs[:, 0]]] - points[rim[pairs[:, 1]]], axis=1)
    lengths = np.unique(apart)
    low, high = 0, len(lengths) - 1
    while low < high:
        middle = (low + high) // 2
        if _weld_within(lengths[middle], tree, rim, points, faces, segments) is None:
            low = middle + 1
        else:
            high = middle
    return _weld_within(lengths[high], tree, rim, points, faces, segments)


def _weld_within(
    width: float, tree, rim: np.ndarray, points: Points, faces: Faces, segments: np.ndarray
) -> CrackRepair | None:
    """Weld rim vertices up to ``width`` apart, found by the k-d tree; None if still open."""
    pairs = tree.query_pairs(width * MORE, output_type="ndarray")
    if len(pairs) == 0:
        return None
    labels = _weld_pairs(pairs, rim, len(points))
    table = edge_table(labels[faces], len(points))
    lines = None if table.is_balanced else residual_lines(table, points)
    if lines is not None and len(lines.survivors(points)):
        return None
    moved = float(np.linalg.norm(points - points[labels], axis=1).max())
    proved = complement_is_connected(points, labels[segments], 2 * moved)
    oriented = lines is None or lines.is_balanced()
    return CrackRepair(labels, moved, 3 * moved if proved else None, oriented)


def _weld_pairs(pairs: np.ndarray, rim: np.ndarray, n_points: int) -> np.ndarray:
    """Label every vertex by the lowest of those it is linked to."""
    cluster = connected_labels(len(rim), pairs)
    lowest = np.full(cluster.max() + 1, n_points)
    np.minimum.at(lowest, cluster, rim)
    labels = np.arange(n_points, dtype=np.int32)
    labels[rim] = lowest[cluster]
    return labels
