"""Queries on a mesh: closest points, winding numbers."""

from .closest_point import ClosestPoint, ClosestPoints

__all__ = ["ClosestPoint", "ClosestPoints"]
