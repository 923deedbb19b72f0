"""meshsdf.io.dds beside a header put together from the format's own words, and another reader."""

import json
import struct

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from meshsdf.errors import IoError
from meshsdf.grid import Grid
from meshsdf.io import probe_volume, read_volume, write_volume
from meshsdf.io.volumes import check_volume_output
from tests.io.dense_examples import assert_centered, sphere_grid

DIRECT_X_10 = struct.unpack("<I", b"DX10")[0]


def texture(values, *, number=41, dimension=3, letters=DIRECT_X_10, **changes) -> bytes:
    """A file made by hand: values [z, y, x], of the type that DXGI gives this number."""
    nz, ny, nx = values.shape
    fields = {
        "size": 124,
        "flags": 0x80100F,
        "height": ny,
        "width": nx,
        "pitch": 0,
        "depth": nz,
        "levels": 1,
        "kind_size": 32,
        "kind_flags": 4,
        "letters": letters,
        "caps": 0x1008,
        "caps2": 0x200000,
        "misc": 0,
        "n_textures": 1,
    } | changes
    f = fields.__getitem__
    head = struct.pack(
        "<7I44x", *map(f, ("size", "flags", "height", "width", "pitch", "depth", "levels"))
    )
    head += struct.pack("<3I20x", f("kind_size"), f("kind_flags"), f("letters"))
    head += struct.pack("<2I12x", f("caps"), f("caps2"))
    more = struct.pack("<5I", number, dimension + 1, f("misc"), f("n_textures"), 0)
    return b"DDS " + head + (more if letters == DIRECT_X_10 else b"") + values.tobytes()


