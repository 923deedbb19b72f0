"""Surfaces that are no solids, and the edits that break a sound mesh in one known way.

Coordinates that come from sines are rounded to 6 decimals before anything is planted, so that
the bytes are the same on every machine; what is planted is exact.
"""

from itertools import pairwise

import numpy as np

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.tubes import closed_tube, torus

DECIMALS = 6


def make(points, faces) -> Mesh:
    """A mesh of anything array-like."""
    faces = np.asarray(faces, dtype=np.int32).reshape(-1, 3)
    return Mesh(np.asarray(points, dtype=np.float64), faces)


def rounded(mesh: Mesh) -> Mesh:
    """Coordinates to 6 decimals, without negative zeros."""
    return make(mesh.vertices.round(DECIMALS) + 0.0, mesh.faces)


def sphere(subdivisions: int = 3, *, radius: float = 1.0, center=(0.0, 0.0, 0.0)) -> Mesh:
    return rounded(icosphere(radius, subdivisions=subdivisions, center=center))


def ring(n_major: int = 24, n_minor: int = 12) -> Mesh:
    return rounded(torus(1.0, 0.35, n_major=n_major, n_minor=n_minor))


def cube(corner=(0.0, 0.0, 0.0)) -> Mesh:
    """The unit cube with that lower corner."""
    return box_mesh(center=np.add(corner, 0.5))


def bowed_tube(*, n_along: int = 120, n_around: int = 12) -> Mesh:
    """A tube along a flat figure 8, which runs through itself at the crossing."""
    # Half a step keeps the two rings at the crossing from sharing vertices.
    t = 2 * np.pi * (np.arange(n_along) + 0.5) / n_along
    curve = np.column_stack([2 * np.sin(t), np.sin(2 * t), 0 * t])
    along = np.column_stack([2 * np.cos(t), 2 * np.cos(2 * t), 0 * t])
    return rounded(closed_tube(curve, along, radius=0.2, n_around=n_around))


def needle_fan(n: int = 2000) -> Mesh:
    """Two apexes, each joined to all n vertices of one circle by needles."""
    angle = 2 * np.pi * np.arange(n) / n
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    here = np.arange(n)
    after = np.roll(here, -1)
    above = np.column_stack([here, after, np.full(n, n)])
    below = np.column_stack([after, here, np.full(n, n + 1)])
    apexes = [[0.0, 0, 1], [0, 0, -1]]
    return rounded(make(np.vstack([circle, apexes]), np.vstack([above, below])))


def moebius_band(n: int = 48, n_across: int = 6) -> Mesh:
    """A strip that closes after half a turn, so its last row meets the first one backwards."""
    t = 2 * np.pi * np.arange(n)[:, None] / n
    s = np.linspace(-0.3, 0.3, n_across + 1)[None]
    radius = 1 + s * np.cos(t / 2)
    points = np.stack([radius * np.cos(t), radius * np.sin(t), s * np.sin(t / 2)], axis=-1)
    row = np.arange(n * (n_across + 1)).reshape(n, -1)
    row = np.vstack([row, row[0, ::-1]])
    return rounded(make(points.reshape(-1, 3), _quads(row)))


def klein_bottle(n: int = 48, k: int = 17) -> Mesh:
    """A figure 8 led round a circle with half a turn: an immersion, crossing itself on a circle.

    Half a turn takes (x, z) to -(x, z), the 8 run backwards. With an odd number k of points no
    two of them meet at the crossing in the middle.
    """
    u = 2 * np.pi * np.arange(n)[:, None] / n
    v = 2 * np.pi * np.arange(k)[None] / k
    x = np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    z = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    points = np.stack([(3 + x) * np.cos(u), (3 + x) * np.sin(u), z], axis=-1)
    row = np.arange(n * k).reshape(n, k)
    row = np.vstack([row, row[0, -np.arange(k) % k]])
    return rounded(make(points.reshape(-1, 3), _quads(np.hstack([row, row[:, :1]]))))


