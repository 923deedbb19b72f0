"""Is it sound? Triangle meshes, their two-set check and their measures."""

from .components import Component
from .edge_chain import residual_edge_lines
from .faces import degenerate_faces, net_faces, odd_faces
from .holes import Hole
from .measures import (
    area,
    euler_number,
    face_areas,
    face_normals,
    is_watertight,
    n_boundary_loops,
    n_components,
    volume,
)
from .mesh import Material, Mesh
from .outer_boundary import OuterBoundary, outer_boundary
from .primitives import box_mesh, cylinder, icosphere, tetrahedron
from .sampling import SurfacePoints, sample_surface
from .self_intersections import SelfIntersections, find_self_intersections
from .tubes import closed_tube, torus, trefoil_tube
from .two_set import check
from .two_set_report import TwoSetReport
from .weld import weld

__all__ = [
    "Component",
    "Hole",
    "Material",
    "Mesh",
    "OuterBoundary",
    "SelfIntersections",
    "SurfacePoints",
    "TwoSetReport",
    "area",
    "box_mesh",
    "check",
    "closed_tube",
    "cylinder",
    "degenerate_faces",
    "euler_number",
    "face_areas",
    "face_normals",
    "find_self_intersections",
    "icosphere",
    "is_watertight",
    "n_boundary_loops",
    "n_components",
    "net_faces",
    "odd_faces",
    "outer_boundary",
    "residual_edge_lines",
    "sample_surface",
    "tetrahedron",
    "torus",
    "trefoil_tube",
    "volume",
    "weld",
]
