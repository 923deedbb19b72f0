"""A stroke as data: what a journal keeps, and what can be painted again anywhere."""

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float64

from ..arrays import Points, Values
from ..errors import TextureError
from .brush import Brush


@dataclass(frozen=True, eq=False)
class StrokeRecord:
    """The brush and the samples of a stroke.

    Attributes
    ----------
    brush : Brush
    points, normals : (n, 3) float64
    pressures : (n,) float64
    layer : int
        Number of the layer that was painted on.
    """

    brush: Brush
    points: Points
    normals: Float64[np.ndarray, "n 3"]
    pressures: Values
    layer: int

    def to_params(self) -> dict[str, Any]:
        """Plain numbers, strings and arrays, by name."""
        return {
            "brush": self.brush.to_dict(),
            "points": self.points,
            "normals": self.normals,
            "pressures": self.pressures,
            "layer": self.layer,
        }

    @classmethod
    def from_params(cls, params: dict[str, Any]) -> "StrokeRecord":
        """The record that `to_params` described.

        Raises
        ------
        TextureError
            It describes none.
        """
        try:
            points = np.array(params["points"], np.float64).reshape(-1, 3)
            normals = np.array(params["normals"], np.float64).reshape(-1, 3)
            pressures = np.array(params["pressures"], np.float64).reshape(-1)
            brush, layer = params["brush"], int(params["layer"])
        except (TypeError, ValueError, KeyError) as error:
            what = f"this describes no stroke: {error}"
            fix = "pass what to_params returned"
            raise TextureError(what, "StrokeRecord.from_params", fix) from None
        return cls(Brush.from_dict(brush), points, normals, pressures, layer)

    def to_dict(self) -> dict[str, Any]:
        """Everything as JSON can hold it; samples as float64 in base64, so that nothing is lost."""
        samples = np.column_stack([self.points, self.normals, self.pressures])
        packed = base64.b64encode(samples.astype("<f8").tobytes()).decode("ascii")
        return {"brush": self.brush.to_dict(), "samples": packed, "layer": self.layer}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> "StrokeRecord":
        """The record that `to_dict` described.

        Raises
        ------
        TextureError
            It describes none.
        """
        try:
            packed = base64.b64decode(data["samples"], validate=True)
            samples = np.frombuffer(packed, "<f8").astype(np.float64).reshape(-1, 7)
            layer = int(data["layer"])
            brush = data["brush"]
        except (TypeError, ValueError, KeyError) as error:
            what = f"this describes no stroke: {error}"
            raise TextureError(
                what, "StrokeRecord.from_dict", "pass what to_dict returned"
            ) from None
        points, normals = samples[:, :3].copy(), samples[:, 3:6].copy()
        return cls(Brush.from_dict(brush), points, normals, samples[:, 6].copy(), layer)
