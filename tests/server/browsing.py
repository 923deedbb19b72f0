"""The painting page in a real browser, without a display and without a graphics card."""

import contextlib
import json
import shutil
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from meshsdf.server.bundle import COMMAND
from meshsdf.server.static_page import has_page

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ARGUMENTS = [
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
    "--no-sandbox",
]  # fmt: skip
SECONDS = 60.0

# Sockets that a test may cut, and, if it wants one, a small limit of the graphics card
BEFORE = """
  window.sockets = [];
  const Plain = window.WebSocket;
  window.WebSocket = class extends Plain {
    constructor(...parts) { super(...parts); window.sockets.push(this); }
  };
  const most = %s;
  const ask = WebGL2RenderingContext.prototype.getParameter;
  WebGL2RenderingContext.prototype.getParameter = function (name) {
    return most && name === this.MAX_3D_TEXTURE_SIZE ? most : ask.call(this, name);
  };
"""

# Every few pixels, away from the rims: the point under it, the face's normal, what is drawn, where
LOOK = """(step) => {
  const { width, height, data } = meshsdf.viewer.pixels();
  const canvas = document.getElementById("canvas").getBoundingClientRect();
  const rows = [];
  for (let y = 2; y < height; y += step) {
    for (let x = 2; x < width; x += step) {
      const at = 4 * ((height - 1 - y) * width + x);
      if (data[at + 3] < 255) continue;
      const place = [canvas.left + ((x + 0.5) * canvas.width) / width,
        canvas.top + ((y + 0.5) * canvas.height) / height];
      const found = meshsdf.viewer.exactColor(...place);
      if (!found) continue;
      const pixel = [...data.subarray(at, at + 3), height - 1 - y, x];
      rows.push([...found.point, ...found.faceNormal, ...pixel]);
    }
  }
  return rows;
}"""

DRAWN = """() => {
  const gl = document.getElementById("canvas").getContext("webgl2");
  const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const data = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
  return [width, height, Array.from(data)];
}"""


NEXT_FRAMES = """() => new Promise((done) => {
  const next = requestAnimationFrame;
  next(() => next(() => next(done)));
})"""


class Painted:
    """A page that shows a model."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def ask(self, expression: str, argument: Any = None) -> Any:
        """The value of a piece of JavaScript."""
        return self.page.evaluate(expression, argument)

    def until(self, expression: str) -> None:
        """Wait until it is true."""
        end = time.monotonic() + SECONDS
        while not self.ask(expression):
            assert time.monotonic() < end, f"{expression}: {self.store()}"
            time.sleep(0.03)

    def store(self) -> dict[str, Any]:
        """What the page knows, but for the facts."""
        return json.loads(self.ask("JSON.stringify({...meshsdf.store.get(), facts: null})"))

    def set(self, key: str, **values: Any) -> None:
        """Change members of ``view`` or ``tool``."""
        known = self.ask("(key) => meshsdf.store.get()[key]", key)
        self.ask("(patch) => meshsdf.store.set(patch)", {key: known | values})

    def settle(self) -> None:
        """Wait until all is sent, shown and at rest."""
        self.until("window.meshsdf?.store.get().connection === 'open' && meshsdf.store.get().tool")
        self.until("meshsdf.store.get().unacked === 0")
        before: dict[str, int] = {}
        while (now := self.ask("meshsdf.viewer.stats()")) != before or now["isMoving"]:
            before = now
            time.sleep(0.6)  # longer than the page waits until it draws everything once more

    def draw_what_waits(self) -> None:
        """Until the page has drawn whatever it had been asked to by now."""
        self.ask(NEXT_FRAMES)

    @property
    def middle(self) -> tuple[float, float]:
        """Of the canvas, in the page's pixels."""
        box = self.page.locator("#canvas").bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def drag(self, *places: tuple[float, float], steps: int = 6, lifts: bool = True) -> None:
        """Press the left button at the first place, counted from the middle, and go on to all."""
        x, y = self.middle
        mouse = self.page.mouse
        mouse.move(x + places[0][0], y + places[0][1])
        mouse.down()
        for dx, dy in places[1:]:
            mouse.move(x + dx, y + dy, steps=steps)
        if lifts:
            mouse.up()

    def look(self, step: int = 5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points and face normals in the wire's coordinates, and bytes drawn there, unlit."""
        return self.look_at_pixels(step)[:3]

    def look_at_pixels(self, step: int = 5) -> tuple[np.ndarray, ...]:
        """The same, and which rows and columns of `drawn` these are."""
        rows = np.array(self.ask(LOOK, step))
        return rows[:, :3], rows[:, 3:6], rows[:, 6:9], rows[:, 9:].astype(int)

    def drawn(self) -> np.ndarray:
        """The canvas as it stands."""
        width, height, data = self.ask(DRAWN)
        return np.array(data, np.uint8).reshape(height, width, 4)


@contextlib.contextmanager
def browser_of_this_machine() -> Iterator[Any]:
    """A browser; the test is skipped where there is none, or no page to show."""
    playwright = pytest.importorskip("playwright.sync_api", reason="no Playwright")
    paths = [path for name in BROWSERS if (path := shutil.which(name))]
    if not paths:
        pytest.skip(f"none of {', '.join(BROWSERS)} is installed")
    if not has_page():
        pytest.skip(f"the page was not put together: {COMMAND}")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=paths[0], args=ARGUMENTS)
        yield browser
        browser.close()


@contextlib.contextmanager
def opened(
    browser: Any, address: str, *, most_3d: int = 0, width: int = 400, height: int = 360, **options
) -> Iterator[Painted]:
    """The page at an address, without a side panel; its complaints fail the test."""
    context = browser.new_context(viewport={"width": width, "height": height}, **options)
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.add_init_script(BEFORE % most_3d)
    page.goto(address)
    painted = Painted(page)
    painted.settle()
    painted.set("view", lit=False)
    painted.settle()
    yield painted
    context.close()
    assert not faults
