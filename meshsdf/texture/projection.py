"""What all projections share: where they stand, how a footprint becomes a width in the image.

A projection takes points to texture coordinates (u, v) by closed formulas. It stands in texture
space, which a matrix T takes to world space; a point P is looked up at the inverse T(P), so that
the texture moves with the shape that T moves, or with ``space="world"`` at P itself, so that the
shape moves through the texture.

Filtering: a footprint is a disc on the surface, or a ball where no normals are given. Its width
along u is its diameter times the length of the gradient of u, less the part along the normal; along
v likewise (first order). The gradients are formulas too, so that nothing widens where u jumps.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float64

from ..arrays import Matrix4, Number, Points, Points2
from ..errors import TextureError
from ..kernels.parallel import even_ranges, run_pieces
from ..spatial.image import Colors, Image, Lengths, Widths, check_finite, check_wraps, uv_widths

Gradients = Float64[np.ndarray, "k 2 3"]  # of u and v, per unit of length
Normals = Float64[np.ndarray, "normals 3"]
Directions = Float64[np.ndarray, "d 3"]
Width = Float64[np.ndarray, "w 1"]  # of footprints, for each point, or once for all
Linear = Float64[np.ndarray, "3 3"]
Reached = Bool[np.ndarray, " n"] | None

PER_PIECE = 16384  # points: what is computed on the way stays in the cache
FLATTEST = 1e-12  # ratio of singular values of a matrix that flattens space


def _identity() -> Matrix4:
    return np.eye(4)


@dataclass(frozen=True, eq=False)
class Projection(ABC):
    """An image laid over space: ``f(points, normals=None, footprint=0.0) -> colours``.

    Attributes
    ----------
    image : Image
        What is projected.
    matrix : (4, 4) float64
        Takes texture space to world space; affine, invertible.
    space : {"model", "world"}
        Look points up where the matrix's inverse takes them, or where they are.

    Raises
    ------
    TextureError
        The matrix is not affine or not invertible, or the space or a wrap has an unknown name.
    """

    image: Image
    matrix: Matrix4 = field(default_factory=_identity, kw_only=True)
    space: str = field(default="model", kw_only=True)

    def __post_init__(self) -> None:
        where = f"{type(self).__name__}(matrix=...)"
        if self.space not in ("model", "world"):
            what = f"unknown space {self.space!r}"
            raise TextureError(what, f"{type(self).__name__}(space=...)", "pass model or world")
        check_wraps(self._wraps(), f"{type(self).__name__}(wrap=...)")
        if not np.isfinite(self.matrix).all() or (self.matrix[3] != [0, 0, 0, 1]).any():
            what = f"the matrix's last row is {self.matrix[3].tolist()}, or it is not finite"
            raise TextureError(what, where, "pass an affine matrix: its last row is 0 0 0 1")
        largest, _, smallest = np.linalg.svd(self.matrix[:3, :3], compute_uv=False)
        if smallest <= FLATTEST * largest:
            what = f"the matrix flattens space: singular values from {largest:g} to {smallest:g}"
            raise TextureError(what, where, "pass an invertible matrix")

    def __call__(
        self,
        points: Points,
        normals: Normals | None = None,
        footprint: Number | Lengths = 0.0,
    ) -> Colors:
        """Return colours at points.

        Parameters
        ----------
        points : (n, 3) float64
            World space, finite.
        normals : (n, 3) float64, optional
            Of the surface, world space, of any length; a zero normal faces nothing.
        footprint : float or (n,) float64
            Diameter of what to average, world units.

        Returns
        -------
        colors : (n, 4) float32
            Linear RGB, straight alpha; all zero where the projection does not reach.

        Raises
        ------
        TextureError
            Points, normals or footprints that are not finite or not as many.
        """
        normals = self._checked(points, normals)
        widths = uv_widths(footprint, len(points), f"{type(self).__name__}(...)(footprint=...)")
        inverse = np.linalg.inv(self.matrix) if self.space == "model" else np.eye(4)
        linear = np.ascontiguousarray(inverse[:3, :3])
        local = points @ linear.T + inverse[:3, 3]
        facing = None if normals is None else normals @ np.linalg.inv(linear)
        reached = self._reached(local, facing)
        pieces = even_ranges(len(points), len(points) // PER_PIECE + 1)
        colors = np.empty((len(points), 4), np.float32)

        def work(piece: int) -> None:
            here = slice(*pieces[piece])
            mine = [None if rows is None else rows[here] for rows in (normals, facing)]
            width = (widths if len(widths) == 1 else widths[here])[:, :1]
            colors[here] = self._colors(local[here], *mine, linear, width)

        run_pieces(work, len(pieces))
        if reached is not None:
            colors[~reached] = 0
        return colors

    def _checked(self, points: Points, normals: Normals | None) -> Points | None:
        """Unit normals; TextureError if points or normals cannot be looked up."""
        where = f"{type(self).__name__}(...)(points, normals)"
        check_finite(points, "points", where)
        if normals is None:
            return None
        if len(normals) != len(points):
            what = f"{len(points)} points and {len(normals)} normals"
            raise TextureError(what, where, "pass one normal per point")
        check_finite(normals, "normals", where)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return normals / np.where(length > 0, length, 1.0)

    def _wraps(self) -> tuple[str, str]:
        """What lies beyond the image's borders."""
        return ("repeat", "repeat")

    @abstractmethod
    def _colors(
        self,
        local: Points,
        normals: Points | None,
        facing: Points | None,
        linear: Linear,
        width: Width,
    ) -> Colors:
        """Colours at points of texture space, on the caller's thread alone."""

    def _reached(self, local: Points, facing: Points | None) -> Reached:
        """Which points get colour; None for all. ``facing``: normals there, of any length."""
        return None


