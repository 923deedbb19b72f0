"""f(points) -> values: shapes as functions, negative inside."""

from .csg import complement, difference, intersection, union
from .implicit import Exactness, Implicit, central_differences, from_function
from .primitives import box, gyroid, plane, sphere, torus

__all__ = [
    "Exactness",
    "Implicit",
    "box",
    "central_differences",
    "complement",
    "difference",
    "from_function",
    "gyroid",
    "intersection",
    "plane",
    "sphere",
    "torus",
    "union",
]
