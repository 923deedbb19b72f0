"""Small meshes with known verdicts, as plain (vertices, faces) arrays."""

import numpy as np

from meshsdf.mesh import Mesh

# Corner 4 i + 2 j + k of the unit cube is at (i, j, k); two triangles per side, outward.
CUBE_POINTS = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
CUBE_QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
CUBE_FACES = np.array([t for a, b, c, d in CUBE_QUADS for t in ((a, b, c), (a, c, d))], np.int32)


def make(points, faces) -> Mesh:
    """A mesh from anything array-like."""
    faces = np.asarray(faces, dtype=np.int32).reshape(-1, 3)
    return Mesh(np.asarray(points, dtype=np.float64), faces)


def cube(lower=(0, 0, 0), size=1.0) -> Mesh:
    """A cube; ``size`` may be three lengths."""
    return make(np.array(lower) + CUBE_POINTS * size, CUBE_FACES)


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one, nothing welded."""
    starts = np.cumsum([0, *(m.n_vertices for m in meshes[:-1])])
    return make(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + start for m, start in zip(meshes, starts, strict=True)]),
    )


def with_faces(mesh: Mesh, *faces) -> Mesh:
    """The mesh with faces added."""
    return make(mesh.vertices, np.concatenate([mesh.faces, np.array(faces, dtype=np.int32)]))


def without_faces(mesh: Mesh, *numbers: int) -> Mesh:
    """The mesh with faces left out."""
    return make(mesh.vertices, np.delete(mesh.faces, numbers, axis=0))


def flipped(mesh: Mesh, *numbers: int) -> Mesh:
    """The mesh with some faces turned round."""
    faces = mesh.faces.copy()
    faces[list(numbers)] = faces[list(numbers)][:, ::-1]
    return make(mesh.vertices, faces)


def soup_of(mesh: Mesh) -> Mesh:
    """Every face with vertices of its own, as an STL file stores it."""
    return make(mesh.triangles.reshape(-1, 3), np.arange(3 * mesh.n_faces))


def with_t_junction(mesh: Mesh, face: int, point) -> Mesh:
    """Split one face at a point on its first edge; the neighbour keeps the whole edge."""
    a, b, c = mesh.faces[face]
    new = mesh.n_vertices
    faces = np.concatenate([np.delete(mesh.faces, face, axis=0), [(a, new, c), (new, b, c)]])
    return make(np.concatenate([mesh.vertices, [point]]), faces)


def moebius_band(n: int = 12) -> Mesh:
    """A strip of 2 n triangles with half a twist; its rim is one loop of 2 n edges."""
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    points = []
    for t in angle:
        for s in (-0.3, 0.3):
            radius = 1 + s * np.cos(t / 2)
            points.append((radius * np.cos(t), radius * np.sin(t), s * np.sin(t / 2)))
    faces = []
    for i in range(n):
        a, b = 2 * i, 2 * i + 1
        c, d = (2 * i + 2, 2 * i + 3) if i < n - 1 else (1, 0)
        faces += [(a, c, b), (b, c, d)]
    return make(points, faces)


def klein_bottle(n: int = 16, k: int = 9) -> Mesh:
    """The figure-8 immersion: a figure 8 that makes half a turn on its way round a circle.

    After the half turn (x, z) becomes -(x, z), which is the figure 8 traversed backwards, so the
    last ring is joined to the first with its points in reverse order. An odd k keeps the crossing
    in the middle of the 8 from being hit twice.
    """
    v = 2 * np.pi * np.arange(k) / k
    eight = np.sin(v) + 1j * np.sin(2 * v)
    rings = []
    for u in 2 * np.pi * np.arange(n) / n:
        turned = eight * np.exp(0.5j * u)
        radius = 3 + turned.real
        rings.append(np.stack([radius * np.cos(u), radius * np.sin(u), turned.imag], axis=1))

    def vertex(i: int, j: int) -> int:
        return i * k + j % k if i < n else -j % k

    faces = []
    for i in range(n):
        for j in range(k):
            a, b, c, d = vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)
            faces += [(a, b, c), (a, c, d)]
    return make(np.concatenate(rings), faces)
