"""Points of meshes, and of zero sets of trilinear interpolants, the latter by scipy alone."""

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

from meshsdf.mesh import Mesh


def dense_values(band):
    """The values of a band at the nodes of a box, and its lowest node; none is negative beyond."""
    low = band.index.coordinates.min(axis=0) * 8
    high = band.index.coordinates.max(axis=0) * 8 + 8
    nodes = np.stack(np.indices(high - low), axis=-1) + low
    negative = nodes[band.value_at(nodes.reshape(-1, 3)).reshape(nodes.shape[:3]) < 0]
    low, high = negative.min(axis=0) - 1, negative.max(axis=0) + 2
    nodes = np.stack(np.indices(high - low), axis=-1) + low
    return band.value_at(nodes.reshape(-1, 3)).reshape(nodes.shape[:3]), low


def interpolated(values, points):
    """Trilinear interpolation at (n, 3) points in index coordinates."""
    return map_coordinates(values, points.T, order=1, mode="nearest")


def fine_roots(values, n_parts):
    """Zeros on the edges of the lattice with spacing 1 / n_parts, in index coordinates.

    Along such an edge the interpolant is linear, so these are exact. Every zero is within
    sqrt(3) / n_parts of one: it lies in a small cube with a change of sign between corners, and
    so along an edge.
    """
    axes = [np.arange((n - 1) * n_parts + 1) / n_parts for n in values.shape]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    fine = interpolated(values, places.reshape(-1, 3)).reshape(places.shape[:3])
    found = []
    for axis in range(3):
        f = np.moveaxis(fine, axis, 0)
        start = np.moveaxis(places, axis, 0)
        changes = (f[:-1] < 0) != (f[1:] < 0)
        a, b = f[:-1][changes], f[1:][changes]
        points = start[:-1][changes].copy()
        points[:, axis] += a / (a - b) / n_parts
        found.append(points)
    return np.concatenate(found)


def turned(mesh, seed):
    rotation = Rotation.random(random_state=seed).as_matrix()
    return Mesh(mesh.vertices @ rotation.T, mesh.faces)


def samples_of(mesh, n, seed):
    rng = np.random.default_rng(seed)
    corners = mesh.triangles[rng.integers(0, mesh.n_faces, n)]
    return np.einsum("nk,nkx->nx", rng.dirichlet(np.ones(3), n), corners)
