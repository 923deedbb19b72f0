"""Give every fan of faces a vertex of its own, where missing data tear a surface apart."""

import numpy as np

from ..mesh.pieces import connected_labels


def separate_fans(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Drop vertices without faces, and repeat those where cells without data part the faces."""
    corner = np.arange(faces.size).reshape(-1, 3)
    start, end = faces, np.roll(faces, -1, axis=1)
    key = start.astype(np.int64) * len(vertices) + end
    reverse = end.astype(np.int64) * len(vertices) + start
    order = np.argsort(key, axis=None)
    at = np.searchsorted(key.ravel()[order], reverse.ravel()).clip(max=max(key.size - 1, 0))
    partner = order[at]
    has_partner = key.ravel()[partner] == reverse.ravel()
    # The edge runs from this corner to the next; its partner from that corner's twin to ours.
    here = corner.ravel()[has_partner]
    there = np.roll(corner, -1, axis=1).ravel()[partner[has_partner]]
    fan = connected_labels(faces.size, np.column_stack([here, there]))
    n_fans = int(fan.max(initial=-1)) + 1
    origin = np.empty(n_fans, np.int64)
    origin[fan] = faces.ravel()
    ordered = np.lexsort((np.arange(n_fans), origin))
    rank = np.empty(n_fans, np.int32)
    rank[ordered] = np.arange(n_fans, dtype=np.int32)
    return vertices[origin[ordered]], rank[fan].reshape(-1, 3)
