"""A pinhole or orthographic camera: rays through pixels, and pixels of points.

Pixel coordinates are (x, y) with (0, 0) at the picture's upper left corner and y downward; the
middle of the first pixel is (0.5, 0.5).
"""

from dataclasses import dataclass, field
from math import isfinite, radians, tan

import numpy as np
from jaxtyping import Float64

from ..arrays import Number, Points, Points2, Values, Vector3
from ..errors import RayError

Axes = Float64[np.ndarray, "3 3"]
Places = Float64[np.ndarray, "k 3"]
Pixels = Float64[np.ndarray, "k 2"]

PARALLEL = 1e-9  # sine of the angle between up and the line of sight that is too small


def _upward() -> Vector3:
    return np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, eq=False)
class Camera:
    """Where a picture is taken from.

    Attributes
    ----------
    position : (3,) float64
        World units.
    target : (3,) float64
        A point in the middle of the picture, world units.
    up : (3,) float64
        What is up in the picture; any length, not along the line of sight.
    field_of_view : float
        Angle from the lower to the upper border, degrees, between 0 and 180.
    orthographic_height : float or None
        World units from the lower to the upper border of a picture without perspective; the field
        of view then plays no part.

    Raises
    ------
    RayError
        Numbers that make no camera.

    Examples
    --------
    >>> camera = Camera(np.array([0.0, 0.0, 5.0]), np.zeros(3), field_of_view=90)
    >>> camera.project(np.array([[0.0, 0.0, 0.0], [5.0, 2.5, 0.0]]), 200, 100)
    (array([[100.,  50.],
           [150.,  25.]]), array([5., 5.]))
    """

    position: Vector3
    target: Vector3
    up: Vector3 = field(default_factory=_upward)
    field_of_view: Number = 30.0
    orthographic_height: Number | None = None

    def __post_init__(self) -> None:
        where = "Camera"
        for name in ("position", "target", "up"):
            if not np.isfinite(getattr(self, name)).all():
                what = f"{name} is {getattr(self, name).tolist()}"
                raise RayError(what, where, "pass three finite numbers")
        if not 0 < self.field_of_view < 180:
            what = f"the field of view is {self.field_of_view:g} degrees"
            raise RayError(what, where, "pass an angle between 0 and 180")
        height = self.orthographic_height
        if height is not None and not (isfinite(height) and height > 0):
            what = f"the orthographic height is {height:g}"
            raise RayError(what, where, "pass a positive length")
        sight = self.target - self.position
        if not sight.any():
            raise RayError("position and target are the same point", where, "move one of them")
        across = np.linalg.norm(np.cross(_unit(sight), self.up))
        if across <= PARALLEL * np.linalg.norm(self.up):
            fix = "pass another up"
            raise RayError("up lies along the line of sight, or is zero", where, fix)

    @property
    def axes(self) -> Axes:
        """Rows: the unit vectors to the right, upward, and back towards the viewer."""
        back = _unit(self.position - self.target)
        right = _unit(np.cross(self.up, back))
        return np.stack([right, np.cross(back, right), back])

    def pixel_size(self, height: int) -> float:
        """World units that a pixel covers: at distance 1 with perspective, else everywhere."""
        if self.orthographic_height is not None:
            return float(self.orthographic_height) / height
        return 2.0 * tan(radians(self.field_of_view) / 2.0) / height

    def rays(self, width: int, height: int, pixels: Pixels | None = None) -> tuple[Places, Places]:
        """Return the rays through places of a picture.

        Parameters
        ----------
        width, height : int
            Of the picture, pixels.
        pixels : (k, 2) float64, optional
            Pixel coordinates (x, y); the middles of all pixels, row by row, if left out.

        Returns
        -------
        origins, directions : (k, 3) float64
            Directions have length 1.
        """
        if pixels is None:
            y, x = np.divmod(np.arange(width * height), width)
            pixels = np.column_stack([x, y]) + 0.5
        size = self.pixel_size(height)
        right, up, back = self.axes
        x, y = (pixels[:, :1] - 0.5 * width) * size, (0.5 * height - pixels[:, 1:]) * size
        across = x * right + y * up
        if self.orthographic_height is not None:
            return self.position + across, np.tile(-back, (len(pixels), 1))
        directions = (across - back) / np.sqrt(x * x + y * y + 1.0)
        return np.tile(self.position, (len(pixels), 1)), directions

    def project(self, points: Points, width: int, height: int) -> tuple[Points2, Values]:
        """Return where points appear in a picture: the inverse of `rays`.

        Parameters
        ----------
        points : (n, 3) float64
            World units.
        width, height : int
            Of the picture, pixels.

        Returns
        -------
        pixels : (n, 2) float64
            Pixel coordinates, also beyond the borders; NaN for points that are not before a
            camera with perspective.
        depth : (n,) float64
            Distance in front of the camera along the line of sight, world units.
        """
        x, y, z = self.axes @ (points - self.position).T
        size = np.full(len(points), self.pixel_size(height))
        if self.orthographic_height is None:
            size *= np.where(z < 0, -z, np.nan)
        return np.column_stack([0.5 * width + x / size, 0.5 * height - y / size]), -z


def _unit(vector: Vector3) -> Vector3:
    scaled = vector / np.abs(vector).max()  # so that no square is lost
    return scaled / np.linalg.norm(scaled)
