"""Cameras that see the whole of something, as large as fits."""

from math import isfinite, radians, sin, tan
from typing import Literal

import numpy as np

from ..arrays import Number, Points, Values, Vector3
from ..box import Box
from ..errors import RayError
from ..mesh import Mesh
from .camera import Axes, Camera

VIEWS = {
    "three-quarter": (35.0, 20.0),
    "front": (0.0, 0.0),
    "back": (180.0, 0.0),
    "left": (-90.0, 0.0),
    "right": (90.0, 0.0),
    "top": (0.0, 90.0),
    "bottom": (0.0, -90.0),
}
"""Azimuth, from the front towards +x, and elevation, upward, in degrees."""

Up = Literal["y", "z"]
NEAREST = 0.05  # of the diagonal: the camera stays this far before the foremost point


def frame(
    subject: Box | Mesh,
    view: str | tuple[Number, Number] = "three-quarter",
    aspect: Number = 4 / 3,
    *,
    up: Up = "y",
    field_of_view: Number = 30.0,
    margin: Number = 0.04,
    orthographic: bool = False,
) -> Camera:
    """Return the camera nearest to the subject that has all of it in the picture.

    Parameters
    ----------
    subject : Box or Mesh
        A box is fitted by its corners; a mesh by its vertices, which brings it closer.
    view : str or (azimuth, elevation)
        "three-quarter", "front", "back", "left", "right", "top" or "bottom", or two angles in
        degrees: how far the camera goes from the front towards +x, and how far upward.
    aspect : float
        Width of the picture divided by its height.
    up : "y" or "z"
        Which way is up in the model. The camera in front of it looks along -z if y is up, along
        +y if z is up; either way +x is on its right.
    field_of_view : float
        From the lower to the upper border, degrees.
    margin : float
        Part of the picture, from 0 to below 0.5, left free at every border.
    orthographic : bool
        Without perspective.

    Raises
    ------
    RayError
        No such view, or numbers that make no picture.

    Notes
    -----
    Exact: two opposite borders of the margin are touched, and the other two are equally far from
    the subject, to rounding.

    Examples
    --------
    >>> box = Box(np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 1.0]))
    >>> camera = frame(box, "front", aspect=1.0, field_of_view=90, margin=0)
    >>> camera.position
    array([0., 0., 2.])
    """
    where = "frame"
    azimuth, elevation = _angles(view, where)
    if not (isfinite(aspect) and aspect > 0):
        raise RayError(f"aspect is {aspect:g}", where, "pass width / height")
    if not 0 <= margin < 0.5:
        raise RayError(f"margin is {margin:g}", where, "pass a number from 0 to below 0.5")
    if not 0 < field_of_view < 180:
        what = f"the field of view is {field_of_view:g} degrees"
        raise RayError(what, where, "pass an angle between 0 and 180")
    axes = _axes(azimuth, elevation, up)
    box = subject.box if isinstance(subject, Mesh) else subject
    diagonal = box.diagonal or 1.0
    free = 1.0 - 2.0 * margin
    places = (_points(subject) - box.center) @ axes.T
    if orthographic:
        place, height = _fit_parallel(places, float(aspect) * free, free, diagonal)
    else:
        slope = tan(radians(field_of_view) / 2.0) * free
        place, height = _fit_perspective(places, slope * float(aspect), slope, diagonal), None
    return Camera(
        box.center + place @ axes,
        box.center + place * [1.0, 1.0, 0.0] @ axes,
        axes[1],
        field_of_view,
        height,
    )


def _angles(view: str | tuple[Number, Number], where: str) -> tuple[float, float]:
    if isinstance(view, str):
        if view not in VIEWS:
            fix = f"use one of {', '.join(VIEWS)}, or (azimuth, elevation)"
            raise RayError(f"there is no view {view!r}", where, fix)
        return VIEWS[view]
    azimuth, elevation = view
    if not (isfinite(azimuth) and -90 <= elevation <= 90):
        what = f"azimuth is {azimuth:g} and elevation {elevation:g}"
        raise RayError(what, where, "pass degrees, the elevation from -90 to 90")
    return float(azimuth), float(elevation)


def _axes(azimuth: float, elevation: float, up: Up) -> Axes:
    """The camera's axes (right, up, back) as rows."""
    sa, ca = _sine(azimuth), _sine(azimuth + 90.0)
    se, ce = _sine(elevation), _sine(elevation + 90.0)
    axes = np.array([[ca, 0.0, -sa], [-se * sa, ce, -se * ca], [ce * sa, se, ce * ca]])
    if up == "z":
        axes = np.stack([axes[:, 0], -axes[:, 2], axes[:, 1]], axis=1)
    return axes


def _sine(degrees: float) -> float:
    """Sine, exactly 0 and 1 at multiples of 90 degrees, so that named views look straight."""
    turns = degrees % 360.0
    if turns % 90.0 == 0.0:
        return (0.0, 1.0, 0.0, -1.0)[int(turns // 90.0)]
    return sin(radians(turns))


def _points(subject: Box | Mesh) -> Points:
    if isinstance(subject, Mesh):
        return subject.vertices[np.unique(subject.faces)]
    corners = np.indices((2, 2, 2)).reshape(3, 8).T
    return np.where(corners == 0, subject.lower, subject.upper)


def _fit_perspective(places: Points, wide: float, high: float, diagonal: float) -> Vector3:
    """Where to put the eye, in camera axes.

    Seen from (ex, ey, ez), a place (x, y, z) is within the borders if |x - ex| <= wide (ez - z) and
    |y - ey| <= high (ez - z). Each side bounds ez ± ex or ez ± ey from below.
    """
    x, y, z = places.T
    depth = z.max() + NEAREST * diagonal
    for across, slope in ((x, wide), (y, high)):
        upper, lower = (slope * z + across).max(), (slope * z - across).max()
        depth = max(depth, (upper + lower) / (2 * slope))
    return np.array([_middle(x, z, depth), _middle(y, z, depth), depth])


def _middle(across: Values, z: Values, depth: float) -> float:
    """Where between two borders the eye sees as far to one side as to the other.

    The slope s to both is the root of max(s z + x) + max(s z - x) - 2 s depth, which is convex and
    piecewise linear in s: Newton's steps from 0 only rise, and end at the root after a few.
    """
    slope = 0.0
    while True:
        upper, lower = np.argmax(slope * z + across), np.argmax(slope * z - across)
        last = slope
        slope = (across[upper] - across[lower]) / (2 * depth - z[upper] - z[lower])
        if slope <= last:
            return 0.5 * float(across[upper] + across[lower] + last * (z[upper] - z[lower]))


def _fit_parallel(
    places: Points, wide: float, high: float, diagonal: float
) -> tuple[Vector3, float]:
    """Where to put the camera, in its axes, and the height of the picture."""
    lower, upper = places.min(axis=0), places.max(axis=0)
    across, along = upper[:2] - lower[:2]
    height = max(across / wide, along / high) or diagonal
    middle = 0.5 * (lower + upper)
    return np.array([middle[0], middle[1], upper[2] + diagonal]), float(height)
