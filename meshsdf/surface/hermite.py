"""Hermite data: exact crossings, normals and features of the mesh that a volume was made from."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from ..arrays import Number, Points
from ..errors import SurfaceError
from ..grid import Grid, NarrowBand
from ..grid.hermite import Hermite
from ..kernels.dual_arrays import Crossings
from ..kernels.quadric import fit_points
from ..mesh import Mesh
from ..progress import Progress, silent
from .arc_vertices import find_ends, folded_arcs, place_arcs
from .brick_field import BrickField, field_of_band, in_ranges
from .dual_faces import crossing_places
from .dual_loops import DualLoops, find_loops
from .features import ALLOWED, place_loops
from .gradients import gradient_crossings
from .located import Located
from .mesh_hits import find_hits
from .near_features import NearFeatures
from .regions import cut_regions

FEATURE_ANGLE = 30.0
"""Degrees by which the normals of two faces differ at a crease."""

EXACT = {"truncation": 0.03, "reach": 1.0}
"""Where normals are the mesh's own: planes that meet at more than about 3 degrees make a crease,
and a point in all planes may lie up to a voxel outside its cell."""

ESTIMATED = {"truncation": 0.1, "reach": 0.0}
"""Where they are estimates: 11 degrees, and within the cell."""


@dataclass(frozen=True)
class NormalSource:
    """Where dual contouring takes crossings and normals from.

    Attributes
    ----------
    kind : str
        "mesh", "stored" or "gradients".
    warnings : tuple of str
        What the user should know about the result.
    """

    kind: str
    warnings: tuple[str, ...] = ()


def choose_normals(
    volume: NarrowBand | Grid, mesh: Mesh | None = None, *, level: Number = 0.0
) -> NormalSource:
    """Choose the best source of normals there is: the mesh, data stored with the band, gradients.

    Mesh and stored data know the surface of level 0 alone.
    """
    has_stored = isinstance(volume, NarrowBand) and volume.hermite is not None
    if level == 0 and mesh is not None:
        return NormalSource("mesh")
    if level == 0 and has_stored:
        return NormalSource("stored")
    why = "no mesh and no Hermite data are at hand"
    if mesh is not None or has_stored:
        why = f"the mesh's normals are those of level 0, not {level:g}"
    return NormalSource(
        "gradients", (f"{why}: normals are estimated by gradients, and creases come back rounded",)
    )


def sample_hermite(
    mesh: Mesh,
    band: NarrowBand,
    *,
    feature_angle: Number = FEATURE_ANGLE,
    progress: Progress = silent,
) -> Hermite:
    """Find where a mesh crosses the edges of its band, its normals there, and its features.

    Parameters
    ----------
    mesh : Mesh
        The mesh that the band was made from.
    band : NarrowBand
        Signed.
    feature_angle : float
        In degrees: edges whose faces turn by more are creases.
    progress : Progress
        Called between pieces of work.

    Returns
    -------
    hermite : Hermite
        For ``dataclasses.replace(band, hermite=...)``, to be stored with the band.

    Raises
    ------
    SurfaceError
        The band is unsigned, so that no edge is crossed.

    Notes
    -----
    Accuracy: crossings lie on the mesh, to rounding of float64.
    Cost: time and memory grow with the surface in voxels and with the number of faces.
    """
    if not band.is_signed:
        raise SurfaceError(
            "the band is unsigned, so the mesh crosses none of its edges",
            "sample_hermite(band=...)",
            'make the band with sign="parity" or "winding"',
        )
    field = field_of_band(band, 0.0, progress)
    loops = find_loops(field, 0.0, 0.5, progress)
    located, moved = locate_on_mesh(mesh, band, field, loops, feature_angle, progress)
    return Hermite(
        located.crossings.fractions,
        located.crossings.normals,
        moved,
        to_world(band, loops, located.points[moved]),
        located.arcs,
        to_world(band, loops, located.arc_points),
    )


def locate_on_mesh(
    mesh: Mesh,
    volume: NarrowBand | Grid,
    field: BrickField,
    loops: DualLoops,
    feature_angle: Number,
    progress: Progress,
) -> tuple[Located, np.ndarray]:
    """Locate all vertices by the mesh; also return which loops the quadric does not locate."""
    regions = cut_regions(
        mesh, sign=volume.sign, feature_angle=feature_angle, voxel_size=volume.voxel_size
    )
    hits = find_hits(volume, field, loops, regions, progress)
    near = NearFeatures(loops, regions, hits)
    points, is_curved = fitted_points(loops, near.crossings, **EXACT, progress=progress)
    kinds = place_loops(near, points, is_curved, feature_angle)
    progress("features", 0.5)
    arcs, arc_points = place_arcs(near, folded_arcs(loops), points, kinds)
    progress("features", 1.0)
    located = Located(loops, near.crossings, points, arcs, arc_points, ALLOWED)
    return located, np.flatnonzero(kinds.is_moved).astype(np.int32)


def locate_by_store(band: NarrowBand, loops: DualLoops, progress: Progress) -> Located:
    """Locate all vertices by the Hermite data of a band.

    Raises
    ------
    SurfaceError
        The data name crossings, loops or arcs that the band does not have.
    """
    hermite = band.hermite
    _check_stored(hermite, loops)
    crossings = Crossings(loops.nodes, loops.ways, hermite.fractions, hermite.normals)
    points, _ = fitted_points(loops, crossings, **EXACT, progress=progress)
    points[hermite.loops] = to_voxels(band, loops, hermite.loop_points)
    arcs, places = with_folded(loops, crossings, hermite.arcs)
    places[np.searchsorted(arcs, hermite.arcs)] = to_voxels(band, loops, hermite.arc_points)
    return Located(loops, crossings, points, arcs, places, ALLOWED)


def locate_by_gradients(
    volume: NarrowBand | Grid, field: BrickField, loops: DualLoops, progress: Progress
) -> Located:
    """Locate all vertices, within their cells, by normals that the values suggest."""
    crossings = gradient_crossings(volume, field, loops, progress)
    points, _ = fitted_points(loops, crossings, **ESTIMATED, progress=progress)
    return Located(
        loops, crossings, points, *with_folded(loops, crossings, np.empty(0, np.int64)), np.inf
    )


def fitted_points(
    loops: DualLoops,
    crossings: Crossings,
    *,
    truncation: Number,
    reach: Number,
    progress: Progress = silent,
) -> tuple[Points, Bool[np.ndarray, " l"]]:
    """Points that fit the planes at each loop's crossings, and which loops are curved."""
    points, is_curved = np.empty((loops.n_loops, 3)), np.empty(loops.n_loops, np.bool_)

    def fit(begin: int, end: int) -> None:
        fit_points(loops.arrays, crossings, truncation, reach, begin, end, points, is_curved)

    in_ranges(fit, loops.n_loops, "points", progress, nodes_per_item=64)
    return points, is_curved


