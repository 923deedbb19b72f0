"""Do the certified statistics hold what dense sampling sees, and how long do they take?

python -m tests.benchmarks.statistics [SAMPLES] [RESOLUTION]

Ten models, each against its round trip (marching cubes) and back. The points of the sample are one
in each of SAMPLES equal parts of the source's area (10^7 by default); their distances come from
`ClosestPoint`, of which 10^5 are checked against libigl first. A row is wrong if an interval misses
the sampled value by more than five of its standard errors.
"""

import sys
import time

import igl
import numpy as np

from meshsdf import Mesh, marching_cubes, mesh_to_band, read_mesh
from meshsdf.report.hausdorff import one_sided_hausdorff
from meshsdf.report.statistics import one_sided_statistics
from meshsdf.spatial import ClosestPoint

from ..models import model
from .alternate import machine

MODELS = (
    "armadillo.obj",
    "stanford-bunny.obj",
    "camelhead.off",
    "fandisk.obj",
    "cow.obj",
    "spot.obj",
    "suzanne.obj",
    "teapot.obj",
    "cheburashka.obj",
    "alligator.obj",
)
CHUNK = 1_000_000
CHECKED = 100_000


def samples(mesh: Mesh, n: int, seed: int):
    """Yield (k, 3) points, one in each of n equal parts of the area, in chunks."""
    rng = np.random.default_rng(seed)
    triangles = mesh.triangles
    sides = triangles[:, 1:] - triangles[:, :1]
    total = np.cumsum(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1))
    for begin in range(0, n, CHUNK):
        k = min(CHUNK, n - begin)
        place = (begin + np.arange(k) + rng.random(k)) / n * total[-1]
        face = np.minimum(np.searchsorted(total, place), mesh.n_faces - 1)
        yield np.einsum("nk,nkx->nx", rng.dirichlet(np.ones(3), k), triangles[face])


def distances(source: Mesh, target: Mesh, n: int) -> np.ndarray:
    """Of the samples, checked against libigl."""
    closest = ClosestPoint(target)
    found = []
    for points in samples(source, n, 0):
        some = closest.distances(points).distance
        if not found:
            few = points[:: max(1, len(points) // CHECKED)]
            faces = target.faces.astype(np.int64)
            theirs = igl.point_mesh_squared_distance(few, target.vertices, faces)[0]
            ours = some[:: max(1, len(points) // CHECKED)]
            assert np.abs(np.sqrt(theirs) - ours).max() < 1e-9 * target.box.diagonal
        found.append(some)
    return np.concatenate(found)


def show(name: str, source: Mesh, target: Mesh, n: int) -> bool:
    """Print one row; whether all intervals hold."""
    begin = time.perf_counter()
    found = one_sided_statistics(source, target)
    spent = time.perf_counter() - begin
    begin = time.perf_counter()
    one_sided_hausdorff(source, target, means=False)
    ratio = spent / (time.perf_counter() - begin)
    seen = distances(source, target, n)
    mean, error = seen.mean(), seen.std() / np.sqrt(n)
    square = (seen**2).mean()
    rms, rms_error = np.sqrt(square), (seen**2).std() / np.sqrt(n) / (2 * np.sqrt(square))
    rows = [("mean", found.mean, mean, error), ("rms", found.rms, rms, rms_error)]
    for percent, enclosure in found.percentiles.items():
        share = percent / 100
        spread = np.sqrt(share * (1 - share) / n)
        low, middle, high = np.quantile(seen, [share - spread, share, min(share + spread, 1)])
        rows.append((f"{percent:g} %", enclosure, middle, max(high - middle, middle - low)))
    slack = 1e-12 * target.box.diagonal
    holds = True
    for label, enclosure, value, deviation in rows:
        reach = 5 * deviation + slack
        right = enclosure.lower - reach <= value <= enclosure.upper + reach
        holds = holds and right
        print(
            f"{name:<22} {label:>5}  [{enclosure.lower:.6g}, {enclosure.upper:.6g}] "
            f"{100 * enclosure.width / max(value, 1e-300):6.2f} %  {value:.6g} ± {deviation:.1g}"
            f"{'' if right else '  WRONG'}"
        )
    print(
        f"{'':<22} {spent:.2f} s, {ratio:.1f} times the Hausdorff search, "
        f"{found.n_evaluations} evaluations, "
        f"{'within' if found.is_within_tolerance else 'NOT within'} tolerance",
        flush=True,
    )
    return holds


def main() -> None:
    """All models, both ways."""
    n = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000
    resolution = int(sys.argv[2]) if len(sys.argv) > 2 else 64
    print(machine())
    wrong = 0
    for name in MODELS:
        mesh = read_mesh(model(name))
        back = marching_cubes(mesh_to_band(mesh, resolution=resolution))
        print(f"{name}: {mesh.n_faces} faces, round trip at {resolution}: {back.n_faces}")
        wrong += not show(f"{name} forward", mesh, back, n)
        wrong += not show(f"{name} backward", back, mesh, n)
    print(f"{wrong} of {2 * len(MODELS)} directions are wrong")


if __name__ == "__main__":
    main()
