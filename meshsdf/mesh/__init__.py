"""Is it sound? Triangle meshes, their two-set check and their measures."""

from .mesh import Material, Mesh

__all__ = ["Material", "Mesh"]
