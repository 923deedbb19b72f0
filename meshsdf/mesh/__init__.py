"""Is it sound? Triangle meshes, their two-set check and their measures."""

from .components import Component
from .edge_chain import residual_edge_lines
from .faces import degenerate_faces, net_faces, odd_faces
from .holes import Hole
from .mesh import Material, Mesh
from .self_intersections import SelfIntersections, find_self_intersections
from .two_set import check
from .two_set_report import TwoSetReport
from .weld import weld

__all__ = [
    "Component",
    "Hole",
    "Material",
    "Mesh",
    "SelfIntersections",
    "TwoSetReport",
    "check",
    "degenerate_faces",
    "find_self_intersections",
    "net_faces",
    "odd_faces",
    "residual_edge_lines",
    "weld",
]
