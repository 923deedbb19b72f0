"""Dual contouring: sharp shapes come back, whatever the values the mesh is closed and manifold."""

import os
from dataclasses import replace
from pathlib import Path

import igl
import manifold3d
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from meshsdf import Grid, Mesh, compare, dual_contouring, marching_cubes, mesh_to_band, read_mesh
from meshsdf.errors import SurfaceError
from meshsdf.mesh.measures import is_watertight
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.mesh.self_intersections import find_self_intersections
from meshsdf.surface.hermite import choose_normals, sample_hermite

from .soundness import assert_closed

MODELS = os.environ.get("MESHSDF_MODELS")
needs_models = pytest.mark.skipif(MODELS is None, reason="MESHSDF_MODELS names no folder")
TURN = trimesh.transformations.euler_matrix(0.3, 0.7, 1.1)[:3, :3]


def turned(vertices, faces, turn=TURN):
    return Mesh(np.asarray(vertices, float) @ turn.T, np.asarray(faces, np.int32))


def prism(outline):
    """A solid of height 0.8 over a polygon, turned."""
    solid = manifold3d.Manifold.extrude(manifold3d.CrossSection([outline]), 0.8).to_mesh()
    return turned(solid.vert_properties[:, :3], solid.tri_verts)


def octahedron(turn):
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    solid = trimesh.Trimesh(vertices).convex_hull
    return turned(solid.vertices, solid.faces, turn)


def tetrahedron():
    solid = trimesh.Trimesh([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]).convex_hull
    return turned(solid.vertices, solid.faces)


ALIGNED = ("cube", "octahedron")  # with nodes on all their edges, at 16
WEDGE = np.tan(np.radians(10))
SHAPES = {
    "cube": box_mesh(),
    "turned cube": turned(box_mesh().vertices, box_mesh().faces),
    "tetrahedron": tetrahedron(),
    "octahedron": octahedron(np.eye(3)),
    "turned octahedron": octahedron(TURN),
    "L-block": prism([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]),
    "wedge of 10 degrees": prism([[0, 0], [2, 0], [2, 2 * WEDGE]]),
}


def largest(mesh, surface):
    return compare(mesh, surface, tolerance=1e-13 * mesh.box.diagonal).distance.upper


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("resolution", [16, 25])
def test_polyhedra_come_back_to_rounding(name, resolution):
    mesh = SHAPES[name]
    band = mesh_to_band(mesh, resolution=resolution)
    surface = dual_contouring(band, mesh)
    assert_closed(surface)
    assert largest(mesh, surface) < 1e-9 * mesh.box.diagonal
    # Seen by another library: samples of the surface lie on the mesh, and the other way about
    for one, other in ((mesh, surface), (surface, mesh)):
        points = np.concatenate([one.vertices, one.triangles.mean(axis=1)])
        square, *_ = igl.point_mesh_squared_distance(
            points, other.vertices.copy(), other.faces.copy()
        )
        assert np.sqrt(square.max()) < 1e-9 * mesh.box.diagonal
    # Marching cubes cuts all edges off
    assert largest(mesh, marching_cubes(band)) > 0.1 * band.voxel_size or name in ALIGNED


@pytest.mark.parametrize("name", SHAPES)
def test_clamped_surfaces_do_not_cross_themselves(name):
    mesh = SHAPES[name]
    band = mesh_to_band(mesh, resolution=24)
    surface = dual_contouring(band, mesh, clamp=True)
    assert_closed(surface)
    assert find_self_intersections(surface.vertices, surface.faces).n_pairs == 0
    assert largest(mesh, surface) < 1.5 * band.voxel_size


@pytest.mark.parametrize("clamp", [False, True])
@pytest.mark.parametrize("kind", ["ties", "noise"])
def test_any_values_give_a_closed_manifold(kind, clamp):
    rng = np.random.default_rng(0)
    inner = rng.normal(size=(22, 23, 24)).astype(np.float32)
    if kind == "ties":
        inner = rng.integers(-2, 3, inner.shape).astype(np.float32)
    values = np.pad(inner, 1, constant_values=np.float32(2))
    grid = Grid(values, 0.5, np.array([1.0, -2.0, 3.0]))
    surface = dual_contouring(grid, clamp=clamp)
    assert surface.n_faces > 10000
    assert_closed(surface)
    if clamp and kind == "noise":
        assert find_self_intersections(surface.vertices, surface.faces).n_pairs == 0


def test_stored_data_do_what_the_mesh_does_and_gradients_less():
    mesh = SHAPES["L-block"]
    band = mesh_to_band(mesh, resolution=24)
    stored = replace(band, hermite=sample_hermite(mesh, band))
    assert choose_normals(stored).kind == "stored"
    assert largest(mesh, dual_contouring(stored)) < 1e-9 * mesh.box.diagonal
    assert choose_normals(band).kind == "gradients"
    assert "estimated by gradients" in choose_normals(band).warnings[0]
    assert "not 0.01" in choose_normals(band, mesh, level=0.01).warnings[0]
    rounded = dual_contouring(band)
    assert_closed(rounded)
    assert largest(mesh, rounded) < 2.0 * band.voxel_size
    hermite = stored.hermite
    wrong = replace(hermite, fractions=hermite.fractions[1:], normals=hermite.normals[1:])
    with pytest.raises(SurfaceError, match=r"crossings, the band has"):
        dual_contouring(replace(band, hermite=wrong))
    with pytest.raises(SurfaceError, match="unsigned"):
        sample_hermite(mesh, mesh_to_band(mesh, resolution=16, sign="unsigned"))


