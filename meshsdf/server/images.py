"""Pictures that a page sent, decoded and kept for when they are projected."""

import hashlib
import threading
from collections import OrderedDict
from dataclasses import dataclass

import numpy as np

from ..errors import TextureError
from ..io.picture_bytes import decode_picture
from .limits import MOST_IMAGE_BYTES, MOST_IMAGES, MOST_PIXELS


@dataclass(frozen=True)
class Kept:
    """What a page is told of its picture.

    Attributes
    ----------
    id : str
        By which operations name it: the same picture has the same.
    width, height : int
    """

    id: str
    width: int
    height: int


class Images:
    """The pictures sent last; those that were not used for longest make room for others.

    Parameters
    ----------
    most, most_bytes, most_pixels : int
        How many there may be, with how many bytes in all, and the pixels that each may have.
    """

    def __init__(
        self,
        most: int = MOST_IMAGES,
        most_bytes: int = MOST_IMAGE_BYTES,
        most_pixels: int = MOST_PIXELS,
    ) -> None:
        self.most, self.most_bytes, self.most_pixels = most, most_bytes, most_pixels
        self._kept: OrderedDict[str, np.ndarray] = OrderedDict()
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def n_bytes(self) -> int:
        """Memory of all that are kept."""
        return sum(picture.nbytes for picture in self._kept.values())

    def add(self, data: bytes) -> Kept:
        """Decode a picture's file and keep it; IoError as `decode_picture`. On any thread."""
        name = hashlib.sha256(data).hexdigest()[:32]
        picture = self._kept.get(name)
        if picture is None:
            picture = decode_picture(data, most_pixels=self.most_pixels)
        with self._lock:
            self._kept[name] = picture
            self._kept.move_to_end(name)
            while len(self._kept) > self.most or (
                len(self._kept) > 1 and self.n_bytes > self.most_bytes
            ):
                self._kept.popitem(last=False)
        return Kept(name, picture.shape[1], picture.shape[0])

    def get(self, name: str) -> np.ndarray:
        """The picture (h, w, c), uint8 in sRGB or float32 in linear light. On any thread.

        Raises
        ------
        TextureError
            It was never sent, or has made room for others.
        """
        with self._lock:
            if name not in self._kept:
                what = f"there is no picture {str(name)[:40]!r}"
                raise TextureError(what, "image=...", "send it to POST /api/images first")
            self._kept.move_to_end(name)
            return self._kept[name]
