"""The sign of a band around an open or badly oriented mesh, by generalised winding numbers.

A node is inside where the magnitude of the winding number exceeds 1/2 (Jacobson, Kavan, Sorkine
2013, doi:10.1145/2461912.2461916). Across an opening the sign changes far from any face: bricks
are added where it does, with no active nodes and +-background, so that the surface extracted from
the band is closed. The opening's membrane starts at the rim, inside the band, and is followed
from brick to brick through the faces on which the sign changes.
"""

from dataclasses import replace

import numpy as np

from ..arrays import Number
from ..grid import BrickIndex, NarrowBand
from ..kernels.open_signs import mark_mixed_faces
from ..progress import Progress
from .lattice_winding import LatticeWinding
from .memory import BYTES_PER_BRICK, require_memory
from .placed_mesh import PlacedMesh


def sign_by_winding_number(
    band: NarrowBand, placed: PlacedMesh, *, max_memory: Number | None, progress: Progress
) -> NarrowBand:
    """Return the unsigned band with signs, and with bricks added along the membranes.

    The values of ``band`` are used up.

    Notes
    -----
    Accuracy: distances are untouched. The sign is that of the exact generalised winding number,
    up to rounding (1e-12, or more within 1e-6 voxels of a boundary edge); nodes of one missing
    region get one sign, that of its first brick. ``uncertain_voxels`` counts the nodes of bricks
    at which it is nearer to 1/2 than 0.05.
    """
    winding = LatticeWinding(placed, band.index)
    inside, uncertain = winding.first_sides(progress)
    bricks, sides = [band.index.coordinates], [inside]
    n_uncertain, n = int(uncertain.sum()), band.index.n_bricks
    grown = _across_mixed_faces(bricks, inside, band.index)
    while len(grown):
        n += len(grown)
        require_memory(2 * n * BYTES_PER_BRICK, max_memory, where="mesh_to_band(...): openings")
        inside, uncertain = winding.sides(grown, progress)
        n_uncertain += int(uncertain.sum())
        bricks.append(grown)
        sides.append(inside)
        grown = _across_mixed_faces(bricks, inside, band.index)
    coordinates, inside = bricks[0], sides[0]
    if len(bricks) > 1:
        coordinates, inside = np.concatenate(bricks), np.concatenate(sides)
        order = np.lexsort(coordinates.T[::-1])
        coordinates, inside = coordinates[order], inside[order]
    inner = _inner_bricks(winding, coordinates)
    return _signed(band, coordinates, inner, inside, n_uncertain)


def _across_mixed_faces(
    bricks: list[np.ndarray], inside: np.ndarray, index: BrickIndex
) -> np.ndarray:
    """Bricks not yet known next to faces of the last of ``bricks`` on which the sign changes.

    Known are those of the index and those that were grown: all of ``bricks``.
    """
    mixed = np.empty((len(inside), 6), np.bool_)
    mark_mixed_faces(inside, mixed)
    found = []
    for face in range(6):
        step = (2 * (face & 1) - 1) * np.eye(3, dtype=np.int64)[face >> 1]
        beyond = bricks[-1][mixed[:, face]] + step
        found.append(beyond[index.lookup(beyond) < 0])
    candidates = np.unique(np.concatenate(found), axis=0)
    if len(bricks) == 1 or len(candidates) == 0:
        return candidates
    grown = BrickIndex.from_coordinates(np.unique(np.concatenate(bricks[1:]), axis=0))
    return candidates[grown.lookup(candidates) < 0]


def _inner_bricks(winding: LatticeWinding, coordinates: np.ndarray) -> np.ndarray:
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
    inner = flat[first][np.abs(winding.at_centers(bricks)) > 0.5]
    return np.argwhere(np.isin(regions, inner)) + low


def _signed(
    band: NarrowBand,
    coordinates: np.ndarray,
    inner: np.ndarray,
    inside: np.ndarray,
    n_uncertain: int,
) -> NarrowBand:
    """The band on a larger index; new bricks are empty but for their sign."""
    index = band.index
    if len(coordinates) > index.n_bricks or len(inner):
        index = BrickIndex.from_coordinates(coordinates, inner)
    old = index.lookup(band.index.coordinates)

    def spread(array: np.ndarray | None, empty: Number) -> np.ndarray | None:
        if array is None or len(array) == index.n_bricks:
            return array
        wide = np.full((index.n_bricks, *array.shape[1:]), empty, array.dtype)
        wide[old] = array
        return wide

    values = spread(band.values, band.background)
    np.negative(values, out=values, where=inside)
    return replace(
        band,
        index=index,
        values=values,
        active=spread(band.active, 0),
        sign="winding",
        closest_face=spread(band.closest_face, -1),
        barycentric=spread(band.barycentric, 0.0),
        uncertain_voxels=n_uncertain,
    )
