"""The sign of a band around an open or badly oriented mesh, by generalised winding numbers.

A node is inside where the magnitude of the winding number exceeds 1/2 (Jacobson, Kavan, Sorkine
2013, doi:10.1145/2461912.2461916). Across an opening the sign changes far from any face: bricks
are added where it does, with no active nodes and +-background, so that the surface extracted from
the band is closed. The opening's membrane starts at the rim, inside the band, and is followed
from brick to brick through the faces on which, or between which, the sign changes.
"""

from dataclasses import replace

import numpy as np

from ..arrays import Number
from ..grid import BrickIndex, NarrowBand
from ..kernels.brick_finish import NEGATIVE_ZERO
from ..kernels.open_signs import HALF
from ..kernels.sign_changes import mark_mixed_faces
from ..progress import Progress
from .brick_gaps import BrickGaps
from .lattice_winding import LatticeWinding
from .memory import BYTES_PER_BRICK, require_memory
from .placed_mesh import PlacedMesh

BRICKS_AT_ONCE = 4096  # bounds the memory of intermediate results

# To the neighbours through the faces -x, +x, -y, +y, -z, +z
STEPS = np.repeat(np.eye(3, dtype=np.int64), 2, axis=0) * np.tile([[-1], [1]], (3, 1))


def sign_by_winding_number(
    band: NarrowBand, placed: PlacedMesh, *, max_memory: Number | None, progress: Progress
) -> NarrowBand:
    """Return the unsigned band with signs, and with bricks added along the membranes.

    The values of ``band`` are used up.

    Notes
    -----
    Accuracy: distances are untouched. The sign is that of the exact generalised winding number,
    up to rounding (1e-12, or more within 1e-6 voxels of a boundary edge); nodes within 1e-9 of
    1/2 are outside. Near more than a thousand boundary edges, nodes whose number is not within
    0.01 of 1/2 by libigl's approximation (its error has no proven bound; 4e-3 is the largest
    seen) are not evaluated exactly. Nodes of one missing region get one sign, that of its first
    brick. ``uncertain`` marks the nodes of bricks at which the number is nearer to 1/2 than 0.05.
    """
    winding = LatticeWinding(placed, band.index)
    own, doubts = winding.first_sides(progress)
    more_doubts = np.empty((0, doubts.shape[1]), np.uint64)
    bricks, inside = np.empty((0, 3), np.int64), np.empty((0, *own.shape[1:]), np.bool_)
    last = band.index.coordinates
    while True:
        grown = BrickIndex.from_coordinates(bricks)
        fresh = _beyond_changes(last, own, inside, (band.index, grown))
        if len(fresh) == 0:
            break
        n = band.index.n_bricks + len(bricks) + len(fresh)
        require_memory(2 * n * BYTES_PER_BRICK, max_memory, where="mesh_to_band(...): openings")
        more, new_doubts = winding.sides(fresh, progress)
        last = fresh
        bricks, inside, more_doubts = _merge(
            (bricks, inside, more_doubts), (fresh, more, new_doubts)
        )
    _negate(band.values, own)
    del own
    everything = np.concatenate([band.index.coordinates, bricks])
    everything = everything[np.lexsort(everything.T[::-1])]
    inner = _inner_runs(winding, everything)
    band = replace(band, sign="winding", uncertain=doubts)
    return _with_bricks(band, everything, inner, bricks, inside, more_doubts)


def _negate(values: np.ndarray, inside: np.ndarray) -> None:
    """Make values negative where ``inside``, in place."""
    for first in range(0, len(values), BRICKS_AT_ONCE):
        some, within = (
            values[first : first + BRICKS_AT_ONCE],
            inside[first : first + BRICKS_AT_ONCE],
        )
        np.negative(some, out=some, where=within)
        some[within & (some == 0)] = NEGATIVE_ZERO


def _merge(some: tuple[np.ndarray, ...], more: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    """Both sets of bricks, and what belongs to them, in lexicographic order."""
    joined = [np.concatenate(pair) for pair in zip(some, more, strict=True)]
    order = np.lexsort(joined[0].T[::-1])
    return tuple(array[order] for array in joined)


def _slots(bricks: np.ndarray, indices: tuple[BrickIndex, BrickIndex]) -> np.ndarray:
    """Slots of bricks in the band's index, or behind those in that of the grown; else negative."""
    found, grown = (index.lookup(bricks) for index in indices)
    return np.where(grown >= 0, grown + indices[0].n_bricks, found).astype(np.int32)


def _beyond_changes(
    bricks: np.ndarray, own: np.ndarray, inside: np.ndarray, indices: tuple[BrickIndex, BrickIndex]
) -> np.ndarray:
    """Missing bricks into which a change of sign in or next to one of ``bricks`` goes on."""
    beside = np.stack([_slots(bricks + step, indices) for step in STEPS], axis=1)
    mixed = np.empty((len(bricks), 6), np.bool_)
    mixed_beside = np.empty((len(bricks), 6, 6), np.bool_)
    mark_mixed_faces(own, inside, _slots(bricks, indices), beside, mixed, mixed_beside)
    brick, face = np.nonzero(mixed & (beside < 0))
    candidates = bricks[brick] + STEPS[face]
    brick, way, face = np.nonzero(mixed_beside)
    candidates = np.concatenate([candidates, bricks[brick] + STEPS[way] + STEPS[face]])
    candidates = candidates[_slots(candidates, indices) < 0]
    return np.unique(candidates, axis=0)


def _inner_runs(winding: LatticeWinding, coordinates: np.ndarray) -> np.ndarray:
    """Runs of missing bricks that lie inside; each connected region of them is judged once."""
    gaps = BrickGaps.between(coordinates)
    bricks = gaps.first_bricks()
    if len(bricks) == 0:
        return gaps.runs[:0]
    is_inner = np.abs(winding.at_centers(bricks)) > HALF
    return gaps.runs[(gaps.region >= 0) & is_inner[gaps.region]]


def _with_bricks(
    band: NarrowBand,
    coordinates: np.ndarray,
    inner: np.ndarray,
    more: np.ndarray,
    inside: np.ndarray,
    doubts: np.ndarray,
) -> NarrowBand:
    """The band on a larger index; the bricks ``more`` are empty but for their sign."""
    index = band.index
    if len(more) or len(inner):
        index = BrickIndex.from_coordinates(coordinates, inner)
    old = index.lookup(band.index.coordinates)

    def spread(array: np.ndarray | None, empty: Number) -> np.ndarray | None:
        if array is None or len(array) == index.n_bricks:
            return array
        wide = np.full((index.n_bricks, *array.shape[1:]), empty, array.dtype)
        wide[old] = array
        return wide

    values = spread(band.values, band.background)
    uncertain = spread(band.uncertain, 0)
    new = index.lookup(more)
    values[new] = np.where(inside, -band.background, band.background)
    uncertain[new] = doubts
    return replace(
        band,
        index=index,
        values=values,
        active=spread(band.active, 0),
        uncertain=uncertain,
        closest_face=spread(band.closest_face, -1),
        barycentric=spread(band.barycentric, 0.0),
    )
