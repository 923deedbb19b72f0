"""meshsdf.texture.octree: which texels a surface needs, and how many they are."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from meshsdf import read_mesh
from meshsdf.errors import MemoryLimitError, TextureError
from meshsdf.kernels import parallel
from meshsdf.mesh import Mesh
from meshsdf.mesh.measures import area
from meshsdf.mesh.primitives import box_mesh, cylinder, icosphere
from meshsdf.mesh.sampling import sample_surface
from meshsdf.texture import octree, octree_levels
from meshsdf.texture.octree import Octree
from meshsdf.texture.refine import texel_mask
from meshsdf.texture.volume_texture import VolumeTexture
from tests.models import model, needs_models

# Meshes all of whose parts are many texels wide at that resolution. Left out: alligator.obj, whose
# open strips each add a row of cells at their ends, octagonal_pocket.stl, whose walls are a few
# texels apart, and soup.stl, of triangles that cross
RESOLVED = {
    "3holes.off": 256, "Duck.glb": 256, "armadillo.obj": 256, "boolean.glb": 256, "busted.STL": 256,
    "camelhead.off": 256, "cheburashka.obj": 256, "cow.obj": 256, "decimated-knight.off": 256,
    "fandisk.obj": 256, "fuze.obj": 256, "spot.obj": 256, "stanford-bunny.obj": 256,
    "suzanne.obj": 256, "teapot.obj": 256, "1002_tray_bottom.STL": 512, "featuretype.STL": 512,
    "multibody.stl": 512, "icosphere": 128, "cylinder": 256,
}  # fmt: skip
PRIMITIVES = {"icosphere": icosphere(), "cylinder": cylinder(n_around=256)}


def turned(mesh, seed):
    """The mesh turned at random."""
    rotation = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    return Mesh(mesh.vertices @ rotation.T, mesh.faces)


def nodes_of(octree, level):
    """All needed nodes (n, 3) of a level, those of two sheets once."""
    entries = np.arange(*octree.level_first[level : level + 2], dtype=np.int32)
    row, t = np.nonzero(texel_mask_of(octree, entries))
    nodes = 8 * octree.tables.bricks[entries[row]] + np.stack([t >> 6, (t >> 3) & 7, t & 7], axis=1)
    return np.unique(nodes, axis=0)


def texel_mask_of(octree, entries):
    return texel_mask(VolumeTexture(octree), entries)


def clipped(polygon, axis, bound, side):
    """The part of a convex polygon where side * (x[axis] - bound) <= 0."""
    out = []
    for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        a, b = side * (p[axis] - bound), side * (q[axis] - bound)
        if a <= 0:
            out.append(p)
        if (a < 0 < b) or (b < 0 < a):
            out.append(p + (q - p) * (a / (a - b)))
    return out


def cells_by_clipping(mesh, spacing, slack):
    """The cells (i, j, k) that triangles meet, by clipping every triangle to every cell."""
    cells = set()
    for face in mesh.faces:
        triangle = mesh.vertices[face] / spacing
        low = np.floor(triangle.min(axis=0) - 0.01).astype(int)
        high = np.floor(triangle.max(axis=0) + 0.01).astype(int)
        for cell in np.ndindex(*(high - low + 1)):
            polygon = list(triangle)
            for axis in range(3):
                for side, bound in ((-1, 0 - slack), (1, 1 + slack)):
                    polygon = clipped(polygon, axis, low[axis] + cell[axis] + bound, side)
                    if not polygon:
                        break
                if not polygon:
                    break
            if polygon:
                cells.add(tuple((low + cell).tolist()))
    return cells


def corners_of(cells):
    """The corners of cells (n, 3), each once."""
    cells = np.array(list(cells))
    corners = cells[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T
    return np.unique(corners.reshape(-1, 3), axis=0)


def rows(array):
    return set(map(tuple, array.tolist()))


@needs_models
def test_three_texels_are_stored_for_a_square_texel_of_surface():
    # Of a plane with the unit normal n there are 2 (|nx| + |ny| + |nz|): 3 on average over turns.
    # What the turn of large flat faces makes of that is taken out
    ratios, turns = {}, {}
    for seed, (name, resolution) in enumerate(RESOLVED.items()):
        mesh = turned(PRIMITIVES.get(name) or read_mesh(model(name)), seed)
        found = Octree.around(mesh, resolution=resolution)
        ratios[name] = found.n_texels(0) * found.texel**2 / area(mesh)
        corners = mesh.vertices[mesh.faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
        turns[name] = 2 * np.abs(cross).sum() / area(mesh)
    assert len(ratios) == 20
    for name, ratio in ratios.items():
        assert 2.85 <= 3 * ratio / turns[name] <= 3.15, (name, ratio, turns[name])
    assert 2.95 <= np.mean(list(ratios.values())) <= 3.05


@pytest.mark.parametrize("seed", range(3))
def test_the_texels_are_the_corners_of_the_cells_that_clipping_finds(seed):
    random = np.random.default_rng(seed)
    mesh = Mesh(random.normal(size=(12, 3)), np.arange(12, dtype=np.int32).reshape(4, 3))
    found = Octree.around(mesh, resolution=40)
    for level in range(found.n_levels):
        spacing = found.spacing(level)
        nodes = rows(nodes_of(found, level))
        # Cells are taken a billionth larger than they are: between two slacks around that
        assert rows(corners_of(cells_by_clipping(mesh, spacing, 0.0))) <= nodes
        assert nodes <= rows(corners_of(cells_by_clipping(mesh, spacing, 1e-8)))


@pytest.mark.parametrize("mesh", [icosphere(subdivisions=3), cylinder(0.3, 0.02), box_mesh()])
def test_every_point_of_the_surface_lies_in_a_cell_with_all_its_corners(mesh):
    found = Octree.around(mesh, resolution=90)
    points = sample_surface(mesh, 100_000, seed=2).points
    for level in range(found.n_levels):
        cells = np.unique(np.floor(points / found.spacing(level)).astype(np.int64), axis=0)
        assert rows(corners_of(cells)) <= rows(nodes_of(found, level))


def test_texels_in_a_sheet_have_the_normal_of_the_surface_there():
    mesh = icosphere(subdivisions=4)
    texture = VolumeTexture.around(mesh, resolution=64)
    first, last = texture.octree.level_first[:2]
    points, normals = texture.places(np.arange(first, last, dtype=np.int32))
    outward = points / np.linalg.norm(points, axis=1, keepdims=True)
    # 0.9 degrees of the code; the mean over the faces of cells within a texel, 1/32, of the node
    limit = np.radians(0.9) + np.sqrt(3) / 32 + 2 * np.pi / 60
    assert (np.linalg.norm(np.cross(normals, outward), axis=1) < limit).all()
    assert ((normals * outward).sum(axis=1) > 0).all()


def test_neighbours_and_parents_are_those_beside_and_above():
    octree = Octree.around(icosphere(subdivisions=3), resolution=150)
    tables = octree.tables
    assert len(tables.groups) == 0
    bricks = zip(tables.levels.tolist(), tables.bricks.tolist(), strict=True)
    entries = {(level, *brick): e for e, (level, brick) in enumerate(bricks)}
    steps = np.indices((3, 3, 3)).reshape(3, 27).T - 1
    for (level, *brick), e in entries.items():
        wanted = [entries.get((level, *(brick + step).tolist()), -1) for step in steps]
        assert_array_equal(tables.neighbors[e], wanted)
        above = (level + 1, *(n >> 1 for n in brick))
        assert tables.parents[e] == entries.get(above, -1)
        assert level + 1 == octree.n_levels or tables.parents[e] >= 0


def test_one_thread_and_two_give_the_same_bytes(monkeypatch):
    mesh = cylinder(0.5, 0.01)
    results = []
    for threads in (1, 2, 3):
        monkeypatch.setattr(parallel, "n_threads", lambda threads=threads: threads)
        monkeypatch.setattr(octree_levels, "n_threads", lambda threads=threads: threads)
        results.append(Octree.around(mesh, resolution=200).tables)
    for tables in results[1:]:
        for name, array in results[0]._asdict().items():
            assert np.asarray(array).tobytes() == np.asarray(getattr(tables, name)).tobytes(), name
    assert len(results[0].groups) > 100


def test_another_process_gives_the_same_bytes():
    script = (
        "import hashlib; from meshsdf.mesh.primitives import cylinder; import numpy as np\n"
        "from meshsdf.texture.octree import Octree\n"
        "tables = Octree.around(cylinder(0.5, 0.01), resolution=100).tables\n"
        "print(hashlib.sha256(b''.join(np.asarray(t).tobytes() for t in tables)).hexdigest())"
    )
    runs = [
        subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    ]  # fmt: skip
    assert runs[0] == runs[1] != ""


def test_faces_without_area_are_held_too():
    vertices = np.array([[0.0, 0, 0], [1, 1, 0.3], [0.5, 0.5, 0.15], [1, 0, 0]])
    needle = Mesh(vertices, np.array([[0, 1, 2], [3, 3, 3], [0, 1, 3], [1, 1, 0]], np.int32))
    found = Octree.around(needle, texel=0.05)
    line = np.linspace(0, 1, 2001)[:, None] * vertices[1]
    cells = np.unique(np.floor(line / 0.05).astype(np.int64), axis=0)
    assert rows(corners_of(cells)) <= rows(nodes_of(found, 0))
    point = Mesh(np.zeros((3, 3)) + 0.01, np.array([[0, 1, 2]], np.int32))
    assert Octree.around(point, texel=1.0).n_texels(0) == 8
    with pytest.raises(TextureError, match="a single point"):
        Octree.around(point)


@pytest.mark.parametrize("offset", [1e7, -1e7])
def test_far_away_the_texels_are_those_near_the_origin(offset):
    texel = 2.0**-6
    near = icosphere(subdivisions=2)
    # Vertices on a lattice fine enough to be exact there, too
    near = Mesh(np.rint(near.vertices * 2.0**20) / 2.0**20, near.faces)
    far = Mesh(near.vertices + offset, near.faces)
    move = np.int64(offset / texel)
    assert_array_equal(far.vertices - offset, near.vertices)
    a, b = (nodes_of(Octree.around(mesh, texel=texel), 0) for mesh in (near, far))
    assert_array_equal(b, a + move)


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_scale_changes_nothing(scale):
    mesh = icosphere(subdivisions=3, center=(0.1, 0.2, 0.3))
    small = Mesh(mesh.vertices * scale, mesh.faces)
    a, b = (nodes_of(Octree.around(m, resolution=50), 0) for m in (mesh, small))
    assert_array_equal(a, b)
    assert_allclose(Octree.around(small, resolution=50).texel, small.box.longest_side / 50)


def test_what_does_not_fit_in_memory_is_refused_before_the_work(monkeypatch):
    monkeypatch.setattr(octree, "available_memory", lambda: 3e8)
    Octree.around(icosphere(subdivisions=2), resolution=128)
    with pytest.raises(
        MemoryLimitError, match=r"need about \d+\.\d GB of tables; 0\.3 GB are free"
    ):
        Octree.around(icosphere(subdivisions=2), resolution=8000)


def test_sizes_that_make_no_sense_are_refused():
    mesh = icosphere(subdivisions=1)
    for wrong, message in [
        ({"texel": 0.0}, "texels of 0.0 make no sense"),
        ({"texel": np.nan}, "texels of nan make no sense"),
        ({"resolution": 0}, "a resolution of 0 texels"),
        ({"texel": 1.0, "resolution": 5}, "both"),
        ({"resolution": 24001}, "24001 texels along the longest side are too many"),
    ]:
        with pytest.raises(TextureError, match=message):
            Octree.around(mesh, **wrong)
    far = Mesh(mesh.vertices + 1e15, mesh.faces)
    with pytest.raises(TextureError, match="stored too coarsely"):
        Octree.around(far, texel=1.0)


def test_memory_grows_with_the_surface():
    # Bricks of 8-bit colours in all levels, and the tables, of a ball; dense is what a grid takes
    shares = []
    for resolution in (128, 256, 512):
        texture = VolumeTexture.around(icosphere(subdivisions=4), resolution=resolution)
        layer = texture.add_layer()
        tables = sum(np.asarray(t).nbytes for t in texture.octree.tables) + layer.slots.nbytes
        bricks = 512 * 4 * texture.octree.n_entries
        shares.append((bricks + tables) / (4 * resolution**3))
    assert shares[2] < 1 / 7
    assert shares[1] / shares[0] < 0.6
    assert shares[2] / shares[1] < 0.55
