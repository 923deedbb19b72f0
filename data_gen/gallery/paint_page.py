"""Draw the README's picture of the painting page: a teapot, painted by a script.

Usage: python data_gen/gallery/paint_page.py TEAPOT --out FILE

TEAPOT is the Utah teapot as an OBJ file, y up, which is not part of the project. Wants Chromium and
Playwright.
"""

import argparse
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from playwright.sync_api import sync_playwright

from meshsdf import read_mesh
from meshsdf.mesh import Mesh
from meshsdf.server.client import Painter
from meshsdf.spatial import ClosestPoint
from meshsdf.texture.brush import Brush

SIZE = {"width": 1280, "height": 800}
GLAZE = [0.86, 0.84, 0.76, 1.0]
BLUE, DEEP, GOLD = (0.03, 0.10, 0.42, 1.0), (0.01, 0.03, 0.16, 1.0), (0.60, 0.30, 0.05, 1.0)
ARGUMENTS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
TURN = 2 * np.pi


class Decorator:
    """Strokes along curves that are laid onto the surface."""

    def __init__(self, painter: Painter, mesh: Mesh) -> None:
        self.painter, self.mesh, self.closest = painter, mesh, ClosestPoint(mesh)
        edges = mesh.triangles[:, 1:] - mesh.triangles[:, :1]
        self.normals = np.cross(edges[:, 0], edges[:, 1])

    def stroke(self, layer: int, brush: Brush, curve: np.ndarray) -> None:
        """One stroke along a curve (n, 3) near the surface."""
        found = self.closest(curve)
        self.painter.begin(layer, brush)
        self.painter.dabs(found.point, self.normals[found.face_index])
        self.painter.end()

    def ring(self, layer: int, brush: Brush, height: float, radius: float) -> None:
        """A stroke around the axis."""
        angle = np.linspace(0, TURN, 240)
        level = np.full_like(angle, height)
        at = np.column_stack([radius * np.cos(angle), level, radius * np.sin(angle)])
        self.stroke(layer, brush, at)

    def flower(self, layer: int, angle: float, height: float, size: float) -> None:
        """Six petals, and a middle."""
        across = np.array([-np.sin(angle), 0.0, np.cos(angle)])
        middle = 2.0 * np.array([np.cos(angle), 0.0, np.sin(angle)]) + [0.0, height, 0.0]
        for turn in np.arange(6) / 6 * TURN:
            way = np.cos(turn) * across + np.array([0.0, np.sin(turn), 0.0])
            reach = np.linspace(0.35, 1.0, 12)[:, None] * size
            self.stroke(layer, Brush(0.22 * size, color=BLUE, hardness=0.7), middle + reach * way)
        self.stroke(layer, Brush(0.3 * size, color=GOLD, hardness=0.8), middle[None])


def decorate(painter: Painter, mesh: Mesh) -> None:
    """Glaze, rings, flowers and raised dots."""
    for name, color in (("glaze", GLAZE), ("ornament", None), ("beads", None)):
        painter.operation("add-layer", name=name, **({"color": color} if color else {}))
    painter.catch_up()
    ornament, beads = (layer["number"] for layer in painter.state["layers"][-2:])
    hand = Decorator(painter, mesh)
    for height, radius, width, color in (
        (0.12, 1.6, 0.07, DEEP), (0.45, 2.0, 0.03, BLUE), (1.95, 1.8, 0.03, BLUE),
        (2.12, 1.7, 0.07, DEEP), (2.33, 1.5, 0.05, GOLD),
    ):  # fmt: skip
        hand.ring(ornament, Brush(width, color=color, hardness=0.9), height, radius)
    for number in range(10):
        hand.flower(ornament, number / 10 * TURN, 1.2, 0.42)
    for number in range(40):
        angle = number / 40 * TURN
        at = np.array([[1.95 * np.cos(angle), 0.62, 1.95 * np.sin(angle)]])
        bead = {"radius": 0.06, "hardness": 0.1}
        hand.stroke(beads, Brush(channel="height", value=3.0, **bead), at)
        hand.stroke(beads, Brush(color=GOLD, **bead), at)
    painter.catch_up()


def photograph(address: str, path: Path) -> None:
    """The page as a browser shows it once all is there."""
    found = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=found, args=ARGUMENTS)
        page = browser.new_page(viewport=SIZE)
        page.goto(address)
        page.wait_for_timeout(8000)
        page.evaluate("meshsdf.viewer.look('front')")
        page.wait_for_timeout(3000)
        page.mouse.move(465, 405)
        page.mouse.down(button="right")
        page.mouse.up(button="right")
        page.wait_for_timeout(12000)
        page.screenshot(path=path)
        browser.close()


def main() -> None:
    """Paint, and draw the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("teapot", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        project = str(Path(folder) / "teapot.mtex")
        command = [sys.executable, "-m", "meshsdf", "paint", str(options.teapot)]
        command += ["--project", project, "--port", "0"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            try:
                address = re.search(r"http://\S+", server.stdout.readline())[0]
                with Painter(address) as painter:
                    decorate(painter, read_mesh(options.teapot))
                photograph(address, options.out)
            finally:
                server.send_signal(signal.SIGTERM)


if __name__ == "__main__":
    main()
