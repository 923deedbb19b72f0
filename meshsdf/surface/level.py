"""Which level to extract, and what it means when there is nothing there."""

from ..errors import SurfaceError
from ..grid import Grid, NarrowBand
from ..mesh import Mesh


def default_level(volume: NarrowBand | Grid) -> tuple[float, tuple[str, ...]]:
    """Return the level of the surface, world units, and warnings.

    Signed volumes have their surface at 0. Unsigned ones have no crossing there; the nearest thing
    to a surface is a closed shell at one voxel's distance around every sheet.
    """
    if volume.is_signed:
        return 0.0, ()
    return volume.voxel_size, (
        f"unsigned distances: this is a shell {volume.voxel_size:g} (one voxel) off every sheet",
    )


def require_faces(surface: Mesh, *, level: float) -> None:
    """Refuse an empty surface.

    Raises
    ------
    SurfaceError
        The mesh has no faces.
    """
    if surface.n_faces == 0:
        raise SurfaceError(
            f"no value crosses the level {level:g}, so there is no surface",
            f"marching_cubes(level={level:g})",
            "choose a level between the least and the greatest value, or a higher resolution",
        )
