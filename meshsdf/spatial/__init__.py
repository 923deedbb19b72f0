"""Queries on a mesh: closest points, hits of rays, winding numbers."""

from .closest_point import ClosestPoint, ClosestPoints
from .ray_hits import Hits, RayHits

__all__ = ["ClosestPoint", "ClosestPoints", "Hits", "RayHits"]
