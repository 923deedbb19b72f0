"""Who may talk to the server: whoever holds this run's token, from this server's own pages.

A page from elsewhere, open in the same browser, can send requests here; a name of its own can be
made to lead here (DNS rebinding). So a request must name this server as its host, a page that
sends more than it asks for must be from here, and all but the page itself needs a key that is
given for the token. The token stands in the fragment of the address, which browsers keep to
themselves. No other origin is ever allowed to read (no CORS).

Limits: browsers send a cookie to every port of a host. Whoever runs another server on this machine
and gets its owner to visit it sees the key if the page asks for paths under ``/api``; who reads
along on a network (``--allow-remote``) sees all.
"""

import asyncio
import hmac
import ipaddress
import json
import secrets
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from .limits import MIB, Refused

Scope = dict[str, Any]
Receive = Callable[[], Awaitable[dict[str, Any]]]
Send = Callable[[dict[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

TOKEN_BYTES = 32
LOOPBACK = "127.0.0.1"
READING = ("GET", "HEAD")
SESSION_PATH = "/api/session"
MOST_DRAINED = MIB  # bytes of a refused request that are read for the sake of the answer
DRAIN_SECONDS = 1.0
FORBIDDEN_SOCKET = 4403  # the number that closes a WebSocket which was never accepted

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "font-src 'self'; worker-src 'self' blob:; manifest-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'; object-src 'none'; connect-src 'self'"
)
HEADERS = (
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
    ("x-frame-options", "DENY"),
    ("permissions-policy", "camera=(), geolocation=(), microphone=()"),
)


def new_secret() -> str:
    """256 random bits as text."""
    return secrets.token_urlsafe(TOKEN_BYTES)


@dataclass(frozen=True)
class Gate:
    """What lets a request in.

    Attributes
    ----------
    port : int
        That the server listens on.
    address : str
        That it is bound to.
    token, key : str
        What is in the address, and what the cookie holds that is given for it.
    """

    port: int
    address: str = LOOPBACK
    token: str = field(default_factory=new_secret, repr=False)
    key: str = field(default_factory=new_secret, repr=False)

    @property
    def cookie(self) -> str:
        """The cookie's name: servers on other ports have others."""
        return f"meshsdf_{self.port}"

    def admits_host(self, host: str) -> bool:
        """Whether a Host header names this server: by an address it is bound to, or localhost.

        Bound to all addresses (0.0.0.0, ::), it takes any that is written in numbers: those
        cannot be made to lead elsewhere.

        Examples
        --------
        >>> gate = Gate(8765)
        >>> [gate.admits_host(f"{name}:8765") for name in ("localhost", "[::1]", "example.org")]
        [True, False, False]
        """
        name, port = _host_and_port(host)
        if port != self.port or not name:
            return False
        bound = ipaddress.ip_address(self.address)
        if name == "localhost":
            return bound.is_loopback or bound.is_unspecified
        try:
            asked = ipaddress.ip_address(name)
        except ValueError:
            return False
        return asked == bound or (bound.is_unspecified and not asked.is_multicast)

    def is_token(self, text: str) -> bool:
        """Whether it is this run's token; takes as long whatever it is."""
        return hmac.compare_digest(text.encode(errors="replace"), self.token.encode())

    def is_known(self, headers: dict[str, list[str]]) -> bool:
        """Whether a request brings the cookie's key, or the token itself."""
        if _bears(headers):
            return self.is_token(_bearer(headers))
        keys = [
            value.strip()
            for line in headers.get("cookie", [])
            for name, _, value in (part.partition("=") for part in line.split(";"))
            if name.strip() == self.cookie
        ]
        return any([hmac.compare_digest(key.encode(), self.key.encode()) for key in keys])

    def set_cookie(self) -> str:
        """The header that gives a page its key."""
        return f"{self.cookie}={self.key}; Path=/api; HttpOnly; SameSite=Strict"

    def check(self, scope: Scope) -> None:
        """Let a request for a page or a WebSocket pass.

        Raises
        ------
        Refused
            Its host, its origin or its key is not as it must be.
        """
        headers = headers_of(scope)
        hosts = headers.get("host", [])
        if len(hosts) != 1 or not self.admits_host(hosts[0]):
            what = f"this server is not {', '.join(hosts)[:100]!r}"
            raise Refused(421, what, "the header Host", "use the address that it printed")
        is_socket = scope["type"] == "websocket"
        reads = not is_socket and scope["method"] in READING
        self._check_origin(headers, hosts[0], reads)
        path = scope["path"]
        if not path.startswith("/api"):
            if not reads:
                raise Refused(405, "this can only be read", path, "see /api")
            return
        for site in headers.get("sec-fetch-site", []):
            if site not in ("same-origin", "none"):  # which a link to the page itself may be
                raise _foreign(site)
        if path == SESSION_PATH and not reads and not is_socket:
            return
        if not self.is_known(headers):
            fix = "open the address that the server printed when it was started"
            raise Refused(401, "the key is missing or of another run", path, fix)

    def _check_origin(self, headers: dict[str, list[str]], host: str, reads: bool) -> None:
        """Pages from elsewhere may not send anything; browsers say which page a request is from."""
        origins = headers.get("origin", [])
        own = f"http://{host.lower()}"
        if any(origin.lower() != own for origin in origins):
            raise _foreign(origins[0])
        if not origins and not reads and not _bears(headers):
            what = "the request does not say which page it is from"
            fix = "send the header Origin, or Authorization: Bearer TOKEN"
            raise Refused(403, what, "the header Origin", fix)


class Guard:
    """An app behind a gate: every request is checked, every answer bears the safe headers.

    Parameters
    ----------
    app : ASGI application
    gate : Gate
    """

    def __init__(self, app: App, gate: Gate) -> None:
        self.app, self.gate = app, gate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request, as ASGI wants it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        try:
            self.gate.check(scope)
        except Refused as refused:
            if scope["type"] == "websocket":
                await receive()
                close = {"type": "websocket.close", "code": FORBIDDEN_SOCKET}
                await send(close | {"reason": refused.what[:100]})
            else:
                await answer(_Answer(scope, receive, send).send, refused)
            return
        if scope["type"] == "http":
            safe = _Answer(scope, receive, send)
            receive, send = safe.receive, safe.send
        await self.app(scope, receive, send)


class _Answer:
    """One answer, with the headers that keep browsers from doing more than they should.

    If the request's body was not read to its end, a little more of it is, as a connection that
    closes with bytes unread takes the answer along; if that does not suffice, it closes.
    """

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._scope, self._receive, self._send = scope, receive, send
        headers = headers_of(scope)
        length = headers.get("content-length", ["0"])[0]
        self._is_read = length == "0" and "transfer-encoding" not in headers
        self._may_drain = "expect" not in headers  # who asks first has sent nothing yet

    async def receive(self) -> dict[str, Any]:
        """The next piece of the request."""
        message = await self._receive()
        self._is_read = self._is_read or not message.get("more_body", False)
        return message

    async def send(self, message: dict[str, Any]) -> None:
        """The next piece of the answer."""
        if message["type"] == "http.response.start":
            await self._drain()
            given = list(message.get("headers", []))
            names = {name.lower() for name, _ in given}
            extra = [("content-security-policy", _policy(self._scope)), *HEADERS]
            if self._scope["path"].startswith("/api"):
                extra.append(("cache-control", "no-store"))
            if not self._is_read:
                extra.append(("connection", "close"))
            given += [pair for pair in _encoded(extra) if pair[0] not in names]
            message = message | {"headers": given}
        await self._send(message)

    async def _drain(self) -> None:
        """Read what is left of the request, if it is little and comes soon."""
        n_bytes = 0
        with suppress(TimeoutError):
            async with asyncio.timeout(DRAIN_SECONDS):
                while self._may_drain and not self._is_read and n_bytes < MOST_DRAINED:
                    n_bytes += len((await self.receive()).get("body", b""))


async def answer(send: Send, refused: Refused) -> None:
    """Say in JSON why a request is refused."""
    facts = {"what": refused.what, "where": refused.where, "fix": refused.fix}
    body = json.dumps(facts).encode()
    headers = {"content-type": "application/json", "content-length": str(len(body))}
    start = {"type": "http.response.start", "status": refused.status}
    await send(start | {"headers": _encoded(headers.items())})
    await send({"type": "http.response.body", "body": body})


def headers_of(scope: Scope) -> dict[str, list[str]]:
    """The headers by name in lower case; each may come several times."""
    found: dict[str, list[str]] = {}
    for name, value in scope["headers"]:
        found.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
    return found


def _policy(scope: Scope) -> str:
    """The content security policy; some browsers do not count WebSockets as 'self'."""
    host = "".join(headers_of(scope).get("host", [])[:1])
    plain = host.replace(".", "").replace(":", "").replace("-", "")
    return f"{POLICY} ws://{host}" if plain.isascii() and plain.isalnum() else POLICY


def _host_and_port(host: str) -> tuple[str, int]:
    """The parts of a Host header, in lower case; port 80 if it names none, -1 if it makes no sense.

    An IPv6 address stands in brackets, as RFC 3986 wants it.
    """
    if host.startswith("["):
        name, bracket, rest = host[1:].partition("]")
        if not bracket or ":" not in name or (rest and not rest.startswith(":")):
            return "", -1
        port = rest[1:] if rest else "80"
    else:
        name, colon, port = host.partition(":")
        port = port if colon else "80"
    if not (port.isascii() and port.isdigit() and len(port) <= 5):
        return "", -1
    return name.lower(), int(port)


def _bears(headers: dict[str, list[str]]) -> bool:
    return "authorization" in headers


def _bearer(headers: dict[str, list[str]]) -> str:
    """The token of the header ``Authorization: Bearer TOKEN``; empty if there is no such one."""
    given = headers["authorization"]
    scheme, _, token = given[0].partition(" ")
    return token.strip() if len(given) == 1 and scheme.lower() == "bearer" else ""


def _encoded(pairs: Iterable[tuple[str, str]]) -> list[tuple[bytes, bytes]]:
    return [(name.encode("latin-1"), value.encode("latin-1")) for name, value in pairs]


def _foreign(origin: str) -> Refused:
    what = f"the request is from another page: {origin[:100]!r}"
    return Refused(403, what, "the header Origin", "use the page of this server")
