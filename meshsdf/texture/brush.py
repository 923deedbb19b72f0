"""What a stroke paints with; plain numbers and small pictures, so that strokes can be kept."""

import base64
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Literal

import numpy as np
from jaxtyping import Float32, Float64

from ..arrays import Number
from ..errors import TextureError
from ..kernels.blending import MODES
from ..kernels.brush import FALLOFFS
from .symmetry import Symmetry

Kind = Literal["paint", "erase", "blur", "smudge", "clone", "fill", "gradient"]
KINDS = ("paint", "erase", "blur", "smudge", "clone", "fill", "gradient")
CHANNELS = ("base", "normal", "height", "orm", "mask")
SHAPES = ("linear", "radial")
Curve = tuple[tuple[Number, Number], ...]
Four = tuple[Number, Number, Number, Number]
Picture = Float32[np.ndarray, "h w"]

TEXELS_ACROSS_RADIUS = 8  # a dab has at least 16 texels across
TEXELS_ON_EDGE = 3  # and a soft edge at least this many
LARGEST = 1e30
MOST_PIXELS = 4096  # pixels along a picture's side


@dataclass(frozen=True, eq=False)
class Stencil:
    """A picture in space through whose bright parts paint passes; none passes beside it.

    Attributes
    ----------
    picture : (h, w) float32
        0 holds all paint back, 1 none; row 0 is the top.
    matrix : (3, 4) float64
        From world (x, y, z, 1) to (u w, v w, w); the picture is 0 <= u, v <= 1 where w > 0.
    """

    picture: Picture
    matrix: Float64[np.ndarray, "3 4"]

    def __post_init__(self) -> None:
        _check_picture(self.picture, "Stencil(picture=...)")
        if not np.isfinite(self.matrix).all():
            what = "the stencil's matrix is not finite"
            raise TextureError(what, "Stencil(matrix=...)", "give 12 finite numbers")


