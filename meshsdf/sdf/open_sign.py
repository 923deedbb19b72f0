"""The sign of a band around an open or badly oriented mesh, by generalised winding numbers.

A node is inside where the magnitude of the winding number exceeds 1/2 (Jacobson, Kavan, Sorkine
2013, doi:10.1145/2461912.2461916). Across an opening the sign changes far from any face: bricks
are added where it does, with no active nodes and +-background, so that the surface extracted from
the band is closed. The opening's membrane starts at the rim, inside the band, and is followed
from brick to brick through the faces on which the sign changes.
"""

import numpy as np

from ..arrays import Number
from ..grid import BrickIndex, NarrowBand
from ..grid.brick_index import BRICK
from ..mesh import Mesh
from ..progress import Progress
from ..spatial.winding_number import winding_number
from .memory import BYTES_PER_BRICK, require_memory

BRICKS_AT_ONCE = 4096  # 2 M points, 50 MB


def sign_by_winding_number(
    band: NarrowBand, mesh: Mesh, *, max_memory: Number | None, progress: Progress
) -> NarrowBand:
    """Return the unsigned band with signs, and with bricks added along the membranes.

    Notes
    -----
    Accuracy: distances are untouched. The sign is that of libigl's fast winding number, exact
    where its magnitude is farther from 1/2 than that method's error (about 0.01); nodes of one
    missing region get one sign, that of its first brick.
    """
    inside = _inside(band, mesh, band.index.coordinates, progress)
    coordinates = band.index.coordinates
    while True:
        grown = _across_mixed_faces(coordinates, inside)
        if len(grown) == 0:
            break
        n = len(coordinates) + len(grown)
        require_memory(2 * n * BYTES_PER_BRICK, max_memory, where="mesh_to_band(...): openings")
        more = _inside(band, mesh, grown, progress)
        coordinates = np.concatenate([coordinates, grown])
        inside = np.concatenate([inside, more])
        order = np.lexsort(coordinates.T[::-1])
        coordinates, inside = coordinates[order], inside[order]
    index = BrickIndex.from_coordinates(coordinates, _inner_bricks(band, mesh, coordinates))
    return _signed(band, index, inside)


def _inside(band: NarrowBand, mesh: Mesh, bricks: np.ndarray, progress: Progress) -> np.ndarray:
    """(b, 8, 8, 8) bool: which nodes of the bricks are inside."""
    inside = np.empty((len(bricks), BRICK, BRICK, BRICK), bool)
    offsets = np.indices((BRICK, BRICK, BRICK)).reshape(3, -1).T
    for first in range(0, len(bricks), BRICKS_AT_ONCE):
        some = slice(first, first + BRICKS_AT_ONCE)
        ijk = (bricks[some, None, :] * BRICK + offsets).reshape(-1, 3)
        wound = winding_number(mesh, band.to_world(ijk))
        inside[some] = (np.abs(wound) > 0.5).reshape(-1, BRICK, BRICK, BRICK)
        progress("sign", min(1.0, (first + BRICKS_AT_ONCE) / len(bricks)))
    return inside


def _across_mixed_faces(coordinates: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Missing bricks next to a brick face on which the sign changes, in lexicographic order."""
    found = []
    for axis in range(3):
        for side, step in ((0, -1), (BRICK - 1, 1)):
            layer = inside.take(side, axis=axis + 1).reshape(len(inside), -1)
            mixed = layer.any(axis=1) & ~layer.all(axis=1)
            found.append(coordinates[mixed] + step * np.eye(3, dtype=np.int64)[axis])
    candidates = np.unique(np.concatenate(found), axis=0)
    known = BrickIndex.from_coordinates(coordinates)
    return candidates[known.lookup(candidates) < 0]


def _inner_bricks(band: NarrowBand, mesh: Mesh, coordinates: np.ndarray) -> np.ndarray:
    """Missing bricks that lie inside; each connected region of them is judged once."""
    from scipy import ndimage  # only open meshes wait for it

    low = coordinates.min(axis=0) - 1
    missing = np.ones(coordinates.max(axis=0) - low + 2, bool)
    missing[tuple((coordinates - low).T)] = False
    regions, _ = ndimage.label(missing, structure=np.ones((3, 3, 3)))
    outer = regions[0, 0, 0]
    flat = regions.ravel()
    _, first = np.unique(flat, return_index=True)
    first = first[np.isin(flat[first], [0, outer], invert=True)]
    if len(first) == 0:
        return np.empty((0, 3), np.int64)
    bricks = np.stack(np.unravel_index(first, regions.shape), axis=1) + low
    wound = winding_number(mesh, band.to_world(bricks * BRICK + BRICK // 2))
    inner = flat[first][np.abs(wound) > 0.5]
    return np.argwhere(np.isin(regions, inner)) + low


def _signed(band: NarrowBand, index: BrickIndex, inside: np.ndarray) -> NarrowBand:
    """The band on a larger index; new bricks are empty but for their sign."""
    old = index.lookup(band.index.coordinates)

    def spread(array: np.ndarray | None, empty: Number) -> np.ndarray | None:
        if array is None:
            return None
        wide = np.full((index.n_bricks, *array.shape[1:]), empty, array.dtype)
        wide[old] = array
        return wide

    values = spread(band.values, band.background)
    np.negative(values, out=values, where=inside)
    return NarrowBand(
        index,
        values,
        spread(band.active, 0),
        band.voxel_size,
        band.translation,
        band.half_width,
        "winding",
        spread(band.closest_face, -1),
        spread(band.barycentric, 0.0),
    )
