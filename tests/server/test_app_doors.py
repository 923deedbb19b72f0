"""The whole server's doors: who is let in, on HTTP and on the WebSocket."""

import json
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest
from websockets.exceptions import InvalidStatus

from meshsdf.server import serve
from meshsdf.server.messages import Hello, Type, decode, encode, encode_hello

from .running import cookie_of, knock, raw, running, status_of


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with running(tmp_path_factory.mktemp("served")) as running_server:
        yield running_server


def test_the_token_becomes_a_cookie_that_opens_everything(server):
    with server.page() as page:
        assert page.get("/api/project").json()["name"] == "ball"
    with httpx.Client(base_url=server.base) as stranger:
        answer = stranger.get("/api/project")
        assert answer.status_code == 401
        assert set(answer.json()) == {"what", "where", "fix"}


def test_a_wrong_token_is_refused_and_many_do_not_shut_out_the_right_one(server):
    own = {"origin": server.base}
    with httpx.Client(base_url=server.base, headers=own) as client:

        def tried(token):
            return client.post("/api/session", content=json.dumps({"token": token})).status_code

        for token in ("", "x" * 43, server.gate.key, 7, None, "é"):
            assert tried(token) == 403
        # On a slow machine it takes longer until there are too many a second
        assert 429 in (tried("guess") for _ in range(1000))
        assert "set-cookie" not in client.post("/api/session", json={"token": "x"}).headers
        right = client.post("/api/session", json={"token": server.gate.token})
        assert right.status_code == 204


@pytest.mark.parametrize(
    "given",
    [
        {"origin": "http://example.org"},
        {"origin": "null"},
        {"host": "rebound.example"},
        {"host": "[::1]"},
        {"sec-fetch-site": "cross-site"},
    ],
)
def test_requests_of_foreign_pages_are_refused_whatever_they_know(server, given):
    given = {k: f"{v}:{server.gate.port}" if k == "host" else v for k, v in given.items()}
    with server.client(**given) as client:
        for answer in (client.get("/api/project"), client.post("/api/exports", json={})):
            assert answer.status_code in (403, 421)
            assert "name" not in answer.json()


def test_a_preflight_gets_no_leave(server):
    asked = {"origin": "http://example.org", "access-control-request-method": "POST"}
    answer = httpx.options(server.base + "/api/exports", headers=asked)
    assert answer.status_code == 403
    assert "access-control-allow-origin" not in answer.headers


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"origin": "OWN"},
        {"cookie": "COOKIE"},
        {"cookie": "COOKIE", "origin": "http://example.org"},
        {"cookie": "COOKIE", "origin": "http://127.0.0.1:1"},
        {"cookie": "COOKIE", "origin": "null"},
        {"authorization": "Bearer wrong"},
        {"authorization": "TOKEN", "origin": "http://example.org"},
    ],
)
def test_a_socket_is_refused_before_it_is_one(server, given):
    known = {"OWN": server.base, "COOKIE": cookie_of(server), "TOKEN": server.bearer.popitem()[1]}
    with pytest.raises(InvalidStatus, match="403"):
        knock(server, **{name: known.get(value, value) for name, value in given.items()})


def test_a_socket_for_a_rebound_host_is_refused(server):
    for host in ("rebound.example", "[::1]"):
        upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        known = f"Cookie: {cookie_of(server)}\r\nSec-WebSocket-Key: {'A' * 22}==\r\n"
        where = f"Host: {host}:{server.gate.port}\r\nOrigin: http://{host}:{server.gate.port}\r\n"
        asked = f"GET /api/socket HTTP/1.1\r\n{where}{upgrade}{known}\r\n"
        assert status_of(raw(server, asked.encode())) == 403


def test_a_socket_opens_for_the_page_and_for_the_token(server):
    for given in ({"origin": server.base, "cookie": cookie_of(server)}, server.bearer):
        with knock(server, **given) as socket:
            socket.send(encode_hello(Hello("0" * 32)))
            assert decode(socket.recv(), downward=True).type is Type.WELCOME


def test_a_socket_stays_open_longer_than_requests_may_take(server, monkeypatch):
    monkeypatch.setattr(serve, "PATIENCE", {state: 0.3 for state in serve.PATIENCE})
    with knock(server, **server.bearer) as socket:
        socket.send(encode_hello(Hello("1" * 32)))
        assert decode(socket.recv(), downward=True).type is Type.WELCOME
        time.sleep(1.0)
        socket.send(encode(Type.UNDO, 1))
        while decode(socket.recv(timeout=5), downward=True).type not in (Type.ACK, Type.ERROR):
            pass


def test_short_messages_do_not_wait_for_the_other_side(server):
    with knock(server, **server.bearer) as page:
        page.send(encode_hello(Hello("2" * 32)))
        page.recv(timeout=10)
        (one,) = server.server.server_state.connections
        accepted = one.transport.get_extra_info("socket")
        assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_server_that_ends_while_much_waits_ends_soon_and_without_a_fault(
    tmp_path, monkeypatch, caplog
):
    monkeypatch.setattr(serve, "LAST_SECONDS", 0.3)
    gate = threading.Event()
    threading.Timer(2.0, gate.set).start()
    with (
        caplog.at_level("ERROR"),
        ThreadPoolExecutor(1) as pool,
        running(tmp_path) as ending,
        knock(ending, **ending.bearer) as page,
        ending.client() as client,
    ):
        page.send(encode_hello(Hello("1" * 32)))
        assert decode(page.recv(timeout=10), downward=True).type is Type.WELCOME
        ending.studio._thread.submit(gate.wait)
        for cseq in range(1, 40):
            page.send(encode(Type.UNDO, cseq))
        asked = pool.submit(client.get, "/api/digest")
        time.sleep(0.3)
        ending.server.should_exit = True
        assert asked.result(10).status_code == 503
    assert gate.is_set()  # what was begun is done
    assert not [one for one in caplog.records if one.exc_info or "ASGI" in one.getMessage()]
