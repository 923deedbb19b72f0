"""Numbers to colours that people with any colour vision can order."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float64

from ..arrays import Values
from ..errors import RayError
from ..srgb import linear_from_srgb

Colors = Float64[np.ndarray, "n 3"]
N_COLORS = 1025
NAMES = ("cividis", "viridis", "magma", "inferno", "plasma")
REVERSED = "_r"


def color_map(name: str = "cividis") -> Callable[[Values], Colors]:
    """Return a function from (n,) numbers in [0, 1] to (n, 3) linear RGB.

    Parameters
    ----------
    name : str
        "cividis" (Nuñez, Anderton, Renslow 2018, doi:10.1371/journal.pone.0199239), "viridis",
        "magma", "inferno" or "plasma" as matplotlib has them, all rising evenly in lightness; with
        "_r" appended, falling.

    Returns
    -------
    colors : callable
        Numbers beyond [0, 1] get the colour of the nearer end, NaN that of 0.

    Raises
    ------
    RayError
        No such map.

    Notes
    -----
    Accuracy: within half of 1/1024 of the map's range.
    """
    if name.removesuffix(REVERSED) not in NAMES:
        fix = f"use one of {', '.join(NAMES)}, with {REVERSED} appended to reverse it"
        raise RayError(f"there is no colour map {name!r}", "color_map", fix)
    from matplotlib import colormaps

    places = np.linspace(0.0, 1.0, N_COLORS)
    table = linear_from_srgb(np.ascontiguousarray(colormaps[name](places)[:, :3]))

    def colors(values: Values) -> Colors:
        clipped = np.clip(np.nan_to_num(values, nan=0.0), 0.0, 1.0)
        return table[np.rint(clipped * (N_COLORS - 1)).astype(np.int32)]

    return colors
