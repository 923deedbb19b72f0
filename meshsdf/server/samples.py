"""A pointer's samples as bytes: where it was, how the surface looks there, how hard it pressed.

Normals are octahedral codes of 2 x 16 bits (Meyer et al. 2010,
doi:10.1111/j.1467-8659.2010.01737.x).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ..arrays import Points, Values

MOST_SAMPLES = 2048
SAMPLE = np.dtype(
    [("position", "<f4", 3), ("normal", "<i2", 2), ("pressure", "<u2"), ("dt", "<u2")]
)
SAMPLE_BYTES = SAMPLE.itemsize

Normals = Float64[np.ndarray, "n 3"]


@dataclass(frozen=True, eq=False)
class Samples:
    """Some samples of a stroke.

    Attributes
    ----------
    points : (n, 3) float64
        Counted from the origin of the wire.
    normals : (n, 3) float64
    pressures : (n,) float64
        0 to 1.
    """

    points: Points
    normals: Normals
    pressures: Values

    def packed(self) -> bytes:
        """20 bytes for each: positions to float32, normals and pressures to 16 bits.

        Examples
        --------
        >>> up = np.array([[0.0, 0.0, 1.0]])
        >>> data = Samples(2 * up, up, np.array([0.5])).packed()
        >>> back = Samples.unpacked(data)
        >>> back.points, back.normals, back.pressures.round(4)
        (array([[0., 0., 2.]]), array([[0., 0., 1.]]), array([0.5]))
        """
        out = np.zeros(len(self.points), SAMPLE)
        out["position"] = self.points
        out["normal"] = octahedral_codes(self.normals)
        out["pressure"] = np.rint(np.clip(self.pressures, 0, 1) * 65535)
        return out.tobytes()

    @classmethod
    def unpacked(cls, data: bytes) -> "Samples":
        """The samples of these bytes, whose number is a multiple of 20."""
        rows = np.frombuffer(data, SAMPLE)
        return cls(
            rows["position"].astype(np.float64),
            octahedral_normals(rows["normal"]),
            rows["pressure"] / 65535.0,
        )


def octahedral_codes(normals: Normals) -> np.ndarray:
    """(n, 2) int16 codes of directions of any length; (0, 0), which looks along z, of none."""
    total = np.abs(normals).sum(axis=1, keepdims=True)
    x, y, z = np.divide(normals, total, out=np.zeros_like(normals), where=total > 0).T
    folded_x = (1 - np.abs(y)) * np.where(x >= 0, 1, -1)
    folded_y = (1 - np.abs(x)) * np.where(y >= 0, 1, -1)
    flat = np.where(z[:, None] < 0, np.stack([folded_x, folded_y], 1), np.stack([x, y], 1))
    return np.rint(32767 * flat).astype("<i2")


def octahedral_normals(codes: np.ndarray) -> Normals:
    """(n, 3) unit normals of (n, 2) int16 codes; any code is one."""
    x, y = np.maximum(codes / 32767.0, -1.0).T
    z = 1 - np.abs(x) - np.abs(y)
    fold = np.maximum(-z, 0)
    x, y = x - np.where(x >= 0, fold, -fold), y - np.where(y >= 0, fold, -fold)
    normals = np.stack([x, y, z], axis=1)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
