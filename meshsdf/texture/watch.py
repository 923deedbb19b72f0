"""Which bricks of the picture changed since somebody looked last."""

from collections.abc import Sequence

import numpy as np

from ..kernels.texture_lookup import ABSENT
from .change import same_texels
from .layer import Layer
from .layers import shown
from .octree import Entries
from .volume_texture import VolumeTexture


class Watch:
    """Tells what changed in what is shown of a texture.

    Parameters
    ----------
    texture : VolumeTexture
        All of whose visible layers are looked at together.

    Attributes
    ----------
    layer : Layer
        What was shown at the last `changed`: a layer of the texture, or the picture of several.

    Notes
    -----
    The slots that were shown are held, so whoever paints gets others: entries are found by
    comparing slots, and then texels where slots differ. Memory: the bricks that changed since.

    Examples
    --------
    >>> from meshsdf.mesh import icosphere
    >>> texture = VolumeTexture.around(icosphere(subdivisions=2), resolution=16)
    >>> watch = Watch(texture)
    >>> layer = texture.add_layer("paint", color=(1.0, 0.0, 0.0))
    >>> len(watch.changed()) == len(layer.stored), len(watch.changed())
    (True, 0)
    """

    def __init__(self, texture: VolumeTexture) -> None:
        self.texture = texture
        self.layer: Layer = shown(texture)
        self._seen = self.layer.slots.copy()
        texture.pool.hold(self._seen)

    def changed(self) -> Entries:
        """Entries of which something else is stored than at the last call, in rising order.

        That is: other texels in any channel, stored and not before, or the reverse. A brick and a
        tile of the same texels are the same. What is shown at a place is made of the entry there
        and, if that or one around it is not stored, of coarser ones: each of those that changed is
        told, those that only show others are not.
        """
        return self._changed((None,))[0]

    def changed_in(self, channels: Sequence[str]) -> list[Entries]:
        """As `changed`, of each of these channels by itself; what others hold does not count."""
        return self._changed(channels)

    def _changed(self, channels: Sequence[str | None]) -> list[Entries]:
        texture = self.texture
        self.layer = shown(texture)
        now = self.layer.slots
        entries = np.flatnonzero(self._seen != now).astype(np.int32)
        before, after = self._seen[entries], now[entries]
        both = np.flatnonzero((before != ABSENT) & (after != ABSENT))
        found = []
        for channel in channels:
            same = np.zeros(len(entries), bool)
            same[both] = same_texels(texture, entries[both], before[both], after[both], channel)
            found.append(entries[~same])
        texture.pool.hold(after)
        texture.pool.drop(before)
        self._seen[entries] = after
        return found

    def release(self) -> None:
        """Let go of all bricks; the watch is over."""
        self.texture.pool.drop(self._seen)
        self._seen = np.full_like(self._seen, ABSENT)
