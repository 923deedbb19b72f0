"""What a clone brush lays on: the layer as it was before the stroke, from some way off."""

import numpy as np

from .brush import Brush
from .layer import Layer
from .lookup import look_up
from .refine import texel_mask
from .stroke_cover import Touched
from .volume_texture import VolumeTexture


class CloneSource:
    """The picture ``brush.offset`` away from texels, looked up when they are first painted.

    Where the texture knows its surface, the place is the point of the surface nearest to that.
    """

    def __init__(self, texture: VolumeTexture, layer: Layer, brush: Brush) -> None:
        self.texture, self.brush = texture, brush
        self._slots = layer.slots.copy()
        self._values = np.zeros((0, 512, 4), np.float32)
        self._known = np.zeros(0, bool)

    def of(self, touched: Touched) -> np.ndarray:
        """(rows, 512, 4) float32, right in the rows of the entries that were touched."""
        n_rows = int(touched.rows.max(initial=-1)) + 1
        if n_rows > len(self._known):
            more = max(n_rows, 2 * len(self._known)) - len(self._known)
            empty = np.zeros((more, 512, 4), np.float32)
            self._values = np.concatenate([self._values, empty])
            self._known = np.concatenate([self._known, np.zeros(more, bool)])
        new = ~self._known[touched.rows]
        self._known[touched.rows[new]] = True
        levels = self.texture.octree.tables.levels[touched.entries]
        for level in np.unique(levels[new]):
            part = new & (levels == level)
            self._fill(touched.entries[part], touched.rows[part], int(level))
        return self._values

    def _fill(self, entries: np.ndarray, rows: np.ndarray, level: int) -> None:
        texture, name = self.texture, self.brush.channel
        points, normals = texture.places(entries)
        points = points + np.array(self.brush.offset, np.float64)
        parts = texture.texel_parts(entries)
        if texture.surface is not None:
            points, normals, faces = texture.nearest_places(points)
            parts = texture.octree.parts_of(faces) if texture.knows_parts else None
        colors = look_up(
            texture.octree, self._slots, texture.pool.use(name), texture.tiles.arrays[name],
            texture.channels[name].kind, points, normals, texture.octree.spacing(level),
            parts=parts,
        )  # fmt: skip
        values = np.zeros((len(entries), 512, 4), np.float32)
        values[texel_mask(texture, entries)] = colors
        self._values[rows] = values
