"""Overlapping bodies, their unions by other means, and what must hold of an outer boundary."""

import igl
import manifold3d
import numpy as np

from meshsdf.mesh import Mesh, degenerate_faces, net_faces, outer_boundary
from meshsdf.mesh.outer_boundary import OuterBoundary
from meshsdf.mesh.primitives import box_mesh, icosphere, tetrahedron
from meshsdf.spatial.closest_point import ClosestPoint

from .shapes import joined, make


def solid(mesh: Mesh) -> manifold3d.Manifold:
    """The body inside a mesh."""
    faces = mesh.faces.astype(np.uint64)
    body = manifold3d.Manifold(manifold3d.Mesh64(np.array(mesh.vertices), faces))
    assert body.status() == manifold3d.Error.NoError
    return body


def united(*meshes: Mesh) -> Mesh:
    """The union of several bodies by manifold3d."""
    body = solid(meshes[0])
    for mesh in meshes[1:]:
        body += solid(mesh)
    found = body.to_mesh64()
    return make(found.vert_properties[:, :3], found.tri_verts.astype(np.int32))


def rotation(seed: int) -> np.ndarray:
    """A turn that fits no lattice."""
    turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


def moved(mesh: Mesh, turn: np.ndarray, step=(0.0, 0.0, 0.0)) -> Mesh:
    return Mesh(mesh.vertices @ turn.T + np.asarray(step, float), mesh.faces)


def random_bodies(seed: int) -> list[Mesh]:
    """Two to five balls, boxes and tetrahedra that overlap, turned at random."""
    rng = np.random.default_rng(seed)
    kinds = [
        lambda: icosphere(rng.uniform(0.3, 1.0), subdivisions=int(rng.integers(0, 3))),
        lambda: box_mesh(rng.uniform(0.2, 1.5, 3)),
        lambda: tetrahedron(rng.uniform(0.5, 2.0)),
    ]
    return [
        moved(kinds[rng.integers(3)](), rotation(100 * seed + i), rng.uniform(-0.5, 0.5, 3))
        for i in range(rng.integers(2, 6))
    ]


def lattice_boxes(seed: int) -> tuple[list[Mesh], np.ndarray]:
    """Boxes with whole coordinates from 0 to 6, and which unit cells (6, 6, 6) they fill."""
    rng = np.random.default_rng(seed)
    boxes, cells = [], np.zeros((6, 6, 6), bool)
    for _ in range(rng.integers(2, 8)):
        low = rng.integers(0, 4, 3)
        high = low + rng.integers(1, 3, 3)
        boxes.append(box_mesh((high - low).astype(float), center=(low + high) / 2.0))
        cells[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
    return boxes, cells


def exposed_area(cells: np.ndarray) -> int:
    """Number of unit squares between filled and empty cells."""
    filled = np.pad(cells, 1)
    return sum(int((np.diff(filled, axis=axis) != 0).sum()) for axis in range(3))


def lattice_tetrahedra(seed: int) -> list[Mesh]:
    """Tetrahedra with whole coordinates: common planes, edges and corners."""
    rng = np.random.default_rng(seed)
    n, size, bodies = rng.integers(2, 9), rng.integers(2, 5), []
    while len(bodies) < n:
        corners = rng.integers(0, size, (4, 3)).astype(float)
        volume = np.linalg.det(corners[1:] - corners[0])
        if volume != 0:
            faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
            bodies.append(make(corners, faces if volume > 0 else faces[:, ::-1]))
    return bodies


def bounding(mesh: Mesh) -> tuple[OuterBoundary | None, Mesh]:
    """The outer boundary of a mesh, and its triangles as a mesh (the faces, if all bound)."""
    points, faces = np.array(mesh.welded.points), np.array(mesh.welded.faces)
    faces = faces[~degenerate_faces(points, faces) & net_faces(faces)]
    found = outer_boundary(points, faces)
    return found, make(points, faces) if found is None else Mesh(*found.place(points, faces))


def assert_bounds(mesh: Mesh, *, seed: int = 0, n: int = 1500) -> None:
    """At random places on its faces, the outer boundary is where winding numbers by libigl say.

    They are summed 1e-6 and 1e-11 beside the face; where the two disagree, another sheet passes
    in between, and nothing is demanded.
    """
    _, boundary = bounding(mesh)
    a, b, c = mesh.triangles.swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    double = np.linalg.norm(normal, axis=1)
    rng = np.random.default_rng(seed)
    face = rng.choice(mesh.n_faces, n, p=double / double.sum())
    weights = rng.dirichlet([1, 1, 1], n)
    places = np.einsum("ni,nij->nj", weights, mesh.triangles[face])
    normal = normal[face] / double[face][:, None]
    vertices, faces = np.array(mesh.vertices), mesh.faces.astype(np.int64)
    bounds, certain = np.zeros(n, bool), np.ones(n, bool)
    for beside in (1e-6, 1e-11):
        sides = [
            np.abs(igl.winding_number(vertices, faces, places + step * normal))
            for step in (beside, -beside)
        ]
        # Libigl's sum of angles is of no use right at an edge
        certain &= (np.abs(np.rint(sides) - sides) < 1e-3).all(axis=0)
        changes = (sides[0] > 0.5) != (sides[1] > 0.5)
        certain &= (beside == 1e-6) | (changes == bounds)
        bounds = changes
    assert certain.mean() > 0.5
    distance = ClosestPoint(boundary)(places).distance if boundary.n_faces else np.full(n, np.inf)
    assert (distance[bounds & certain] < 1e-11).all()
    assert (distance[~bounds & certain] > 1e-13).all()


__all__ = [
    "assert_bounds",
    "bounding",
    "exposed_area",
    "joined",
    "lattice_boxes",
    "lattice_tetrahedra",
    "moved",
    "random_bodies",
    "rotation",
    "solid",
    "united",
]
