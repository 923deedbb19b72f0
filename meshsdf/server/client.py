"""A painter in Python: does what the page does, for scripts and other programs.

Nothing is lost when the connection breaks: it comes back by itself, and what was not acknowledged
is sent again. Only this module imports websockets.
"""

import contextlib
import json
import secrets
import threading
import time
import urllib.error
import urllib.request
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np

from ..arrays import Number, Points, Values, Vector3
from ..errors import ServerError
from ..kernels.wire_codes import PICTURES
from ..texture.brush import Brush
from .messages import (
    COMPLETE,
    PICTURE_SHIFT,
    Hello,
    Message,
    OperationAsked,
    StrokeBegin,
    Type,
    decode,
    encode,
    encode_hello,
    encode_json,
    encode_view,
)
from .samples import MOST_SAMPLES, Normals, Samples
from .wire_records import brick_records, bricks_digest

PAUSES = (0.05, 0.1, 0.25, 0.5, 1.0)  # seconds before the tries to come back
PATIENCE = 60.0  # seconds
MOST_SENT = 64  # messages under way, not acknowledged
MOST_DOWN = 16 * 2**20  # bytes of a frame from the server
WHERE = "Painter"


class Painter:
    """A connection to a `meshsdf paint` that paints.

    Parameters
    ----------
    address : str
        What `meshsdf paint` printed: ``http://127.0.0.1:PORT/#t=TOKEN``.
    client : str, optional
        32 hexadecimal digits; those of an earlier painter to go on where it stopped.
    patience : float
        Seconds after which `wait` and connecting give up.

    Attributes
    ----------
    facts : dict
        The answer to GET /api/project.
    state : dict
        Layers and steps, as the server told last.
    pictures : dict of str to dict of int to bytes
        What is shown: of every picture ("base", "normal", "height") and entry the brick, as it
        came.
    bricks : dict of int to bytes
        Those of the base colour.
    n_connections : int

    Raises
    ------
    ServerError
        The server is not there, or does not let us in; or the package websockets is missing.

    Examples
    --------
    Paint one red dab on the first layer::

        with Painter("http://127.0.0.1:8000/#t=...") as painter:
            painter.begin(0, Brush(0.1, color=(1.0, 0.0, 0.0, 1.0)))
            painter.dabs(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 1.0]]))
            painter.end()
    """

    def __init__(self, address: str, *, client: str = "", patience: Number = PATIENCE) -> None:
        self.base, self._token = _parted(address)
        self.client = client or secrets.token_hex(16)
        self.patience = float(patience)
        self._connect = _Connector()
        self.facts = self.get_json("/api/project")
        self.origin: Vector3 = np.array(self.facts["origin"], np.float64)
        self.state: dict[str, Any] = {}
        self.pictures: dict[str, dict[int, bytes]] = {name: {} for name in PICTURES}
        self.bricks = self.pictures["base"]
        self.n_connections = 0
        self._run, self._since, self._newest = "", 0, 0
        self._cseq = self._sent = 0
        self._waiting: dict[int, bytes] = {}  # not acknowledged, oldest first
        self._numbers: dict[int, int] = {}
        self._errors: list[ServerError] = []
        self._socket: Any = None
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._stay_connected, daemon=True)
        self._thread.start()
        try:
            self._wait_for(lambda: self.state, "the server's greeting")
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "Painter":
        return self

    def __exit__(self, kind: Any, *_: object) -> None:
        try:
            if kind is None:
                self.wait()
        finally:
            self.close()

    def begin(self, layer: int, brush: Brush) -> int:
        """Begin a stroke; the number of the message."""
        asked = StrokeBegin(layer, brush.to_dict())
        return self._post(Type.STROKE_BEGIN, {"layer": asked.layer, "brush": asked.brush})

    def dabs(self, points: Points, normals: Normals, pressures: Values | None = None) -> None:
        """Go on with the stroke, to points in the texture's space."""
        pressures = np.ones(len(points)) if pressures is None else pressures
        for first in range(0, len(points), MOST_SAMPLES):
            part = slice(first, first + MOST_SAMPLES)
            samples = Samples(points[part] - self.origin, normals[part], pressures[part])
            self._post(Type.DABS, samples.packed())

    def end(self) -> int:
        """End the stroke."""
        return self._post(Type.STROKE_END)

    def cancel(self) -> int:
        """Take the stroke back."""
        return self._post(Type.STROKE_CANCEL)

    def undo(self) -> int:
        """Take the newest step back, whoever did it."""
        return self._post(Type.UNDO)

    def redo(self) -> int:
        """Do the step again that was taken back last."""
        return self._post(Type.REDO)

    def operation(self, kind: str, *, replaces: bool = False, **params: Any) -> int:
        """Do an operation, see `texture.operations`; pictures are named by their ids."""
        asked = OperationAsked(kind, params, replaces)
        return self._post(Type.OPERATION, vars(asked))

    def view(self, eye: Vector3, cursor: Vector3 | None = None) -> None:
        """Say what is looked at, so that bricks near it come first."""
        near = None if cursor is None else cursor - self.origin
        self._send(encode_view(eye - self.origin, near))

    def wait(self) -> None:
        """Wait until all that was sent is on the server's disk.

        Raises
        ------
        ServerError
            Something was refused, or is not acknowledged in time.
        """
        self._wait_for(lambda: not self._waiting, "acknowledgements")
        with self._changed:
            if self._errors:
                raise self._errors.pop(0)

    def number(self, cseq: int) -> int:
        """The operation's number in the journal that a message has become; 0 if none."""
        return self._numbers.get(cseq, 0)

    def digest(self, picture: str = "base") -> str:
        """SHA-256 of the bricks that are here of a picture, as GET /api/digest gives it."""
        with self._changed:
            return bricks_digest(sorted(self.pictures[picture].items()))

    def catch_up(self) -> str:
        """Wait for all messages and all bricks; the digest of colours that is the server's, too."""
        self.wait()
        until = time.monotonic() + self.patience
        while time.monotonic() < until:
            found = self.get_json("/api/digest")
            wanted = {"base": found["shown"]} | {name: found[name] for name in PICTURES[1:]}
            with self._changed:
                if self._changed.wait_for(lambda wanted=wanted: self._shows(wanted), 0.5):
                    return wanted["base"]
        raise ServerError("the bricks here are not the server's", WHERE, "wait longer")

    def get(self, path: str) -> bytes:
        """The answer to a GET of a path."""
        request = urllib.request.Request(self.base + path, headers=self._headers())
        try:
            with urllib.request.urlopen(request, timeout=self.patience) as answer:
                return answer.read()
        except urllib.error.HTTPError as error:
            with error:
                words = f"{error.code} {error.read(500).decode(errors='replace')}"
            raise ServerError(words, f"GET {path}", "use the address that was printed") from None
        except (OSError, ValueError) as error:
            what = f"the server does not answer: {error}"
            raise ServerError(what, self.base, "see whether it runs") from None

    def get_json(self, path: str) -> dict[str, Any]:
        """The same, of JSON."""
        return json.loads(self.get(path))

    def go_to(self, address: str) -> None:
        """Go on at another address: that of the server that was started again."""
        with self._changed:
            self.base, self._token = _parted(address)
            socket = self._socket
            self._changed.notify_all()
        if socket is not None:
            socket.close()

    def drop(self) -> None:
        """Break the connection, as networks do; it comes back by itself."""
        with self._changed:
            socket = self._socket
        if socket is not None:
            socket.close()

    def close(self) -> None:
        """Break off; what is not acknowledged by now may be lost."""
        with self._changed:
            self._closed = True
            socket = self._socket
        if socket is not None:
            socket.close()
        self._thread.join()

    def _shows(self, digests: dict[str, str]) -> bool:
        return all(self.digest(picture) == wanted for picture, wanted in digests.items())

    def _headers(self) -> dict[str, str]:
        return {"Authorization": f"Bearer {self._token}"}

    def _post(self, kind: Type, body: bytes | dict[str, Any] = b"") -> int:
        """Keep a durable message until it is acknowledged, and send it when it may go."""
        with self._changed:
            if self._closed:
                raise ServerError("the painter is closed", WHERE, "make another one")
            self._cseq += 1
            if isinstance(body, dict):
                frame = encode_json(kind, body, self._cseq)
            else:
                frame = encode(kind, self._cseq, body)
            self._waiting[self._cseq] = frame
            self._pump()
            return self._cseq

    def _pump(self) -> None:
        """Send what waits, in order, as far as few enough are under way."""
        if self._socket is None:
            return
        for cseq, frame in list(self._waiting.items())[:MOST_SENT]:
            if cseq > self._sent:
                self._send(frame)
                self._sent = cseq

    def _send(self, frame: bytes) -> None:
        socket = self._socket
        if socket is not None:
            with contextlib.suppress(self._connect.closed):  # then it is sent after coming back
                socket.send(frame)

    def _stay_connected(self) -> None:
        tries = 0
        while not self._closed:
            try:
                with self._connect(self.base, self._headers()) as socket:
                    tries = 0
                    self._talk(socket)
            except (*self._connect.faults, OSError, ServerError) as error:
                self._last_fault = error
            with self._changed:
                self._socket = None
                self._changed.notify_all()
                if not self._closed:
                    self._changed.wait(PAUSES[min(tries, len(PAUSES) - 1)])
            tries += 1

    def _talk(self, socket: Any) -> None:
        socket.send(encode_hello(Hello(self.client, self._run, self._since)))
        for data in socket:
            message = decode(data, downward=True)
            with self._changed:
                self._take(socket, message)
                self._changed.notify_all()
            if self._closed:
                return

    def _take(self, socket: Any, message: Message) -> None:
        body = message.body
        if message.type is Type.WELCOME:
            self._welcomed(socket, body)
        elif message.type is Type.STATE:
            self.state = body
        elif message.type is Type.ACK:
            self._waiting.pop(message.seq, None)
            self._numbers[message.seq] = body
            self._pump()
        elif message.type is Type.ERROR:
            self._waiting.pop(message.seq, None)
            self._errors.append(ServerError(body["what"], body["where"], body["fix"]))
            self._pump()
        elif message.type is Type.BRICKS:
            bricks = self.pictures[PICTURES[message.flags >> PICTURE_SHIFT]]
            for entry, version, brick in brick_records(body):
                self._newest = max(self._newest, version)
                bricks[entry] = brick
            if message.flags & COMPLETE:
                self._since = self._newest
            socket.send(encode(Type.SHOWN, message.seq))

    def _welcomed(self, socket: Any, body: dict[str, Any]) -> None:
        if body["run"] != self._run:
            self._run, self._since, self._newest = body["run"], 0, 0
            for bricks in self.pictures.values():
                bricks.clear()
        self.state = body["state"]
        self._cseq = max(self._cseq, body["cseq"])
        for cseq in [one for one in self._waiting if one <= body["cseq"]]:
            del self._waiting[cseq]
        self.n_connections += 1
        self._socket, self._sent = socket, 0
        self._pump()

    def _wait_for(self, met: Any, what: str) -> None:
        with self._changed:
            if not self._changed.wait_for(met, self.patience):
                words = f"{what} did not come within {self.patience:g} seconds"
                raise ServerError(words, self.base, "see whether the server runs")


def _parted(address: str) -> tuple[str, str]:
    """Where the server is, and the token."""
    parts = urlsplit(address)
    return f"{parts.scheme}://{parts.netloc}", parse_qs(parts.fragment).get("t", [""])[0]


class _Connector:
    """How to connect: the package, if it is there."""

    def __init__(self) -> None:
        try:
            from websockets.exceptions import ConnectionClosed, WebSocketException
            from websockets.sync.client import connect
        except ImportError:
            what = "painting from Python needs the package websockets"
            raise ServerError(what, WHERE, "pip install '.[paint]'") from None
        self._connect = connect
        self.closed = ConnectionClosed
        self.faults = (WebSocketException,)

    def __call__(self, base: str, headers: dict[str, str]) -> Any:
        address = "ws" + base.removeprefix("http") + "/api/socket"
        return self._connect(
            address, additional_headers=headers, compression=None, max_size=MOST_DOWN, proxy=None
        )
