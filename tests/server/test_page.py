"""The painting page as people use it: keys, the export menu, leaving it and coming back."""

import numpy as np
import pytest

from meshsdf.io import probe_volume, read_mesh
from meshsdf.io.picture_bytes import decode_picture
from meshsdf.mesh.primitives import icosphere
from meshsdf.server.bundle import STATIC
from meshsdf.texture.journal import Project
from tests.server.browsing import opened
from tests.server.running import painted_ball, running

BLUE = [0.05, 0.1, 0.8]
SIZE = {"width": 1280, "height": 800}


@pytest.fixture
def folder(tmp_path):
    painted_ball(tmp_path / "ball.mtex", icosphere(1.0, subdivisions=3), resolution=64)
    return tmp_path


def test_what_was_painted_is_there_after_a_reload_and_a_restart(browser, folder):
    with running(folder, STATIC) as server, opened(browser, server.address, **SIZE) as page:
        empty = page.look()[2]
        page.set("tool", color=BLUE, radius=0.15)
        page.drag((-60, 0), (60, 20))
        page.settle()
        painted = page.look()[2]
        assert (np.abs(painted - empty).max(axis=1) > 50).sum() > 100
        page.page.reload()
        page.settle()
        page.set("view", lit=False)
        page.settle()
        np.testing.assert_array_equal(page.look()[2], painted)
    with running(folder, STATIC) as server, opened(browser, server.address, **SIZE) as page:
        np.testing.assert_array_equal(page.look()[2], painted)
        assert len(page.store()["state"]["history"]["done"]) == 2


def test_the_keyboard_chooses_tools_and_turns_time_back(browser, folder):
    with running(folder, STATIC) as server, opened(browser, server.address, **SIZE) as page:
        keys = page.page.keyboard
        before = page.look()[2]
        page.set("tool", color=BLUE)
        page.drag((-60, 0), (60, 20))
        page.settle()
        painted = page.look()[2]
        keys.press("Control+z")
        page.until("meshsdf.store.get().state.history.undone.length === 1")
        page.settle()
        np.testing.assert_array_equal(page.look()[2], before)
        keys.press("Control+Shift+z")
        page.until("meshsdf.store.get().state.history.undone.length === 0")
        page.settle()
        np.testing.assert_array_equal(page.look()[2], painted)
        radius = page.store()["tool"]["radius"]
        keys.press("]")
        assert page.store()["tool"]["radius"] > radius
        keys.press("e")
        assert page.store()["tool"]["kind"] == "erase"
        keys.press("b")
        assert page.store()["tool"]["kind"] == "paint"
        keys.press("?")
        assert page.page.locator("dialog[open]").count() == 1
        keys.press("e")  # nothing is heard while the dialog is open
        assert page.store()["tool"]["kind"] == "paint"
        keys.press("Escape")
        assert page.page.locator("dialog[open]").count() == 0


def test_every_row_of_the_export_menu_writes_what_it_says(browser, folder):
    with running(folder, STATIC) as server, opened(browser, server.address, **SIZE) as page:
        page.set("tool", color=BLUE)
        page.drag((-60, 0), (60, 20))
        page.settle()
        page.page.get_by_role("button", name="Export").first.click()
        rows = page.page.locator(".menu-row")
        suffixes = [
            f".{words.lower()}" for words in page.page.locator(".menu-key").all_inner_texts()
        ]
        for n in range(rows.count()):
            with page.page.expect_download(timeout=60_000) as found:
                rows.nth(n).click()
            assert found.value.suggested_filename.endswith(suffixes[n])
            page.until("!document.querySelector('.menu-row .spinner')")
    assert sorted(suffixes) == [".exr", ".glb", ".mtex", ".obj", ".ply", ".png", ".vdb"]
    for suffix in (".glb", ".ply", ".obj"):
        mesh = read_mesh(folder / f"ball{suffix}")
        assert mesh.vertex_colors is not None or mesh.materials[0].image is not None
    for suffix in (".png", ".exr"):
        data = (folder / f"ball{suffix}").read_bytes()
        assert has_both_colors(decode_picture(data, most_pixels=1 << 26))
    assert "Cd" in [grid["name"] for grid in probe_volume(folder / "ball.vdb")["grids"]]
    copy = next(path for path in folder.glob("ball*.mtex") if path.name != "ball.mtex")
    with Project.open(copy) as project:
        assert [step.name for step in project.history.steps] == ["add-layer", "stroke"]


def has_both_colors(texels):
    """Whether red and blue are in a picture."""
    red, blue = (texels[..., k] > 0.5 * texels.max() for k in (0, 2))
    return bool((red & ~blue).any() and (blue & ~red).any())
