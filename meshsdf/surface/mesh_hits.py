"""Where a mesh crosses the edges of a lattice: exact positions, normals and faces."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int32, Int64

from ..arrays import Ijk1, Points
from ..grid import BrickIndex, Grid, NarrowBand
from ..grid.brick_index import BRICK
from ..kernels.lattice_hits import pick_hits, scan_lines, sort_hits
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..mesh import Mesh
from ..progress import Progress, silent
from ..spatial import ClosestPoint
from .brick_field import BrickField, in_ranges
from .dual_loops import DualLoops
from .regions import Regions

ORDERS = ((1, 2, 0), (0, 2, 1), (0, 1, 2))  # of coordinates: the axis last, the others as they are
PIECES_PER_THREAD = 4
ROOM = 1.5  # times the hits expected if all faces and axes had as many; else a second pass

SEEN_FROM = 0.5
"""In voxels: a crossing that no face explains belongs to the nearest face if that is nearer, and
else to a membrane across an opening."""

TOUCHED = 1e-6  # voxels; a crossing this near to a face lies on it
STEEPEST = (
    1e-3  # cosine between an edge and a normal; planes less steep do not say where they cross
)


@dataclass(frozen=True, eq=False)
class MeshHits:
    """For every crossed edge of a field, the place on the mesh.

    Attributes
    ----------
    points : (u, 3) float64
        The vertices of the regions, in voxels from the base of the loops.
    fractions : (c,) float64
        As a fraction of the edge; where linear interpolation puts it if no face is near.
    normals : (c, 3) float64
        Unit normals towards the outer node; 0 where no face is near.
    faces : (c,) int32
        Faces of the regions; -1 where none is near.
    """

    points: Points
    fractions: Float64[np.ndarray, " c"]
    normals: Float64[np.ndarray, "c 3"]
    faces: Int32[np.ndarray, " c"]


def find_hits(
    volume: NarrowBand | Grid,
    field: BrickField,
    loops: DualLoops,
    regions: Regions,
    progress: Progress = silent,
) -> MeshHits:
    """Cross every edge with the faces, and with the nearest one where none is hit."""
    table = brick_table(volume, field)
    h, translation = volume.voxel_size, _translation(volume)
    places = (regions.points - (h * table.origin + translation)) / h
    found = [_scan(places, regions, table.index, loops, axis, progress) for axis in range(3)]
    numbers, heights, hit_faces, steps = (np.concatenate(part) for part in zip(*found, strict=True))
    c = loops.n_crossings
    start, order = np.empty(c + 1, np.int32), np.empty(len(numbers), np.int32)
    sort_hits(numbers, c, start, order)
    fractions, normals = loops.fractions.copy(), np.zeros((c, 3))
    faces = np.full(c, -1, np.int32)

    def pick(begin: int, end: int) -> None:
        pick_hits(
            start, order, heights, hit_faces, steps, regions.normals, volume.sign == "parity",
            loops.ways, begin, end, fractions, faces, normals,
        )  # fmt: skip

    in_ranges(pick, c, nodes_per_item=BRICK)
    points = (regions.points - (h * loops.base + translation)) / h
    hits = MeshHits(points, fractions, normals, faces)
    leaving = leaves_grid(volume, loops)
    _explain_rest(hits, loops, regions, np.flatnonzero((faces < 0) & ~leaving))
    set_border_normals(normals, loops, leaving)
    return hits


def leaves_grid(volume: NarrowBand | Grid, loops: DualLoops) -> Bool[np.ndarray, " c"]:
    """Tell which crossed edges end outside a grid, in its padding."""
    if isinstance(volume, NarrowBand):
        return np.zeros(loops.n_crossings, np.bool_)
    axis = (loops.ways >> 1)[:, None]
    node = np.take_along_axis(loops.nodes, axis, axis=1) + loops.base[axis]
    return ((node < 0) | (node + 1 >= np.array(volume.values.shape)[axis]))[:, 0]


def set_border_normals(
    normals: np.ndarray, loops: DualLoops, leaving: Bool[np.ndarray, " c"]
) -> None:
    """Give the edges that leave a grid the normal of its border."""
    rows = np.flatnonzero(leaving)
    normals[rows] = 0.0
    normals[rows, loops.ways[rows] >> 1] = np.where(loops.ways[rows] & 1, 1.0, -1.0)


def _translation(volume: NarrowBand | Grid) -> np.ndarray:
    return volume.translation if isinstance(volume, NarrowBand) else volume.origin


@dataclass(frozen=True, eq=False)
class BrickTable:
    """The row of every brick of a field that has values, by its place.

    Attributes
    ----------
    index : BrickIndex
        Slots are rows of the field.
    origin : (3,) int64
        Node that ``index.root`` starts at.
    """

    index: BrickIndex
    origin: Ijk1


def brick_table(volume: NarrowBand | Grid, field: BrickField) -> BrickTable:
    """Look up the bricks of a field.

    A band's table starts where its signs were counted from, so that not even rounding differs.
    """
    if isinstance(volume, NarrowBand):
        return BrickTable(volume.index, volume.index.origin * BRICK)
    shift = -field.corners[:1].sum(axis=0) % BRICK  # no bricks, no shift
    index = BrickIndex.from_coordinates((field.corners + shift) // BRICK)
    return BrickTable(index, index.origin * BRICK - shift)


def _scan(
    points: Points,
    regions: Regions,
    index: BrickIndex,
    loops: DualLoops,
    axis: int,
    progress: Progress,
) -> tuple[np.ndarray, ...]:
    """All hits along an axis: number of the crossing, height, face, step."""
    turned = np.ascontiguousarray(points[:, ORDERS[axis]])
    m = len(regions.faces)
    ranges = even_ranges(m, PIECES_PER_THREAD * n_threads())
    found = [None] * len(ranges)
    room = int(ROOM * loops.n_crossings / (3 * len(ranges))) + 64

    def scan(piece: int) -> None:
        n = room
        while True:
            out = np.empty(n, np.int32), np.empty(n), np.empty(n, np.int32), np.empty(n, np.int8)
            n_hits = scan_lines(
                turned, regions.faces, regions.edge_line, regions.line_ends, axis, index.root,
                index.pages, loops.words, loops.first, *ranges[piece], *out,
            )  # fmt: skip
            if n_hits <= n:
                break
            n = n_hits
        found[piece] = tuple(part[:n_hits] for part in out)

    run_pieces(scan, len(ranges), stage="crossings", progress=progress)
    return tuple(np.concatenate(part) for part in zip(*found, strict=True))


def _explain_rest(
    hits: MeshHits, loops: DualLoops, regions: Regions, rest: Int64[np.ndarray, " r"]
) -> None:
    """Fill in crossings that no face was found for: at nodes on the mesh, and at openings."""
    if len(rest) == 0:
        return
    axis, rows = loops.ways[rest] >> 1, np.arange(len(rest))
    nodes = loops.nodes[rest].astype(np.float64)
    places = nodes.copy()
    places[rows, axis] += hits.fractions[rest]
    near = ClosestPoint(Mesh(hits.points, regions.faces))(places)
    faces, normals = near.face_index, regions.normals[near.face_index]
    offset = (normals * (hits.points[regions.faces[faces, 0]] - nodes)).sum(axis=1)
    along = normals[rows, axis]
    is_steep = np.abs(along) > STEEPEST
    share = offset / np.where(is_steep, along, 1.0)
    is_met = is_steep & (share >= -TOUCHED) & (share <= 1 + TOUCHED) & (near.distance < SEEN_FROM)
    hits.fractions[rest[is_met]] = share[is_met].clip(0.0, 1.0)
    known = is_met | (near.distance < TOUCHED)
    outward = np.where(loops.ways[rest] & 1, 1.0, -1.0) * np.where(along < 0, -1.0, 1.0)
    hits.faces[rest[known]] = faces[known]
    hits.normals[rest[known]] = (normals * outward[:, None])[known]
