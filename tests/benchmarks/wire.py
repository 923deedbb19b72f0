"""Do pages show what textures show, and what does it cost to tell them?

python -m tests.benchmarks.wire MESH... [--resolution 512] [--strokes 12]

Every mesh gets three layers of random strokes. Printed are: how many bricks there are and how many
bytes they take; how long making all of them takes, per brick; how far colours at 10^5 surface
points, looked up in the bricks as a page does, are from the texture's own (premultiplied, in sRGB,
in steps of 1/255): the worst where the page's sheets hold all corners, how many others there are,
and how many points of all are off by more than a step; and for dabs of 25 texels' radius, how
long finding and making the changed bricks takes beside painting them.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from meshsdf.io import read_mesh
from meshsdf.mesh import Mesh
from meshsdf.server.wire_bricks import WireBricks
from meshsdf.texture import Brush, Stroke, VolumeTexture
from tests.server.test_wire_bricks import errors
from tests.server.wire_examples import painted, surface_points, thin_plate

from .alternate import machine

N_POINTS = 100_000
RADIUS = 25  # texels


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("meshes", nargs="*", type=Path)
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--strokes", type=int, default=12)
    asked = parser.parse_args()
    print(machine())
    meshes = {path.stem: read_mesh(path) for path in asked.meshes}
    for name, mesh in {"thin plate": thin_plate(), **meshes}.items():
        rng = np.random.default_rng(0)
        texture = painted(
            mesh, rng, n_layers=3, n_strokes=asked.strokes, resolution=asked.resolution
        )
        wire = WireBricks(texture).pictures["base"]
        wire.payload(wire.present[:10])
        begin = time.perf_counter()
        payload = wire.payload(wire.present)
        seconds = time.perf_counter() - begin
        off, plain = errors(texture, mesh, rng, N_POINTS)
        print(
            f"{name}: {texture.octree.n_entries} entries, {len(wire.present)} bricks, "
            f"{len(payload) / 2**20:.1f} MiB, {1e6 * seconds / len(wire.present):.0f} us a brick; "
            f"off by {255 * off[plain].max():.2f} at most where sheets hold all corners, "
            f"{1e6 * (~plain).mean():.0f} ppm of points are elsewhere, "
            f"{1e6 * (off > 1 / 255).mean():.0f} ppm are off by more than 1, "
            f"{255 * off.max():.0f} at most"
        )
        told_beside_painted(texture, mesh, rng)


def told_beside_painted(texture: VolumeTexture, mesh: Mesh, rng: np.random.Generator) -> None:
    """Print how long a dab's bricks take beside the dab."""
    wire = WireBricks(texture)
    brush = Brush(RADIUS * texture.octree.texel, color=(1.0, 0.0, 0.0, 1.0))
    place, _ = surface_points(mesh, 1, rng)
    way = rng.normal(size=3) * texture.octree.texel
    paint, tell, n_bricks, n_bytes = [], [], 0, 0
    with Stroke(texture, texture.layers[-1], brush) as stroke:
        for step in range(60):
            points, normals = texture.on_surface(place + 3 * step * way)
            begin = time.perf_counter()
            stroke.add(points, normals)
            painted_at = time.perf_counter()
            changed = wire.update()["base"]
            n_bytes += len(wire.pictures["base"].payload(changed))
            tell.append(time.perf_counter() - painted_at)
            paint.append(painted_at - begin)
            n_bricks += len(changed)
    print(
        f"  a dab of {RADIUS} texels: {n_bricks / 60:.0f} bricks, {n_bytes / 60 / 2**10:.0f} KiB; "
        f"telling them takes {np.median(tell) / np.median(paint):.1f} times painting it "
        f"({1e3 * np.median(tell):.1f} ms)"
    )


if __name__ == "__main__":
    main()
