"""What an extractor needs of a volume: bricks where the surface may pass, and what is around them.

A narrow band brings its bricks along; a dense grid is cut into bricks where its signs change.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int32, Int64, UInt64

from ..errors import SurfaceError
from ..grid import Grid, NarrowBand
from ..grid.brick_index import BRICK, INSIDE, OUTSIDE
from ..kernels.marching_cubes import NO_DATA, classify_bricks, cut_blocks, flag_blocks
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..progress import Progress, silent
from .cube_cases import CORNERS, EDGES

PIECES_PER_THREAD = 4
NODES_PER_PIECE = 2**15  # at least: less work than that is not worth a thread

_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
_OFFSETS = np.array(CORNERS, np.int64)


@dataclass(frozen=True, eq=False)
class BrickField:
    """Node values and signs of w bricks, of which the first b have stored values.

    Attributes
    ----------
    corners : (w, 3) int64
        Lowest node of each brick.
    values : (b, 8, 8, 8) float32 or float64
        Stored values.
    inside, valid : (w + 3, 8) uint64
        Bit ``8 j + k`` of word i: node (i, j, k) lies below the level; is not NaN. The last three
        rows stand for what is no brick: -3 no data, -2 inside, -1 outside.
    near : (w, 8) int32
        Brick or code at offset (x, y, z) of each brick, at ``4 x + 2 y + z``.
    background : float
        Magnitude of the value of constant bricks.
    has_gaps : bool
        Whether NaN occurs among the values given.
    """

    corners: Int64[np.ndarray, "w 3"]
    values: Float[np.ndarray, "b 8 8 8"]
    inside: UInt64[np.ndarray, "w3 8"]
    valid: UInt64[np.ndarray, "w3 8"]
    near: Int32[np.ndarray, "w 8"]
    background: float
    has_gaps: bool


def in_ranges(
    work: Callable[[int, int], None],
    n_items: int,
    stage: str = "",
    progress: Progress = silent,
    *,
    nodes_per_item: int = BRICK**3,
) -> None:
    """Call ``work(start, stop)`` on pieces of ``range(n_items)``, on all cores."""
    if n_items:
        n_pieces = n_items * nodes_per_item // NODES_PER_PIECE
        ranges = even_ranges(n_items, min(n_pieces, PIECES_PER_THREAD * n_threads()))
        run_pieces(lambda p: work(*ranges[p]), len(ranges), stage=stage, progress=progress)


def field_of(
    volume: NarrowBand | Grid, level: float, border: str, progress: Progress = silent
) -> BrickField:
    """`field_of_band` or `field_of_grid`, whichever suits."""
    if isinstance(volume, NarrowBand):
        return field_of_band(volume, level, progress)
    return field_of_grid(volume, level, border, progress)


def field_of_band(band: NarrowBand, level: float, progress: Progress = silent) -> BrickField:
    """Take the bricks of a band, and the missing ones whose cells the surface may enter.

    Raises
    ------
    SurfaceError
        Of two missing bricks side by side, one is inside and one outside.
    """
    n = band.index.n_bricks
    coordinates = band.index.coordinates
    inside, valid = _classify(band.values, level, n, progress)
    near = np.stack([_lookup(band, coordinates + offset) for offset in _OFFSETS], axis=1)
    ghosts, states = _ghosts(band, inside[:n], near)
    around = np.stack([_lookup(band, ghosts + offset) for offset in _OFFSETS], axis=1)
    near = np.concatenate([near, around])
    everything = np.concatenate([coordinates, ghosts])
    _check_missing(near, everything)
    if len(ghosts):
        inside = np.insert(inside, n, inside[states], axis=0)
        valid = np.insert(valid, n, valid[states], axis=0)
        slot_of = {tuple(brick): n + g for g, brick in enumerate(ghosts.tolist())}
        for w, o in np.argwhere(near < 0):
            brick = tuple((everything[w] + _OFFSETS[o]).tolist())
            near[w, o] = slot_of.get(brick, near[w, o])
    has_gaps = bool((valid[:n] != _ALL).any())
    return BrickField(
        everything * BRICK, band.values, inside, valid, near, band.background, has_gaps
    )


def field_of_grid(grid: Grid, level: float, border: str, progress: Progress = silent) -> BrickField:
    """Cut a dense grid into bricks and keep those around a change of sign.

    With ``border="open"`` there are no data beyond the grid, else infinitely large values.
    """
    shift = 0 if border == "open" else 1
    values = np.ascontiguousarray(grid.values)
    keep = _blocks_to_keep(values, level, shift, progress)
    blocks = np.argwhere(keep)
    slots = np.full(np.array(keep.shape) + 1, NO_DATA, np.int32)
    slots[:-1, :-1, :-1][keep] = np.arange(len(blocks), dtype=np.int32)
    near = np.stack([slots[tuple((blocks + offset).T)] for offset in _OFFSETS], axis=1)
    corners = blocks * BRICK - shift
    fill = np.nan if border == "open" else np.inf
    bricks = np.full((len(blocks), BRICK, BRICK, BRICK), fill, values.dtype)
    in_ranges(lambda start, stop: cut_blocks(values, corners, start, stop, bricks), len(blocks))
    inside, valid = _classify(bricks, level, len(blocks), progress)
    known = int(np.bitwise_count(valid[: len(blocks)]).sum())
    nodes = np.minimum(corners + BRICK, values.shape) - np.maximum(corners, 0)
    expected = int(nodes.prod(axis=1).sum()) if border == "open" else 512 * len(blocks)
    return BrickField(corners, bricks, inside, valid, near, np.inf, known != expected)


def _lookup(band: NarrowBand, bricks: np.ndarray) -> np.ndarray:
    """Slot, INSIDE or OUTSIDE; constant tiles are outside, as for `NarrowBand.value_at`."""
    found = band.index.lookup(bricks)
    found[found < INSIDE] = OUTSIDE
    return found


def _classify(
    values: np.ndarray, level: float, n: int, progress: Progress
) -> tuple[np.ndarray, np.ndarray]:
    """The words `BrickField.inside` and `BrickField.valid`, without ghosts."""
    inside = np.zeros((n + 3, BRICK), np.uint64)
    valid = np.full((n + 3, BRICK), _ALL)
    valid[NO_DATA] = 0
    inside[INSIDE] = _ALL
    threshold = least_not_below(level, values.dtype)
    in_ranges(
        lambda start, stop: classify_bricks(values, threshold, start, stop, inside, valid),
        n,
        "signs",
        progress,
    )
    return inside, valid


def least_not_below(level: float, dtype: np.dtype) -> np.floating:
    """The least number of the type that is not below the level: v < level <=> v < threshold."""
    with np.errstate(over="ignore"):
        threshold = dtype.type(level)
    if float(threshold) < level:
        threshold = np.nextafter(threshold, dtype.type(np.inf))
    return threshold


def _touching(offset: np.ndarray, *, last: bool = False) -> np.ndarray:
    """(8,) words of a brick's nodes in its first (or last) layer along the axes of an offset."""
    layer = -1 if last else 0
    nodes = np.ones((BRICK, BRICK, BRICK), bool)
    for axis in np.flatnonzero(offset):
        kept = np.zeros(BRICK, bool)
        kept[layer] = True
        nodes &= np.expand_dims(kept, [a for a in range(3) if a != axis])
    packed = np.packbits(nodes.reshape(BRICK, -1), axis=1, bitorder="little")
    return packed.view("<u8").astype(np.uint64)[:, 0]