@dataclass(frozen=True, eq=False)
class Brush:
    """A brush, checked when it is made.

    Attributes
    ----------
    radius : float
        Of a dab at full pressure, world units.
    kind : str
        "paint", "erase" (back to what was never painted), "blur", "smudge", "clone" (paint what
        is ``offset`` away), "fill" (connected texels of like colour) or "gradient" (from the
        stroke's first point to its last, all over the surface).
    hardness : float
        Share of the radius within which a dab is full.
    falloff : str
        Between there and the rim: "smooth", "linear" or "round".
    flow : float
        How much one dab lays on.
    opacity : float
        How much the whole stroke lays on at most.
    build_up : bool
        Dabs add up to the opacity where they overlap; else the strongest of them counts, and
        strokes are drawn as unbroken bands from sample to sample.
    spacing : float
        Distance of dabs that add up, and of stamps, in radii.
    pressure_radius, pressure_flow : tuple of (pressure, factor)
        Curves, linear between their points.
    color : four numbers
        Linear RGB and alpha; for "orm" its values, for "normal" a direction.
    value : float
        What is painted into "height" (finest texels) and "mask".
    channel : str
        "base", "normal", "height", "orm" or "mask".
    blend : str
        One of `kernels.blending.MODES`.
    symmetry : Symmetry
    angle : two numbers
        Cosines of the angle between a texel's normal and the dab's: nothing is painted below the
        first, all from the second on.
    geodesic : bool
        Paint only what is connected to the dab's centre within the dab, along the surface.
    through : bool
        Where sheets that look the same way lie so close that they need the same texels, and have
        some of their own for that: paint all of them, not just the dab's own.
    stamp : (h, w) float32, optional
        Picture of a dab, its width the dab's diameter; takes the place of the falloff.
    stencil : Stencil, optional
    detail : float, optional
        Largest spacing of texels to paint at, world units, where the brush alone would do with
        coarser ones.
    offset : three numbers
        Where a clone takes its paint, from where it lays it.
    tolerance : float
        How far colours may differ, in any component, to be filled together.
    end_color : four numbers
        What a gradient ends in.
    shape : str
        "linear" or "radial": of a gradient.

    Examples
    --------
    >>> brush = Brush(0.1, hardness=0.8, color=(1.0, 0.0, 0.0, 1.0))
    >>> Brush.from_dict(brush.to_dict()).hardness
    0.8
    """

    radius: Number
    kind: Kind = "paint"
    hardness: Number = 0.5
    falloff: Literal["smooth", "linear", "round"] = "smooth"
    flow: Number = 1.0
    opacity: Number = 1.0
    build_up: bool = False
    spacing: Number = 0.15
    pressure_radius: Curve = ((0.0, 1.0), (1.0, 1.0))
    pressure_flow: Curve = ((0.0, 1.0), (1.0, 1.0))
    color: Four = (0.0, 0.0, 0.0, 1.0)
    value: Number = 1.0
    channel: str = "base"
    blend: str = "normal"
    symmetry: Symmetry = field(default_factory=Symmetry)
    angle: tuple[Number, Number] = (0.0, 0.25)
    geodesic: bool = False
    stamp: Picture | None = None
    stencil: Stencil | None = None
    detail: Number | None = None
    offset: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    tolerance: Number = 0.05
    end_color: Four = (1.0, 1.0, 1.0, 1.0)
    shape: str = "linear"
    through: bool = False

    def __post_init__(self) -> None:
        for name, least, most in (
            ("radius", 1e-30, LARGEST), ("hardness", 0, 1), ("flow", 0, 1), ("opacity", 0, 1),
            ("spacing", 0.01, 10), ("tolerance", 0, LARGEST), ("value", -LARGEST, LARGEST),
        ):  # fmt: skip
            self._check_range(name, getattr(self, name), least, most)
        if self.detail is not None:
            self._check_range("detail", self.detail, 1e-30, LARGEST)
        for name, choices in (
            ("kind", KINDS), ("falloff", FALLOFFS), ("channel", CHANNELS), ("blend", MODES),
            ("shape", SHAPES),
        ):  # fmt: skip
            if getattr(self, name) not in choices:
                what = f"there is no {name} {getattr(self, name)!r}"
                raise TextureError(what, f"Brush({name}=...)", f"use one of {', '.join(choices)}")
        for name, n in (("color", 4), ("end_color", 4), ("offset", 3), ("angle", 2)):
            self._check_numbers(name, n)
        if not -1 <= self.angle[0] <= self.angle[1] <= 1:
            what = f"the cosines {self.angle} are not in order"
            raise TextureError(what, "Brush(angle=...)", "give two from -1 to 1 that do not fall")
        for name in ("pressure_radius", "pressure_flow"):
            self._check_curve(name)
        if self.stamp is not None:
            _check_picture(self.stamp, "Brush(stamp=...)")

    @property
    def spacing_wanted(self) -> float:
        """The coarsest texels that show a dab well, even at little pressure; world units."""
        least = min(float(factor) for _, factor in self.pressure_radius)
        radius = float(self.radius) * min(max(least, 0.25), 1.0)
        wanted = radius / TEXELS_ACROSS_RADIUS
        if self.stamp is not None:
            wanted = min(wanted, 2 * radius / max(self.stamp.shape))
        elif self.kind in ("paint", "erase", "clone"):
            wanted = min(wanted, (1 - float(self.hardness)) * radius / TEXELS_ON_EDGE)
        return wanted if self.detail is None else min(wanted, float(self.detail))

    @property
    def discrete(self) -> bool:
        """Whether the stroke is a row of dabs, not a band."""
        return self.build_up or self.stamp is not None or self.kind in ("blur", "smudge")

    def to_dict(self) -> dict[str, Any]:
        """Everything in plain numbers, strings and lists, as JSON can hold it."""
        out: dict[str, Any] = {}
        for one in fields(self):
            value = getattr(self, one.name)
            if isinstance(value, Symmetry):
                value = asdict(value)
            elif isinstance(value, Stencil):
                value = {"picture": _packed(value.picture), "matrix": value.matrix.tolist()}
            elif isinstance(value, np.ndarray):
                value = _packed(value)
            out[one.name] = _plain(value)
        return out

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> "Brush":
        """The brush that `to_dict` described.

        Raises
        ------
        TextureError
            It describes none.
        """
        try:
            known = {name: _tuples(value) for name, value in data.items()}
            known["symmetry"] = Symmetry(**_members(data.get("symmetry")))
            if data.get("stamp") is not None:
                known["stamp"] = _unpacked(data["stamp"])
            if data.get("stencil") is not None:
                picture = _unpacked(data["stencil"]["picture"])
                known["stencil"] = Stencil(picture, np.array(data["stencil"]["matrix"], float))
            return cls(**known)
        except (TypeError, ValueError, KeyError, AttributeError) as error:
            what = f"this describes no brush: {error}"
            raise TextureError(what, "Brush.from_dict", "pass what to_dict returned") from None

    def _check_range(self, name: str, value: Number, least: Number, most: Number) -> None:
        if not least <= value <= most:
            raise TextureError(
                f"a brush's {name} cannot be {value}",
                f"Brush({name}=...)",
                f"give a number from {least:g} to {most:g}",
            )

    def _check_numbers(self, name: str, n: int) -> None:
        values = getattr(self, name)
        if len(values) != n or not (np.abs(np.asarray(values, np.float64)) <= LARGEST).all():
            what = f"{values} is no {name}"
            raise TextureError(what, f"Brush({name}=...)", f"give {n} finite numbers")

    def _check_curve(self, name: str) -> None:
        curve = np.asarray(getattr(self, name), np.float64)
        fits = curve.ndim == 2 and curve.shape[1] == 2 and len(curve) > 0
        if not fits or not ((curve >= 0) & (curve <= 1)).all() or (np.diff(curve[:, 0]) < 0).any():
            what = f"{getattr(self, name)} is no curve of pressure"
            fix = "give (pressure, factor) pairs from 0 to 1, pressures in order"
            raise TextureError(what, f"Brush({name}=...)", fix)


def _check_picture(picture: np.ndarray, where: str) -> None:
    fits = picture.ndim == 2 and min(picture.shape) > 0 and max(picture.shape) <= MOST_PIXELS
    if not fits or not ((picture >= 0) & (picture <= 1)).all():
        what = f"a picture of shape {picture.shape} has pixels beyond 0 and 1, or too many, or none"
        raise TextureError(
            what, where, f"give (h, w) numbers in [0, 1], {MOST_PIXELS} a side at most"
        )


def _packed(picture: np.ndarray) -> dict[str, Any]:
    data = np.ascontiguousarray(picture, "<f4").tobytes()
    return {"shape": list(picture.shape), "float32": base64.b64encode(data).decode("ascii")}


def _unpacked(data: dict[str, Any]) -> np.ndarray:
    values = np.frombuffer(base64.b64decode(data["float32"]), "<f4")
    return values.reshape(data["shape"]).astype(np.float32)


def _plain(value: Any) -> Any:
    """Tuples to lists, numpy's numbers to Python's."""
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return value.item() if isinstance(value, np.generic) else value


def _tuples(value: Any) -> Any:
    return tuple(_tuples(one) for one in value) if isinstance(value, list) else value


def _members(data: dict[str, Any] | None) -> dict[str, Any]:
    return {name: _tuples(one) for name, one in (data or {}).items()}
