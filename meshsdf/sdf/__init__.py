"""mesh -> distance: narrow bands and dense grids, signed by a reasoned choice."""

from .dense import mesh_to_grid
from .lattice import resolve_voxel_size
from .mesh_distance import MeshDistance, PointDistances
from .narrow_band import mesh_to_band
from .normalization import Normalization, normalization
from .samples import Samples, deepsdf_counts, sample_distances
from .sign import SignChoice, choose_sign, small_words
from .union import union_words

__all__ = [
    "MeshDistance",
    "Normalization",
    "PointDistances",
    "Samples",
    "SignChoice",
    "choose_sign",
    "deepsdf_counts",
    "mesh_to_band",
    "mesh_to_grid",
    "normalization",
    "resolve_voxel_size",
    "sample_distances",
    "small_words",
    "union_words",
]
