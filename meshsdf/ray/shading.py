"""A studio for pictures: clay, and lights that move with the camera.

Diffuse light: a key light from the upper left, a fill light from the right, a rim light from
behind, and a sky that is brighter above than below. What other parts of the surface hide is taken
from a brightness of the sky, seen by rays, in which the key light is a broad lobe, so that shadows
are soft; the light that hidden places get from their surroundings is that of a hollow of the same
colour (one over one minus its albedo times the hidden share).
"""

import numpy as np
from jaxtyping import Float32, Float64

from .camera import Camera

Normals = Float64[np.ndarray, "k 3"]
Colors = Float64[np.ndarray, "k 3"]
Shares = Float64[np.ndarray, " k"]

CLAY = np.array([0.40, 0.45, 0.52])  # linear RGB: a light grey with some blue
# Directions in the camera's axes (right, up, back), and linear RGB
KEY, KEY_COLOR = np.array([-0.52, 0.62, 0.59]), np.array([1.02, 0.98, 0.92])
FILL, FILL_COLOR = np.array([0.80, 0.10, 0.59]), np.array([0.16, 0.18, 0.21])
RIM, RIM_COLOR = np.array([0.45, 0.50, -0.74]), np.array([0.30, 0.32, 0.35])
ABOVE, BELOW = np.array([0.42, 0.46, 0.52]), np.array([0.15, 0.14, 0.13])
GLOSS, SHARPNESS = 0.05, 24.0  # a faint highlight of the key light
EVEN, SLOPE, LOBE = 0.45, 0.20, 1.10  # the brightness of the sky that rays see
N_SETS = 16  # of directions; as `kernels.sky_light` has it
PAINTED = 0.45  # share of even light on painted surfaces, so that their colours can be read
KNEE, PAINTED_KNEE = 0.5, 0.85  # brighter light is compressed
BOUNCE = 0.6  # hollows get this part of the light that a closed one would


def sky(camera: Camera) -> Float64[np.ndarray, "9"]:
    """The brightness of the sky for `kernels.sky_light`, world axes."""
    axes = camera.axes
    return np.concatenate([[EVEN, SLOPE, LOBE], axes[1], _unit(KEY) @ axes])


def ray_sets(n_rays: int) -> Float64[np.ndarray, "16 r 3"]:
    """Directions around +z with density of the cosine: 16 sets, together one even set.

    Points of the plane's golden lattice (Roberts 2018: the R2 sequence, steps 1/g and 1/g² for
    g³ = g + 1) are lifted from the disk to the hemisphere; set k takes every 16th.
    """
    golden = 1.32471795724474602596
    count = np.arange(N_SETS * n_rays)
    first, second = (0.5 + count / golden) % 1.0, (0.5 + count / golden**2) % 1.0
    radius, angle = np.sqrt(first), 2 * np.pi * second
    height = np.sqrt(1.0 - first)
    spread = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    return np.ascontiguousarray(spread.reshape(n_rays, N_SETS, 3).transpose(1, 0, 2))


def shade(
    colors: Colors,
    normals: Normals,
    toward: Normals,
    shares: Shares,
    camera: Camera,
    *,
    is_painted: bool,
) -> Float32[np.ndarray, "k 3"]:
    """Return the linear colour that a surface shows.

    Parameters
    ----------
    colors : (k, 3) float64
        Albedo, linear RGB.
    normals, toward : (k, 3) float64
        Unit vectors: away from the surface on the side seen, and towards the eye.
    shares : (k,) float64
        How much of the sky's light arrives, from 0 to 1.
    camera : Camera
        The lights stand around it.
    is_painted : bool
        Light more evenly, and change no hue, because the colours mean something.
    """
    axes = camera.axes
    key, fill, rim = (_unit(light) @ axes for light in (KEY, FILL, RIM))
    facing = np.maximum(normals @ np.stack([key, fill, rim]).T, 0.0)
    above = (0.5 + 0.5 * (normals @ axes[1]))[:, None]
    light = BELOW + above * (ABOVE - BELOW) + facing @ np.stack([KEY_COLOR, FILL_COLOR, RIM_COLOR])
    if is_painted:
        even = (1.0 - PAINTED) * (light / _light_ahead()).mean(axis=1) + PAINTED
        arriving = even * shares / (1.0 - BOUNCE * 0.5 * (1.0 - shares))
        return (colors * _compressed(arriving, PAINTED_KNEE)[:, None]).astype(np.float32)
    hidden = BOUNCE * np.minimum(colors, 0.9) * (1.0 - shares)[:, None]
    shown = colors * light * (shares[:, None] / (1.0 - hidden))
    halfway = key + toward
    halfway /= np.linalg.norm(halfway, axis=1, keepdims=True)
    shine = np.maximum(np.einsum("kx,kx->k", normals, halfway), 0.0) ** SHARPNESS
    shown += (GLOSS * shares * shine)[:, None] * KEY_COLOR
    return _compressed(shown, KNEE).astype(np.float32)


def _compressed(light: np.ndarray, knee: float) -> np.ndarray:
    """Light above the knee bent so that nothing is brighter than 1; smooth, and rising."""
    above = np.maximum(light - knee, 0.0) / (1.0 - knee)
    return np.where(above > 0, 1.0 - (1.0 - knee) * np.exp(-above), light)


def _light_ahead() -> Float64[np.ndarray, "3"]:
    """The light on a surface that faces the camera, in the open."""
    facing = np.maximum([_unit(light)[2] for light in (KEY, FILL, RIM)], 0.0)
    return 0.5 * (ABOVE + BELOW) + facing @ np.stack([KEY_COLOR, FILL_COLOR, RIM_COLOR])


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
