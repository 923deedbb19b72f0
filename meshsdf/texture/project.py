"""Images projected along an axis, around it, from a center, along all three axes, onto a box.

The book's projection textures (Bier, Sloan 1986, doi:10.1109/MCG.1986.276545): a simple shape
around the object has coordinates of its own, and every point takes those of its image there.
Texture space is right-handed with z upward, but for `Planar` and `Decal`, which look down z.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Number, Points, Points2
from ..errors import TextureError
from ..spatial.image import Colors
from .projection import (
    Gradients,
    Linear,
    Mapped,
    Projection,
    Reached,
    Width,
    check_positive,
    look,
    stretch,
    toward,
)

TURN = 2.0 * np.pi
NEAREST = 1e-150  # to an axis or a center that gradients are taken at; squares stay finite


@dataclass(frozen=True, eq=False)
class Planar(Mapped):
    """Along z, through everything: u = x / width, v = y / height.

    Attributes
    ----------
    width, height : float
        Of the image, units of texture space; its lower left corner lies at x = y = 0.
    wrap : str
        As for `Image.sample`.

    Examples
    --------
    >>> from meshsdf.spatial.image import Image
    >>> image = Image.from_linear(np.array([[[0.0], [1.0]]], np.float32))
    >>> Planar(image, width=2)(np.array([[0.5, 7.0, 7.0], [1.0, 0.0, 0.0]]))
    array([[0. , 0. , 0. , 1. ],
           [0.5, 0.5, 0.5, 1. ]], dtype=float32)
    """

    width: Number = 1.0
    height: Number = 1.0
    wrap: str = "repeat"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_size(self, "width", "height")

    def _uv(self, local: Points) -> Points2:
        return local[:, :2] / [self.width, self.height]

    def _gradients(self, local: Points) -> Gradients:
        return np.array([[[1 / self.width, 0, 0], [0, 1 / self.height, 0]]])

    def _wraps(self) -> tuple[str, str]:
        return (self.wrap, self.wrap)


@dataclass(frozen=True, eq=False)
class Cylindrical(Mapped):
    """Around z: u = angle / 2 pi from the x axis towards y, v = z / height.

    Attributes
    ----------
    height : float
        Of the image, units of texture space; its lower border lies at z = 0.
    wrap : str
        What lies below and above it, as for `Image.sample`.
    """

    height: Number = 1.0
    wrap: str = "repeat"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_size(self, "height")

    def _uv(self, local: Points) -> Points2:
        x, y, z = local.T
        return np.column_stack([np.arctan2(y, x) / TURN, z / self.height])

    def _gradients(self, local: Points) -> Gradients:
        gradients = np.zeros((len(local), 2, 3))
        gradients[:, 0] = _around(local)
        gradients[:, 1, 2] = 1 / self.height
        return gradients

    def _wraps(self) -> tuple[str, str]:
        return ("repeat", self.wrap)

    def _widest(self) -> tuple[float, float]:
        return (1.0, np.inf)


@dataclass(frozen=True, eq=False)
class Spherical(Mapped):
    """From the center: u = longitude / 2 pi from x towards y, v = 1/2 + latitude / pi.

    The image's lower border is the pole at -z, its upper one that at +z. At a pole, and in the
    center, where no longitude is, that of the x axis is taken.
    """

    def _uv(self, local: Points) -> Points2:
        x, y, z = local.T
        latitude = np.arctan2(z, np.hypot(x, y))
        return np.column_stack([np.arctan2(y, x) / TURN, 0.5 + latitude / np.pi])

    def _gradients(self, local: Points) -> Gradients:
        x, y, z = local.T
        rho = np.hypot(x, y)
        radius, on_axis = np.hypot(rho, z), rho == 0
        outward = np.column_stack([x, y]) / np.where(on_axis, 1.0, rho)[:, None]
        outward[on_axis, 0] = 1.0
        radius = np.maximum(radius, NEAREST)[:, None]
        gradients = np.empty((len(local), 2, 3))
        gradients[:, 0] = _around(local)
        gradients[:, 1, :2] = -(z[:, None] / radius) * outward / (np.pi * radius)
        gradients[:, 1, 2:] = rho[:, None] / radius / (np.pi * radius)
        return gradients

    def _widest(self) -> tuple[float, float]:
        return (1.0, 1.0)

    def _wraps(self) -> tuple[str, str]:
        return ("repeat", "clamp")


@dataclass(frozen=True, eq=False)
class Triplanar(Projection):
    """Along all three axes, blended by how much the surface faces each; needs normals.

    Attributes
    ----------
    width, height : float
        Of the image, units of texture space; from every side it stands upright, z (from above and
        below, y) upward, and is not mirrored.
    sharpness : float
        The weight of axis k is ``|normal_k| ** sharpness``, divided by the sum of the three.
    wrap : str
        As for `Image.sample`.
    """

    width: Number = 1.0
    height: Number = 1.0
    sharpness: Number = 4.0
    wrap: str = "repeat"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_size(self, "width", "height", "sharpness")

    def _reached(self, local: Points, facing: Points | None) -> Reached:
        if facing is None:
            where = "Triplanar(...)(points, normals)"
            raise TextureError("there are no normals", where, "pass the surface's normals")
        return facing.any(axis=1)

    def _colors(
        self,
        local: Points,
        normals: Points | None,
        facing: Points | None,
        linear: Linear,
        width: Width,
    ) -> Colors:
        size = np.abs(facing)
        size /= np.maximum(size.max(axis=1, keepdims=True), np.finfo(float).tiny)
        weights = size**self.sharpness
        total, alphas = np.zeros((len(local), 3)), np.zeros(len(local))
        for axis, (right, side, up) in enumerate(((1, 1, 2), (0, -1, 2), (0, 1, 1))):
            sign = np.where(facing[:, axis] < 0, -side, side)
            uv = np.column_stack([sign * local[:, right] / self.width, local[:, up] / self.height])
            widths = np.zeros((1, 2))
            if width.any():
                gradients = np.zeros((1, 2, 3))
                gradients[0, 0, right], gradients[0, 1, up] = 1 / self.width, 1 / self.height
                widths = width * stretch(gradients @ linear, normals)
            colors = look(self.image, uv, widths, (self.wrap, self.wrap))
            share = weights[:, axis] * colors[:, 3]
            total += share[:, None] * colors[:, :3]
            alphas += share
        total /= np.where(alphas > 0, alphas, 1.0)[:, None]
        alphas /= np.maximum(weights.sum(axis=1), 1.0)  # only a zero normal has less
        return np.column_stack([total, alphas]).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Decal(Mapped):
    """A sticker: along z within a box around the origin, upright and unmirrored seen from +z.

    Attributes
    ----------
    width, height, depth : float
        Of the box, along x, y and z, units of texture space. Half a texel within the image's
        border, alpha begins to fade.
    steepest : float
        Degrees; where normals are given, those turned this far from +z or farther get nothing.
    """

    width: Number = 1.0
    height: Number = 1.0
    depth: Number = 1.0
    steepest: Number = 90.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_size(self, "width", "height", "depth")
        check_positive(self.steepest, "steepest", "Decal(steepest=...)", 180)

    def _uv(self, local: Points) -> Points2:
        return local[:, :2] / [self.width, self.height] + 0.5

    def _gradients(self, local: Points) -> Gradients:
        return np.array([[[1 / self.width, 0, 0], [0, 1 / self.height, 0]]])

    def _wraps(self) -> tuple[str, str]:
        return ("transparent", "transparent")

    def _reached(self, local: Points, facing: Points | None) -> Reached:
        reached = (np.abs(local) <= 0.5 * np.array([self.width, self.height, self.depth])).all(1)
        if facing is not None:
            reached &= toward(facing, np.array([[0.0, 0.0, 1.0]]), self.steepest)
        return reached


def _around(local: Points) -> Points:
    """The gradient of the angle around z, in turns; on the axis that of a point beside it."""
    x, y = local[:, 0], local[:, 1]
    rho = np.hypot(x, y)
    unit = np.where(rho > 0, rho, 1.0)
    along = np.column_stack([-y / unit, np.where(rho > 0, x / unit, 1.0), np.zeros(len(x))])
    return along / (TURN * np.maximum(rho, NEAREST))[:, None]


def _check_size(projection: Projection, *names: str) -> None:
    """TextureError unless the named attributes are positive."""
    for name in names:
        check_positive(getattr(projection, name), name, f"{type(projection).__name__}({name}=...)")
