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


def check_level(volume: NarrowBand | Grid, level: float, function: str) -> None:
    """Refuse a level that the volume cannot have, and a grid without cells.

    Raises
    ------
    SurfaceError
        No value lies below the level, or beyond it nothing is known, or there is no cell;
        ``function`` is named as the place.
    """
    where = f"{function}(level=...)"
    if not volume.is_signed and level <= 0:
        raise SurfaceError(
            f"level is {level:g}, but the volume is unsigned: no value lies below 0",
            where,
            f"pass a level above 0, such as the voxel size, {volume.voxel_size:g}",
        )
    if isinstance(volume, NarrowBand):
        if abs(level) >= volume.background:
            raise SurfaceError(
                f"level is {level:g}, but the band holds only values between "
                f"{-volume.background:g} and {volume.background:g}",
                where,
                "pass a level strictly between, or make the band wider with half_width",
            )
    elif min(volume.values.shape) < 2:
        raise SurfaceError(
            f"the grid has {' x '.join(map(str, volume.values.shape))} nodes, so it has no cell",
            f"{function}(volume=...)",
            "pass at least 2 nodes along each axis",
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
