"""Queries on a mesh: closest points, winding numbers."""
