"""meshsdf.server.socket and client: painters over real sockets, and what is never lost."""

import contextlib
import sqlite3
import struct
import sys
import time

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra paint is not installed")

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from meshsdf.errors import ServerError
from meshsdf.mesh import icosphere
from meshsdf.server.client import Painter
from meshsdf.server.messages import Hello, Type, decode, encode, encode_hello
from meshsdf.texture import Brush, Operation, Project
from meshsdf.texture.live import LiveStrokes

from .serving import serving
from .wire_examples import frame, good_frames

RED = Brush(0.1, color=(1.0, 0.0, 0.0, 1.0))
CLIENT = "0123456789abcdef" * 2


def made(folder, name="a.mtex"):
    """Strokes on a new project of one grey layer."""
    project = Project.create(folder / name, icosphere(subdivisions=3), resolution=64)
    project.apply(Operation("add-layer", {"color": [0.5, 0.5, 0.5]}))
    return LiveStrokes(project)


def arc(turn, n=12):
    """n points on the unit sphere along an arc."""
    angle = np.linspace(0, 1, n)
    way = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    c, s = np.cos(turn), np.sin(turn)
    return way @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def draw(painter, turn, *, batches=3, brush=RED):
    """One stroke, in batches."""
    painter.begin(0, brush)
    for part in np.array_split(arc(turn), batches):
        painter.dabs(part, part)
    return painter.end()


def reopened(folder, name="a.mtex"):
    """The digest of the project's file, and its steps."""
    with Project.open(folder / name) as project:
        return project.digest(), project.history.names


@pytest.fixture
def served(tmp_path):
    """The address of a server, and its studio."""
    with serving(made(tmp_path)) as (address, studio):
        yield address, studio


def test_a_stroke_is_painted_kept_and_shown(tmp_path):
    with serving(made(tmp_path)) as (address, _), Painter(address) as painter:
        sent = draw(painter, 0.3)
        painter.wait()
        assert painter.number(sent) == 2
        shown = painter.catch_up()
        assert shown == painter.digest() == painter.get_json("/api/digest")["shown"]
        project = painter.get_json("/api/digest")["project"]
        steps = painter.state["history"]["done"]
        assert [step["name"] for step in steps] == ["add-layer", "stroke"]
        assert steps[1]["client"] == painter.client
        assert painter.state["painters"] == 1
    assert reopened(tmp_path) == (project, ["add-layer", "stroke"])


def test_steps_are_taken_back_and_done_again(served):
    with Painter(served[0]) as painter:
        before = painter.catch_up()
        draw(painter, 0.3)
        after = painter.catch_up()
        painter.undo()
        assert painter.catch_up() == before != after
        painter.redo()
        assert painter.catch_up() == after
        painter.begin(0, RED)
        painter.dabs(arc(1.0), arc(1.0))
        assert painter.catch_up() != after  # a stroke is seen before it ends
        painter.cancel()
        assert painter.catch_up() == after


def test_an_operation_replaces_only_the_clients_own_newest_step_of_its_kind(served):
    def fill(painter, red, **more):
        painter.operation("fill-color", layer=0, color=[red, 0.0, 0.0], **more)
        painter.catch_up()
        return [step["name"] for step in painter.state["history"]["done"]]

    with Painter(served[0]) as one, Painter(served[0]) as other:
        assert fill(one, 0.1, replaces=True) == ["add-layer", "fill-color"]
        assert fill(one, 0.2, replaces=True) == ["add-layer", "fill-color"]
        assert fill(other, 0.3, replaces=True)[1:] == 2 * ["fill-color"]
        assert fill(one, 0.4, replaces=True)[1:] == 3 * ["fill-color"]
        assert fill(one, 0.5)[1:] == 4 * ["fill-color"]
        one.operation("fill-color", layer=7, color=[1.0, 1.0, 1.0], replaces=True)
        with pytest.raises(ServerError, match="there is no layer 7"):
            one.wait()
        assert len(one.state["history"]["done"]) == 5
        assert one.state["history"]["undone"] == []


def test_two_painters_at_once_see_the_same(tmp_path):
    with serving(made(tmp_path)) as (address, _), Painter(address) as one, Painter(address) as two:
        for turn in range(3):
            for painter, more in ((one, 0.0), (two, 0.5)):
                painter.begin(0, RED)
                part = arc(turn + more)
                painter.dabs(part, part)
            one.end()
            two.end()
        one.wait()
        two.wait()
        assert one.catch_up() == two.catch_up()
        digest = one.get_json("/api/digest")["project"]
    assert reopened(tmp_path) == (digest, ["add-layer"] + 6 * ["stroke"])


