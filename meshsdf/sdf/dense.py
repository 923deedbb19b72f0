"""The signed distance transform of a mesh on a full grid, exact at every node."""

import numpy as np

from ..arrays import Number, Vector3
from ..grid import Grid, NarrowBand
from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport, check
from ..progress import Progress, silent
from ..spatial.closest_point import ClosestPoint
from .memory import require_memory
from .narrow_band import mesh_to_band
from .placed_mesh import bounding_faces, weld_faces
from .sign import SignMethod, choose_sign

NODES_AT_ONCE = 1 << 20


def mesh_to_grid(
    mesh: Mesh,
    *,
    resolution: Number | None = None,
    voxel_size: Number | None = None,
    half_width: Number = 3.0,
    sign: SignMethod = "auto",
    translation: Vector3 | None = None,
    report: TwoSetReport | None = None,
    max_memory: Number | None = None,
    progress: Progress = silent,
) -> Grid:
    """Sample the signed distance to a mesh on every node of its box, grown by ``half_width``.

    Parameters, errors and signs are those of `mesh_to_band`; nodes lie where the band's lie.

    Notes
    -----
    Accuracy: every value is the Euclidean distance rounded to float32, near and far.
    Cost: one closest-point query per node outside the band.
    """
    if report is None:
        report = check(mesh, self_intersections=False)
    band = mesh_to_band(
        mesh,
        resolution=resolution,
        voxel_size=voxel_size,
        half_width=half_width,
        sign=sign,
        translation=translation,
        report=report,
        max_memory=max_memory,
        progress=progress,
    )
    first, shape = _node_box(mesh, band)
    where = f"mesh_to_grid(...): {shape[0]} x {shape[1]} x {shape[2]} nodes"
    n_nodes = float(np.prod(shape.astype(float)))
    require_memory(4 * n_nodes + 150 * NODES_AT_ONCE, max_memory, where=where)
    values = np.empty(shape, np.float32)
    query = ClosestPoint(_bounding_mesh(mesh, band, report))
    planes = max(1, int(NODES_AT_ONCE // np.prod(shape[1:])))
    for i in range(0, shape[0], planes):
        last = min(i + planes, shape[0])
        ijk = np.indices((last - i, *shape[1:])).reshape(3, -1).T + first + np.array([i, 0, 0])
        values[i:last] = _distances(band, query, ijk).reshape(last - i, *shape[1:])
        progress("far field", last / shape[0])
    return Grid(values, band.voxel_size, band.to_world(first[None])[0], band.sign)


def _bounding_mesh(mesh: Mesh, band: NarrowBand, report: TwoSetReport) -> Mesh:
    """The faces that the band's distances are measured to."""
    by_crossings = (
        band.is_signed and choose_sign(report, band.sign, voxel_size=band.voxel_size).by_crossings
    )
    points, faces = weld_faces(mesh)
    keep = bounding_faces(points, faces, cancel=band.sign if by_crossings else "unsigned")
    return Mesh(points, faces[keep])


def _node_box(mesh: Mesh, band: NarrowBand) -> tuple[np.ndarray, np.ndarray]:
    """First node and number of nodes of the mesh's box grown by the band."""
    box = mesh.box
    low = (box.lower - band.translation) / band.voxel_size - band.half_width
    high = (box.upper - band.translation) / band.voxel_size + band.half_width
    first = np.floor(low).astype(np.int64)
    return first, np.ceil(high).astype(np.int64) - first + 1


def _distances(band: NarrowBand, query: ClosestPoint, ijk: np.ndarray) -> np.ndarray:
    """Signed distances of nodes: the band's where it has them, else by closest point."""
    values = band.value_at(ijk)
    far = np.abs(values) >= band.background
    distance = query(band.to_world(ijk[far])).distance
    values[far] = np.copysign(distance, values[far])
    return values
