"""meshsdf.io.samples: samples of signed distances in files."""

import numpy as np
import pytest
import trimesh

from meshsdf.errors import IoError
from meshsdf.io import probe_samples, probe_volume, read_mesh, read_volume
from meshsdf.io.samples import DEEPSDF, PLAIN, write_samples
from meshsdf.mesh import box_mesh, icosphere
from meshsdf.sdf import sample_distances

COUNTS = {"near": 300, "uniform": 200, "surface": 100}


@pytest.fixture(scope="module")
def samples():
    mesh = icosphere(2.0, subdivisions=3, center=(5.0, 6, 7))
    return sample_distances(mesh, COUNTS, normalize="unit-sphere", closest=True, seed=9)


def loaded_as_deepsdf_does(path, subsample, random):
    """What a loader of this layout takes: as many samples outside as inside, by chance."""
    with np.load(path) as found:
        sides = [found[name] for name in ("pos", "neg")]
    sides = [side[~np.isnan(side[:, 3])] for side in sides]
    picked = [side[(random.random(subsample // 2) * len(side)).astype(int)] for side in sides]
    return np.concatenate(picked)


def test_plain_npz_holds_every_array_bit_by_bit(samples, tmp_path):
    path = tmp_path / "a.npz"
    write_samples(path, samples)
    with np.load(path, allow_pickle=False) as found:
        for name in ("points", "distance", "kind", "normals", "closest_point", "face_index"):
            assert found[name].dtype == getattr(samples, name).dtype
            assert found[name].tobytes() == getattr(samples, name).tobytes()
        assert str(found["format"]) == PLAIN
        space = samples.normalization
        assert (found["center"].tolist(), float(found["scale"])) == ([5, 6, 7], space.scale)
        assert (str(found["normalization"]), int(found["seed"])) == ("unit-sphere", 9)
        world = found["points"] / found["scale"] + found["center"]
    radius = np.linalg.norm(world - [5, 6, 7], axis=1)
    # The sphere's facets lie up to 0.02 within it
    assert np.abs(radius - 2 - samples.distance / space.scale).max() < 0.03


def test_deepsdf_npz_loads_as_its_authors_loader_expects(samples, tmp_path):
    path = tmp_path / "a.npz"
    write_samples(path, samples, layout="deepsdf")
    with np.load(path, allow_pickle=False) as found:
        pos, neg = found["pos"], found["neg"]
        offset, scale = found["offset"], found["scale"]
        assert str(found["format"]) == DEEPSDF
    for side in (pos, neg):
        assert (side.dtype, side.shape[1], side.flags.c_contiguous) == (np.float32, 4, True)
    assert len(pos) + len(neg) == 600
    assert (pos[:, 3] > 0).all()
    assert (neg[:, 3] <= 0).all()
    both = np.concatenate([pos, neg])
    table = np.column_stack([samples.points, samples.distance])
    assert {row.tobytes() for row in both} == {row.tobytes() for row in table}
    # world = point / scale - offset, as with the authors' files of normalisation parameters
    center = samples.normalization.center
    np.testing.assert_allclose(both[:, :3] / scale - offset, both[:, :3] / scale + center)
    batch = loaded_as_deepsdf_does(path, 256, np.random.default_rng(0))
    assert (batch.shape, batch.dtype) == ((256, 4), np.float32)
    assert ((batch[:, 3] > 0).sum(), (batch[:, 3] <= 0).sum()) == (128, 128)


def test_ply_shows_points_normals_and_distances_to_other_programs(samples, tmp_path):
    path = tmp_path / "a.ply"
    write_samples(path, samples)
    cloud = trimesh.load(path)
    assert isinstance(cloud, trimesh.PointCloud)
    np.testing.assert_array_equal(cloud.vertices, samples.points)
    raw = cloud.metadata["_ply_raw"]["vertex"]["data"]
    names = ["x", "y", "z", "distance", "kind", "nx", "ny", "nz"]
    names += ["closest_x", "closest_y", "closest_z", "face_index"]
    assert sorted(raw.dtype.names) == sorted(names)
    columns = {"distance": samples.distance, "kind": samples.kind, "nz": samples.normals[:, 2]}
    columns |= {"closest_y": samples.closest_point[:, 1], "face_index": samples.face_index}
    for name, values in columns.items():
        np.testing.assert_array_equal(raw[name].reshape(-1), values)
    header = path.read_bytes().split(b"end_header")[0].decode()
    space = samples.normalization
    assert f"comment meshsdf_scale {space.scale!r}\n" in header
    assert "comment meshsdf_center 5.0 6.0 7.0\n" in header
    assert "comment kind 2 is surface\n" in header


@pytest.mark.parametrize("is_double", [False, True])
@pytest.mark.parametrize(("name", "layout"), [("a.npz", "plain"), ("a.ply", "plain")])
def test_headers_tell_what_is_there(tmp_path, name, layout, is_double):
    found = sample_distances(box_mesh(), {"near": 7}, is_double=is_double, seed=3)
    write_samples(tmp_path / name, found, layout=layout)
    facts = probe_samples(tmp_path / name)
    assert facts == {
        "kind": "samples",
        "n": 7,
        "dtype": "float64" if is_double else "float32",
        "format": PLAIN,
        "normalization": "none",
        "sign": found.sign,
        "seed": 3,
        "n_uncertain": 0,
        "center": [0, 0, 0],
        "scale": 1,
        "has_normals": False,
        "has_closest_point": False,
    }


def test_files_of_the_authors_own_program_are_known(tmp_path):
    path = tmp_path / "theirs.npz"
    np.savez(path, pos=np.ones((5, 4), np.float32), neg=-np.ones((3, 4), np.float32))
    facts = probe_samples(path)
    assert (facts["format"], facts["n"]) == ("DeepSDF", 8)
    assert (facts["n_pos"], facts["n_neg"]) == (5, 3)


def test_samples_are_no_volume_and_volumes_no_samples(samples, tmp_path):
    for layout in ("plain", "deepsdf"):
        path = tmp_path / f"{layout}.npz"
        write_samples(path, samples, layout=layout)
        for function in (read_volume, probe_volume):
            with pytest.raises(IoError, match=f"{layout}.npz holds samples .*, not a volume"):
                function(path)
    write_samples(tmp_path / "a.ply", samples)
    with pytest.raises(IoError, match="it holds 600 points, but no faces"):
        read_mesh(tmp_path / "a.ply")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    assert probe_samples(tmp_path / "other.npz") is None
    (tmp_path / "noise.npz").write_bytes(np.random.default_rng(0).bytes(500))
    assert probe_samples(tmp_path / "noise.npz") is None
    start = (tmp_path / "a.ply").read_bytes()
    for end in range(0, 400, 7):
        (tmp_path / "cut.ply").write_bytes(start[:end])
        assert probe_samples(tmp_path / "cut.ply") is None


def test_the_same_samples_give_the_same_bytes(samples, tmp_path):
    for name, layout in (("a.npz", "plain"), ("d.npz", "deepsdf"), ("p.ply", "plain")):
        one, two = tmp_path / name, tmp_path / f"again_{name}"
        write_samples(one, samples, layout=layout)
        write_samples(two, samples, layout=layout)
        assert one.read_bytes() == two.read_bytes()


def test_places_that_cannot_be_written_are_refused(samples, tmp_path):
    with pytest.raises(IoError, match=r"with suffix '\.csv'"):
        write_samples(tmp_path / "a.csv", samples)
    with pytest.raises(IoError, match=r"that of \.npz files, not of \.ply"):
        write_samples(tmp_path / "a.ply", samples, layout="deepsdf")
    write_samples(tmp_path / "a.npz", samples)
    with pytest.raises(IoError, match="the output exists"):
        write_samples(tmp_path / "a.npz", samples)
    write_samples(tmp_path / "a.npz", samples, layout="deepsdf", force=True)
