"""field -> mesh: marching squares and cubes, dual contouring."""

from .marching_cubes import marching_cubes

__all__ = ["marching_cubes"]