class Mapped(Projection):
    """A projection that has texture coordinates (u, v) at every point."""

    def _colors(
        self,
        local: Points,
        normals: Points | None,
        facing: Points | None,
        linear: Linear,
        width: Width,
    ) -> Colors:
        """Colours at points of texture space, on the caller's thread alone."""
        widths = np.zeros((1, 2))
        if width.any():
            widths = width * stretch(self._gradients(local) @ linear, normals)
            widths = np.minimum(widths, self._widest())
        return look(self.image, self._uv(local), widths, self._wraps())

    @abstractmethod
    def _uv(self, local: Points) -> Points2:
        """Texture coordinates of points of texture space."""

    @abstractmethod
    def _gradients(self, local: Points) -> Gradients:
        """How u and v grow in texture space: for each point, or once for all."""

    def _widest(self) -> tuple[float, float]:
        """What no footprint exceeds along u and v."""
        return (np.inf, np.inf)


def stretch(gradients: Gradients, normals: Points | None) -> Float64[np.ndarray, "lengths 2"]:
    """The lengths of the gradients of u and v along the surface."""
    if normals is not None:
        across = np.einsum("kui,ki->ku", np.broadcast_to(gradients, (len(normals), 2, 3)), normals)
        gradients = gradients - across[:, :, None] * normals[:, None, :]
    return np.sqrt(np.einsum("kui,kui->ku", gradients, gradients))


def look(image: Image, uv: Points2, widths: Widths, wraps: tuple[str, str]) -> Colors:
    """Colours at texture coordinates, on the caller's thread alone."""
    check_finite(uv, "texture coordinates", "a projection: the image's size is out of proportion")
    colors = np.empty((len(uv), 4), np.float32)
    image.look(image.levels_for(widths), uv, widths, wraps, 0, len(uv), colors)
    return colors


def toward(facing: Points, direction: Directions, steepest: Number) -> Bool[np.ndarray, " n"]:
    """Whether normals are less than ``steepest`` degrees off their directions, of any length."""
    lengths = np.linalg.norm(facing, axis=1) * np.linalg.norm(direction, axis=1)
    least = 0.0 if steepest == 90 else np.cos(np.radians(float(steepest)))
    return np.einsum("ni,ni->n", facing, direction) > least * lengths


def check_positive(value: Number, name: str, where: str, largest: Number = np.inf) -> None:
    """Raise TextureError unless the number is positive, finite and at most ``largest``."""
    if not (0 < value < np.inf and value <= largest):
        limit = "" if largest == np.inf else f" of at most {largest:g}"
        raise TextureError(f"{name} is {value:g}", where, f"pass a positive number{limit}")
