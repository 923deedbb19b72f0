"""The signed distance transform of a mesh on a full grid, exact at every node."""

import numpy as np

from ..arrays import Number, Vector3
from ..grid import Grid
from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport
from ..progress import Progress, silent
from ..spatial.closest_point import ClosestPoint
from .far_field import BYTES_PER_FACE, fill_grid
from .lattice import resolve_voxel_size
from .memory import require_memory
from .narrow_band import check_half_width, measured_band
from .placed_mesh import mesh_of_parts
from .sign import SignMethod


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
    Cost: about a seventh of a closest-point query per node outside the band, for triangles of a
    voxel's size; in proportion to their number where they are smaller.
    Method: see `kernels.far_lists`; nothing is propagated from node to node.
    """
    size = resolve_voxel_size(mesh, resolution, voxel_size)
    check_half_width(half_width)
    first, shape = _node_box(mesh, size, half_width, translation)
    where = f"mesh_to_grid(...): {shape[0]:.4g} x {shape[1]:.4g} x {shape[2]:.4g} nodes"
    needed = 4 * float(np.prod(shape)) + BYTES_PER_FACE * mesh.n_faces
    require_memory(needed, max_memory, where=where)
    first, shape = first.astype(np.int64), shape.astype(np.int64)
    band, measured = measured_band(
        mesh,
        report,
        voxel_size=size,
        half_width=half_width,
        sign=sign,
        translation=translation,
        closest=False,
        max_memory=max_memory,
        progress=progress,
    )
    query = ClosestPoint(mesh_of_parts(mesh.welded, measured.face_ids, measured.weights))
    values = fill_grid(band, query, first, shape, progress)
    origin = band.to_world(first[None])[0]
    counts = {name: getattr(band, name) for name in ("uncertain_voxels", "n_inner_faces")}
    return Grid(values, band.voxel_size, origin, band.sign, **counts)


def _node_box(
    mesh: Mesh, voxel_size: float, half_width: Number, translation: Vector3 | None
) -> tuple[np.ndarray, np.ndarray]:
    """First node and number of nodes of the mesh's box grown by the band; whole floats."""
    origin = np.zeros(3) if translation is None else translation
    first = np.floor((mesh.box.lower - origin) / voxel_size - half_width)
    last = np.ceil((mesh.box.upper - origin) / voxel_size + half_width)
    return first, last - first + 1
