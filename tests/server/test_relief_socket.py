"""Strokes into heights and normals over real sockets: live, taken back, on all pages the same."""

import hashlib

import numpy as np
import pytest
from numpy.testing import assert_allclose

pytest.importorskip("starlette", reason="the extra paint is not installed")

from meshsdf.server.client import Painter
from meshsdf.texture import Brush, Project
from meshsdf.texture.live import LiveStrokes

from .serving import serving
from .test_socket import arc, made
from .wire_twin import page_colors, unpacked_bricks

EMPTY = hashlib.sha256().hexdigest()
POLE = np.array([[0.0, 0.0, 1.0]])
RAISED = Brush(0.2, channel="height", value=3.0, hardness=0.9)
TILTED = Brush(0.2, channel="normal", color=(0.0, 3.0, 4.0, 1.0), hardness=0.9)
RED = Brush(0.2, color=(1.0, 0.0, 0.0, 1.0))
STEP = 1 / 2048  # of a height in half precision, beside itself


@pytest.fixture
def served(tmp_path):
    """The address of a server, and its studio."""
    with serving(made(tmp_path)) as (address, studio):
        yield address, studio


def stroke(painter, brush, points=POLE):
    """A whole stroke."""
    painter.begin(0, brush)
    painter.dabs(points, points)
    painter.end()


def digests(painter):
    """The server's digests of all pictures, once the painter has these, too."""
    painter.catch_up()
    found = painter.get_json("/api/digest")
    for picture, wanted in (("base", "shown"), ("normal", "normal"), ("height", "height")):
        assert painter.digest(picture) == found[wanted]
    return found["shown"], found["normal"], found["height"]


def height_at_pole(served, painter):
    """The height that the texture has at the pole; the painter's bricks say the same."""
    texture = served[1].texture
    painter.catch_up()
    bricks = unpacked_bricks(painter.pictures["height"].items(), "height")
    slots = texture.layers[0].slots
    got, _ = page_colors(texture.octree, slots, bricks, POLE, POLE)
    wanted = float(texture.colors(POLE, POLE, channel="height")[0, 0])
    assert_allclose(np.nan_to_num(got[0, 0]), wanted, rtol=STEP, atol=1e-6)
    return wanted


def test_heights_are_painted_live_and_taken_back_to_the_byte(served):
    with Painter(served[0]) as painter, Painter(served[0]) as other:
        before = digests(painter)
        assert before[1:] == (EMPTY, EMPTY)
        painter.begin(0, RAISED)
        painter.dabs(POLE, POLE)
        assert height_at_pole(served, painter) == 3.0  # before the stroke ends
        painter.end()
        after = digests(painter)
        assert digests(other) == after
        assert after[1] == EMPTY != after[2]
        painter.undo()
        assert digests(painter) == digests(other) == before
        painter.redo()
        assert digests(painter) == after
        painter.begin(0, RAISED)
        painter.dabs(-POLE, -POLE)
        assert digests(painter) != after
        painter.cancel()
        assert digests(painter) == digests(other) == after


def test_normals_are_painted_live_and_taken_back(served):
    with Painter(served[0]) as painter:
        before = digests(painter)
        stroke(painter, TILTED)
        after = digests(painter)
        assert after[1] != EMPTY == after[2]
        texture = served[1].texture
        normal = texture.colors(POLE, POLE, channel="normal")
        assert_allclose(normal, [[0.0, 0.6, 0.8, 1.0]], atol=1e-4)
        painter.undo()
        assert digests(painter) == before


@pytest.mark.parametrize(
    ("more", "wanted"),
    [
        ({"value": 5.0}, 5.0),
        ({"value": 5.0, "opacity": 0.25}, 3.5),
        ({"value": 1.5, "blend": "add"}, 4.5),
        ({"value": -4.0, "blend": "add"}, -1.0),
        ({"value": 1.0, "blend": "add", "opacity": 0.5}, 3.5),
        ({"value": 1.0, "blend": "subtract"}, 2.0),
        ({"value": 4.0, "blend": "subtract"}, 0.0),
        ({"kind": "erase"}, 0.0),
        ({"kind": "erase", "opacity": 0.25}, 2.25),
    ],
)
def test_a_stroke_over_heights_does_what_the_protocol_says(served, more, wanted):
    with Painter(served[0]) as painter:
        stroke(painter, RAISED)
        own = Brush(**({"radius": 0.2, "channel": "height", "hardness": 0.9} | more))
        painter.begin(0, own)
        for _ in range(3):  # passing over a place again adds nothing within one stroke
            painter.dabs(POLE, POLE)
        painter.end()
        assert_allclose(height_at_pole(served, painter), wanted, atol=2e-3)


def test_all_pictures_survive_breaks_and_restarts(tmp_path):
    def paint_all(painter, drops):
        for turn, brush in enumerate([RAISED, RED, TILTED, RAISED, RED, TILTED]):
            painter.begin(0, brush)
            for part in np.array_split(arc(turn), 4):
                painter.dabs(part, part)
                if drops:
                    painter.drop()
            painter.end()
        return digests(painter)

    (tmp_path / "calm").mkdir()
    with serving(made(tmp_path / "calm")) as (address, _), Painter(address) as painter:
        wanted = paint_all(painter, drops=False)
    with serving(made(tmp_path)) as (address, _), Painter(address) as painter:
        assert paint_all(painter, drops=True) == wanted
        assert painter.n_connections > 1
        assert all(map(len, painter.pictures.values()))
    with Project.open(tmp_path / "a.mtex") as project:
        assert project.history.names == ["add-layer"] + 6 * ["stroke"]
    with serving(LiveStrokes.open(tmp_path / "a.mtex")) as (address, _), Painter(address) as new:
        assert digests(new) == wanted


def test_a_painter_that_comes_back_is_told_only_what_is_newer(served):
    with Painter(served[0]) as painter:
        stroke(painter, RAISED)
        stroke(painter, RED)
        digests(painter)
        n_records = []
        take = painter._take

        def counted(socket, message):
            if isinstance(message.body, bytes):
                n_records.append(int.from_bytes(message.body[:4], "little"))
            take(socket, message)

        painter._take = counted
        painter.drop()
        painter._wait_for(lambda: painter.n_connections == 2 and n_records, "the way back")
        assert sum(n_records) == 0
        stroke(painter, RAISED, -POLE)
        digests(painter)
        n_held = sum(map(len, painter.pictures.values()))
        assert 0 < sum(n_records) < n_held