def test_a_smooth_ball_is_hardly_worse_than_by_marching_cubes():
    mesh = icosphere(1.0, subdivisions=5)
    for resolution in (16, 32):
        band = mesh_to_band(mesh, resolution=resolution)
        blunt = largest(mesh, marching_cubes(band))
        assert largest(mesh, dual_contouring(band, mesh)) < 1.1 * blunt


def test_bad_choices_are_refused():
    band = mesh_to_band(box_mesh(), resolution=8)
    with pytest.raises(SurfaceError, match="feature_angle is 0"):
        dual_contouring(band, feature_angle=0)
    with pytest.raises(SurfaceError, match="level is nan"):
        dual_contouring(band, level=float("nan"))
    with pytest.raises(SurfaceError, match="holds only values between"):
        dual_contouring(band, level=9.0)


@needs_models
def test_fandisk_loses_a_tenth_of_what_marching_cubes_loses():
    mesh = read_mesh(Path(MODELS) / "fandisk.obj")
    band = mesh_to_band(mesh, resolution=64)
    tolerance = 1e-3 * band.voxel_size
    sharp = compare(mesh, dual_contouring(band, mesh), tolerance=tolerance).distance
    blunt = compare(mesh, marching_cubes(band), tolerance=tolerance).distance
    assert sharp.upper < 0.1 * blunt.lower


def feature_samples(mesh, step):
    """Places along the edges at which faces turn, the ends of these edges, and where these are."""
    solid = trimesh.Trimesh(mesh.welded.points, mesh.welded.faces, process=False)
    normals = solid.face_normals[solid.face_adjacency]
    turns = np.linalg.norm(np.cross(normals[:, 0], normals[:, 1]), axis=1) > 1e-6
    ends = solid.face_adjacency_edges[turns]
    start, along = solid.vertices[ends[:, 0]], np.diff(solid.vertices[ends], axis=1)[:, 0]
    n = np.ceil(np.linalg.norm(along, axis=1) / step).astype(int) + 1
    edge = np.repeat(np.arange(len(ends)), n)
    share = (np.arange(len(edge)) - np.repeat(np.cumsum(n) - n, n)) / (n[edge] - 1)
    return start[edge] + share[:, None] * along[edge], ends[edge], solid.vertices


def has_close_features(near, places, ends, vertices, apart):
    """Whether two of the places near lie on different features, less than ``apart`` apart."""
    a, b = np.triu_indices(len(near), 1)
    a, b = np.array(near)[a], np.array(near)[b]
    close = np.linalg.norm(places[a] - places[b], axis=1) < apart
    a, b = a[close & (ends[a] != ends[b]).any(axis=1)], b[close & (ends[a] != ends[b]).any(axis=1)]
    # Edges that meet are near each other there; that is one feature, a corner
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        away = np.linalg.norm(places[a] - vertices[ends[a, i]], axis=1) > apart
        kept = (ends[a, i] != ends[b, j]) | away
        a, b = a[kept], b[kept]
    return len(a) > 0


@needs_models
def test_a_pocket_comes_back_exactly_where_features_are_two_voxels_apart():
    mesh = read_mesh(Path(MODELS) / "octagonal_pocket.stl")
    band = mesh_to_band(mesh, resolution=200)
    h, exact = band.voxel_size, 1e-9 * mesh.box.diagonal
    surface = dual_contouring(band, mesh)
    points = np.concatenate([surface.vertices, surface.triangles.mean(axis=1)])
    square, *_ = igl.point_mesh_squared_distance(points, mesh.vertices.copy(), mesh.faces.copy())
    off = points[np.sqrt(square) > exact]
    assert len(off) < 0.03 * len(points)
    places, ends, vertices = feature_samples(mesh, 0.5 * h)
    for near in cKDTree(places).query_ball_point(off[:: len(off) // 500], 3 * h):
        assert has_close_features(near, places, ends, vertices, 2.0 * h)
    assert largest(mesh, surface) < 0.2 * h


@needs_models
@pytest.mark.parametrize("name", ["armadillo.obj", "3holes.off", "octagonal_pocket.stl", "cow.obj"])
def test_real_models_are_solids_for_manifold3d(name):
    mesh = read_mesh(Path(MODELS) / name)
    for resolution in (32, 64):
        band = mesh_to_band(mesh, resolution=resolution)
        for clamp in (False, True):
            surface = dual_contouring(band, mesh, clamp=clamp)
            assert is_watertight(surface)
            solid = manifold3d.Manifold(
                manifold3d.Mesh(
                    surface.vertices.astype(np.float32), surface.faces.astype(np.uint32)
                )
            )
            assert solid.status() == manifold3d.Error.NoError
