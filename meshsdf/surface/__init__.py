"""field -> mesh: marching squares and cubes, dual contouring."""

from .level import default_level, require_faces
from .marching_cubes import marching_cubes

__all__ = ["default_level", "marching_cubes", "require_faces"]
