"""How much one page, or whoever poses as one, may ask of the server.

Numbers are far above what painting needs, and low enough that reaching them does no harm.
"""

import asyncio
import time
from collections.abc import AsyncIterator

from ..arrays import Number
from ..errors import ServerError
from ..texture.brush import Brush
from ..texture.volume_texture import VolumeTexture

KIB, MIB = 1 << 10, 1 << 20

MOST_JSON = 64 * KIB  # bytes of a request in words
MOST_IMAGE = 64 * MIB  # bytes of a picture's file
MOST_PIXELS = 1 << 25  # of a picture: 1 GiB while it is projected
MOST_IMAGES = 16  # pictures kept
MOST_IMAGE_BYTES = 512 * MIB  # of all pictures kept, decoded
MOST_BRICKS = 4096  # entries of a request for bricks
MOST_RADIUS = 8.0  # of a brush, in longest sides of the mesh's box
MOST_FRAME = MIB  # bytes of a WebSocket message
MOST_QUEUED = 32  # WebSocket messages not yet looked at
MOST_SOCKETS = 64  # WebSockets at once
MOST_CONNECTIONS = 256  # at once; of those that wait, the oldest go first
MOST_UPLOADS = 2  # pictures on their way at once
MOST_EXPORTS = 4  # waiting or being written
MOST_HEAD = 16 * KIB  # bytes of a request's line and headers
HEAD_SECONDS = 10.0  # for a request's line and headers
BODY_SECONDS = 120.0  # for what follows them


class Refused(ServerError):
    """A request that is not answered as asked.

    Parameters
    ----------
    status : int
        As RFC 9110 numbers them.
    """

    def __init__(self, status: int, what: str, where: str, fix: str) -> None:
        super().__init__(what, where, fix)
        self.status = status


class RateLimit:
    """So many a second on average, and so many at once.

    Parameters
    ----------
    per_second, burst : float, int
    what : str
        What there would be too many of, for people.
    """

    def __init__(self, per_second: Number, burst: int, what: str) -> None:
        self.per_second, self.burst, self.what = per_second, burst, what
        self._left = float(burst)
        self._at = time.monotonic()

    def take(self) -> None:
        """Count one; Refused if there are too many."""
        now = time.monotonic()
        self._left = min(float(self.burst), self._left + (now - self._at) * self.per_second)
        self._at = now
        if self._left < 1:
            what = f"too many {self.what}: more than {self.per_second:g} a second"
            raise Refused(429, what, "this server", "wait a moment")
        self._left -= 1


def check_brush(brush: Brush, texture: VolumeTexture) -> None:
    """Refuse a brush that is larger than anything that could be meant.

    Raises
    ------
    Refused
        Its radius is more than `MOST_RADIUS` times the mesh's longest side.
    """
    box = texture.surface.box if texture.surface is not None else None
    longest = float(box.size.max()) if box is not None else 0.0
    most = MOST_RADIUS * longest
    if longest > 0 and not brush.radius <= most:
        what = f"a brush of radius {brush.radius:g} on a mesh of {longest:g}"
        raise Refused(400, what, "Brush(radius=...)", f"use one of at most {most:g}")


async def whole_body(
    chunks: AsyncIterator[bytes], most: int, told: str | None = None, seconds: Number = BODY_SECONDS
) -> bytes:
    """All of a request's body.

    Parameters
    ----------
    chunks : async iterator of bytes
    most : int
        Bytes it may have.
    told : str, optional
        What its header says of its length: if that is too much, nothing is read.
    seconds : float
        Within which it must have come.

    Raises
    ------
    Refused
        It is longer, or comes too slowly.
    """
    if told is not None and not (told.isascii() and told.isdigit() and int(told[:20]) <= most):
        raise _too_long(most)
    parts, length = [], 0
    try:
        async with asyncio.timeout(seconds):
            async for chunk in chunks:
                length += len(chunk)
                if length > most:
                    raise _too_long(most)
                parts.append(chunk)
    except TimeoutError:
        what = f"the request did not arrive within {seconds:g} seconds"
        raise Refused(408, what, "the request's body", "send it again") from None
    return b"".join(parts)


def _too_long(most: int) -> Refused:
    what = f"the request is longer than {most} bytes"
    return Refused(413, what, "the request's body", "send less at a time")
