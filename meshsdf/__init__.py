"""Polygon meshes to exact signed distance volumes and back, with the loss proved."""
