"""Signed distances at given points by libigl and, where it is installed, Open3D.

Open3D also needs the system's libusb-1.0; without either its rows are left out.
"""

import time
from collections.abc import Callable

import numpy as np

from meshsdf import Mesh

Timed = Callable[[], tuple[float, np.ndarray]]


def rivals(mesh: Mesh, points: np.ndarray) -> dict[str, Timed]:
    """Name -> run; a run returns its seconds, preparation included, and the distances."""
    import igl

    vertices, faces = mesh.vertices.copy(), mesh.faces.astype(np.int64)

    def by_igl(kind: int) -> tuple[float, np.ndarray]:
        begin = time.perf_counter()
        found = igl.signed_distance(points, vertices, faces, sign_type=kind)[0]
        return time.perf_counter() - begin, found

    runs: dict[str, Timed] = {
        "libigl pseudonormal": lambda: by_igl(igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL),
        "libigl fast winding": lambda: by_igl(igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER),
    }
    try:
        import open3d
    except (ImportError, OSError) as error:
        print(f"without Open3D: {error}")
        return runs
    single, triangles = vertices.astype(np.float32), mesh.faces.astype(np.uint32)
    queries = points.astype(np.float32)

    def by_open3d() -> tuple[float, np.ndarray]:
        begin = time.perf_counter()
        scene = open3d.t.geometry.RaycastingScene()
        scene.add_triangles(open3d.core.Tensor(single), open3d.core.Tensor(triangles))
        found = scene.compute_signed_distance(open3d.core.Tensor(queries)).numpy()
        return time.perf_counter() - begin, found

    runs["Open3D"] = by_open3d
    return runs


def compare_answers(name: str, ours: np.ndarray, theirs: np.ndarray, size: float) -> None:
    """Refuse to time a rival that answers another question; tell how far apart the answers are.

    Open3D works in float32: 1e-5 of the mesh's size is allowed. libigl's fast winding number w
    scales the distance by ``1 - 2 |w|``: 1e-2 is. Signs may err near edges and thin parts: 1 in
    1000 is allowed.
    """
    allowed = 1e-2 if "fast winding" in name else 1e-5
    gap = np.abs(np.abs(ours) - np.abs(theirs)).max() / size
    assert gap < allowed, f"{name} differs by {gap:.2g} of the mesh's size"
    other = (ours < 0) != (theirs < 0)
    n_other = int((other & (np.abs(ours) > 1e-6 * size)).sum())
    assert n_other <= 1e-3 * len(ours), f"{name} has {n_other} other signs"
    print(f"       {name}: largest difference {gap:.1g} of the size, {n_other} other signs")
