"""mesh -> distance: narrow bands and dense grids, signed by a reasoned choice."""

from .dense import mesh_to_grid
from .lattice import resolve_voxel_size
from .mesh_distance import MeshDistance, PointDistances
from .narrow_band import mesh_to_band
from .sign import SignChoice, choose_sign
from .union import union_words

__all__ = [
    "MeshDistance",
    "PointDistances",
    "SignChoice",
    "choose_sign",
    "mesh_to_band",
    "mesh_to_grid",
    "resolve_voxel_size",
    "union_words",
]