def test_a_texture_is_a_header_and_texels_with_x_fastest(tmp_path):
    grid = sphere_grid()
    for half, number, kind in ((False, 41, "<f4"), (True, 54, "<f2")):
        write_volume(tmp_path / "a.dds", grid, half=half, force=True)
        data = (tmp_path / "a.dds").read_bytes()
        texels = np.ascontiguousarray(grid.values.transpose(2, 1, 0), kind)
        pitch = 27 * texels.itemsize
        assert data == texture(texels, number=number, pitch=pitch)
        assert len(data) == 148 + texels.nbytes
        facts = json.loads((tmp_path / "a.dds.json").read_text())
        assert (facts["format"], facts["shape"]) == ("meshsdf.dds/1", [27, 26, 28])
        assert facts["dtype"] == texels.dtype.name
        flat = np.frombuffer(data, kind, offset=148)
        n = np.arange(len(flat))
        ijk = np.stack([n % 27, n // 27 % 26, n // (27 * 26)], axis=1)
        assert_array_equal(flat, grid.values[tuple(ijk.T)].astype(kind))
        if not half:
            assert_centered(flat, np.array(facts["origin"]) + facts["voxel_size"] * ijk)


@pytest.mark.parametrize("half", [False, True], ids=["float", "half"])
def test_another_reader_of_textures_finds_every_texel(tmp_path, half):
    core = pytest.importorskip("panda3d.core", reason="panda3d is not installed")
    grid = sphere_grid()
    path = tmp_path / "a.dds"
    write_volume(path, grid, half=half)
    found = core.Texture()
    assert found.read(core.Filename.from_os_specific(str(path)))
    assert found.texture_type == core.Texture.TT_3d_texture
    assert (found.x_size, found.y_size, found.z_size) == grid.values.shape
    assert (found.num_components, found.component_width) == (1, 2 if half else 4)
    texels = np.frombuffer(bytes(found.get_ram_image()), "<f2" if half else "<f4")
    # Its own textures begin below and at the back
    texels = texels.reshape(grid.values.shape[::-1])[::-1, ::-1]
    assert_array_equal(texels.transpose(2, 1, 0), grid.values.astype(texels.dtype))


@pytest.mark.parametrize(
    ("number", "letters", "kind"),
    [(41, DIRECT_X_10, "<f4"), (54, DIRECT_X_10, "<f2"), (0, 114, "<f4"), (0, 111, "<f2")],
)
def test_a_texture_of_others_gets_a_centred_box_and_says_so(tmp_path, number, letters, kind):
    values = np.random.default_rng(0).normal(size=(4, 5, 8)).astype(kind)
    (tmp_path / "a.dds").write_bytes(texture(values, number=number, letters=letters))
    for strange in (None, '{"format": "another/1"}', '{"mine": 1}'):
        if strange is not None:
            (tmp_path / "a.dds.json").write_text(strange)
        notes = []
        grid = read_volume(tmp_path / "a.dds", warn=notes.append)
        assert_array_equal(grid.values, values.transpose(2, 1, 0))
        assert (grid.voxel_size, grid.sign) == (1 / 8, "winding")
        last = grid.origin + grid.voxel_size * np.array([7, 4, 3])
        assert_array_equal(grid.origin, -last)
        assert len(notes) == 1
        assert "so the voxel size is 0.125" in notes[0]
        facts = probe_volume(tmp_path / "a.dds")
        assert (facts["shape"], facts["dtype"]) == ([8, 5, 4], np.dtype(kind).name)
        assert "voxel_size" not in facts


def test_of_several_levels_the_first_is_read(tmp_path):
    values = np.random.default_rng(0).normal(size=(4, 5, 8)).astype("<f4")
    smaller = bytes(4 * (2 * 2 * 4 + 1 * 1 * 2 + 1))
    path, notes = tmp_path / "a.dds", []
    path.write_bytes(texture(values, levels=4) + smaller)
    assert_array_equal(read_volume(path, warn=notes.append).values, values.transpose(2, 1, 0))
    assert notes[0] == "of 4 levels the first, which is the largest, is read"
    assert probe_volume(path)["levels"] == 4
    path.write_bytes(texture(values, levels=4))
    with pytest.raises(IoError, match="has 640 bytes of texels, but its counts tell 716"):
        read_volume(path)


def test_other_textures_are_refused_with_what_they_are(tmp_path):
    values, path = np.zeros((2, 2, 2), "<f4"), tmp_path / "a.dds"
    cases = [
        ({"dimension": 2}, "it is a flat texture"),
        ({"letters": 114, "caps2": 0}, "it is a flat texture"),
        ({"number": 28}, "its texels are of type 28, not one float each"),
        ({"letters": 0x31545844}, "not one float each"),
        ({"kind_flags": 0x41}, "its texels are no floats"),
        ({"n_textures": 6}, "a cube or a list"),
        ({"misc": 4}, "a cube or a list"),
        ({"size": 100}, "its headers take 100 and 32 bytes"),
        ({"kind_size": 1}, "its headers take 124 and 1 bytes"),
        ({"depth": 0}, "it claims 2 x 2 x 0 texels"),
        ({"levels": 3}, "it claims 3 levels of 2 x 2 x 2 texels"),
        ({"width": 2**32 - 1, "height": 2**32 - 1, "depth": 2**32 - 1}, "values take"),
        ({"width": 1}, "it has 32 bytes of texels, but its counts tell 16"),
    ]
    for changes, words in cases:
        path.write_bytes(texture(values, **changes))
        with pytest.raises(IoError, match=words):
            read_volume(path)


def test_a_json_that_tells_of_another_texture_is_refused(tmp_path):
    write_volume(tmp_path / "a.dds", sphere_grid())
    words = (tmp_path / "a.dds.json").read_text()
    for old, new, told in (
        ("26", "27", "it tells 27 x 27 x 28 float32, the .dds holds 27 x 26 x 28 float32"),
        ("float32", "float16", "it tells 27 x 26 x 28 float16"),
        ("dds/1", "dds/2", "its format is"),
        ('"format"', '"format', "a.dds.json is not a readable volume"),
    ):
        (tmp_path / "a.dds.json").write_text(words.replace(old, new, 1))
        with pytest.raises(IoError, match=told):
            read_volume(tmp_path / "a.dds")


def test_a_strangers_json_is_never_replaced(tmp_path):
    (tmp_path / "a.dds.json").write_text('{"mine": 1}')
    for force in (False, True):
        with pytest.raises(IoError, match=r"the output exists|does not belong to the \.dds volume"):
            write_volume(tmp_path / "a.dds", sphere_grid(), force=force)
        with pytest.raises(IoError, match=r"the output exists|does not belong to the \.dds volume"):
            check_volume_output(tmp_path / "a.dds", force=force)
    assert [file.name for file in tmp_path.iterdir()] == ["a.dds.json"]


def test_what_no_graphics_card_loads_is_written_with_a_word(tmp_path):
    notes = []
    long = Grid(np.ones((2049, 1, 1), np.float32), 1.0, np.zeros(3))
    write_volume(tmp_path / "a.dds", long, warn=notes.append)
    assert notes == ["2049 x 1 x 1 texels are written; Direct3D loads up to 2048 a side"]
    assert read_volume(tmp_path / "a.dds").values.shape == (2049, 1, 1)


def test_volumes_of_one_stem_keep_their_facts_apart_and_older_names_are_read(tmp_path):
    grid = sphere_grid()
    for suffix in (".dds", ".raw", ".exr"):
        write_volume(tmp_path / f"s{suffix}", grid)
    for suffix in (".dds", ".raw", ".exr"):
        found = read_volume(tmp_path / f"s{suffix}")
        assert_array_equal(found.values, grid.values)
        assert found.voxel_size == grid.voxel_size
    for suffix in (".dds", ".raw"):
        beside, older = tmp_path / f"s{suffix}.json", tmp_path / "s.json"
        assert probe_volume(tmp_path / f"s{suffix}")["facts_from"] == beside.name
        beside.rename(older)
        assert read_volume(tmp_path / f"s{suffix}").voxel_size == grid.voxel_size
        assert probe_volume(tmp_path / f"s{suffix}")["facts_from"] == "s.json"
    # The last is of the .raw volume, so the texture has none
    told = probe_volume(tmp_path / "s.dds")
    assert "voxel_size" not in told
    assert told["facts_from"].startswith("no s.dds.json is here, so no voxel size")