def to_world(volume: NarrowBand | Grid, loops: DualLoops, points: Points) -> Points:
    """Voxels from the base of the loops -> world units."""
    origin = volume.translation if isinstance(volume, NarrowBand) else volume.origin
    return volume.voxel_size * (points + loops.base) + origin


def to_voxels(volume: NarrowBand | Grid, loops: DualLoops, points: Points) -> Points:
    """World units -> voxels from the base of the loops."""
    origin = volume.translation if isinstance(volume, NarrowBand) else volume.origin
    return (points - origin) / volume.voxel_size - loops.base


def with_folded(
    loops: DualLoops, crossings: Crossings, arcs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Keys of arcs with a vertex: those given, and those that need one; the arcs' middles."""
    arcs = np.union1d(arcs, folded_arcs(loops))
    ends, _ = find_ends(loops.arrays, arcs)
    return arcs, crossing_places(crossings, ends.ravel()).reshape(-1, 2, 3).mean(axis=1)


def _check_stored(hermite: Hermite, loops: DualLoops) -> None:
    """Compiled loops index without looking, and follow arcs until they find the other end."""
    wrong = ""
    if hermite.n_crossings != loops.n_crossings:
        wrong = f"{hermite.n_crossings} crossings, the band has {loops.n_crossings}"
    elif hermite.loops.max(initial=-1) >= loops.n_loops:
        wrong = f"loop {hermite.loops.max()}, the band has {loops.n_loops}"
    elif not _are_keys(hermite.arcs, loops):
        wrong = "arcs that the band does not have"
    if wrong:
        raise SurfaceError(
            f"the Hermite data name {wrong}",
            "dual_contouring(volume=...)",
            "sample them anew with sample_hermite(mesh, band)",
        )


def _are_keys(arcs: np.ndarray, loops: DualLoops) -> bool:
    if arcs.max(initial=-1) >= 4 * loops.n_crossings:
        return False
    c, q = arcs >> 2, arcs & 3
    if (loops.around[c, q] < 0).any() or (loops.around[c, (q + 1) & 3] < 0).any():
        return False
    return bool(find_ends(loops.arrays, arcs)[1].all())
