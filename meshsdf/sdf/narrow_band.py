"""The signed distance transform of a mesh, in a narrow band around it."""

from dataclasses import replace

import numpy as np

from ..arrays import Faces, Number, Vector3
from ..errors import SdfError
from ..grid import NarrowBand
from ..grid.brick_grid import node_words
from ..mesh import Mesh, outer_boundary
from ..mesh.two_set import TwoSetReport, check
from ..mesh.welded import weld_mesh
from ..progress import Progress, silent
from .band_builder import BandBuilder
from .lattice import Lattice, resolve_voxel_size
from .memory import band_bytes, estimate_bricks, estimate_fold_share, require_memory
from .open_sign import sign_by_winding_number
from .placed_mesh import PlacedMesh, place
from .sign import SignMethod, choose_sign
from .union import aside, may_overlap, parts_of_union, require_faces

MIN_HALF_WIDTH = 1.0
MAX_HALF_WIDTH = 1000.0
BRICKS_AT_ONCE = 4096  # bounds the memory of intermediate results


def mesh_to_band(
    mesh: Mesh,
    *,
    resolution: Number | None = None,
    voxel_size: Number | None = None,
    half_width: Number = 3.0,
    sign: SignMethod = "auto",
    translation: Vector3 | None = None,
    closest: bool = False,
    report: TwoSetReport | None = None,
    max_memory: Number | None = None,
    progress: Progress = silent,
) -> NarrowBand:
    """Sample the signed distance to a mesh on all lattice nodes nearer than ``half_width`` voxels.

    Parameters
    ----------
    mesh : Mesh
        Any triangles.
    resolution, voxel_size : float
        Exactly one: voxels along the longest side of the mesh's box, or their size (world units).
    half_width : float
        In voxels, at least 1.
    sign : "auto", "parity", "winding" or "unsigned"
        How inside is told; "auto" asks `check`. "winding" counts oriented crossings where the
        mesh is oriented and closed: overlapping bodies become their union. Elsewhere it takes
        generalised winding numbers.
    translation : (3,) float64
        World position of node (0, 0, 0); zero by default, so that bands of one voxel size line up.
    closest : bool
        Also keep the closest face and its barycentrics at every active node.
    report : TwoSetReport
        What `check` said of this mesh, if it is known already. With its crossing faces counted,
        no overlap goes unnoticed.
    max_memory : float
        In bytes; by default 80 % of what is free.
    progress : callable
        Called with the stage and the fraction done.

    Returns
    -------
    band : NarrowBand
        World units.

    Raises
    ------
    SdfError
        Sizes that make no sense, a mesh without area, or parity asked of an open mesh.
    MemoryLimitError
        The band would not fit; known before the work starts.

    Notes
    -----
    Accuracy: every active value is the Euclidean distance to the faces (those that do not cancel)
    rounded to float32, to within 1e-7 voxel; a node is active exactly when it is nearer than the
    band's background. Parity and oriented crossings are exact: they are the parity or integer
    winding number of a point at most that rounding away.
    Union: with oriented crossings distances are measured only to faces, and parts of faces, across
    which the winding number changes between 0 and something else. Inner ones are searched for
    where parts may overlap or have been seen to; `sdf.union` says what can be missed.
    Cost: time and memory grow with the surface in voxels and with the number of faces.
    Method: the normal regions of faces, edges and vertices are scanned line by line (Mauch 2003);
    signs by summing crossings along lattice lines.

    References
    ----------
    S. Mauch, "Efficient algorithms for solving static Hamilton-Jacobi equations", PhD thesis,
    California Institute of Technology, 2003.
    """
    band, _ = measured_band(
        mesh,
        report,
        voxel_size=resolve_voxel_size(mesh, resolution, voxel_size),
        half_width=half_width,
        sign=sign,
        translation=translation,
        closest=closest,
        max_memory=max_memory,
        progress=progress,
    )
    return band


