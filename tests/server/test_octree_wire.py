"""meshsdf.server.octree_wire: the bytes alone lead to the entries that the octree finds."""

import json
import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from meshsdf.mesh import icosphere
from meshsdf.mesh.primitives import box_mesh
from meshsdf.server.octree_wire import octree_bytes, wire_origin
from meshsdf.texture import VolumeTexture

from .wire_examples import surface_points, thin_plate

TYPES = {"i32": "<i4", "i16": "<i2", "u8": "|u1"}


def read(data):
    """The head and the arrays, by the words of PROTOCOL.md."""
    (length,) = struct.unpack_from("<I", data)
    head = json.loads(data[4 : 4 + length])
    arrays = {}
    for name, told in head["arrays"].items():
        assert told["at"] % 4 == 0
        count, at = int(np.prod(told["shape"])), 4 + length + told["at"]
        arrays[name] = np.frombuffer(data, TYPES[told["type"]], count, at).reshape(told["shape"])
    return head, arrays


def sheet_normals(codes):
    """Octahedral codes to directions, as pages do."""
    x, y = (codes / 32767).T
    z = 1 - np.abs(x) - np.abs(y)
    fold = np.maximum(-z, 0)
    out = np.stack([x - np.copysign(fold, x), y - np.copysign(fold, y), z], axis=1)
    out[(codes == -32768).all(axis=1)] = 0
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)


def entry_at(head, arrays, level, brick, normal):
    """What the page table says of one brick."""
    *first, page = arrays["heads"][level].tolist()
    near = np.array(brick) - first
    if near.min() < 0 or near.max() > 4095:
        return -1
    for shift in (8, 4, 0):
        page = arrays["pages"][page][((near >> shift) & 15) @ [256, 16, 1]]
        if page == -1:
            return -1
    if page > -1:
        return page
    first, count = arrays["groups"][-3 - page]
    dots = sheet_normals(arrays["sheets"][first : first + count]) @ normal
    return first + int(np.argmax(dots))


@pytest.mark.parametrize(
    ("mesh", "size"),
    [
        (icosphere(subdivisions=3), {"resolution": 64}),
        (box_mesh((3.0, 2.0, 1.0), center=(4000.0, -7.0, 3.3)), {"resolution": 96}),
        (thin_plate(), {"texel": 1.0}),
    ],
    ids=["sphere", "far box", "plate"],
)
def test_the_page_table_leads_to_the_same_entries(mesh, size):
    texture = VolumeTexture.around(mesh, **size)
    octree, origin = texture.octree, wire_origin(texture)
    head, arrays = read(octree_bytes(texture))
    assert (head["levels"], head["entries"]) == (octree.n_levels, octree.n_entries)
    assert head["level_first"] == octree.level_first.tolist()
    assert_allclose(head["origin"], origin)
    points, normals = surface_points(mesh, 300, np.random.default_rng(0))
    for level in range(octree.n_levels):
        size = 8 * octree.spacing(level)
        assert_allclose(origin / size, np.round(origin / size), atol=1e-9)
        wanted = octree.find(level, np.floor(points / size).astype(np.int64), normals)
        bricks = np.floor((points - origin) / size).astype(np.int64)
        found = [entry_at(head, arrays, level, *one) for one in zip(bricks, normals, strict=True)]
        assert_array_equal(found, wanted)
        assert_array_equal(arrays["bricks"][found], bricks)
        assert (arrays["levels"][found] == level).all()
    assert_array_equal(arrays["parents"], octree.tables.parents)


def test_coordinates_on_the_wire_are_small():
    far = box_mesh((3.0, 2.0, 1.0), center=(4000.0, -7.0, 3.3))
    texture = VolumeTexture.around(far, resolution=96)
    _, arrays = read(octree_bytes(texture))
    # Two coarsest bricks hold about all of the mesh
    reach = 8 * texture.octree.spacing(texture.octree.n_levels - 1)
    assert np.abs(far.vertices - wire_origin(texture)).max() < 2 * reach
    assert np.abs(arrays["bricks"]).max() < 2 ** (texture.octree.n_levels + 1)
