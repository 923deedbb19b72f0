"""Values on nodes: dense grids and sparse bricks."""

from .brick_grid import NarrowBand
from .brick_index import BrickIndex
from .grid import Grid

__all__ = ["BrickIndex", "Grid", "NarrowBand"]
