"""Run the painting server until it is told to end; uvicorn is imported here alone.

A connection that does not come to the point is closed: requests have `HEAD_SECONDS` and
`BODY_SECONDS` to arrive, and when there are too many connections, the oldest of these go first.
"""

import asyncio
import errno
import ipaddress
import signal
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from ..errors import ServerError
from .limits import BODY_SECONDS, HEAD_SECONDS, MOST_CONNECTIONS, MOST_FRAME, MOST_HEAD, MOST_QUEUED
from .security import App, Receive, Scope, Send

SIGNALS = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    if hasattr(signal, name)
)
LAST_SECONDS = 3  # for requests that are being answered when the server ends
PATIENCE = {"IDLE": HEAD_SECONDS, "SEND_BODY": BODY_SECONDS}  # by h11's names of what is due


def listen(address: str, port: int) -> socket.socket:
    """A socket that others may connect to; the system chooses the port if it is 0.

    Raises
    ------
    ServerError
        The address is none of this machine, or the port is taken or may not be used.
    """
    where = f"address {address}, port {port}"
    try:
        family = socket.AF_INET6 if ipaddress.ip_address(address).version == 6 else socket.AF_INET
    except ValueError:
        what = f"{address!r} is no IP address"
        raise ServerError(what, where, "give one in numbers, such as 192.168.0.7") from None
    # The protocol by name: only then asyncio lets short messages go without waiting for longer ones
    found = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):  # Windows lets others share a port otherwise
            found.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        else:
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((address, port))
        found.listen(MOST_CONNECTIONS)
    except OSError as error:
        found.close()
        what, fix = {
            errno.EADDRINUSE: (
                f"port {port} is in use by another program",
                "choose another one, or --port 0 for any that is free",
            ),
            errno.EACCES: (f"port {port} may not be used", "choose one above 1023, or --port 0"),
            errno.EADDRNOTAVAIL: (
                f"{address} is no address of this machine",
                "give one that it has",
            ),
        }.get(error.errno, (f"nobody can be served: {error.strerror}", "try --port 0"))
        raise ServerError(what, where, fix) from None
    return found


def serve(
    server: "PaintServer",
    listening: socket.socket,
    *,
    ready: Callable[[], None],
    close: Callable[[], Awaitable[None]],
) -> None:
    """Answer until the server is told to end, then close what was served.

    Parameters
    ----------
    server : PaintServer
        From `server_of`. It ends at a signal, or when its ``should_exit`` is set.
    listening : socket
        From `listen`; it is closed at the end.
    ready : callable
        Called once requests are answered.
    close : callable
        Awaited at the end, however it comes.
    """
    asyncio.run(_serve(server, listening, ready, close))


async def _serve(server: "PaintServer", listening, ready, close) -> None:
    announcing = asyncio.create_task(_announce(server, ready))
    try:
        await server.serve(sockets=[listening])
    finally:
        announcing.cancel()
        await close()


class PaintServer(uvicorn.Server):
    """A server that ends in peace: a signal is no error, a second one does not wait."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """End on signals that ask for it, where this thread may listen to them.

        Those that are to be ignored (``nohup``) are.
        """
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        heard = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
        before = {number: signal.signal(number, self.handle_exit) for number in heard}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def handle_exit(self, sig: int, frame: Any) -> None:
        """Answer what is asked already, and end."""
        self.force_exit = self.should_exit
        self.should_exit = True


class PatientProtocol(H11Protocol):
    """HTTP on one connection, with an end to patience."""

    _timer: asyncio.TimerHandle | None = None
    _waits_for = ""
    _since = 0.0

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for a request; make room if there are too many connections."""
        super().connection_made(transport)
        self._since = self.loop.time()
        if len(self.connections) > MOST_CONNECTIONS:
            others = [one for one in self.connections if isinstance(one, PatientProtocol)]
            min(others, key=lambda one: (one._timer is None, one._since)).transport.abort()
        self._watch()

    def data_received(self, data: bytes) -> None:
        """Take bytes in, and see whether they make a request."""
        super().data_received(data)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._wait("")
        super().connection_lost(exc)

    def _watch(self) -> None:
        state = str(self.conn.their_state)
        has_left = self.transport.get_protocol() is not self  # for a WebSocket
        self._wait(state if state in PATIENCE and not has_left else "")

    def _wait(self, state: str) -> None:
        """Give the other side its time for what is due, or for nothing."""
        if state == self._waits_for:
            return
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._waits_for = state
        if state:
            self._timer = self.loop.call_later(PATIENCE[state], self.transport.abort)


def server_of(app: App) -> PaintServer:
    """The server of an app, not yet running."""
    config = uvicorn.Config(
        _ending_well(app),
        loop="asyncio",
        http=PatientProtocol,
        ws="websockets-sansio",
        ws_per_message_deflate=False,
        ws_max_size=MOST_FRAME,
        ws_max_queue=MOST_QUEUED,
        h11_max_incomplete_event_size=MOST_HEAD,
        timeout_graceful_shutdown=LAST_SECONDS,
        lifespan="off",
        log_config=None,
        log_level="error",
        access_log=False,  # it would hold whatever people put into addresses
        server_header=False,
        proxy_headers=False,  # what they say of where a request is from could be made up
    )
    return PaintServer(config)


def _ending_well(app: App) -> App:
    """An app whose answers may be broken off when the server ends; whoever waits is told so."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        begun = False

        async def note(message: Any) -> None:
            nonlocal begun
            begun = True
            await send(message)

        try:
            await app(scope, receive, note)
        except asyncio.CancelledError:
            if scope["type"] == "http" and not begun:
                await send({"type": "http.response.start", "status": 503, "headers": []})
                await send({"type": "http.response.body", "body": b""})

    return answer


async def _announce(server: uvicorn.Server, ready: Callable[[], None]) -> None:
    while not server.started:
        await asyncio.sleep(0.01)
    ready()