def test_nothing_is_lost_or_doubled_when_connections_break(tmp_path):
    with serving(made(tmp_path, "calm.mtex")) as (address, _), Painter(address) as painter:
        for turn in range(6):
            draw(painter, turn, batches=6)
        wanted = painter.catch_up()
    with serving(made(tmp_path)) as (address, _), Painter(address) as painter:
        for turn in range(6):
            painter.begin(0, RED)
            for part in np.array_split(arc(turn), 6):
                painter.dabs(part, part)
                painter.drop()
                time.sleep(0.03)  # sometimes it is back by the next batch, sometimes not
            painter.end()
        assert painter.catch_up() == wanted
        assert painter.n_connections > 6
    assert reopened(tmp_path) == reopened(tmp_path, "calm.mtex")


def test_what_is_acknowledged_is_on_the_disk(tmp_path):
    with serving(made(tmp_path)) as (address, _), Painter(address) as painter:
        file = sqlite3.connect(tmp_path / "a.mtex")

        def count(table):
            return file.execute(f"SELECT count(*) FROM {table}").fetchone()[0]

        painter.begin(0, RED)
        painter.wait()
        for n, part in enumerate(np.array_split(arc(0.0), 6)):
            painter.dabs(part, part)
            painter.wait()
            assert count("pending") == n + 2
            assert count("op") == 1
        painter.end()
        painter.wait()
        assert (count("pending"), count("op")) == (0, 2)
        file.close()


def test_a_stroke_goes_on_after_the_server_died_and_ends_when_its_painter_stays_away(tmp_path):
    live = made(tmp_path)
    live.begin(CLIENT, 1, 0, RED)
    live.add(CLIENT, 2, arc(0.0), arc(0.0))
    # The project is closed with the stroke open, as a killed server leaves it
    live.project.close()
    with serving(LiveStrokes.open(tmp_path / "a.mtex"), patience=0.3) as (address, studio):
        with Painter(address, client=CLIENT) as painter:
            time.sleep(0.5)
            part = arc(0.5)
            painter.dabs(part, part)
            painter.wait()
            assert painter.state["history"]["done"][-1]["name"] == "add-layer"
        until = time.monotonic() + 10
        while studio.state["seq"] == 1 and time.monotonic() < until:
            time.sleep(0.02)
        assert [step["name"] for step in studio.state["history"]["done"]] == ["add-layer", "stroke"]


def test_a_refused_message_says_why_and_does_nothing_else(served):
    with Painter(served[0]) as painter:
        before = painter.catch_up()
        for send, words in [
            (lambda: painter.begin(5, RED), "there is no layer 5"),
            (lambda: painter.dabs(arc(0.0), arc(0.0)), "no stroke open"),
            (lambda: painter.operation("stroke", layer=0), "pages may not do that"),
            (lambda: painter.operation("fill-color", layer=0, color="red"), "no sense|colou?r"),
            (lambda: painter.operation("fill-color", layer=[], color=[1, 1, 1]), "layer cannot be"),
            (lambda: painter.operation("add-layer", name=5), "name"),
            (lambda: painter.operation("bake", layer=0, texture_kind="nothing"), "nothing"),
            (
                lambda: painter.operation("bake", layer=0, texture_kind="checker", level="a"),
                "level",
            ),
            (lambda: painter.operation("coarsen", layer=0, tolerance="x"), "sense|tolerance"),
            (lambda: painter.operation("project", layer=0, image="none"), "picture"),
            (lambda: painter.operation("layer", layer=0, opacity=7), "opacity cannot be"),
            (lambda: painter.operation("layer", layer=0, mode="none"), "mode|none"),
            (painter.redo, "nothing to redo"),
        ]:
            send()
            with pytest.raises(ServerError, match=words):
                painter.wait()
        assert painter.catch_up() == before
        draw(painter, 0.0)
        assert painter.catch_up() != before


def test_a_brush_that_is_none_is_refused(served):
    with Painter(served[0]) as painter:
        for wrong in ({}, {"radius": -1}, {"radius": "x"}, {"radius": 0.1, "kind": ["paint"]},
                      {"radius": 0.1, "stamp": 5}, {"radius": 0.1, "symmetry": {"a": 1}},
                      {"radius": 0.1, "color": [[1]]}, {"radius": 0.1, "no": 1}):  # fmt: skip
            painter._post(Type.STROKE_BEGIN, {"layer": 0, "brush": wrong})
            with pytest.raises(ServerError):
                painter.wait()


def raw(address):
    """A bare connection."""
    base = address.split("/#")[0]
    return connect("ws" + base.removeprefix("http") + "/api/socket", compression=None, proxy=None)


@contextlib.contextmanager
def greeted(address, client=CLIENT):
    """A bare connection that is past its greeting."""
    with raw(address) as socket:
        assert hello(socket, client).type is Type.WELCOME
        yield socket


def hello(socket, client=CLIENT):
    """Greet; the answer."""
    socket.send(encode_hello(Hello(client)))
    return decode(socket.recv(timeout=10), downward=True)


def closed(socket):
    """The code it was closed with, after the error that was told, if one was."""
    told = None
    while True:
        try:
            message = decode(socket.recv(timeout=10), downward=True)
            told = message.body if message.type is Type.ERROR else told
        except ConnectionClosed as end:
            return end.rcvd.code, told


