"""How far the colours that came back are from those that were there, in numbers.

ΔE is the length between two colours in CIELAB (CIE76): about 2.3 is just seen side by side
(Mahy, Van Eycken and Oosterlinck 1994, doi:10.1002/col.5080190205), 100 is black to white.
"""

from dataclasses import asdict, dataclass

import numpy as np
from jaxtyping import Float32

from ..arrays import Points, Values, Vector3
from ..srgb import lab_from_linear, srgb_rgba

PERCENT = 95.0
Colors = Float32[np.ndarray, "n 4"]


@dataclass(frozen=True, eq=False)
class ColorDifference:
    """Differences at points that were drawn, so that none of these numbers is proved.

    Attributes
    ----------
    mean, percentile_95, largest : float
        ΔE; the second is the value that 95 % of the points stay below.
    where : (3,) float64
        Of the largest one, world units.
    expected, found : str
        The colours there, "#rrggbb" in sRGB; with alpha, "#rrggbbaa", where it is not 1.
    """

    mean: float
    percentile_95: float
    largest: float
    where: Vector3
    expected: str
    found: str

    @classmethod
    def between(cls, points: Points, expected: Colors, found: Colors) -> "ColorDifference":
        """Compare colours at points, of which there is at least one."""
        difference = delta_e(expected, found)
        worst = int(difference.argmax())
        return cls(
            float(difference.mean()),
            float(np.percentile(difference, PERCENT)),
            float(difference[worst]),
            points[worst],
            *(hexadecimal(colors[worst]) for colors in (expected, found)),
        )

    def to_json(self) -> dict:
        """Return plain types."""
        return asdict(self) | {"where": self.where.tolist()}


@dataclass(frozen=True, eq=False)
class ColorLoss:
    """What the colours of a mesh became on a surface made from it.

    Attributes
    ----------
    texel : float
        Spacing of the texels that carried them, world units.
    n_points : int
        How many points were drawn from the surface, uniform by area.
    sharp : ColorDifference
        Against the colours at the mesh's closest points: all that was lost.
    filtered : ColorDifference
        Against the mesh's colours averaged over a texel there: without the blur that texels of
        that size cannot avoid, so what is left is misplaced, or blurred beyond that. Images are
        averaged; materials and vertex colours are not, so for these it is the same as ``sharp``.
    """

    texel: float
    n_points: int
    sharp: ColorDifference
    filtered: ColorDifference

    def to_json(self) -> dict:
        """Return plain types, as the command prints them."""
        head = {"texel": self.texel, "n_points": self.n_points}
        return head | {"sharp": self.sharp.to_json(), "filtered": self.filtered.to_json()}


def delta_e(first: Colors, second: Colors) -> Values:
    """CIE76 difference of colours with straight alpha, linear RGB.

    Where one is not opaque they are laid over black and over white, and the larger counts.

    Examples
    --------
    >>> white, black = np.ones((1, 4), np.float32), np.array([[0, 0, 0, 1]], np.float32)
    >>> delta_e(white, black).round(3)
    array([100.])
    """
    differences = [
        np.linalg.norm(_lab_over(first, ground) - _lab_over(second, ground), axis=1)
        for ground in (0.0, 1.0)
    ]
    return np.maximum(*differences)


def hexadecimal(color: Float32[np.ndarray, "4"]) -> str:
    """A linear colour in sRGB, as pages write it; alpha only if it is not 1.

    >>> hexadecimal(np.array([1, 0.5, 0, 1], np.float32))
    '#ffbc00'
    """
    numbers = np.rint(255 * srgb_rgba(color[None])[0]).astype(int).tolist()
    return "#" + "".join(f"{n:02x}" for n in numbers[: 3 if numbers[3] == 255 else 4])


def _lab_over(colors: Colors, ground: float) -> Points:
    alpha = colors[:, 3:].astype(np.float64)
    return lab_from_linear(alpha * colors[:, :3] + (1 - alpha) * ground)
