"""Polygon meshes to exact signed distance volumes and back, with the loss proved.

The main job reads: `read_mesh`, `check`, `mesh_to_band`, `marching_cubes`, `compare`.

Conventions
-----------
- Distances are negative inside and positive outside.
- Faces are counter-clockwise seen from outside.
- Lengths are in world units: the numbers of the mesh file. Colours are linear RGB inside the
  program, sRGB only at a file's edge, by its format's own rule.
- Node (i, j, k) of a volume lies at ``voxel_size * (i, j, k) + translation``. The translation is
  zero unless asked for, so volumes of one voxel size line up. Arrays are indexed ``[i, j, k]``.
- ``resolution=N`` makes the voxel size the longest side of the mesh's box / N; ``half_width`` is
  in voxels, 3 unless asked for.
- Points and what is computed on them are float64, stored volumes float32.
- The same input gives the same bytes, with any number of threads.

>>> import numpy as np
>>> from meshsdf import mesh_to_band
>>> from meshsdf.mesh.primitives import box_mesh
>>> band = mesh_to_band(box_mesh(size=(2.0, 2.0, 2.0)), voxel_size=0.25)
>>> band.value_at(np.array([[0, 0, 5], [0, 0, 4], [0, 0, 3]]))
array([ 0.25,  0.  , -0.25])
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .errors import MeshsdfError
    from .grid import Grid, NarrowBand
    from .implicit import Exactness, Implicit, from_function
    from .io import read_mesh, read_volume, write_mesh, write_samples, write_volume
    from .mesh import Mesh, TwoSetReport, check, sample_surface
    from .ray import Camera, frame, render_distances, render_mesh
    from .report import (
        Comparison,
        Conditioning,
        Enclosure,
        ErrorBudget,
        RoundTrip,
        Tolerance,
        compare,
        conditioning,
        error_budget,
        hausdorff,
        roundtrip,
    )
    from .sdf import MeshDistance, Samples, mesh_to_band, mesh_to_grid, sample_distances
    from .spatial import RayHits
    from .surface import (
        Curve,
        Curves,
        MeshPart,
        carry,
        continue_surface,
        dual_contouring,
        find_seeds,
        marching_cubes,
        marching_cubes_slices,
        marching_squares,
        marching_squares_rows,
        singular_cells,
        surface_nets,
    )
    from .texture import (
        Brush,
        MeshSource,
        Operation,
        Project,
        Stroke,
        VolumeTexture,
        atlas_for,
        bake,
        procedural,
        textured,
        transfer,
        vertex_colored,
    )

_HOME = {
    "Brush": "texture",
    "Camera": "ray",
    "Comparison": "report",
    "Conditioning": "report",
    "Curve": "surface",
    "Curves": "surface",
    "Enclosure": "report",
    "ErrorBudget": "report",
    "Exactness": "implicit",
    "Grid": "grid",
    "Implicit": "implicit",
    "Mesh": "mesh",
    "MeshDistance": "sdf",
    "MeshPart": "surface",
    "MeshSource": "texture",
    "MeshsdfError": "errors",
    "NarrowBand": "grid",
    "Operation": "texture",
    "Project": "texture",
    "RayHits": "spatial",
    "RoundTrip": "report",
    "Samples": "sdf",
    "Stroke": "texture",
    "Tolerance": "report",
    "TwoSetReport": "mesh",
    "VolumeTexture": "texture",
    "atlas_for": "texture",
    "bake": "texture",
    "carry": "surface",
    "check": "mesh",
    "compare": "report",
    "conditioning": "report",
    "continue_surface": "surface",
    "dual_contouring": "surface",
    "error_budget": "report",
    "find_seeds": "surface",
    "frame": "ray",
    "from_function": "implicit",
    "hausdorff": "report",
    "marching_cubes": "surface",
    "marching_cubes_slices": "surface",
    "marching_squares": "surface",
    "marching_squares_rows": "surface",
    "mesh_to_band": "sdf",
    "mesh_to_grid": "sdf",
    "procedural": "texture",
    "read_mesh": "io",
    "read_volume": "io",
    "render_distances": "ray",
    "render_mesh": "ray",
    "roundtrip": "report",
    "sample_distances": "sdf",
    "sample_surface": "mesh",
    "singular_cells": "surface",
    "surface_nets": "surface",
    "textured": "texture",
    "transfer": "texture",
    "vertex_colored": "texture",
    "write_mesh": "io",
    "write_samples": "io",
    "write_volume": "io",
}

__all__ = [
    "Brush",
    "Camera",
    "Comparison",
    "Conditioning",
    "Curve",
    "Curves",
    "Enclosure",
    "ErrorBudget",
    "Exactness",
    "Grid",
    "Implicit",
    "Mesh",
    "MeshDistance",
    "MeshPart",
    "MeshSource",
    "MeshsdfError",
    "NarrowBand",
    "Operation",
    "Project",
    "RayHits",
    "RoundTrip",
    "Samples",
    "Stroke",
    "Tolerance",
    "TwoSetReport",
    "VolumeTexture",
    "atlas_for",
    "bake",
    "carry",
    "check",
    "compare",
    "conditioning",
    "continue_surface",
    "dual_contouring",
    "error_budget",
    "find_seeds",
    "frame",
    "from_function",
    "hausdorff",
    "marching_cubes",
    "marching_cubes_slices",
    "marching_squares",
    "marching_squares_rows",
    "mesh_to_band",
    "mesh_to_grid",
    "procedural",
    "read_mesh",
    "read_volume",
    "render_distances",
    "render_mesh",
    "roundtrip",
    "sample_distances",
    "sample_surface",
    "singular_cells",
    "surface_nets",
    "textured",
    "transfer",
    "vertex_colored",
    "write_mesh",
    "write_samples",
    "write_volume",
]


def __getattr__(name: str):
    # Imported on first use, so that `import meshsdf` and the command line start at once
    if name not in _HOME:
        raise AttributeError(f"module 'meshsdf' has no attribute {name!r}")
    value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
