"""Heights in a real browser: painted by hand, they are shown as what the program says they are."""

import numpy as np
import pytest

from meshsdf.mesh.primitives import icosphere
from meshsdf.server.bundle import STATIC
from tests.server.browsing import Painted, opened
from tests.server.running import Running, painted_ball, running

LOW, EVEN, HIGH = (np.array(one) for one in ((0.17, 0.37, 0.66), (0.62,) * 3, (0.97, 0.69, 0.32)))
ROUNDING = 0.5  # of a pixel's byte
BLEND = 3 / 512  # of the range: the card's weights have 8 bits along each axis
PEN = {"radius": 0.1, "hardness": 0.2, "pressure_radius": False}


@pytest.fixture
def ball(tmp_path):
    painted_ball(tmp_path / "ball.mtex", icosphere(1.0, subdivisions=4), resolution=64)
    with running(tmp_path, STATIC) as server:
        yield server


@pytest.fixture
def painted(browser, ball):
    with shown(browser, ball) as found:
        yield found


def shown(browser, server: Running):
    return opened(browser, server.address, width=320, height=300)


def sculpt(painted: Painted, *places: tuple[float, float], **tool) -> None:
    """Paint heights from place to place."""
    if painted.store()["tool"]["channel"] != "height":
        painted.page.keyboard.press("t")
    painted.set("tool", **PEN | tool)
    painted.drag(*places)
    painted.page.mouse.move(2, 2)
    painted.settle()


def show(painted: Painted, **view) -> None:
    painted.set("view", **view)
    painted.settle()


def come_near(painted: Painted) -> None:
    """Until a pixel is smaller than a texel, so that only the finest level shows."""
    painted.page.mouse.move(*painted.middle)
    painted.page.mouse.wheel(0, -600)
    painted.page.mouse.move(2, 2)
    painted.settle()


def heights_at(server: Running, points, normals) -> np.ndarray:
    """Heights that the program's own lookup gives."""
    texture, origin = server.studio.texture, server.studio.origin
    return texture.colors(points + origin, normals, channel="height")[:, 0].astype(np.float64)


def on_the_map(heights: np.ndarray, reach: float) -> np.ndarray:
    """Bytes, as reals, of the colours that heights have."""
    share = np.clip(heights / reach, -1, 1)[:, None]
    return 255 * (EVEN + np.abs(share) * (np.where(share < 0, LOW, HIGH) - EVEN))


def check_map(painted: Painted, server: Running) -> np.ndarray:
    """Compare the map of heights with the program's; the heights."""
    show(painted, show="displacement", relief=False, lit=False)
    points, normals, drawn = painted.look()
    assert len(points) > 800
    reach = painted.store()["reach"]
    heights = heights_at(server, points, normals)
    assert np.abs(heights).max() <= reach * (1 + 1e-6)
    low, high = (on_the_map(heights + way * BLEND * reach, reach) for way in (-1, 1))
    assert (drawn >= np.minimum(low, high) - ROUNDING - 1e-3).all()
    assert (drawn <= np.maximum(low, high) + ROUNDING + 1e-3).all()
    return heights


def test_the_map_of_heights_is_what_the_program_says_and_leaves_the_rest_alone(painted, ball):
    come_near(painted)
    sculpt(painted, (-70, -50), (70, -65), amount=3)
    sculpt(painted, (-60, 20), (60, 25), amount=-5)
    heights = check_map(painted, ball)
    assert (heights > 2).sum() > 50
    assert (heights < -3).sum() > 50
    assert (heights == 0).sum() > 200
    assert painted.store()["reach"] == pytest.approx(5, abs=1e-3)
    with ball.client() as client:
        said = client.get("/api/digest").json()
    for name, key in (("base", "shown"), ("normal", "normal"), ("height", "height")):
        assert painted.ask("(name) => meshsdf.viewer.digest(name)", name) == said[key]


def test_relief_changes_the_light_where_it_was_painted_and_undo_takes_it_back(painted, ball):
    come_near(painted)
    show(painted, lit=True)
    points, normals, _, pixels = painted.look_at_pixels()
    before = painted.drawn()
    sculpt(painted, (-60, 20), (40, -10), amount=4)
    after = painted.drawn()
    touched = heights_at(ball, points, normals) != 0
    gap = np.linalg.norm(points[:, None] - points[touched][None], axis=2).min(axis=1)
    # Vertices move as means over a few texels say, and take their faces along
    away = gap > 8 * ball.studio.texture.octree.texel
    assert away.sum() > 200
    changed = np.abs(after[tuple(pixels.T)].astype(int) - before[tuple(pixels.T)]).max(axis=1)
    assert (changed[away] == 0).all()
    assert (changed[touched] > 12).sum() > 50

    show(painted, relief=False)
    np.testing.assert_array_equal(painted.drawn(), before)
    show(painted, relief=True)
    np.testing.assert_array_equal(painted.drawn(), after)
    painted.ask("meshsdf.session.undo()")
    painted.settle()
    np.testing.assert_array_equal(painted.drawn(), before)
    assert painted.store()["reach"] == 0


