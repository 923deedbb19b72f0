"""How large a mesh may become."""

from ..errors import SurfaceError

MAX_VERTICES = 2**31 - 1  # faces are int32


def require_nameable(n_vertices: int) -> None:
    """Refuse more vertices than faces can name.

    Raises
    ------
    SurfaceError
        There are more than 2^31 - 1.
    """
    if n_vertices > MAX_VERTICES:
        raise SurfaceError(
            f"the surface has {n_vertices} vertices, faces can name {MAX_VERTICES}",
            "marching_cubes(volume=...)",
            "cut the volume into parts, or use a larger voxel size",
        )
