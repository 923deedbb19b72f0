"""Too much, too slow, too strange: all refused, and the server answers as before."""

import contextlib
import hashlib
import json
import logging
import socket
import struct
import time

import httpx
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

from meshsdf.server import serve as serving
from meshsdf.server.client import Painter
from meshsdf.server.limits import MOST_CONNECTIONS, MOST_JSON
from meshsdf.server.messages import Hello, Type, decode, encode, encode_hello
from meshsdf.texture.brush import Brush

from .running import MIB, head, is_alive, knock, raw, running, status_of


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with running(tmp_path_factory.mktemp("served")) as running_server:
        yield running_server


def send_and_listen(socket, frame: bytes) -> None:
    """Send a frame, and hear what comes until the connection ends."""
    socket.send(frame)
    while True:
        socket.recv(timeout=10)


def test_a_frame_of_100_mb_ends_the_connection_and_nothing_else(server):
    with knock(server, **server.bearer) as socket:
        socket.send(encode_hello(Hello("1" * 32)))
        with pytest.raises(ConnectionClosed) as closed:
            send_and_listen(socket, bytes(100 * MIB))
    received = closed.value.rcvd
    assert received is None or received.code == 1009
    assert is_alive(server)


def told_of(server, *frames: bytes) -> dict:
    """The first ERROR that a new page hears after these frames."""
    client = hashlib.sha256(b"".join(frames)).hexdigest()[:32]
    with knock(server, **server.bearer) as socket:
        socket.send(encode_hello(Hello(client)))
        for frame in frames:
            socket.send(frame)
        while True:
            message = decode(socket.recv(timeout=10), downward=True)
            if message.type is Type.ERROR:
                return message.body


def begin(**brush) -> bytes:
    """The frame that begins a stroke."""
    asked = {"layer": 0, "brush": Brush(0.2).to_dict() | brush}
    return encode(Type.STROKE_BEGIN, 1, json.dumps(asked).encode())


def dab(*place: float) -> bytes:
    """The frame of a dab that presses fully."""
    return encode(Type.DABS, 2, struct.pack("<3f2hHH", *place, 0, 0, 65535, 16))


@pytest.mark.parametrize("place", [(np.nan, 0, 0), (0, np.inf, 0), (0, 0, 3e38)])
def test_a_dab_from_nowhere_is_refused_with_a_reason_and_painting_goes_on(server, place):
    with Painter(server.address) as painter:
        before = painter.digest()
        told = told_of(server, begin(), dab(*place))
        assert told["what"]
        assert told["fix"]
        pole = np.array([[0.0, 0.0, 1.0]])
        another = painter.state["seq"] % 16 / 16
        painter.begin(0, Brush(0.2, color=(0.0, another, 1.0, 1.0)))
        painter.dabs(pole, pole)
        painter.end()
        painter.wait()
        assert painter.digest() != before


@pytest.mark.parametrize(
    ("brush", "reason"),
    [
        ({"radius": 1e30}, "a brush of radius 1e+30 on a mesh of 2"),
        ({"radius": -1}, "radius cannot be -1"),
        ({"radius": float("nan")}, "NaN"),
        ({"radius": 1e999}, "Infinity"),
        ({"color": [1, 2]}, "color"),
        ({"kind": "explode"}, "explode"),
        ({"more": 1}, "more"),
    ],
)
def test_an_absurd_brush_is_refused_with_a_reason(server, brush, reason):
    assert reason in told_of(server, begin(**brush))["what"]
    assert is_alive(server)


@pytest.mark.parametrize("path", ["/api/session", "/api/images", "/api/exports", "/api/project"])
def test_a_body_of_100_mb_is_not_read(server, path):
    known = f"Authorization: {server.bearer['authorization']}"
    asked = head(server, f"POST {path}", known, f"Content-Length: {100 * MIB}")
    began = time.monotonic()
    answer = raw(server, asked, *[bytes(MIB)] * 100)
    assert status_of(answer) in (0, 405, 413)  # 0: cut off before the answer was read
    assert time.monotonic() - began < 10
    assert is_alive(server)