def test_a_bump_stands_out_at_the_rim_and_is_there_after_a_reload(painted, ball):
    sculpt(painted, (-20, 0), (20, 0), amount=5, radius=0.35, hardness=0)
    views = [look_from_the_side(painted, show="normal", relief=one) for one in (False, True)]
    flat, raised = (one[..., 3] == 255 for one in views)
    assert (flat & ~raised).sum() == 0
    assert 100 < (raised & ~flat).sum() < 0.2 * flat.sum()
    # What a pixel shows of the moved surface is what lies under it for a pointer
    points, normals, drawn = looked_at(painted, "displacement")
    wanted = on_the_map(heights_at(ball, points, normals), painted.store()["reach"])
    off = np.abs(drawn - wanted).max(axis=1)
    assert (np.abs(wanted - 255 * EVEN).max(axis=1) > 40).sum() > 100
    assert np.quantile(off, 0.95) < 6
    before = look_from_the_side(painted, show="color", relief=True)
    painted.page.reload()
    painted.settle()
    np.testing.assert_array_equal(look_from_the_side(painted, lit=False, relief=True), before)


def look_from_the_side(painted: Painted, **view) -> np.ndarray:
    painted.set("view", **view)
    painted.ask("meshsdf.viewer.resetView()")
    painted.settle()
    painted.ask("meshsdf.viewer.look('top')")
    painted.settle()
    painted.ask("meshsdf.viewer.pixels()")
    return painted.drawn()


def looked_at(painted: Painted, display: str):
    painted.ask("meshsdf.viewer.resetView()")
    show(painted, show=display, relief=True, lit=False)
    return painted.look()


def test_the_eraser_and_keys_work_on_heights_and_colours_are_put_away(painted, ball):
    colors = painted.page.locator("[data-card=color]")
    assert not colors.get_attribute("hidden")
    size = painted.store()["tool"]["radius"]
    sculpt(painted, (-40, 0), (40, 0), amount=2)
    assert colors.get_attribute("hidden") is not None
    painted.page.keyboard.press("x")
    assert painted.store()["tool"]["amount"] == -2
    show(painted, relief=False)  # what is drawn does not move, so that the way is the same
    painted.drag((-40, 0), (40, 0))
    painted.settle()
    assert painted.store()["reach"] < 0.25  # out and in is level
    painted.page.keyboard.press("x")
    painted.drag((-40, 0), (40, 0))
    painted.page.keyboard.press("e")
    painted.set("tool", radius=0.3, hardness=1)
    painted.drag((-40, 0), (40, 0))
    painted.settle()
    assert painted.store()["reach"] == 0
    painted.page.keyboard.press("t")
    assert painted.store()["tool"]["radius"] == size
    painted.page.keyboard.press("r")
    assert painted.store()["view"]["relief"]


def test_heights_everywhere_find_room_on_the_card(browser, tmp_path):
    painted_ball(tmp_path / "ball.mtex", icosphere(1.0, subdivisions=4), resolution=112)
    with running(tmp_path, STATIC) as server, shown(browser, server) as painted:
        first = painted.ask("meshsdf.viewer.stats()")
        assert first["heightRoom"] == 0  # nothing is there before something is painted
        sculpt(painted, (-60, -60), (60, 60), kind="gradient", amount=6)
        stats = painted.ask("meshsdf.viewer.stats()")
        assert stats["heightRoom"] > 784
        assert stats["residentHeights"] == stats["heights"] > 784
        come_near(painted)
        heights = check_map(painted, server)
        assert np.ptp(heights) > 1


def test_painted_normals_are_shown_as_far_as_they_cover_the_surface(painted, ball):
    come_near(painted)
    painted.set("tool", **PEN | {"channel": "normal", "color": [0.0, 0.6, 0.8], "hardness": 0.6})
    painted.drag((-50, 0), (50, -20))
    painted.page.mouse.move(2, 2)
    painted.settle()
    show(painted, show="normal")
    points, normals, drawn = painted.look()
    texture, origin = ball.studio.texture, ball.studio.origin
    found = texture.colors(points + origin, normals, channel="normal").astype(np.float64)
    center = np.asarray(texture.surface.vertices).mean(axis=0) - origin
    own = unit(points - center)
    share = found[:, 3:]
    assert (share > 0.99).sum() > 100
    wanted = unit((1 - share) * own + share * unit(found[:, :3]))
    # Eight bits on the wire, and a ball of some thousand faces
    assert np.abs(drawn - 127.5 * (1 + wanted)).max() < 5


def unit(vectors):
    """Vectors of length 1; 0 where there is none."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.maximum(length, 1e-30), 0.0)