def random_soup(n: int, *, random: np.random.Generator) -> Mesh:
    """Triangles at random places in a box."""
    corners = random.uniform(-1, 1, (3 * n, 3))
    return rounded(make(corners, np.arange(3 * n)))


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one, nothing shared."""
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    return make(np.vstack([mesh.vertices for mesh in meshes]), np.vstack(faces))


def merged(mesh: Mesh) -> Mesh:
    """Equal positions become one vertex."""
    points, which = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return make(points, which.ravel()[mesh.faces])


def flipped(mesh: Mesh, which=slice(None)) -> Mesh:
    """The mesh with some faces, or all, turned round."""
    faces = mesh.faces.copy()
    faces[which] = faces[which][:, ::-1]
    return make(mesh.vertices, faces)


def with_faces(mesh: Mesh, faces) -> Mesh:
    return make(mesh.vertices, np.vstack([mesh.faces, faces]))


def without_faces(mesh: Mesh, which) -> Mesh:
    """The mesh without some faces, and without the vertices that then no face uses."""
    faces = np.delete(mesh.faces, which, axis=0)
    used, faces = np.unique(faces, return_inverse=True)
    return make(mesh.vertices[used], faces)


def soup(mesh: Mesh) -> Mesh:
    """Every face with three vertices of its own."""
    return make(mesh.triangles.reshape(-1, 3), np.arange(3 * mesh.n_faces))


def moved(mesh: Mesh, *, scale: float = 1.0, shift=(0.0, 0.0, 0.0)) -> Mesh:
    return make(mesh.vertices * scale + shift, mesh.faces)


def split_side(mesh: Mesh, a: int, b: int, places, *, sliver: bool = False) -> Mesh:
    """Cut the face that runs from a to b at new vertices on that side; its neighbour stays whole.

    ``places`` are fractions of the way from a to b. With ``sliver`` (one place only) a face
    without area fills what is between the side and its two halves.
    """
    ahead = np.roll(mesh.faces, -1, axis=1)
    face, side = np.argwhere((mesh.faces == a) & (ahead == b))[0]
    apex = mesh.faces[face, (side + 2) % 3]
    start, end = mesh.vertices[a], mesh.vertices[b]
    points = [(1 - place) * start + place * end for place in places]
    chain = [a, *range(mesh.n_vertices, mesh.n_vertices + len(places)), b]
    pieces = [(p, q, apex) for p, q in pairwise(chain)]
    if sliver:
        pieces.append((a, b, chain[1]))
    faces = np.vstack([np.delete(mesh.faces, face, axis=0), pieces])
    return make(np.vstack([mesh.vertices, points]), faces)


def pierced(mesh: Mesh, weights) -> Mesh:
    """Cut every face in three at the point with these barycentric weights."""
    points = np.tensordot(mesh.triangles, np.asarray(weights), axes=([1], [0]))
    new = mesh.n_vertices + np.arange(mesh.n_faces)
    a, b, c = mesh.faces.T
    faces = [np.column_stack(corners) for corners in [(a, b, new), (b, c, new), (c, a, new)]]
    return make(np.vstack([mesh.vertices, points]), np.vstack(faces))


def torn(mesh: Mesh, corners, places) -> Mesh:
    """Give corners, as (face, which of its three) pairs, new vertices at other places."""
    faces = mesh.faces.copy()
    for new, (face, which) in enumerate(corners, start=mesh.n_vertices):
        faces[face, which] = new
    return make(np.vstack([mesh.vertices, places]), faces)


def apart(mesh: Mesh, n: int, *, random: np.random.Generator) -> np.ndarray:
    """Choose n faces at random whose neighbourhoods share no vertex."""
    taken = np.zeros(mesh.n_vertices, dtype=bool)
    chosen = []
    for face in random.permutation(mesh.n_faces):
        around = np.isin(mesh.faces, mesh.faces[face]).any(axis=1)
        near = np.unique(mesh.faces[around])
        if not taken[near].any():
            taken[near] = True
            chosen.append(face)
        if len(chosen) == n:
            return np.array(chosen)
    raise SystemExit(f"the mesh has no {n} faces far enough apart")


def _quads(row: np.ndarray) -> np.ndarray:
    """Two triangles between each pair of neighbours in successive rows."""
    quads = [row[:-1, :-1], row[1:, :-1], row[1:, 1:], row[:-1, 1:]]
    return np.stack(quads, axis=-1)[..., [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
