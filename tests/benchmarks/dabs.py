"""How many dabs a second does a brush paint?

python -m tests.benchmarks.dabs [MODEL] [--resolution N] [--refined] [--geodesic] [--cpu]

Strokes wander over the surface, one sample every quarter of a radius, and are painted in batches as
a pointer gives them; a dab is a sample with the band to the sample before. Brushes paint at the
finest texels (``detail``), with radii of 8, 25 and 50 of them. The time of ending the strokes (mips
of coarser levels) is given beside. Unless --refined, storing the bricks that are not yet stored is
part of the time. With --cpu the time is that of all cores together, which says more on a busy
machine. Before the clock starts the paint is checked against plain NumPy at all texels.
"""

import argparse
import time

import numpy as np

from meshsdf import read_mesh
from meshsdf.texture.brush import Brush
from meshsdf.texture.refine import refine_to
from meshsdf.texture.stroke import Stroke, paint
from meshsdf.texture.volume_texture import VolumeTexture

from ..models import model
from .alternate import machine

RADII = (8, 25, 50)  # texels
FLOORS = {8: 4000, 25: 1000, 50: 250}
STEP = 0.25  # radii between samples
RED = (1.0, 0.0, 0.0, 1.0)


def wander(texture: VolumeTexture, step: float, n: int, rng) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) points a step apart on the surface, nearly straight on, and the normals there."""
    mesh = texture.surface
    place = mesh.vertices[rng.integers(len(mesh.vertices))][None]
    heading = rng.normal(size=3)
    points, normals = np.empty((n, 3)), np.empty((n, 3))
    for i in range(n):
        point, normal = texture.on_surface(place)
        points[i], normals[i] = point[0], normal[0] / np.linalg.norm(normal[0])
        heading = heading + 0.1 * rng.normal(size=3)
        heading -= (heading @ normals[i]) * normals[i]
        heading /= np.linalg.norm(heading)
        place = point + step * heading
    return points, normals


def check(texture: VolumeTexture, brush: Brush, points: np.ndarray, normals: np.ndarray) -> None:
    """One dab against its definition at every texel."""
    layer = texture.add_layer("check")
    refine_to(texture, layer, 0)
    paint(texture, layer, brush, points[:1], normals[:1])
    entries = np.arange(texture.octree.level_first[1], dtype=np.int32)
    places, looks = texture.places(entries)
    seen = np.empty((0, 4), np.float32)
    for begin in range(0, len(entries), 4096):
        part = entries[begin : begin + 4096]
        slots = layer.slots[part]
        exists = np.unpackbits(
            texture.octree.tables.masks[part].view(np.uint8), axis=1, bitorder="little"
        ).astype(bool)
        texels = np.where(
            (slots >= 0)[:, None],
            texture.pool.arrays["base"][np.maximum(slots, 0)],
            texture.tiles.arrays["base"][np.maximum(-2 - slots, 0)][:, None],
        )
        seen = np.concatenate([seen, texture.channels["base"].decoded(texels[exists])])
    far = np.linalg.norm(places - points[0], axis=1) / brush.radius
    x = np.clip((far - brush.hardness) / (1 - brush.hardness), 0, 1)
    cosine = np.clip((looks @ normals[0] - brush.angle[0]) / np.ptp(brush.angle), 0, 1)
    cosine[(looks == 0).all(axis=1)] = 1
    want = (1 - x * x * (3 - 2 * x)) * cosine * cosine * (3 - 2 * cosine)
    assert np.abs(seen[:, 3] - want).max() < 1 / 255
    assert want.max() > 0.9
    texture.drop_layer(layer)


def rate(texture: VolumeTexture, brush: Brush, paths, asked) -> tuple[float, float]:
    """Dabs a second while painting, and with the ends of strokes counted in."""
    layer = texture.add_layer("paint", color=(1.0, 1.0, 1.0, 1.0))
    if asked.refined:
        refine_to(texture, layer, 0)
    clock = time.process_time if asked.cpu else time.perf_counter
    during = ending = 0.0
    n = 0
    for points, normals in paths:
        begin = clock()
        stroke = Stroke(texture, layer, brush)
        for first in range(0, len(points), asked.batch):
            part = slice(first, first + asked.batch)
            stroke.add(points[part], normals[part])
        middle = clock()
        stroke.end()
        during += middle - begin
        ending += clock() - middle
        n += len(points)
    texture.drop_layer(layer)
    return n / during, n / (during + ending)


def main() -> None:
    """One line per radius."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", nargs="?", default="armadillo.obj")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--strokes", type=int, default=8)
    parser.add_argument("--samples", type=int, default=128)
    parser.add_argument("--refined", action="store_true")
    parser.add_argument("--geodesic", action="store_true")
    parser.add_argument("--cpu", action="store_true")
    asked = parser.parse_args()
    texture = VolumeTexture.around(read_mesh(model(asked.model)), resolution=asked.resolution)
    texel = texture.octree.texel
    print(machine())
    print(f"{asked.model} at {asked.resolution}, {asked.batch} dabs a batch, {asked}")
    for radius in RADII:
        rng = np.random.default_rng(radius)
        brush = Brush(radius * texel, detail=texel, color=RED, geodesic=asked.geodesic)
        paths = [
            wander(texture, STEP * radius * texel, asked.samples, rng) for _ in range(asked.strokes)
        ]
        if not asked.geodesic:
            check(texture, brush, *paths[0])
        rate(texture, brush, paths[:1], asked)
        rates = [rate(texture, brush, paths, asked) for _ in range(3)]
        during, whole = np.median(rates, axis=0)
        print(
            f"radius {radius:3}: {during:8.0f} dabs/s, {whole:8.0f} with the ends of strokes; "
            f"floor {FLOORS[radius]}",
            flush=True,
        )


if __name__ == "__main__":
    main()
