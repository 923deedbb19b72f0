"""The messages of the painting page and the server, as bytes; `PROTOCOL.md` says what they mean.

A frame is a header of 16 bytes and a payload. Whatever bytes come in, reading them gives a message
or raises a `ServerError`.
"""

import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from ..arrays import Vector3
from ..errors import ServerError
from ..kernels.wire_codes import PICTURES
from .plain_json import json_bytes, json_object
from .samples import MOST_SAMPLES, SAMPLE_BYTES, Samples

__all__ = ["Hello", "Message", "OperationAsked", "StrokeBegin", "Type", "View", "decode", "encode"]

VERSION = 2
HEADER = struct.Struct("<BBHIII")
MOST_BYTES = 2**20  # of a frame that goes up
COMPLETE = 1  # flag of BRICKS: whoever got this has everything
PICTURE_SHIFT = 1  # its other flags are the number of the picture that the bricks are of
VIEW = struct.Struct("<6f")
ACK = struct.Struct("<I")
MOST_FLAGS = (len(PICTURES) - 1) << PICTURE_SHIFT | COMPLETE
CLIENT_DIGITS = 32
MOST_KIND = 64  # characters of an operation's name


class Type(IntEnum):
    """The first byte of a frame; what goes down starts at 64."""

    HELLO = 1
    STROKE_BEGIN = 2
    DABS = 3
    STROKE_END = 4
    UNDO = 5
    REDO = 6
    OPERATION = 7
    VIEW = 8
    SHOWN = 9
    STROKE_CANCEL = 10
    WELCOME = 64
    ACK = 65
    BRICKS = 66
    STATE = 67
    ERROR = 68


DURABLE = frozenset(
    {
        Type.STROKE_BEGIN, Type.DABS, Type.STROKE_END, Type.UNDO, Type.REDO, Type.OPERATION,
        Type.STROKE_CANCEL,
    }
)  # fmt: skip
"""What is kept before it is acknowledged; the frame's number is the client's own."""

EMPTY = frozenset({Type.STROKE_END, Type.UNDO, Type.REDO, Type.SHOWN, Type.STROKE_CANCEL})


@dataclass(frozen=True)
class Hello:
    """The first message: who speaks, and what it knows already.

    Attributes
    ----------
    client : str
        32 hexadecimal digits that the client keeps over reconnects.
    run, since : str, int
        From the last WELCOME, and the largest version of all bricks when it last had everything.
    """

    client: str
    run: str = ""
    since: int = 0


@dataclass(frozen=True)
class StrokeBegin:
    """A stroke begins: on which layer, with which `Brush.to_dict()`."""

    layer: int
    brush: dict[str, Any]


@dataclass(frozen=True)
class OperationAsked:
    """An operation; ``replaces`` takes back this client's last step of the same kind first."""

    kind: str
    params: dict[str, Any]
    replaces: bool = False


@dataclass(frozen=True, eq=False)
class View:
    """Where the eye and the cursor are, counted from the origin; no cursor is None."""

    eye: Vector3
    cursor: Vector3 | None


Body = Hello | StrokeBegin | OperationAsked | View | Samples | dict | int | bytes | None


@dataclass(frozen=True, eq=False)
class Message:
    """One frame.

    Attributes
    ----------
    type : Type
    seq : int
        The client's number of a durable message or of the one acknowledged; that of a BRICKS.
    body : object
        What the type carries: `Hello`, `StrokeBegin`, `Samples`, `OperationAsked`, `View`, a dict
        (WELCOME, STATE, ERROR), a number (ACK), bytes (BRICKS) or None.
    flags : int
    """

    type: Type
    seq: int = 0
    body: Body = None
    flags: int = 0


def encode(kind: Type, seq: int = 0, payload: bytes = b"", flags: int = 0) -> bytes:
    """The frame of a payload.

    Examples
    --------
    >>> encode(Type.STROKE_END, 7).hex(" ", 4)
    '04020000 07000000 00000000 00000000'
    """
    return HEADER.pack(kind, VERSION, flags, seq, len(payload), zlib.crc32(payload)) + payload


def encode_json(kind: Type, body: dict[str, Any], seq: int = 0) -> bytes:
    """The frame of a message that carries JSON."""
    return encode(kind, seq, json_bytes(body))


def encode_hello(hello: Hello) -> bytes:
    """The frame of the first message."""
    body: dict[str, Any] = {"client": hello.client, "version": VERSION}
    if hello.run:
        body |= {"run": hello.run, "since": hello.since}
    return encode_json(Type.HELLO, body)


def encode_view(eye: Vector3, cursor: Vector3 | None) -> bytes:
    """The frame that tells what the page looks at."""
    where = np.full(3, np.nan) if cursor is None else cursor
    return encode(Type.VIEW, 0, VIEW.pack(*eye, *where))


def encode_ack(cseq: int, number: int) -> bytes:
    """The frame that says a message is on the disk."""
    return encode(Type.ACK, cseq, ACK.pack(number))


def encode_error(cseq: int, error: Any) -> bytes:
    """The frame of a `MeshsdfError` about the client's message ``cseq``."""
    words = {"cseq": cseq, "what": error.what, "where": error.where, "fix": error.fix}
    return encode_json(Type.ERROR, words, cseq)


