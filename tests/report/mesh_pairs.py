"""Random pairs of meshes of every kind, and libigl's distances to them.

All vertices are multiples of 2**-24 below 4, so scaling by a power of two or by 1e6 and moving by
1e6 round nothing: the truth about the placed pair is the truth about the pair, placed.
"""

from dataclasses import dataclass

import igl
import numpy as np
from scipy.spatial import Delaunay

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.report.hausdorff import OneSided
from tests.oracles import distance_to_triangle

GRID = 2.0**24
PLACES = ((1.0, 0.0), (1e6, 0.0), (2.0**-20, 0.0), (1.0, 1e6))  # scale, offset


def snapped(vertices: np.ndarray, grid: float = GRID) -> np.ndarray:
    """The nearest multiples of 1 / grid."""
    return np.round(vertices * grid) / grid


def rough(mesh: Mesh, amount: float, rng: np.random.Generator) -> Mesh:
    """Every vertex moved by a normal deviate."""
    return Mesh(snapped(mesh.vertices + amount * rng.normal(size=mesh.vertices.shape)), mesh.faces)


def sphere_with_dents(rng: np.random.Generator) -> Mesh:
    return rough(icosphere(subdivisions=int(rng.integers(1, 4))), rng.uniform(0.0, 0.1), rng)


def terrain(rng: np.random.Generator) -> Mesh:
    """A square sheet with heights; sometimes flat."""
    n = int(rng.integers(5, 400))
    points = np.vstack([[[0, 0], [1, 0], [0, 1], [1, 1]], rng.random((n, 2))])
    heights = rng.choice([0.0, 0.03, 0.3]) * rng.normal(size=n + 4)
    faces = Delaunay(points).simplices.astype(np.int32)
    return Mesh(snapped(np.column_stack([points, heights])), faces)


def soup(rng: np.random.Generator) -> Mesh:
    """Triangles of all sizes, needles, segments and points."""
    m = int(rng.integers(1, 120))
    corners = rng.normal(size=(m, 1, 3)) / 2 + 10.0 ** rng.uniform(-3, 0, (m, 1, 1)) * (
        rng.normal(size=(m, 3, 3)) / 2
    )
    corners = snapped(corners, GRID / 2)
    corners[::5, 1] = corners[::5, 0]
    corners[::10, 2] = corners[::10, 0]
    corners[2::5, 2] = 0.5 * (corners[2::5, 0] + corners[2::5, 1])
    return Mesh(corners.reshape(-1, 3), np.arange(3 * m, dtype=np.int32).reshape(-1, 3))


def crumpled(rng: np.random.Generator) -> Mesh:
    """A closed mesh in which every tenth vertex was pulled into a neighbour."""
    mesh = sphere_with_dents(rng)
    vertices = mesh.vertices.copy()
    edges = mesh.faces[rng.random(mesh.n_faces) < 0.05, :2]
    vertices[edges[:, 0]] = vertices[edges[:, 1]]
    return Mesh(vertices, mesh.faces)


def squashed(rng: np.random.Generator) -> Mesh:
    """A closed mesh of needles."""
    mesh = sphere_with_dents(rng)
    return Mesh(snapped(mesh.vertices * [1.0, 0.05, 0.002]), mesh.faces)


def open_part(rng: np.random.Generator) -> Mesh:
    mesh = sphere_with_dents(rng)
    keep = mesh.triangles.mean(axis=1) @ rng.normal(size=3) > rng.uniform(-0.5, 0.5)
    keep[0] = True
    return Mesh(mesh.vertices, mesh.faces[keep])


def box(rng: np.random.Generator) -> Mesh:
    mesh = box_mesh(tuple(rng.uniform(0.2, 2.0, 3).tolist()))
    return Mesh(snapped(mesh.vertices + 0.2 * rng.normal(size=3)), mesh.faces)


MAKERS = (sphere_with_dents, terrain, soup, crumpled, squashed, open_part, box)


def mesh_pair(seed: int) -> tuple[Mesh, Mesh]:
    """Two meshes near each other; all pairs of kinds occur within 49 seeds."""
    rng = np.random.default_rng(seed)
    one, other = divmod(seed % len(MAKERS) ** 2, len(MAKERS))
    a, b = MAKERS[one](rng), MAKERS[other](rng)
    if one == other and rng.random() < 0.3:
        b = Mesh(a.vertices, a.faces[rng.random(a.n_faces) < 0.9]) if a.n_faces > 20 else a
    return a, b


def placed(mesh: Mesh, scale: float, offset: float) -> Mesh:
    return Mesh(scale * mesh.vertices + offset, mesh.faces)


def samples_of(mesh: Mesh, n: int, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) points of the surface, as many on every face."""
    corners = mesh.triangles[rng.integers(0, mesh.n_faces, n)]
    return np.einsum("nk,nkx->nx", rng.dirichlet(np.full(3, 0.7), n), corners)


def libigl_distances(points: np.ndarray, mesh: Mesh) -> np.ndarray:
    """(n,) distances; faces without area are given to libigl as the segments they are."""
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    flat = (np.cross(b - a, c - a) == 0).all(axis=1)
    vertices, faces = mesh.vertices.copy(), mesh.faces.astype(np.int64)
    longest = np.argmax([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    ends = np.stack([longest, (longest + 1) % 3], axis=1)
    segments = np.take_along_axis(faces, ends, axis=1)
    squares = np.full(len(points), np.inf)
    for simplices in (faces[~flat], segments[flat]):
        if len(simplices) > 0:
            found = igl.point_mesh_squared_distance(points, vertices, simplices.copy())[0]
            squares = np.minimum(squares, found)
    return np.sqrt(squares)


@dataclass(frozen=True)
class Held:
    """An enclosure beside libigl, in the units of the pair before it was placed.

    Attributes
    ----------
    seen : float
        The largest of libigl's distances at the samples.
    at_witness : float
        libigl's distance of the witness to the target.
    off_face : float
        The witness's distance to the face it should lie on, in rational arithmetic.
    slack : float
        What the rounding of the witness's coordinates and libigl's own may change.
    """

    lower: float
    upper: float
    seen: float
    at_witness: float
    off_face: float
    slack: float

    @property
    def is_true(self) -> bool:
        """No sample beyond the upper end, and a point of the source reaches the lower one."""
        reached = self.lower <= self.at_witness + self.slack and self.off_face <= self.slack
        return reached and self.seen <= self.upper


def hold(
    side: OneSided, source: Mesh, target: Mesh, place: tuple[float, float], samples: np.ndarray
) -> Held:
    """Hold what was found about the placed pair against libigl's answers about the pair itself."""
    scale, offset = place
    witness = ((side.witness - offset) / scale)[None]
    return Held(
        side.distance.lower / scale,
        side.distance.upper / scale,
        float(libigl_distances(samples, target).max()),
        float(libigl_distances(witness, target)[0]),
        distance_to_triangle(witness[0], source.triangles[side.source_face]),
        4 * 2.0**-53 * (abs(offset) / scale + 64),
    )
