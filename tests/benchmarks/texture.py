"""How many texture lookups a second, in the order of a picture, of a bake, and in none?

python -m tests.benchmarks.texture [RESOLUTION ...]

Points lie on armadillo's surface. "picture": in rows of pixels as an orthographic camera sees them,
front, then back; "faces": face by face, as a bake into an atlas asks for them; "random": shuffled.
Beside the trilinear and nearest lookups of one thread and of all, a gather of eight rows per point
by numpy, which does less (no search, no weights but sums). Before the clock counts, the answers
must be the baked function's, to the rounding of texels and the curvature of the function.
"""

import sys
import time

import numpy as np

from meshsdf import read_mesh
from meshsdf.kernels import parallel
from meshsdf.mesh.sampling import SurfacePoints, sample_surface
from meshsdf.texture.lookup import look_up
from meshsdf.texture.mip import bake
from meshsdf.texture.volume_texture import VolumeTexture

from .alternate import alternate, machine, median, models

N_POINTS = 1_000_000
REPEATS = 7


def orders(on: SurfacePoints, pixel: float) -> dict[str, np.ndarray]:
    """Permutations of points by the name of their order."""
    column, row, depth = (np.floor(on.points / pixel).T)[:3]
    return {
        "picture": np.lexsort((column, row, depth > np.median(depth))),
        "faces": np.argsort(on.face_index, kind="stable"),
        "random": np.random.default_rng(0).permutation(len(on.points)),
    }


def main(resolutions: list[str]) -> None:
    """Print rates, and times for building and baking."""
    mesh = read_mesh(models() / "armadillo.obj")
    print(machine())
    wave = 30 / mesh.box.longest_side

    def function(points: np.ndarray) -> np.ndarray:
        colors = np.ones((len(points), 4))
        colors[:, :3] = 0.5 + 0.4 * np.sin(wave * points)
        return colors

    for resolution in resolutions:
        begin = time.perf_counter()
        texture = VolumeTexture.around(mesh, resolution=int(resolution))
        built = time.perf_counter()
        layer = texture.add_layer()
        bake(texture, layer, function)
        baked = time.perf_counter()
        n_texels = texture.octree.n_texels(0)
        print(f"{resolution}: {texture.octree.n_entries} bricks, {n_texels} finest texels")
        print(f"       octree {built - begin:.2f} s, bake {baked - built:.2f} s (compilation in)")
        on = sample_surface(mesh, N_POINTS)
        spacing = texture.octree.texel
        apart = np.abs(texture.colors(on.points, on.normals) - function(on.points)).max()
        # Half a step of sRGB, and the curvature of the sine between texels
        allowed = 0.5 * 2.4 / 1.055 / 255 + 3 * 0.4 * (wave * spacing) ** 2 / 8
        assert apart <= allowed + 1e-6, (apart, allowed)
        for name, order in orders(on, spacing).items():
            measure(texture, layer, name, np.ascontiguousarray(on.points[order]), on.normals[order])


def measure(texture, layer, name: str, points: np.ndarray, normals: np.ndarray) -> None:
    """Print the rates of one order."""
    pool, tiles = texture.pool.arrays["base"], texture.tiles.arrays["base"]
    kind = texture.channels["base"].kind
    rows = np.linspace(0, len(pool) * 512 - 9, len(points)).astype(np.int64)
    flat = np.zeros((pool.size, 4), np.float32)
    out = np.empty((len(points), 4), np.float32)
    n_threads, wide = parallel.n_threads, 3 * texture.octree.texel

    def lookups(threads: int, interpolate: bool, footprint: float) -> float:
        parallel.n_threads = lambda: threads
        begin = time.perf_counter()
        look_up(
            texture.octree, layer.slots, pool, tiles, kind, points, normals, footprint,
            interpolate=interpolate, out=out,
        )  # fmt: skip
        parallel.n_threads = n_threads
        return time.perf_counter() - begin

    def gather() -> float:
        begin = time.perf_counter()
        sum(flat[rows + step] for step in (0, 1, 2, 3, 4, 5, 6, 7))
        return time.perf_counter() - begin

    runs = {"numpy gather, 1 thread": gather}
    for threads in sorted({1, n_threads()}):
        some = f"{threads} thread{'s' * (threads > 1)}"
        runs[f"trilinear, {some}"] = lambda threads=threads: lookups(threads, True, 0.0)
        runs[f"two levels, {some}"] = lambda threads=threads: lookups(threads, True, wide)
        runs[f"nearest, {some}"] = lambda threads=threads: lookups(threads, False, 0.0)
    for run in runs.values():
        run()
    print(f"    {name}")
    for what, seconds in alternate(runs, REPEATS).items():
        best, middle = (len(points) / s / 1e6 for s in (min(seconds), median(seconds)))
        print(f"       {what}: {middle:.1f} M/s (best {best:.1f})")


if __name__ == "__main__":
    main(sys.argv[1:] or ["512"])
