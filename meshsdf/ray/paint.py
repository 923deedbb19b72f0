"""What colour a surface has: the caller's, the mesh's own, or clay."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float64, Int32

from ..errors import RayError
from ..mesh import Mesh
from .scene import Seen
from .shading import CLAY

Colors = Float64[np.ndarray, "k 3"]
PointPaint = Callable[[Float64[np.ndarray, "k 3"], Int32[np.ndarray, " k"]], np.ndarray]
SeenPaint = Callable[[Seen], Colors]


def choose_paint(mesh: Mesh, paint: np.ndarray | PointPaint | None) -> SeenPaint:
    """Return a function that gives the linear colours (k, 3) of what is seen.

    Parameters
    ----------
    mesh : Mesh
        What is drawn.
    paint : (n, 3) colours, callable or None
        As for `render_mesh`.

    Raises
    ------
    RayError
        Not one finite colour per vertex, or later, per point.
    """
    if callable(paint):
        return lambda seen: _checked(paint(seen.point, seen.face), len(seen), "point")
    if paint is not None:
        of_vertices = _checked(paint, mesh.n_vertices, "vertex")
        return lambda seen: np.einsum(
            "kc,kcx->kx", seen.barycentric, of_vertices[mesh.faces[seen.face]]
        )
    if mesh.vertex_colors is None and mesh.material_index is None:
        return lambda seen: np.tile(CLAY, (len(seen), 1))
    from ..spatial.mesh_colors import MeshColors  # late: clay does not need images

    colors = MeshColors(mesh)
    return lambda seen: colors(seen.face, seen.barycentric)[:, :3].astype(np.float64)


def _checked(colors: np.ndarray, n: int, per: str) -> Colors:
    """The colours as float64; RayError if they are not n finite ones."""
    colors = np.asarray(colors, np.float64)
    fix = f"give one linear RGB colour per {per}, as an array (n, 3)"
    where = "render_mesh(paint=...)"
    if colors.shape != (n, 3):
        what = f"paint has the shape {colors.shape}, but {per} colours would have {(n, 3)}"
        raise RayError(what, where, fix)
    n_bad = int((~np.isfinite(colors)).any(axis=1).sum())
    if n_bad:
        raise RayError(f"{n_bad} of {n} colours are NaN or infinite", where, fix)
    return colors
