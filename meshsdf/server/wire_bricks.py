"""What is shown of a texture, brick by brick, as it goes over the wire; and what changed."""

import numpy as np

from ..kernels.wire_codes import PICTURES
from ..kernels.wire_nodes import DEEP, mark_affected
from ..texture.mip import used_channels
from ..texture.octree import Entries
from ..texture.volume_texture import VolumeTexture
from ..texture.watch import Watch
from .wire_picture import Colors, Picture
from .wire_records import bricks_digest, bricks_payload
from .wire_relief import Relief, painted

RELIEFS = PICTURES[1:]
FIRST_VERSION = 1  # of what is there when the watching begins; 0 is what never was


class WireBricks:
    """The bricks that pages should show, kept up with a texture.

    Parameters
    ----------
    texture : VolumeTexture
        Edits must be recorded or made of `writable` slots, as `Watch` asks for.

    Attributes
    ----------
    pictures : dict of str to Picture
        Colours, then those of normals and heights whose channels are used, in this order.
    revision : int
        Counts the calls of `update` that found something, in any picture.
    """

    def __init__(self, texture: VolumeTexture) -> None:
        self.texture = texture
        self._watch = Watch(texture)
        self._made_of = np.zeros(texture.octree.n_entries, np.uint8)
        colors = Colors(self._watch, self._made_of)
        self.pictures: dict[str, Picture] = {colors.name: colors}
        self.revision = FIRST_VERSION
        self._deep = np.flatnonzero(self._made_of & DEEP).astype(np.int32)
        colors.versions[colors.present] = FIRST_VERSION
        self._looked_at = (0, 0)
        for name in self._new_channels():
            entries = self._begun(name)
            self.pictures[name].versions[entries] = FIRST_VERSION

    def update(self) -> dict[str, Entries]:
        """Of every picture, entries whose wire brick is another than at the last call.

        In rising order. After many changes at once, also some colours that are the same.
        """
        changed = self._watch.changed_in(list(self.pictures))
        # All before any is followed: bricks are affected by what they were made of
        affected = [self._affected(entries) for entries in changed]
        told = {
            name: picture.follow(some) if len(some) else some
            for (name, picture), some in zip(self.pictures.items(), affected, strict=True)
        }
        if len(affected[0]):
            self._deep = np.flatnonzero(self._made_of & DEEP).astype(np.int32)
        for name in self._new_channels():
            told[name] = self._begun(name)
        if any(map(len, told.values())):
            self.revision += 1
            for name, entries in told.items():
                self.pictures[name].versions[entries] = self.revision
        return told

    def range_payload(self, first: int, last: int, picture: str = "base") -> bytes:
        """The payload of a BRICKS message of the entries first ... last - 1 that have a brick."""
        if picture not in self.pictures:
            return bricks_payload(0, [])
        present = self.pictures[picture].present
        return self.pictures[picture].payload(present[(present >= first) & (present < last)])

    def digest(self, picture: str = "base") -> str:
        """SHA-256 of all bricks of a picture: see `bricks_digest`."""
        if picture not in self.pictures:
            return bricks_digest([])
        return self.pictures[picture].digest()

    def release(self) -> None:
        """Let go of the texture's bricks."""
        self._watch.release()

    def _affected(self, changed: Entries) -> Entries:
        """Entries whose brick may be another after other texels are in the changed ones."""
        if not len(changed):
            return changed
        marked = np.zeros(len(self._made_of), np.bool_)
        mark_affected(self.texture.octree.tables, self._made_of, self._deep, changed, marked)
        return np.flatnonzero(marked).astype(np.int32)

    def _new_channels(self) -> list[str]:
        """Channels that are used now and have no picture yet."""
        texture = self.texture
        now = len(texture.tiles), len(texture.pool.arrays)
        if now == self._looked_at or len(self.pictures) == len(PICTURES):
            return []
        self._looked_at = now
        return [
            name
            for name in used_channels(texture)
            if name in PICTURES[1:] and name not in self.pictures
        ]

    def _begun(self, name: str) -> Entries:
        """Begin a picture; the entries that have a brick in it."""
        picture = Relief(name, self._watch, self._made_of)
        known = self.pictures | {name: picture}
        self.pictures = {one: known[one] for one in PICTURES if one in known}
        return picture.follow(self._affected(painted(self.texture, self._watch.layer.slots, name)))
