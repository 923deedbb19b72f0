"""How long does a proven Hausdorff distance take, beside libigl's maximum over vertices?

python -m tests.benchmarks.hausdorff [--resolution N] [--repeats N]
python -m tests.benchmarks.hausdorff --million
python -m tests.benchmarks.hausdorff --enclosures [--pairs N] [--samples N]

*Default*: armadillo against its own round trip, both directions, to 1 % of a voxel, in alternation
with ``igl.hausdorff`` in one process. libigl takes the largest distance of a vertex, which is a
lower bound without proof; the interval must contain it or lie above.
*Million*: more than a million faces on either side to 1e-6 of the diagonal, each pair in a process
of its own, with its peak memory.
*Enclosures*: random pairs, placed near and far, large and small; libigl's distances of samples must
not exceed the upper end, and a point of the source must reach the lower one.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import igl
import numpy as np

from meshsdf import Mesh, marching_cubes, mesh_to_band, read_mesh
from meshsdf.report.hausdorff import hausdorff
from meshsdf.report.tolerance import Tolerance
from tests.report.mesh_pairs import PLACES, hold, mesh_pair, placed, samples_of

from .alternate import alternate, machine, median, models
from .band import run, subdivided

OURS = Path(__file__).with_name("ours_hausdorff.py")


def fresh(mesh: Mesh) -> Mesh:
    """The mesh without what it remembers from earlier calls."""
    return Mesh(mesh.vertices, mesh.faces)


def round_trip(mesh: Mesh, resolution: float) -> tuple[Mesh, float]:
    """The mesh after a trip through a band, and the size of a voxel."""
    band = mesh_to_band(mesh, resolution=resolution)
    return marching_cubes(band), band.voxel_size


def beside_libigl(mesh: Mesh, resolution: float, repeats: int) -> None:
    """Print medians and the ratio."""
    again, voxel_size = round_trip(mesh, resolution)
    narrow = Tolerance.in_voxels(0.01, voxel_size)
    plain = [
        array
        for one in (mesh, again)
        for array in (np.array(one.vertices), one.faces.astype(np.int64))
    ]

    def ours() -> float:
        a, b = fresh(mesh), fresh(again)
        begin = time.perf_counter()
        hausdorff(a, b, tolerance=narrow, means=False)
        return time.perf_counter() - begin

    def theirs() -> float:
        begin = time.perf_counter()
        igl.hausdorff(*plain)
        return time.perf_counter() - begin

    found, seen = hausdorff(mesh, again, tolerance=narrow, means=False), igl.hausdorff(*plain)
    assert seen <= found.distance.upper, (seen, found.distance)
    print(f"armadillo ({mesh.n_faces} faces), its round trip at {resolution:g} ({again.n_faces})")
    lower, upper = found.distance.lower / voxel_size, found.distance.upper / voxel_size
    print(f"       meshsdf [{lower:.5f}, {upper:.5f}] voxels, libigl {seen / voxel_size:.5f}")
    for side in (found.forward, found.backward):
        assert side.is_within_tolerance
    n = [side.n_evaluations for side in (found.forward, found.backward)]
    print(f"       closest points: {n}, vertices: {[mesh.n_vertices, again.n_vertices]}")
    seconds = alternate({"meshsdf": ours, "libigl": theirs}, repeats)
    middle = {name: median(each) for name, each in seconds.items()}
    for name, value in middle.items():
        print(f"       {name}: {value:.3f} s, {value / middle['libigl']:.2f} x libigl")


def million(mesh: Mesh) -> None:
    """Print seconds and peak memory for two pairs of large meshes."""
    large = subdivided(mesh, 2)
    again, _ = round_trip(mesh, 640.0)
    noise = np.random.default_rng(0).normal(size=large.vertices.shape)
    noisy = Mesh(large.vertices + 1e-4 * mesh.box.diagonal * noise, large.faces)
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "pair.npz")
        for name, other in (("its round trip at 640", again), ("a noisy copy", noisy)):
            np.savez(path, va=large.vertices, fa=large.faces, vb=other.vertices, fb=other.faces)
            told = run([sys.executable, str(OURS), path, "1e-6"])
            print(f"armadillo cut to {large.n_faces} faces, and {name}: {other.n_faces} faces")
            print(f"       {told['seconds']:.2f} s, peak {told['peak'] / 1e9:.2f} GB")
            print(f"       {told['n_evaluations']} closest points, as asked: {told['within']}")
            print(f"       [{told['lower']:.9f}, {told['upper']:.9f}] of the diagonal", flush=True)


def enclosures(n_pairs: int, n_samples: int) -> None:
    """Hold intervals against libigl's distances; report every one that is not true."""
    begin, n_untrue, n_wide, widest = time.perf_counter(), 0, 0, 0.0
    for seed in range(n_pairs):
        a, b = mesh_pair(seed)
        place = PLACES[seed % len(PLACES)]
        found = hausdorff(placed(a, *place), placed(b, *place), means=False)
        rng = np.random.default_rng(seed)
        for side, source, target in ((found.forward, a, b), (found.backward, b, a)):
            held = hold(side, source, target, place, samples_of(source, n_samples, rng))
            if not held.is_true:
                n_untrue += 1
                print(f"       not true: pair {seed} at {place}: {held}", flush=True)
            n_wide += not side.is_within_tolerance
            if held.seen > 1e-3:  # not where the surfaces coincide
                widest = max(widest, (held.upper - held.seen) / held.seen)
        if seed % 10 == 9:
            print(f"       {seed + 1} pairs, {time.perf_counter() - begin:.0f} s", flush=True)
    print(f"{2 * n_pairs} intervals, {n_samples} samples each: {n_untrue} not true, "
          f"{n_wide} wider than asked")  # fmt: skip
    print(f"       an upper end exceeds the largest sample by at most {100 * widest:.2g} %")


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--resolution", type=float, default=128.0)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--million", action="store_true")
    parser.add_argument("--enclosures", action="store_true")
    parser.add_argument("--pairs", type=int, default=200)
    parser.add_argument("--samples", type=int, default=1_000_000)
    asked = parser.parse_args()
    print(machine())
    if asked.enclosures:
        enclosures(asked.pairs, asked.samples)
        return
    mesh = read_mesh(models() / "armadillo.obj")
    if asked.million:
        million(mesh)
    else:
        beside_libigl(mesh, asked.resolution, asked.repeats)


if __name__ == "__main__":
    main()
