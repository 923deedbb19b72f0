"""The faces of a mesh that bound something, cut into smooth regions along its creases."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32

from ..arrays import FaceLabels, Faces, Number, Points
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..kernels.regions import label_flats, label_regions, mark_wide, unit_normals
from ..mesh import Mesh, check, degenerate_faces, net_faces, odd_faces, residual_edge_lines
from ..mesh.edge_chain import residual_lines
from ..mesh.edge_table import EdgeTable, edge_table
from ..mesh.welded import weld_mesh

ZIP = 1e-3
"""In voxels: cracks narrower than this are closed first, so that lattice lines find no way out."""

FLAT_SINE = 1e-7
"""Faces that turn by less belong to one flat."""

WIDE = 1.0
"""In voxels: the edges of flats at least as wide are creases, however little the faces turn."""


@dataclass(frozen=True, eq=False)
class Regions:
    """Welded faces, what region each belongs to, and where regions meet.

    Attributes
    ----------
    points : (u, 3) float64
        World units.
    faces : (m, 3) int32
        Without faces that have no area, and without sheets that cancel.
    edge_line, line_ends : (m, 3), (g, 2) int32
        Edges that cancel only geometrically, as of `residual_edge_lines`.
    half_edges, first_half_edge : (h,), (e + 1,) int32
        The sides ``3 f + corner`` of faces on every edge, as in `EdgeTable`.
    normals : (m, 3) float64
        Unit normals.
    labels : (m,) int32
        Region of every face.
    creases : (s, 2) int32
        Ends of the edges between regions, and of creases within one.
    sides : (s, 2) int32
        Regions on both sides, the lower number first.
    corners : (k,) int32
        Vertices where three or more regions meet.
    corner_start, corner_labels : (k + 1,), (t,) int32
        The regions at corner i are ``corner_labels[corner_start[i]:corner_start[i + 1]]``.
    """

    points: Points
    faces: Faces
    edge_line: Int32[np.ndarray, "l 3"]
    line_ends: Int32[np.ndarray, "g 2"]
    half_edges: Int32[np.ndarray, " h"]
    first_half_edge: Int32[np.ndarray, " e1"]
    normals: Float64[np.ndarray, "m 3"]
    labels: FaceLabels
    creases: Int32[np.ndarray, "s 2"]
    sides: Int32[np.ndarray, "s 2"]
    corners: Int32[np.ndarray, " k"]
    corner_start: Int32[np.ndarray, " k1"]
    corner_labels: Int32[np.ndarray, " t"]


def cut_regions(mesh: Mesh, *, sign: str, feature_angle: Number, voxel_size: Number) -> Regions:
    """Cut a mesh along edges whose faces turn by more than ``feature_angle`` degrees.

    Flats (faces in one plane) at least a voxel wide are regions of their own: only where faces are
    smaller than voxels is a mesh of small turns taken for a smooth surface.

    ``sign`` says how inside was told, and thereby which sheets cancel: those in even number for
    "parity", those that come with their reverse for "winding".
    """
    welded = mesh.welded
    if not welded.table.is_even:
        repair = check(mesh, self_intersections=False).repair
        if repair is not None and repair.width <= ZIP * voxel_size:
            welded = weld_mesh(welded.points, repair.labels[welded.faces])
    points, faces, table = welded.points, welded.faces, welded.table
    keep = ~degenerate_faces(points, faces)
    if sign != "unsigned" and table.may_have_twins:
        keep &= odd_faces(faces) if sign == "parity" else net_faces(faces)
    if not keep.all():
        faces = np.ascontiguousarray(faces[keep])
        table = edge_table(faces, len(points))
    edge_line, line_ends = residual_edge_lines(faces, points, table=table)
    normals = np.empty((len(faces), 3))
    pieces = even_ranges(len(faces), n_threads())
    run_pieces(lambda p: unit_normals(points, faces, *pieces[p], normals), len(pieces))
    cosine = float(np.cos(np.radians(feature_angle)))
    first = np.concatenate([[0], np.cumsum(table.n_uses)]).astype(np.int32)
    flats, labels = np.empty((2, len(faces)), np.int32)
    is_wide, is_crease = np.empty(len(faces), np.bool_), np.empty(len(first) - 1, np.bool_)
    turns = table.half_edges, first, table.net_uses, normals
    label_flats(*turns, FLAT_SINE, flats)
    mark_wide(points, faces, *turns[:2], WIDE * voxel_size, flats, np.empty(len(faces)), is_wide)
    links, seams = _judge(_groups(table, points), normals, cosine, is_wide)
    label_regions(*turns, cosine, links, flats, is_wide, labels, is_crease)
    at = first[:-1][is_crease]
    both = np.stack([table.half_edges[at] // 3, table.half_edges[at + 1] // 3], axis=1)
    creases = np.concatenate([table.edges[is_crease], seams[:, :2]])
    sides = np.sort(labels[np.concatenate([both, seams[:, 2:]])], axis=1)
    return Regions(
        points, faces, edge_line, line_ends, table.half_edges, first, normals, labels,
        creases, sides,
        *_corners(creases, sides),
    )  # fmt: skip


def _groups(table: EdgeTable, points: Points) -> list[tuple[np.ndarray, np.ndarray]]:
    """Edges (k, 2) and faces of what more or fewer than two faces share: lines, and fans."""
    uses = table.n_uses
    if (uses == 2).all():
        return []
    group = np.where(uses > 2, np.arange(len(uses)), -1)
    if not table.is_balanced:
        lines = residual_lines(table, points)
        group[lines.edge_index] = len(uses) + lines.line
    edge_of_use = np.repeat(np.arange(len(uses)), uses)
    group_of_use = group[edge_of_use]
    used = np.flatnonzero(group_of_use >= 0)
    used = used[np.argsort(group_of_use[used], kind="stable")]
    bounds = np.flatnonzero(np.diff(group_of_use[used])) + 1
    found = []
    for members in np.split(used, bounds):
        faces = np.unique(table.half_edges[members] // 3)
        if len(faces) > 1:
            found.append((table.edges[np.unique(edge_of_use[members])], faces))
    return found


def _judge(
    groups: list[tuple[np.ndarray, np.ndarray]],
    normals: np.ndarray,
    cosine: float,
    is_wide: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of faces to join, and edges that part two faces: (vertex, vertex, face, face)."""
    links, seams = [np.empty((0, 2), np.int32)], [np.empty((0, 4), np.int32)]
    for edges, faces in groups:
        a, b = np.triu_indices(len(faces), 1)
        cosines = np.abs((normals[faces[a]] * normals[faces[b]]).sum(axis=1))
        sines = np.linalg.norm(np.cross(normals[faces[a]], normals[faces[b]]), axis=1)
        is_smooth = (cosines >= cosine) & ~is_wide[faces[a]] & ~is_wide[faces[b]]
        is_smooth |= sines <= FLAT_SINE
        links.append(np.stack([faces[a], faces[b]], axis=1)[is_smooth])
        apart = np.stack([faces[a], faces[b]], axis=1)[~is_smooth]
        seams.append(np.hstack([edges.repeat(len(apart), 0), np.tile(apart, (len(edges), 1))]))
    return tuple(np.concatenate(part).astype(np.int32) for part in (links, seams))


def _corners(creases: np.ndarray, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices with three or more regions, where their regions start, and the regions."""
    vertex, label = np.repeat(creases, 2, axis=1).ravel(), np.tile(sides, (1, 2)).ravel()
    pairs = np.unique(np.stack([vertex, label], axis=1), axis=0)
    vertices, n_regions = np.unique(pairs[:, 0], return_counts=True)
    kept = n_regions >= 3
    start = np.concatenate([[0], np.cumsum(n_regions[kept])]).astype(np.int32)
    labels = pairs[np.repeat(kept, n_regions), 1]
    return vertices[kept].astype(np.int32), start, labels.astype(np.int32)
