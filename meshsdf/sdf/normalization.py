"""Where a mesh is put before it is sampled, so that learners see shapes of one size.

``normalized = scale * (world - center)``. Normalised distances are ``scale`` times those in world
units. A margin keeps the mesh off the border: it fills ``1 / (1 + margin)`` of the unit sphere or
cube.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Number, Points, Vector3
from ..box import Box
from ..errors import SdfError
from ..mesh import Mesh

NormalizationName = Literal["none", "unit-sphere", "unit-cube"]

MARGIN = 0.03  # Park et al. 2019: the sphere around the mesh has radius 1 / 1.03


@dataclass(frozen=True, eq=False)
class Normalization:
    """A shift and an even scale.

    Attributes
    ----------
    name : str
        "none", "unit-sphere" or "unit-cube".
    center : (3,) float64
        World position that becomes the origin.
    scale : float
        Normalised length of one world unit.
    domain : Box
        Where uniform samples are drawn, normalised.
    reach : float
        Radius of the sphere around the mesh, grown by the margin, in world units: the unit of the
        variances of samples near the surface.
    """

    name: str
    center: Vector3
    scale: float
    domain: Box
    reach: float

    def normalized(self, points: Points) -> Points:
        """Take (n, 3) world points into the normalised space."""
        return self.scale * (points - self.center)

    def world(self, points: Points) -> Points:
        """Take (n, 3) normalised points into world space."""
        return points / self.scale + self.center


def normalization(
    mesh: Mesh, name: NormalizationName = "none", *, margin: Number = MARGIN
) -> Normalization:
    """Return how a mesh is normalised.

    Parameters
    ----------
    mesh : Mesh
        With faces; vertices that none uses are passed over.
    name : "none", "unit-sphere" or "unit-cube"
        "none" keeps world space; the domain is the mesh's box, longer on every side by the margin
        times half its longest side. "unit-sphere": the sphere about the middle of the mesh's box
        that holds the mesh, grown by the margin, gets radius 1; the domain is the cube around it,
        [-1, 1]. "unit-cube": the cube around the mesh's box, grown by the margin, becomes
        [-1/2, 1/2], which is the domain, too.
    margin : number
        From 0 on.

    Raises
    ------
    SdfError
        The name is unknown, the margin below 0, or all vertices lie in one place.

    References
    ----------
    Park et al., "DeepSDF: Learning Continuous Signed Distance Functions for Shape Representation",
    2019, doi:10.1109/CVPR.2019.00025: "unit-sphere" with a margin of 0.03.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> found = normalization(box_mesh((4.0, 2.0, 2.0)), "unit-cube", margin=0)
    >>> found.scale, found.domain.lower
    (0.25, array([-0.5, -0.5, -0.5]))
    """
    where = f"normalization({name!r}, margin={margin})"
    if name not in ("none", "unit-sphere", "unit-cube"):
        raise SdfError(f"{name!r} is unknown", where, "choose none, unit-sphere or unit-cube")
    if not 0 <= margin < np.inf:
        raise SdfError(f"the margin is {margin}", where, "pass a number from 0 on")
    box, grown = mesh.box, 1.0 + float(margin)
    if not box.longest_side > 0:
        raise SdfError("all vertices lie in one place", where, "pass a mesh with an extent")
    used = mesh.vertices[np.unique(mesh.faces)]
    reach = grown * float(np.linalg.norm(used - box.center, axis=1).max())
    if name == "none":
        more = 0.5 * float(margin) * box.longest_side
        domain = Box(box.lower - more, box.upper + more)
        return Normalization(name, np.zeros(3), 1.0, domain, reach)
    if name == "unit-sphere":
        scale, half = 1.0 / reach, 1.0
    else:
        scale, half = 1.0 / (grown * box.longest_side), 0.5
    return Normalization(name, box.center, scale, Box(np.full(3, -half), np.full(3, half)), reach)