def _ghosts(
    band: NarrowBand, inside: np.ndarray, near: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Missing bricks whose cells may be crossed: coordinates in order, INSIDE or OUTSIDE.

    A crossed cell of a missing brick either holds a stored node of the other sign (`differs`),
    or an edge between a stored node and another missing brick (`leaks`). In a band of distances,
    at a level well within it, there are none.
    """
    coordinates = band.index.coordinates
    below = [_lookup(band, coordinates - offset) for offset in _OFFSETS]
    differs = np.stack(
        [_differ(inside, code, _touching(o)) for code, o in zip(below, _OFFSETS, strict=True)]
    )
    axes = (1, 2, 4)
    leaks = differs[axes, :].any(axis=0)
    for o in axes:
        leaks |= _differ(inside, near[:, o], _touching(_OFFSETS[o], last=True))
    found = {}
    for o in range(1, 8):
        rows = np.flatnonzero((below[o] < 0) & (differs[o] | leaks))
        bricks = (coordinates[rows] - _OFFSETS[o]).tolist()
        found |= {tuple(b): c for b, c in zip(bricks, below[o][rows].tolist(), strict=True)}
    ordered = sorted(found)
    states = np.array([found[brick] for brick in ordered], np.int64)
    return np.array(ordered, np.int64).reshape(-1, 3), states


def _differ(inside: np.ndarray, code: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Which bricks hold, among the given nodes, one of another sign than a missing neighbour."""
    differs = np.zeros(len(code), bool)
    for state, expected in ((INSIDE, nodes), (OUTSIDE, np.zeros_like(nodes))):
        rows = np.flatnonzero(code == state)
        for word in np.flatnonzero(nodes):
            differs[rows] |= (inside[rows, word] & nodes[word]) != expected[word]
    return differs


def _check_missing(near: np.ndarray, coordinates: np.ndarray) -> None:
    for a, b in EDGES:
        codes = near[:, a], near[:, b]
        wrong = np.flatnonzero((codes[0] < 0) & (codes[1] < 0) & (codes[0] != codes[1]))
        if len(wrong):
            first, second = ((coordinates[wrong[0]] + _OFFSETS[o]).tolist() for o in (a, b))
            raise SurfaceError(
                f"missing bricks {first} and {second} lie side by side, one inside and one "
                f"outside ({len(wrong)} such pairs)",
                "marching_cubes(volume=...)",
                "store the bricks between inside and outside, or rebuild the band",
            )


def _blocks_to_keep(values: np.ndarray, level: float, shift: int, progress: Progress) -> np.ndarray:
    """Blocks that own a cell with both signs, and the blocks such cells reach into."""
    shape = tuple((n + 2 * shift + BRICK - 1) // BRICK for n in values.shape)
    has_inside, has_outside = np.zeros(shape, bool), np.zeros(shape, bool)
    threshold = least_not_below(level, values.dtype)
    in_ranges(
        lambda start, stop: flag_blocks(
            values, threshold, shift, start, stop, has_inside, has_outside
        ),
        shape[0],
        "signs",
        progress,
        nodes_per_item=BRICK * values[0].size,
    )
    if shift:
        for side in (0, -1):
            has_outside[side] = has_outside[:, side] = has_outside[:, :, side] = True
    owns = _spread(has_inside, -1) & _spread(has_outside, -1)
    return _spread(owns, 1)


def _spread(flags: np.ndarray, step: int) -> np.ndarray:
    """Or of each entry with its neighbours below (step 1) or above (step -1), diagonals too."""
    out = flags.copy()
    for axis in range(3):
        line = np.moveaxis(out, axis, 0)
        if step > 0:
            line[1:] |= line[:-1].copy()
        else:
            line[:-1] |= line[1:].copy()
    return out