def test_a_request_in_words_is_short_and_the_refusal_reaches_its_sender(server):
    with server.client() as client:
        for path in 20 * ["/api/session", "/api/exports"]:
            answer = client.post(path, content=bytes(MOST_JSON + 1))
            assert answer.status_code == 413
            assert answer.json()["what"] == f"the request is longer than {MOST_JSON} bytes"
    for _ in range(40):
        answer = httpx.post(f"{server.base}/api/images", content=bytes(100_000))
        assert answer.status_code == 403


def test_a_body_without_a_length_is_counted_while_it_comes(server):
    known = f"Authorization: {server.bearer['authorization']}"
    asked = head(server, "POST /api/session", known, "Transfer-Encoding: chunked")
    chunk = b"10000\r\n" + bytes(0x10000) + b"\r\n"
    answer = raw(server, asked, *[chunk] * 20, b"0\r\n\r\n")
    assert status_of(answer) in (0, 413)
    assert is_alive(server)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (b'{"name": NaN}', "NaN"),
        (b"[" * 30000, "deep"),
        (b"[]", "list"),
        (b"\xff\xfe", "JSON"),
        (b"", "JSON"),
        (b'{"name": 1e999}', "inf"),
    ],
)
def test_strange_json_is_refused_with_the_reason(server, body, reason):
    with server.client() as client:
        answer = client.post("/api/exports", content=body)
    assert answer.status_code == 400
    assert reason in answer.json()["what"]


def test_headers_without_end_are_cut(server):
    known = f"X-Long: {'a' * (1 << 20)}"
    assert status_of(raw(server, head(server, "GET /", known))) in (0, 400, 431)
    assert is_alive(server)


def test_whoever_only_connects_is_shown_out_and_keeps_nobody_from_painting(server, monkeypatch):
    monkeypatch.setitem(serving.PATIENCE, "IDLE", 3.0)
    address = ("127.0.0.1", server.gate.port)
    idle = [socket.create_connection(address, timeout=10) for _ in range(MOST_CONNECTIONS + 20)]
    try:
        for one in idle[::2]:
            with contextlib.suppress(ConnectionError):  # it has made room already
                one.sendall(b"GET / HTTP/1.1\r\nX-Slow: ")
        assert is_alive(server)
        ended = 0
        for one in idle:
            try:
                ended += one.recv(1) == b""
            except ConnectionError:
                ended += 1
        assert ended == len(idle)
    finally:
        for one in idle:
            one.close()
    assert is_alive(server)


def test_a_body_that_trickles_is_given_up(server, monkeypatch):
    monkeypatch.setitem(serving.PATIENCE, "SEND_BODY", 0.5)
    known = f"Authorization: {server.bearer['authorization']}"
    for path in ("GET /", "POST /api/session"):
        began = time.monotonic()
        asked = head(server, path, known, "Content-Length: 1000")
        answer = raw(server, asked, b"a", seconds=8)
        assert time.monotonic() - began < 5
        assert status_of(answer) in (0, 200)
    assert is_alive(server)


@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "TRACE", "BREW"])
def test_other_methods_are_none(server, method):
    with server.client() as client:
        assert client.request(method, "/api/project").status_code in (400, 405)
    assert is_alive(server)


def test_connections_that_break_anywhere_are_no_fault_of_the_server(server, caplog):
    hello = encode_hello(Hello("4" * 32))
    with caplog.at_level(logging.ERROR, "uvicorn.error"):
        for frames in ([], [hello], [hello, begin()], [b"no message"], [hello, b""], ["text"]):
            for is_heard in (False, True):
                with knock(server, **server.bearer) as socket:
                    for frame in frames:
                        socket.send(frame)
                    if is_heard and frames:
                        socket.recv(timeout=10)
                    with contextlib.suppress(OSError):  # the server has closed it before
                        socket.socket.shutdown(2)
        for cut in (1, 20, 60):
            raw(server, head(server, "GET /api/mesh", "Connection: close")[:cut], seconds=0.05)
        assert is_alive(server)
    said = [one.getMessage() for one in caplog.records if one.name == "uvicorn.error"]
    assert said == []
