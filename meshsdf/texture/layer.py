"""One layer of paint: which bricks of the octree it stores, and how it lies on those below."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int32

from ..kernels.texture_lookup import ABSENT


@dataclass(eq=False)
class Layer:
    """A sheet of paint over the whole surface.

    Attributes
    ----------
    number : int
        Names it in a project; never used again once the layer is gone.
    name : str
        For people.
    slots : (e,) int32
        For every entry of the octree: the slot of its texels (>= 0), ABSENT (-1) where only
        coarser levels are stored, or the code of a tile (-2 and below). The coarsest level is
        always stored.
    opacity : float
        0 to 1.
    mode : str
        How it is blended with what lies below, one of `layers.BLEND_MODES`.
    visible : bool
        Whether it is shown at all.
    """

    number: int
    name: str
    slots: Int32[np.ndarray, " e"]
    opacity: float = 1.0
    mode: str = "normal"
    visible: bool = True

    @property
    def stored(self) -> Int32[np.ndarray, " n"]:
        """Entries that are stored, as bricks or tiles."""
        return np.flatnonzero(self.slots != ABSENT).astype(np.int32)
