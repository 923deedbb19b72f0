"""A dense grid of values on nodes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..arrays import Vector3
from ..errors import GridError


@dataclass(frozen=True, eq=False)
class Grid:
    """Values at nodes ``origin + voxel_size * (i, j, k)``.

    Attributes
    ----------
    values : (ni, nj, nk) float32 or float64
        World units when they are distances, negative inside; NaN where there are no data.
    voxel_size : float
        World units.
    origin : (3,) float64
        World position of node (0, 0, 0).
    sign : str
        How inside was told: "parity", "winding" or "unsigned".
    uncertain_voxels : int or None
        At how many nodes near the surface the side is not certain, as `NarrowBand.uncertain` says;
        None where it is at all of them.
    n_inner_faces : int
        Faces of the mesh that lie inside the union of its overlapping parts, wholly or in part;
        distances are not measured to those.
    half_width : float or None
        Voxels from the surface beyond which values are clipped to +-`background`, as those of a
        narrow band; None where they are distances everywhere.

    Raises
    ------
    GridError
        The voxel size is not a positive number.
    """

    values: Float[np.ndarray, "i j k"]
    voxel_size: float
    origin: Vector3
    sign: str = "parity"
    uncertain_voxels: int | None = None
    n_inner_faces: int = 0
    half_width: float | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.voxel_size) and self.voxel_size > 0):
            raise GridError(
                f"voxel_size is {self.voxel_size}", "Grid(voxel_size=...)", "pass a length above 0"
            )

    @property
    def is_signed(self) -> bool:
        """Whether values are negative inside."""
        return self.sign != "unsigned"

    @property
    def background(self) -> float | None:
        """Magnitude of clipped values, world units, as stored (float32); None if none are."""
        if self.half_width is None:
            return None
        return float(np.float32(self.half_width * self.voxel_size))

    def facts(self) -> dict:
        """Return what scripts ask for: kind, voxel_size, shape, active_voxels, …"""
        facts = {
            "kind": "grid",
            "voxel_size": self.voxel_size,
            "origin": self.origin.tolist(),
            "shape": list(self.values.shape),
            "active_voxels": int(np.isfinite(self.values).sum()),
            "n_bricks": None,
            "sign": self.sign,
        }
        if self.uncertain_voxels is not None:
            facts["uncertain_voxels"] = self.uncertain_voxels
        if self.n_inner_faces:
            facts["n_inner_faces"] = self.n_inner_faces
        if self.half_width is not None:
            facts["half_width"], facts["background"] = self.half_width, self.background
        return facts
