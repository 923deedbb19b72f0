"""Real files made by others: what each holds, as its folder's README states it."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from meshsdf.errors import IoError
from meshsdf.io import read_mesh
from tests.io.examples import model, needs_models

pytestmark = needs_models

# OBJ counts the pairs of position and texture coordinate that faces use: fuze has 502 positions
# and spot 2930, more along seams; the bunny's other 1113 positions belong to no face.
COUNTS = {
    "1002_tray_bottom.STL": (13560, 4520),
    "3holes.off": (3596, 7200),
    "alligator.obj": (3208, 5981),
    "armadillo.obj": (43243, 86482),
    "boolean.glb": (2020, 3936),
    "busted.STL": (11634, 3878),
    "camelhead.off": (11381, 22704),
    "cheburashka.obj": (6669, 13334),
    "cow.obj": (2903, 5804),
    "decimated-knight.off": (502, 1000),
    "Duck.glb": (2399, 4212),
    "fandisk.obj": (6475, 12946),
    "featuretype.STL": (10428, 3476),
    "fuze.obj": (664, 1000),
    "multibody.stl": (96, 32),  # as stored; 20 after merging within each body
    "octagonal_pocket.stl": (9786, 3262),
    "soup.stl": (300, 100),
    "spot.obj": (3225, 5856),
    "stanford-bunny.obj": (34834, 69451),
    "suzanne.obj": (507, 968),
    "teapot.obj": (3644, 6320),
}


@pytest.mark.parametrize("name", COUNTS)
def test_nothing_is_lost_or_added(name):
    mesh = read_mesh(model(name))
    assert (mesh.n_vertices, mesh.n_faces) == COUNTS[name]


@pytest.mark.parametrize("name", COUNTS)
def test_another_reader_finds_the_same_triangles(name):
    scene = trimesh.load_scene(model(name), process=False)
    other = np.concatenate([part.triangles for part in scene.dump()])
    mine = read_mesh(model(name)).triangles

    def ordered(triangles):
        # Readers may order faces and the parts of a scene as they like; 1e-9 of the size is
        # far below the spacing of vertices and far above rounding.
        size = np.abs(mine).max()
        corners = np.round(triangles / size, 9) + 0.0
        # and to name the corners of a face from any of them.
        turns = np.stack([np.roll(corners, turn, axis=1).reshape(-1, 9) for turn in range(3)])
        keys = np.array([min(face.tolist()) for face in turns.transpose(1, 0, 2)])
        return keys[np.lexsort(keys.T)]

    assert_allclose(ordered(other), ordered(mine), rtol=0, atol=2e-9)


def test_the_text_of_a_file_is_kept_to_the_last_bit():
    lines = model("armadillo.obj").read_text().splitlines()
    spoken = [[float(word) for word in line.split()[1:]] for line in lines if line[:2] == "v "]
    assert read_mesh(model("armadillo.obj")).vertices.tobytes() == np.array(spoken).tobytes()


@pytest.mark.parametrize("name", ["empty.obj", "empty.stl"])
def test_files_without_faces_are_refused_in_words(name):
    with pytest.raises(IoError, match=r"holds no (faces|triangles)"):
        read_mesh(model(name))


def test_the_duck_stands_where_its_nodes_put_it():
    mesh = read_mesh(model("Duck.glb"))
    other = trimesh.load_scene(model("Duck.glb"))
    assert_allclose([mesh.box.lower, mesh.box.upper], other.bounds, rtol=1e-6)
    assert mesh.box.longest_side < 3  # its node scales by 0.01
    assert mesh.materials[0].image.shape == (512, 512, 3)
    assert mesh.uv.shape == (2399, 2)


def test_the_parts_of_boolean_are_placed():
    mesh = read_mesh(model("boolean.glb"))
    other = trimesh.load_scene(model("boolean.glb"))
    assert_allclose([mesh.box.lower, mesh.box.upper], other.bounds, rtol=1e-6)
    # 28 parts, two of which meet in a vertex once equal positions are merged.
    _, merged = np.unique(mesh.vertices, axis=0, return_inverse=True)
    a, b, c = merged[mesh.faces].T
    edges = coo_matrix((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, c])))
    assert connected_components(edges)[0] == 27


@pytest.mark.parametrize(
    ("name", "material", "image"),
    [
        ("fuze.obj", "a-super-duper-material", "fuze uv.jpg"),
        ("spot.obj", "spot", "spot_texture.png"),
    ],
)
def test_textured_files_keep_uv_and_image(name, material, image):
    notes = []
    mesh = read_mesh(model(name), warn=notes.append)
    assert notes == []
    (found,) = mesh.materials
    assert (found.name, found.image_name, found.image.shape) == (material, image, (1024, 1024, 3))
    assert (mesh.material_index == 0).all()
    lines = model(name).read_text().splitlines()
    spoken = {tuple(map(float, line.split()[1:3])) for line in lines if line[:3] == "vt "}
    assert set(map(tuple, mesh.uv.tolist())) == spoken


def test_positions_left_out_of_the_bunny_are_said():
    notes = []
    read_mesh(model("stanford-bunny.obj"), warn=notes.append)
    assert notes == ["1113 of 35947 positions are used by no face; left out"]


@pytest.mark.parametrize("name", COUNTS)
def test_a_file_cut_at_any_tenth_gives_a_sentence_or_fewer_faces(tmp_path, name):
    data = model(name).read_bytes()
    if len(data) > 1_000_000:
        pytest.skip("a long file would teach nothing that a short one does not")
    path = tmp_path / name
    for tenth in range(10):
        path.write_bytes(data[: len(data) * tenth // 10])
        try:
            found = read_mesh(path)
        except IoError:
            continue
        assert path.suffix == ".obj"
        assert found.n_faces < COUNTS[name][1]