def measured_band(
    mesh: Mesh,
    report: TwoSetReport | None,
    *,
    voxel_size: float,
    half_width: Number,
    sign: SignMethod,
    translation: Vector3 | None,
    closest: bool,
    max_memory: Number | None,
    progress: Progress,
) -> tuple[NarrowBand, PlacedMesh]:
    """Return the band, and the faces that its distances are measured to; see `mesh_to_band`."""
    check_half_width(half_width)
    half_width = float(half_width)
    origin = np.zeros(3) if translation is None else np.asarray(translation, np.float64)
    _check_memory(mesh, voxel_size, half_width, closest, max_memory)
    if report is None:
        report = check(mesh, self_intersections=False)
    choice = choose_sign(report, sign, voxel_size=voxel_size)
    corners = np.stack([mesh.box.lower, mesh.box.upper])
    lattice = Lattice.around(corners, voxel_size, origin, half_width)
    cancel = choice.method if choice.by_crossings else "unsigned"
    placed = closed = place(mesh.welded, lattice, cancel=cancel, report=report)
    if choice.by_crossings and report.repair is not None:
        zipped = weld_mesh(mesh.welded.points, report.repair.labels[mesh.welded.faces])
        closed = place(zipped, lattice, cancel=cancel)
    builder = BandBuilder(
        placed, closed, lattice, half_width, cancel, closest, max_memory, progress
    )
    builder.prepare()
    if cancel == "winding":
        _leave_inner_faces_out(builder, mesh.welded.faces, may_overlap(report))
    else:
        builder.tell_sides()
    band = builder.finish()
    if choice.by_crossings:
        _check_leaks(sum(builder.leaks))
        beyond = None if report.repair is None else report.repair.certain_beyond
        if beyond is not None:
            band = replace(band, uncertain=_near(band, beyond))
    elif choice.method == "winding":
        signed = sign_by_winding_number(band, placed, max_memory=max_memory, progress=progress)
        if sign != "auto" or (signed.values < 0).any():
            band = signed  # else nothing is wound about: a sheet
    return band, builder.placed


def _leave_inner_faces_out(builder: BandBuilder, faces: Faces, search: bool) -> None:
    """Tell sides; where bodies overlap, measure to their union. ``faces`` are all of the mesh."""
    if not search:
        builder.tell_sides()
        search = max(builder.wound) > 1
        if not search:
            return
    closed = builder.closed
    lines = closed.edge_line, closed.line_ends
    found = outer_boundary(
        closed.points, closed.faces, table=closed.table, lines=lines, progress=builder.progress
    )
    if found is not None:
        require_faces(found)
        placed = builder.placed
        parts = parts_of_union(found, placed.face_ids, closed.face_ids, placed.points, faces)
        builder.measure_to(PlacedMesh.of_parts(parts), aside(closed.points))
    builder.tell_sides()


def _near(band: NarrowBand, distance: float) -> np.ndarray:
    """Words of the nodes no further than ``distance`` (world units) from the surface."""
    words = np.zeros(band.active.shape, np.uint64)
    for first in range(0, len(words), BRICKS_AT_ONCE):
        some = slice(first, first + BRICKS_AT_ONCE)
        words[some] = node_words(np.abs(band.values[some]) <= distance)
    return words


def check_half_width(half_width: Number) -> None:
    """Refuse a band of no use; SdfError."""
    if not MIN_HALF_WIDTH <= half_width <= MAX_HALF_WIDTH:
        raise SdfError(
            f"half_width is {half_width:g} voxels",
            "mesh_to_band(half_width=...)",
            f"pass {MIN_HALF_WIDTH:g} to {MAX_HALF_WIDTH:g}; 3 is usual",
        )


def _check_memory(
    mesh: Mesh, size: float, half_width: Number, closest: bool, max_memory: Number | None
) -> None:
    n_bricks = estimate_bricks(mesh, size, half_width)
    where = f"mesh_to_band(voxel_size={size:g}): about {n_bricks:.3g} bricks of 8x8x8 nodes"
    folds = estimate_fold_share(mesh, half_width)
    needed = band_bytes(n_bricks, mesh.n_faces, closest=closest, fold_share=folds)
    require_memory(needed, max_memory, where=where)


def _check_leaks(n_leaks: int) -> None:
    """Crossings of a two-set mesh cancel on every line; if not, no sign can be trusted."""
    if n_leaks:
        raise SdfError(
            f"{n_leaks} lattice lines cross the mesh an odd number of times",
            'mesh_to_band(sign="parity" or "winding")',
            'pass sign="unsigned", and report this mesh: its edges do cancel',
        )
