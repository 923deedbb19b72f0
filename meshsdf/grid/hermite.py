"""Where a surface crosses the edges of a band, with its normals there and its features."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32, Int64

from ..errors import GridError


@dataclass(frozen=True, eq=False)
class Hermite:
    """What dual contouring at level 0 takes from the mesh that a band was made of.

    Crossed edges are numbered brick by brick, and within a brick by axis and lower node; loops (the
    polygons of marching cubes) brick by brick, cell by cell.

    Attributes
    ----------
    fractions : (c,) float64
        Where the mesh crosses every edge, as a fraction of its length from the lower node.
    normals : (c, 3) float64
        The mesh's unit normal there, towards the outer node; 0 where the mesh is not near.
    loops : (k,) int32
        Loops whose vertex is known better than by crossings and normals, in rising order.
    loop_points : (k, 3) float64
        Where these vertices lie, world units: on the mesh, on its creases or at its corners.
    arcs : (t,) int64
        Edges of the mesh to be, from loop to loop, that get a vertex of their own, in rising
        order: ``4 c + q`` where the edge passes crossing c between the loops q and q + 1 around it.
    arc_points : (t, 3) float64
        Where these vertices lie, world units.
    """

    fractions: Float64[np.ndarray, " c"]
    normals: Float64[np.ndarray, "c 3"]
    loops: Int32[np.ndarray, " k"]
    loop_points: Float64[np.ndarray, "k 3"]
    arcs: Int64[np.ndarray, " t"]
    arc_points: Float64[np.ndarray, "t 3"]

    def __post_init__(self) -> None:
        for names in (("fractions", "normals"), ("loops", "loop_points"), ("arcs", "arc_points")):
            lengths = [len(getattr(self, name)) for name in names]
            if lengths[0] != lengths[1]:
                raise GridError(
                    f"{lengths[0]} {names[0]}, but {lengths[1]} {names[1]}",
                    "Hermite(...)",
                    "give one of each",
                )

    @property
    def n_crossings(self) -> int:
        """Number of crossed edges."""
        return len(self.fractions)
