"""The page's view in a real browser: what is drawn is what the program says, whatever happens."""

import time

import numpy as np
import pytest

from meshsdf.mesh.primitives import icosphere
from meshsdf.server.bundle import STATIC
from meshsdf.server.feed import Feed
from meshsdf.texture.journal import Project
from meshsdf.texture.operations import Operation
from tests.server.browsing import SECONDS, Painted, opened
from tests.server.running import Running, painted_ball, running

CLAY = np.array([0.40, 0.45, 0.52])  # what the page shows where nothing is painted
ROUNDING = 0.5  # of a pixel's byte
BLEND = 3 / 512  # linear: the card's weights have 8 bits along each axis
BLUE = [0.05, 0.1, 0.8]


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """A server of a red ball, which tests paint on one after another."""
    folder = tmp_path_factory.mktemp("ball")
    painted_ball(folder / "ball.mtex", icosphere(1.0, subdivisions=4), resolution=96)
    with running(folder, STATIC) as server:
        yield server


@pytest.fixture
def painted(browser, ball):
    with opened(browser, ball.address) as found:
        found.set("tool", color=BLUE, radius=0.12, pressure_radius=False)
        yield found


def expected(server: Running, points, normals) -> np.ndarray:
    """Linear colours that the program's own lookup gives, over clay."""
    rgba = server.studio.texture.colors(points + server.studio.origin, normals).astype(np.float64)
    return rgba[:, :3] * rgba[:, 3:] + (1 - rgba[:, 3:]) * CLAY


def encoded(linear: np.ndarray) -> np.ndarray:
    """Bytes of sRGB, as reals."""
    linear = np.clip(linear, 0, 1)
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def come_near(painted: Painted) -> None:
    """Until a pixel is smaller than a texel, so that only the finest level shows."""
    painted.page.mouse.move(*painted.middle)
    for _ in range(8):
        painted.page.mouse.wheel(0, -120)
    painted.settle()


def check_colours(painted: Painted, server: Running) -> int:
    """Compare all that is drawn with the program's colours; how many pixels were blue."""
    points, normals, drawn = painted.look()
    assert len(points) > 1000
    wanted = expected(server, points, normals)
    assert (drawn >= encoded(wanted - BLEND) - ROUNDING).all()
    assert (drawn <= encoded(wanted + BLEND) + ROUNDING).all()
    assert np.median(np.abs(drawn - encoded(wanted))) <= ROUNDING
    return int((wanted[:, 2] > 0.3).sum())


def test_every_pixel_shows_the_colour_of_the_point_under_it(painted, ball):
    painted.drag((-60, 20), (60, -10))
    painted.settle()
    come_near(painted)
    assert check_colours(painted, ball) > 100


def test_a_stroke_changes_what_it_should_and_nothing_else(painted, ball):
    painted.ask("meshsdf.viewer.look('back')")
    painted.settle()
    come_near(painted)
    points, normals, before = painted.look()
    old = encoded(expected(ball, points, normals))
    painted.drag((-100, 40), (90, 40))
    painted.settle()
    again, _, after = painted.look()
    np.testing.assert_array_equal(points, again)
    new = encoded(expected(ball, points, normals))
    should = np.abs(new - old).max(axis=1)
    did = np.abs(after - before).max(axis=1)
    assert (should > 50).sum() > 200
    assert (should == 0).sum() > 200
    assert (did[should == 0] == 0).all()
    assert (did[should > 2] > 0).all()

    painted.ask("meshsdf.session.undo()")
    painted.settle()
    np.testing.assert_array_equal(painted.look()[2], before)


def wait_for_bricks(server: Running) -> None:
    """Until pages show all bricks as the server has them: what is acknowledged may be painted
    later."""
    studio, end = server.studio, time.monotonic() + SECONDS

    def is_shown(feed: Feed) -> bool:
        return feed._complete_at == studio.bricks.revision and not feed._under_way

    while studio.live.n_waiting or not all(is_shown(one.feed) for one in studio._subscribers):
        assert time.monotonic() < end
        time.sleep(0.05)


def test_what_is_drawn_in_parts_is_what_is_drawn_at_once(painted, ball):
    painted.set("tool", radius=0.06)
    painted.settle()
    before = painted.ask("meshsdf.viewer.stats()")
    painted.drag((-40, 0), (0, 25), (40, 0), steps=12, lifts=False)
    painted.page.mouse.move(2, 2)  # the ring goes
    painted.until("meshsdf.store.get().unacked === 0")
    wait_for_bricks(ball)
    painted.until("!meshsdf.viewer.stats().isMoving")
    painted.draw_what_waits()
    parts = painted.drawn().astype(int)
    now = painted.ask("meshsdf.viewer.stats()")
    assert now["parts"] > before["parts"] + 1
    painted.page.mouse.up()
    painted.ask("meshsdf.viewer.pixels()")
    # At the rims, where a pixel covers many texels, parts leave something for a quiet moment
    assert (np.abs(painted.drawn() - parts).max(axis=2) > 2).mean() < 1e-3


