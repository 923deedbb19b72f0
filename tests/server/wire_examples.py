"""Painted textures, messages and frames that several tests share."""

import json
import struct
import zlib

import numpy as np

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh
from meshsdf.texture import Brush, VolumeTexture, paint
from meshsdf.texture.symmetry import Symmetry

SIZES = struct.Struct("<BBHIII")


def frame(kind, payload=b"", *, seq=0, version=2, flags=0, length=None, checksum=None):
    """A frame by the words of PROTOCOL.md, whose header may lie."""
    length = len(payload) if length is None else length
    checksum = zlib.crc32(payload) if checksum is None else checksum
    return SIZES.pack(kind, version, flags, seq, length, checksum) + payload


def good_frames():
    """One frame of every type that goes up."""
    hello = {"client": "0123456789abcdef" * 2, "version": 2, "run": "r", "since": 3}
    brush = Brush(0.1, symmetry=Symmetry(), stamp=np.ones((2, 3), np.float32)).to_dict()
    dab = struct.pack("<3f2h2H", 1.0, -2.0, 0.5, 32767, 0, 65535, 16)
    bake = {"kind": "bake", "params": {"layer": 0, "texture_kind": "checker"}, "replaces": True}
    bodies = {
        1: json.dumps(hello).encode(),
        2: json.dumps({"layer": 0, "brush": brush}).encode(),
        3: 3 * dab,
        7: json.dumps(bake).encode(),
        8: struct.pack("<6f", 1, 2, 3, *[np.nan] * 3),
    }
    return [frame(kind, bodies.get(kind, b""), seq=kind) for kind in range(1, 11)]


def thin_plate(thickness=0.5, turn=0.2):
    """A plate of 60 x 40 texels of 1, turned a little so that no grid plane is along it."""
    mesh = box_mesh((60.0, 40.0, thickness), center=(0.3, 0.2, 0.37))
    c, s = np.cos(turn), np.sin(turn)
    turned = np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    return Mesh(mesh.vertices @ turned.T, mesh.faces)


def surface_points(mesh, n, rng):
    """n random points of a mesh, evenly spread, and the normals of their faces."""
    corners = mesh.vertices[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    face = rng.choice(len(area), n, p=area / area.sum())
    u = rng.random((n, 2))
    u[u.sum(axis=1) > 1] = 1 - u[u.sum(axis=1) > 1]
    a, b, c = corners[face].transpose(1, 0, 2)
    return a + u[:, :1] * (b - a) + u[:, 1:] * (c - a), cross[face] / area[face, None]


def painted(mesh, rng, *, n_layers, n_strokes=8, base="srgb8", texel=None, resolution=None):
    """Layers with soft and hard strokes of all sizes, so of all levels, some of them erased."""
    texture = VolumeTexture.around(mesh, texel=texel, resolution=resolution, base=base)
    size = float(np.ptp(mesh.vertices, axis=0).max())
    for number in range(n_layers):
        alpha = 1.0 if number == 0 else 0.0
        layer = texture.add_layer(color=(*rng.random(3).tolist(), alpha))
        layer.opacity, layer.mode = (1.0, "normal") if number == 0 else (0.7, "multiply")
        for stroke in range(n_strokes):
            start, _ = surface_points(mesh, 1, rng)
            points, normals = texture.on_surface(start + rng.normal(0, 0.02 * size, (4, 3)))
            brush = Brush(
                size * float(rng.uniform(0.01, 0.1)),
                hardness=float(rng.random()),
                color=tuple(rng.random(4).tolist()),
                kind="erase" if stroke % 4 == 3 else "paint",
            )
            paint(texture, layer, brush, points, normals)
    return texture


def with_relief(texture, mesh, rng, *, n_strokes=8, channels=("height", "normal")):
    """Normals and heights beside the colours, on all layers: hard and soft, raised, dug, erased."""
    size = float(np.ptp(mesh.vertices, axis=0).max())
    for number in range(n_strokes * len(texture.layers)):
        start, _ = surface_points(mesh, 1, rng)
        points, normals = texture.on_surface(start + rng.normal(0, 0.02 * size, (4, 3)))
        channel = channels[number % len(channels)]
        brush = Brush(
            size * float(rng.uniform(0.01, 0.1)),
            hardness=float(rng.random()),
            channel=channel,
            color=(*rng.normal(size=3).tolist(), float(rng.random())),
            value=float(rng.uniform(-8, 8)),
            blend="add" if channel == "height" and number % 3 else "normal",
            kind="erase" if number % 7 == 6 else "paint",
        )
        paint(texture, texture.layers[number % len(texture.layers)], brush, points, normals)
    return texture
