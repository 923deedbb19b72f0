"""field -> mesh: marching squares and cubes, dual contouring, surface nets."""

from .carry import carry
from .continuation import continue_surface
from .curves import Curve, Curves
from .dual_contouring import dual_contouring
from .hermite import choose_normals, sample_hermite
from .level import default_level, require_faces
from .marching_cubes import marching_cubes, singular_cells
from .marching_slices import marching_cubes_slices
from .marching_squares import marching_squares, marching_squares_rows
from .plane_sweep import MeshPart
from .seeds import find_seeds
from .surface_nets import surface_nets

__all__ = [
    "Curve",
    "Curves",
    "MeshPart",
    "carry",
    "choose_normals",
    "continue_surface",
    "default_level",
    "dual_contouring",
    "find_seeds",
    "marching_cubes",
    "marching_cubes_slices",
    "marching_squares",
    "marching_squares_rows",
    "require_faces",
    "sample_hermite",
    "singular_cells",
    "surface_nets",
]
