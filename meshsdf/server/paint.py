"""A project served to painters, from its opening to its close: what `meshsdf paint` runs."""

import gc
import ipaddress
import socket as sockets
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from ..errors import ServerError
from ..mesh import Mesh
from ..texture.live import LiveStrokes
from .app import Service, make_app
from .exports import Exports
from .facts import check_paintable
from .images import Images
from .security import LOOPBACK, Gate
from .serve import listen, serve, server_of
from .studio import Studio

USUAL_PORT = 8757  # of no service that IANA's registry names
SWITCH_SECONDS = 0.0002  # a thread that computes lets others go on so often
UNSEEN = ("192.0.2.1", "2001:db8::1")  # addresses that nobody has (RFC 5737, RFC 3849)


@dataclass(frozen=True)
class Place:
    """Where a server is to be found.

    Attributes
    ----------
    address : str
        That it is bound to; 127.0.0.1 is seen from this machine alone.
    port : int, optional
        0 for any that is free; if not given, one that is always the same, so that browsers
        remember what a page keeps with them, or any if that one is taken.
    """

    address: str = LOOPBACK
    port: int | None = None


def paint(
    live: LiveStrokes,
    *,
    name: str,
    mesh: Mesh | None = None,
    place: Place | None = None,
    ready: Callable[[str], None],
) -> None:
    """Serve a project until a signal ends it; then it is closed.

    Parameters
    ----------
    live : LiveStrokes
        Of the project, which is closed in the end, whatever happens.
    name : str
        Of what is painted, for people.
    mesh : Mesh, optional
        The painted mesh with texture coordinates of its own, for exports.
    place : Place, optional
    ready : callable
        Called with the address to open, token and all.

    Raises
    ------
    ServerError
        The place cannot be had, or the mesh is too large for pages.
    """
    place = place or Place()
    listening = None
    try:
        check_paintable(live.project.texture)
        listening = _listening(place)
        studio = Studio(live)
    except BaseException:
        if listening is not None:
            listening.close()
        live.close()
        raise
    gate = Gate(listening.getsockname()[1], place.address)
    exports = Exports(live.project.path)
    parts = {"images": Images(), "exports": exports, "name": name}
    service = Service(studio, gate, mesh=mesh or live.project.texture.surface, **parts)

    async def close() -> None:
        exports.stop()
        await studio.close()

    address = f"http://{seen_address(place.address)}:{gate.port}/#t={gate.token}"
    with _at_the_ready():
        serve(server_of(make_app(service)), listening, ready=lambda: ready(address), close=close)


@contextmanager
def _at_the_ready() -> Iterator[None]:
    """Let nobody wait long for the interpreter: not for others, nor for what was made at the start.

    The garbage collector would look at hundreds of thousands of objects that stay.
    """
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_SECONDS)
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(before)


def _listening(place: Place) -> sockets.socket:
    if place.port is not None:
        return listen(place.address, place.port)
    try:
        return listen(place.address, USUAL_PORT)
    except ServerError:
        return listen(place.address, 0)


def seen_address(address: str) -> str:
    """How others write an address that a server is bound to; of all of them, the one they see."""
    found = ipaddress.ip_address(address)
    if found.is_unspecified:
        family = sockets.AF_INET if found.version == 4 else sockets.AF_INET6
        with sockets.socket(family, sockets.SOCK_DGRAM) as probe:
            try:
                probe.connect((UNSEEN[found.version == 6], 9))  # chooses a way, sends nothing
                found = ipaddress.ip_address(probe.getsockname()[0])
            except OSError:
                found = ipaddress.ip_address("127.0.0.1" if found.version == 4 else "::1")
    return f"[{found}]" if found.version == 6 else str(found)
