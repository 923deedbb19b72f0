"""Shapes whose sheets lie close over one another and look the same way; the texel is 1."""

import numpy as np

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh
from meshsdf.texture.mip import bake
from meshsdf.texture.volume_texture import VolumeTexture

QUAD = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
COLORS = np.array(
    [
        [0.8, 0.05, 0.02, 1], [0.02, 0.1, 0.7, 1], [0.1, 0.6, 0.05, 1], [0.7, 0.6, 0.1, 1],
        [0.5, 0.02, 0.6, 1], [0.05, 0.5, 0.6, 1], [0.3, 0.3, 0.3, 1],
    ],
    np.float32,
)  # fmt: skip


def joined(meshes):
    """Several meshes as one, and which one each face is of."""
    n_vertices = np.cumsum([0] + [mesh.n_vertices for mesh in meshes])
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    faces = [mesh.faces + first for mesh, first in zip(meshes, n_vertices, strict=False)]
    owner = np.repeat(np.arange(len(meshes)), [mesh.n_faces for mesh in meshes])
    return Mesh(vertices, np.concatenate(faces).astype(np.int32)), owner


def plate(z, tilt=0.0):
    """A rectangle of 60 x 40 at height z."""
    corners = np.array([[0.0, 0, 0], [60, 0, 60 * tilt], [60, 40, 60 * tilt], [0, 40, 0]])
    return Mesh(corners + np.array([0.3, 0.2, z]), QUAD)


def plates(gap, z, tilt=0.0):
    """Two of these, one over the other."""
    return joined([plate(z, tilt), plate(z + gap, tilt)])


def strip(curve, width, owners):
    """A curve (n, 2) drawn out along z, and which owner each face has (n - 1,)."""
    n = len(curve)
    low = np.column_stack([curve, np.full(n, 0.37)])
    vertices = np.concatenate([low, low + np.array([0, 0, width])])
    i = np.arange(n - 1)
    faces = [np.stack([i, i + 1, i + n], 1), np.stack([i + 1, i + 1 + n, i + n], 1)]
    return Mesh(vertices, np.concatenate(faces).astype(np.int32)), np.concatenate([owners] * 2)


def zigzag(n_leaves=7, gap=0.25):
    """Leaves of 40 x 20, each joined to the next one at alternating ends."""
    ends = np.array([0.3, 40.3])
    lines = [
        np.stack([np.linspace(*ends[:: 1 if k % 2 == 0 else -1], 41), np.full(41, gap * k)], 1)
        for k in range(n_leaves)
    ]
    leaf = np.repeat(np.arange(n_leaves), 41)[:-1]
    return strip(np.concatenate(lines) + np.array([0, 0.13]), 20.0, leaf)


def boxes(n=2, gap=0.2):
    """Boxes in one another."""
    sizes = [np.array([40.0, 30.0, 20.0]) - 2 * gap * k for k in range(n)]
    return joined([box_mesh(tuple(size), center=(0.31, 0.12, 0.43)) for size in sizes])


def baked(mesh, owner, **options):
    """A texture with every face's owner in its colour."""
    texture = VolumeTexture.around(mesh, texel=1.0, divides=True, **options)
    layer = texture.add_layer()
    bake(texture, layer, lambda points, faces: COLORS[owner[faces]])
    return texture, layer