def decode(data: bytes, *, downward: bool = False) -> Message:
    """The message of a frame that goes up, or down.

    Raises
    ------
    ServerError
        It is none: too long, cut short, altered, of another version, of an unknown type, or its
        payload is not what the type asks for.

    Examples
    --------
    >>> decode(encode(Type.UNDO, 3)).type
    <Type.UNDO: 5>
    """
    if not downward and len(data) > MOST_BYTES:
        raise _wrong(f"a frame of {len(data)} bytes", f"send at most {MOST_BYTES}")
    if len(data) < HEADER.size:
        raise _wrong(f"a frame of {len(data)} bytes has no header", f"begin with {HEADER.size}")
    number, version, flags, seq, length, checksum = HEADER.unpack_from(data)
    payload = bytes(data[HEADER.size :])
    if version != VERSION:
        what = f"a frame of version {version} of the protocol"
        raise _wrong(what, f"speak version {VERSION}; reload the page if it is older")
    if length != len(payload):
        raise _wrong(f"{len(payload)} bytes of payload where {length} are announced")
    if checksum != zlib.crc32(payload):
        raise _wrong("the payload is not what its checksum says")
    kind = _type(number, downward)
    if flags > (MOST_FLAGS if kind is Type.BRICKS else 0):
        raise _wrong(f"{kind.name} has flags {flags}", "leave them 0")
    if kind in DURABLE and seq == 0:
        raise _wrong(f"{kind.name} has no number", "count from 1")
    if kind in EMPTY:
        if payload:
            raise _wrong(f"{kind.name} carries {len(payload)} bytes", "leave it empty")
        return Message(kind, seq)
    return Message(kind, seq, READERS[kind](payload), flags)


def _type(number: int, downward: bool) -> Type:
    if number not in Type.__members__.values() or (number >= Type.WELCOME) != downward:
        raise _wrong(f"there is no message of type {number} in this direction")
    return Type(number)


def _hello(payload: bytes) -> Hello:
    body = _members(payload, {"client": str, "version": int}, {"run": str, "since": int})
    client = body["client"]
    if len(client) != CLIENT_DIGITS or not set(client) <= set("0123456789abcdef"):
        raise _wrong("the client's name is none", f"send {CLIENT_DIGITS} hexadecimal digits")
    if body["version"] != VERSION:
        raise _wrong(f"version {body['version']} of the protocol", f"speak version {VERSION}")
    since = body.get("since", 0)
    if not 0 <= since < 2**32:
        raise _wrong(f"a version of {since}", "send one from 0 to 2^32 - 1")
    return Hello(client, body.get("run", ""), since)


def _stroke_begin(payload: bytes) -> StrokeBegin:
    body = _members(payload, {"layer": int, "brush": dict})
    return StrokeBegin(body["layer"], body["brush"])


def _operation(payload: bytes) -> OperationAsked:
    body = _members(payload, {"kind": str, "params": dict}, {"replaces": bool})
    if len(body["kind"]) > MOST_KIND:
        raise _wrong(f"an operation's name of {len(body['kind'])} letters")
    return OperationAsked(body["kind"], body["params"], body.get("replaces", False))


def _view(payload: bytes) -> View:
    if len(payload) != VIEW.size:
        raise _wrong(f"a VIEW of {len(payload)} bytes", f"send {VIEW.size}")
    numbers = np.array(VIEW.unpack(payload))
    eye, cursor = numbers[:3], numbers[3:]
    if not np.isfinite(eye).all() or np.isinf(cursor).any():
        raise _wrong("a VIEW from nowhere", "send finite numbers; NaN only for no cursor")
    return View(eye, None if np.isnan(cursor).any() else cursor)


def _dabs(payload: bytes) -> Samples:
    n, rest = divmod(len(payload), SAMPLE_BYTES)
    if rest or not 1 <= n <= MOST_SAMPLES:
        what = f"DABS of {len(payload)} bytes"
        raise _wrong(what, f"send 1 to {MOST_SAMPLES} samples of {SAMPLE_BYTES}")
    samples = Samples.unpacked(payload)
    if not np.isfinite(samples.points).all():
        row = int(np.flatnonzero(~np.isfinite(samples.points).all(axis=1))[0])
        raise _wrong(f"sample {row} lies at {samples.points[row]}", "send finite numbers")
    return samples


def _ack(payload: bytes) -> int:
    if len(payload) != ACK.size:
        raise _wrong(f"an ACK of {len(payload)} bytes", f"send {ACK.size}")
    return ACK.unpack(payload)[0]


READERS: dict[Type, Callable[[bytes], Any]] = {
    Type.HELLO: _hello,
    Type.STROKE_BEGIN: _stroke_begin,
    Type.DABS: _dabs,
    Type.OPERATION: _operation,
    Type.VIEW: _view,
    Type.WELCOME: json_object,
    Type.ACK: _ack,
    Type.BRICKS: bytes,
    Type.STATE: json_object,
    Type.ERROR: json_object,
}


def _members(payload: bytes, needed: dict[str, type], other: dict[str, type] | None = None):
    """The members of a JSON object, of just these names and types."""
    body = json_object(payload)
    allowed = needed | (other or {})
    for name in needed:
        if name not in body:
            raise _wrong(f"{name!r} is missing", f"send {', '.join(needed)}")
    for name, value in body.items():
        if name not in allowed:
            raise _wrong(f"{name[:40]!r} is unknown", f"send {', '.join(allowed)}")
        # True is an int to Python
        if type(value) is not allowed[name]:
            what = f"{name!r} is a {type(value).__name__}"
            raise _wrong(what, f"send {allowed[name].__name__}")
    return body


def _wrong(what: str, fix: str = "see the protocol's page") -> ServerError:
    return ServerError(what, "a message of the painting page", fix)