def test_a_line_that_breaks_in_mid_stroke_loses_and_doubles_nothing(painted, ball):
    done = len(painted.store()["state"]["history"]["done"])
    painted.drag((-50, -60), (0, -60), lifts=False)
    painted.ask("sockets.at(-1).close()")
    painted.drag((0, -60), (50, -50))
    painted.until("sockets.length === 2")
    painted.settle()
    assert len(painted.store()["state"]["history"]["done"]) == done + 2
    come_near(painted)
    check_colours(painted, ball)


def test_two_pages_see_what_the_other_paints(painted, browser, ball):
    with opened(browser, ball.address) as other:
        other.set("tool", color=[0.1, 0.6, 0.1], radius=0.1)
        painted.drag((-40, -30), (40, -30), lifts=False)
        other.drag((30, -60), (-10, 60))
        painted.page.mouse.up()
        for page in (painted, other):
            page.settle()
            assert page.store()["state"]["painters"] == 2
        with ball.client() as client:
            shown = client.get("/api/digest").json()["shown"]
        assert painted.ask("meshsdf.viewer.digest()") == shown
        assert other.ask("meshsdf.viewer.digest()") == shown


def test_a_page_left_in_mid_stroke_ends_it_when_it_comes_back(painted, ball):
    done = len(painted.store()["state"]["history"]["done"])
    painted.drag((-50, 20), (50, 20), lifts=False)
    painted.page.reload()
    painted.settle()
    painted.until(f"meshsdf.store.get().state.history.done.length === {done + 1}")
    assert painted.store()["unacked"] == 0


def test_a_graphics_card_that_is_reset_shows_everything_again(painted, ball):
    come_near(painted)
    before = painted.look()[2]
    painted.ask(
        "window.loser = document.getElementById('canvas').getContext('webgl2')"
        ".getExtension('WEBGL_lose_context'), loser.loseContext()"
    )
    painted.page.wait_for_timeout(200)
    painted.ask("meshsdf.session.undo()")  # what comes meanwhile is not lost either
    painted.until("meshsdf.store.get().unacked === 0")
    painted.ask("loser.restoreContext()")
    painted.settle()
    check_colours(painted, ball)
    painted.ask("meshsdf.session.redo()")
    painted.settle()
    np.testing.assert_array_equal(painted.look()[2], before)


def test_what_finds_no_room_on_the_card_shows_coarser_until_one_comes_near(browser, tmp_path):
    painted_ball(tmp_path / "ball.mtex", icosphere(1.0, subdivisions=4), resolution=128)
    with Project.open(tmp_path / "ball.mtex") as project:
        clouds = {"layer": 0, "texture_kind": "clouds", "scale": 0.4}
        project.apply(Operation("bake", clouds))
    with running(tmp_path, STATIC) as server:
        address = server.address
        with opened(browser, address, most_3d=16) as painted:
            stats = painted.ask("meshsdf.viewer.stats()")
            assert stats["bricks"] > 1000 > stats["capacity"] == stats["resident"] == 784
            points, normals, drawn = painted.look()
            off = np.abs(drawn - encoded(expected(server, points, normals))).max(axis=1)
            assert np.quantile(off, 0.95) < 40  # blurred here and there, but the same picture
            for _ in range(2):
                come_near(painted)
            check_colours(painted, server)


def test_fingers_paint_turn_and_zoom(browser, ball):
    address = ball.address
    with opened(browser, address, has_touch=True) as painted:
        painted.set("tool", color=BLUE, radius=0.1)
        done = len(painted.store()["state"]["history"]["done"])
        link = painted.page.context.new_cdp_session(painted.page)
        x, y = painted.middle

        def touch(kind, *places):
            at = [{"x": x + dx, "y": y + dy, "id": n} for n, (dx, dy) in enumerate(places)]
            link.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})

        before = painted.ask("meshsdf.viewer.camera()")
        touch("touchStart", (-30, 0))
        for step in range(6):
            touch("touchMove", (-30 + 10 * step, 0))
        touch("touchEnd")
        painted.settle()
        assert painted.ask("meshsdf.viewer.camera()") == before
        assert len(painted.store()["state"]["history"]["done"]) == done + 1

        touch("touchStart", (-40, 0))
        touch("touchStart", (-40, 0), (40, 0))
        for step in range(6):
            touch("touchMove", (-40 - 8 * step, 0), (40 + 8 * step, 0))
        touch("touchEnd")
        painted.settle()
        after = painted.ask("meshsdf.viewer.camera()")
        distances = [
            np.linalg.norm(np.subtract(one["eye"], one["target"])) for one in (before, after)
        ]
        assert distances[1] == pytest.approx(distances[0] / 2, rel=0.05)
        assert len(painted.store()["state"]["history"]["done"]) == done + 1  # taken back


def test_alt_and_a_click_take_the_colour_that_is_seen(painted, ball):
    x, y = painted.middle
    painted.page.keyboard.down("Alt")
    painted.page.mouse.click(x + 20, y + 15)
    painted.page.keyboard.up("Alt")
    found = painted.ask("([x, y]) => meshsdf.viewer.exactColor(x, y)", [x + 20, y + 15])
    texture = ball.studio.texture
    point = np.array([found["point"]]) + ball.studio.origin
    color = texture.colors(point, np.array([found["faceNormal"]]))[0]
    np.testing.assert_allclose(painted.store()["tool"]["color"], color[:3], atol=2e-3)