@pytest.mark.parametrize("number", range(7))
def test_a_frame_that_is_none_closes_that_socket_alone(served, number):
    bad = [
        b"", b"\x05" * 40, frame(5), frame(3, bytes(19), seq=1), frame(99, seq=1),
        frame(7, b"{", seq=1), frame(3, struct.pack("<3f", np.nan, 0, 0) + bytes(8), seq=1),
    ]  # fmt: skip
    with Painter(served[0]) as painter:
        with greeted(served[0]) as socket:
            socket.send(bad[number])
            code, told = closed(socket)
        assert code == 1008
        assert {"what", "where", "fix", "cseq"} == set(told)
        draw(painter, 0.0)
        painter.catch_up()


def test_the_first_frame_is_a_greeting_and_no_other_is(served):
    with raw(served[0]) as socket:
        socket.send(frame(5, seq=1))
        assert closed(socket)[0] == 1008
    for second in (encode_hello(Hello(CLIENT)), "words"):
        with greeted(served[0]) as socket:
            socket.send(second)
            assert closed(socket)[0] == 1008


def test_too_large_a_frame_closes_with_its_own_number(served):
    with greeted(served[0]) as socket:
        with contextlib.suppress(ConnectionClosed):
            socket.send(bytes(2**20 + 1))
        assert closed(socket)[0] == 1009


def test_a_second_connection_takes_the_place_of_the_first(served):
    with greeted(served[0]) as first, greeted(served[0]) as second:
        assert closed(first)[0] == 4001
        second.send(frame(5, seq=1))
        while decode(second.recv(timeout=10), downward=True).seq != 1:
            pass


def test_known_numbers_are_acknowledged_again_and_not_done(served):
    add = b'{"kind":"add-layer","params":{"name":"once"}}'
    answers = []
    with greeted(served[0]) as socket:
        for _ in range(3):
            socket.send(frame(7, add, seq=1))
        while len(answers) < 3:
            message = decode(socket.recv(timeout=10), downward=True)
            if message.type is Type.ACK:
                answers.append((message.seq, message.body))
    assert answers == 3 * [(1, 2)]
    with raw(served[0]) as again:
        welcome = hello(again).body
        assert welcome["cseq"] == 1
        assert [layer["name"] for layer in welcome["state"]["layers"]].count("once") == 1


def test_a_refused_number_is_refused_again_even_after_later_ones_were_done(served):
    def answer(socket, cseq):
        while True:
            message = decode(socket.recv(timeout=10), downward=True)
            if message.seq == cseq and message.type in (Type.ACK, Type.ERROR):
                return message.type

    wrong = frame(7, b'{"kind":"drop-layer","params":{"layer":9}}', seq=1)
    right = frame(7, b'{"kind":"add-layer","params":{}}', seq=2)
    with greeted(served[0]) as socket:
        socket.send(wrong)
        socket.send(right)
        assert [answer(socket, 1), answer(socket, 2)] == [Type.ERROR, Type.ACK]
    with greeted(served[0]) as socket:
        socket.send(wrong)
        assert answer(socket, 1) == Type.ERROR


def test_a_page_that_reads_nothing_does_not_hold_others_up(served):
    view = encode(Type.VIEW, 0, struct.pack("<6f", 0, 0, 5, 0, 0, 1))
    with greeted(served[0]) as deaf, Painter(served[0]) as painter:
        for turn in range(10):
            draw(painter, turn)
            deaf.send(view)
        painter.catch_up()


def test_altered_frames_in_the_middle_of_a_session_do_not_stop_the_server(served):
    rng = np.random.default_rng(0)
    good = good_frames()
    for number in range(40):
        with greeted(served[0], client=f"{number:032x}") as socket:
            for cseq in range(1, 6):
                one = good[int(rng.integers(1, 10))]
                payload = bytearray(one[16:])
                if payload and rng.random() < 0.5:
                    payload[int(rng.integers(len(payload)))] = int(rng.integers(256))
                with contextlib.suppress(ConnectionClosed):
                    socket.send(frame(one[0], bytes(payload), seq=cseq))
    with Painter(served[0]) as painter:
        end = time.monotonic() + 60
        while painter.state["painters"] > 1:  # what the others sent before they went comes first
            assert time.monotonic() < end
            time.sleep(0.02)
        painter.operation("add-layer", name="after all")
        painter.catch_up()
        assert painter.state["layers"][-1]["name"] == "after all"


def test_without_websockets_a_painter_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "websockets.sync.client", None)
    with pytest.raises(ServerError, match=r"pip install '.\[paint\]'"):
        Painter("http://127.0.0.1:9/#t=x")


def test_a_painter_says_what_is_wrong():
    with pytest.raises(ServerError, match="the server does not answer"):
        Painter("http://127.0.0.1:9/#t=x", patience=1)
