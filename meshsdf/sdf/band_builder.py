"""Build a narrow band slab by slab: mark bricks, count crossings, scan distances, keep the near.

A slab is a run of brick columns along x. Slabs share nothing but the page table, where each
writes its own entries, so they run on all cores and need scratch memory for a few slabs only.
"""

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..arrays import Number, Vector3
from ..grid import BrickIndex, NarrowBand
from ..grid.brick_index import number_marked, without_uniform_pages
from ..kernels.band_distance import scan_edges, scan_faces, scan_vertices
from ..kernels.brick_finish import closest_in_bricks, keep_active, renumber
from ..kernels.brick_lookup import OUTSIDE
from ..kernels.brick_marks import LOWER, UPPER, list_bricks, mark_cells
from ..kernels.crossings import count_crossings, resolve_signs
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..progress import Progress
from .lattice import Lattice
from .memory import MARKED_PER_KEPT, SLABS_PER_THREAD, band_bytes, require_memory
from .placed_mesh import Features, PlacedMesh
from .slabs import bin_features, items_of


@dataclass
class BandBuilder:
    """The state of one conversion: `prepare`, perhaps `measure_to`, `tell_sides`, `finish`.

    Distances are measured to ``placed``, crossings counted with ``closed``: the same mesh, but for
    cracks. ``sign`` is "parity", "winding" (integer crossings) or "unsigned".
    """

    placed: PlacedMesh
    closed: PlacedMesh
    lattice: Lattice
    half_width: float
    sign: str
    closest: bool
    max_memory: Number | None
    progress: Progress
    features: Features = field(init=False)
    root: np.ndarray = field(init=False)
    pages: np.ndarray = field(init=False)

    def prepare(self) -> None:
        """Find the bricks."""
        self._mark()
        self._number_bricks()
        self._allocate()

    def measure_to(self, part: PlacedMesh, aside: Vector3) -> None:
        """Measure distances to a part of the mesh, and tell sides ``aside`` voxels from the nodes.

        The bricks stay those of the whole mesh, as crossings are still counted with all of it.
        """
        self.placed = part
        self.closed = replace(self.closed, points=self.closed.points - aside)
        self._bin_features()
        self.inside[:] = 0

    def tell_sides(self) -> None:
        """Find the side of every node.

        ``leaks`` then counts, per slab, lines whose crossings do not cancel, and ``wound`` holds
        the largest magnitude of a winding number.
        """
        if self.sign != "unsigned":
            run_pieces(self._sign_slab, len(self.slabs), stage="sign", progress=self.progress)

    def finish(self) -> NarrowBand:
        """Measure the distances; return the band."""
        run_pieces(self._fill_slab, len(self.slabs), stage="distance", progress=self.progress)
        return self._collect()

    def _mark(self) -> None:
        """Mark what the root, then the upper, then the lower pages have entries for."""
        size = -(-self.lattice.n_pages // 16)
        self._require_pages(float(np.prod(size.astype(float))) / 4096)
        self.root = np.full(size, OUTSIDE, np.int32)
        self.pages = np.empty((0, 16, 16, 16), np.int32)
        self._mark_all(UPPER, int(size[0]))
        n_upper = number_marked(self.root, 0)
        self.pages = np.full((n_upper, 16, 16, 16), OUTSIDE, np.int32)
        self._mark_all(LOWER, 16 * int(size[0]))
        n_lower = number_marked(self.pages, n_upper)
        self._require_pages(n_upper + n_lower)
        lower = np.full((n_lower, 16, 16, 16), OUTSIDE, np.int32)
        self.pages = np.concatenate([self.pages, lower])
        self._cut_slabs()
        run_pieces(self._mark_slab, len(self.slabs), stage="bricks", progress=self.progress)

    def _mark_all(self, shift: int, n_cells: int) -> None:
        points, faces = self.placed.points, self.placed.faces
        ranges = even_ranges(len(faces), SLABS_PER_THREAD * n_threads())

        def mark(piece: int) -> None:
            ids = np.arange(*ranges[piece], dtype=np.int32)
            mark_cells(
                points, faces, ids, self.half_width, shift, 0, n_cells, self.root, self.pages
            )

        run_pieces(mark, len(ranges))

    def _require_pages(self, n_pages: Number) -> None:
        require_memory(n_pages * 16384, self.max_memory, where="mesh_to_band(...): page table")

    def _cut_slabs(self) -> None:
        """Slabs of brick columns."""
        points = self.placed.points
        low = max(0, int((points[:, 0].min() - self.half_width) // 8))
        high = int((points[:, 0].max() + self.half_width) // 8) + 1
        ranges = even_ranges(high - low, SLABS_PER_THREAD * n_threads())
        self.slabs = [(low + a, low + b) for a, b in ranges]
        self._bin_features()

    def _bin_features(self) -> None:
        """Which faces, edges and vertices reach into each slab."""
        points, faces = self.placed.points, self.placed.faces
        self.features = features = self.placed.features(self.half_width)
        edges = np.array([8.0 * self.slabs[0][0]] + [8.0 * b for _, b in self.slabs])
        reach = self.half_width + 1e-3
        kinds = [features.ends, faces, features.corners[:, None]]
        if self.closed is not self.placed:
            kinds.append(self.closed.faces)
        lists = [None] * len(kinds)

        def bin_kind(kind: int) -> None:
            lists[kind] = bin_features(points, kinds[kind], edges, reach)

        run_pieces(bin_kind, len(kinds))
        self.edges_of, self.faces_of, (start, items) = lists[:3]
        self.vertices_of = start, features.corners[items]
        self.closed_faces_of = lists[-1] if self.closed is not self.placed else self.faces_of

    def _mark_slab(self, s: int) -> None:
        first, last = self.slabs[s]
        ids = items_of(self.faces_of, s)
        points, faces = self.placed.points, self.placed.faces
        mark_cells(points, faces, ids, self.half_width, 3, first, last, self.root, self.pages)

    def _number_bricks(self) -> None:
        """Slots in lexicographic order; ``slot0[s]`` is the first of slab s."""
        first, last = self.slabs[0][0], self.slabs[-1][1]
        count = np.zeros(last - first, np.int64)
        nothing = np.empty((0, 3), np.int64)

        def count_column(x: int) -> None:
            count[x] = list_bricks(self.root, self.pages, first + x, 0, nothing)

        run_pieces(count_column, last - first)
        slots = np.concatenate([[0], np.cumsum(count)])
        self._require_memory(int(slots[-1]))
        self.coordinates = np.empty((slots[-1], 3), np.int64)

        def number_column(x: int) -> None:
            if count[x]:
                list_bricks(self.root, self.pages, first + x, slots[x], self.coordinates)

        run_pieces(number_column, last - first)
        self.slot0 = [int(slots[a - first]) for a, _ in self.slabs] + [int(slots[-1])]

    def _require_memory(self, n_bricks: int) -> None:
        needed = band_bytes(
            n_bricks / MARKED_PER_KEPT,
            len(self.placed.faces),
            closest=self.closest,
            fold_share=len(self.features.ends) / max(1, self.placed.table.n_edges),
        )
        where = f"mesh_to_band(...): {n_bricks} bricks"
        require_memory(needed, self.max_memory, where=where)

    def _allocate(self) -> None:
        n = len(self.coordinates)
        self.inside = np.zeros((n, 8), np.uint64)
        self.values = np.empty((n, 512), np.float32)
        self.active = np.empty((n, 8), np.uint64)
        self.kept = np.empty(n, np.int64)
        self.n_kept = [0] * len(self.slabs)
        self.leaks, self.wound = [0] * len(self.slabs), [0] * len(self.slabs)
        if self.closest:
            self.closest_face = np.empty((n, 512), np.int32)
            self.barycentric = np.empty((n, 512, 2), np.float32)

    def _fill_slab(self, s: int) -> None:
        a, b = self.slot0[s], self.slot0[s + 1]
        if a == b:
            return
        squared, nearest = self._distances(s)
        n = keep_active(
            self.coordinates[a:b],
            squared,
            self.inside[a:b],
            self.half_width,
            self.lattice.voxel_size,
            np.float32(self.half_width * self.lattice.voxel_size),
            self.root,
            self.pages,
            self.values[a:b],
            self.active[a:b],
            self.kept[a:b],
        )
        self.n_kept[s] = n
        self.coordinates[a : a + n] = self.coordinates[a:b][self.kept[a : a + n]]
        if self.closest:
            closest_in_bricks(
                self.coordinates[a : a + n],
                nearest[self.kept[a : a + n]],
                self.active[a : a + n],
                self.placed.points,
                self.placed.faces,
                self.placed.face_ids,
                self.placed.weights,
                self.closest_face[a : a + n],
                self.barycentric[a : a + n],
            )

    def _distances(self, s: int) -> tuple[np.ndarray, np.ndarray]:
        """Squared distances (b, 512) in voxels, and the nearest placed faces if asked for."""
        a, b = self.slot0[s], self.slot0[s + 1]
        squared = np.full((b - a, 512), self.half_width**2)
        nearest = np.full((b - a if self.closest else 0, 512), len(self.placed.faces), np.int32)
        first, last = self.slabs[s]
        window = (self.half_width, 8 * first, 8 * last, self.root, self.pages, a, squared, nearest)
        points, faces, f = self.placed.points, self.placed.faces, self.features
        scan_faces(points, faces, items_of(self.faces_of, s), *window)
        edges, vertices = items_of(self.edges_of, s), items_of(self.vertices_of, s)
        scan_edges(points, faces, f.ends, f.first, f.order, edges, *window)
        scan_vertices(points, f.ends, f.first, f.order, f.start, f.edges, vertices, *window)
        return squared, nearest

    def _sign_slab(self, s: int) -> None:
        a, b = self.slot0[s], self.slot0[s + 1]
        first, last = self.slabs[s]
        crossings = np.zeros((b - a, 512), np.int32)
        parity = self.sign == "parity"
        leaks = count_crossings(
            self.closed.points,
            self.closed.faces,
            self.closed.edge_line,
            self.closed.line_ends,
            items_of(self.closed_faces_of, s),
            8 * first,
            8 * last,
            self.root,
            self.pages,
            a,
            not parity,
            crossings,
        )
        more, self.wound[s] = resolve_signs(
            self.coordinates[a:b], crossings, parity, self.root, self.pages, self.inside[a:b]
        )
        self.leaks[s] = leaks + more

    def _collect(self) -> NarrowBand:
        """Close the gaps between slabs and number the bricks that are left."""
        n = 0
        arrays = [self.values, self.active, self.coordinates]
        if self.closest:
            arrays += [self.closest_face, self.barycentric]
        for s, kept in enumerate(self.n_kept):
            a = self.slot0[s]
            if n != a and kept:
                for array in arrays:
                    array[n : n + kept] = array[a : a + kept]
            n += kept
        coordinates = self.coordinates[:n]
        renumber(coordinates, 0, self.root, self.pages)
        origin = self.lattice.page_origin
        tables = without_uniform_pages(self.root, self.pages)
        index = BrickIndex(coordinates + origin * 16, origin, *tables)
        shaped = partial(np.reshape, shape=(n, 8, 8, 8))
        return NarrowBand(
            index,
            shaped(self.values[:n]),
            self.active[:n],
            self.lattice.voxel_size,
            self.lattice.translation,
            self.half_width,
            self.sign,
            shaped(self.closest_face[:n]) if self.closest else None,
            self.barycentric[:n].reshape(n, 8, 8, 8, 2) if self.closest else None,
            n_inner_faces=self.placed.n_inner,
        )
