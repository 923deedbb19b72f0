"""A narrow band: signed distances in 8^3 bricks where the surface passes, signs everywhere else.

It maps one to one to a VDB level set: a brick is a leaf, its mask the leaf's active mask.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from ..arrays import (
    BrickBarycentrics,
    BrickFaces,
    BrickMasks,
    BrickValues,
    Ijk,
    Ijk1,
    Points,
    Values,
    Vector3,
)
from ..errors import GridError
from ..kernels.brick_lookup import read_nodes
from .brick_index import BRICK, BrickIndex
from .hermite import Hermite


@dataclass(frozen=True, eq=False)
class NarrowBand:
    """Distances within ``half_width`` voxels of a surface; node (i, j, k) lies at
    ``voxel_size * (i, j, k) + translation``.

    Attributes
    ----------
    index : BrickIndex
        Which bricks exist; those that do not are outside or inside as a whole.
    values : (b, 8, 8, 8) float32
        World units, negative inside; +-background at nodes that are not active. An inner node at
        distance 0 holds -2**-126, so that its sign is not lost.
    active : (b, 8) uint64
        Bit ``8 j + k`` of word i is set where node (i, j, k) of the brick is active, that is,
        nearer to the surface than the background.
    voxel_size : float
        World units.
    translation : (3,) float64
        World position of node (0, 0, 0).
    half_width : float
        In voxels.
    sign : str
        How inside was told: "parity", "winding" or "unsigned".
    closest_face : (b, 8, 8, 8) int32 or None
        Face of the mesh with the closest point; -1 at nodes that are not active.
    barycentric : (b, 8, 8, 8, 2) float32 or None
        Weights of the face's second and third corner at the closest point.
    uncertain : (b, 8) uint64 or None
        Bits, as in ``active``, of nodes whose side is not certain; None where all are. Of an open
        mesh: the winding number is within 0.05 of 1/2, so that the side depends on how one thinks
        of the openings as filled. Of a mesh whose cracks were zipped: the node lies so near the
        surface that its side is not proved.
    hermite : Hermite or None
        Crossings, normals and features of the mesh, for dual contouring without it.
    n_inner_faces : int
        Faces of the mesh that lie inside the union of its overlapping parts, wholly or in part;
        distances are not measured to those.
    """

    index: BrickIndex
    values: BrickValues
    active: BrickMasks
    voxel_size: float
    translation: Vector3
    half_width: float
    sign: str
    closest_face: BrickFaces | None = None
    barycentric: BrickBarycentrics | None = None
    uncertain: BrickMasks | None = None
    hermite: Hermite | None = None
    n_inner_faces: int = 0

    def __post_init__(self) -> None:
        n = self.index.n_bricks
        for name in ("values", "active", "closest_face", "barycentric", "uncertain"):
            array = getattr(self, name)
            if array is not None and len(array) != n:
                raise GridError(
                    f"{name} holds {len(array)} bricks, the index {n}",
                    "NarrowBand(...)",
                    "give one entry for every brick of the index",
                )

    @property
    def is_signed(self) -> bool:
        """Whether values are negative inside."""
        return self.sign != "unsigned"

    @property
    def background(self) -> float:
        """Magnitude of the value beyond the band, world units, as stored (float32)."""
        return float(np.float32(self.half_width * self.voxel_size))

    @property
    def n_active(self) -> int:
        """Number of active nodes."""
        return int(np.bitwise_count(self.active).sum())

    @property
    def uncertain_voxels(self) -> int | None:
        """At how many nodes the side is not certain; None where it is at all of them."""
        return None if self.uncertain is None else int(np.bitwise_count(self.uncertain).sum())

    def uncertain_ijk(self) -> Ijk:
        """Return the (n, 3) int64 index coordinates of the nodes whose side is not certain."""
        if self.uncertain is None:
            return np.empty((0, 3), np.int64)
        return _nodes_of(self.uncertain, self.index)

    def active_box(self) -> tuple[Ijk1, Ijk1]:
        """Return the lowest and highest index coordinates of active nodes.

        Raises
        ------
        GridError
            No node is active.
        """
        if self.n_active == 0:
            raise GridError(
                "no node is active", "NarrowBand.active_box()", "use a smaller voxel size"
            )
        rows = self.active.astype("<u8").view(np.uint8).reshape(-1, BRICK, BRICK)
        flat = np.bitwise_or.reduce(rows, axis=(1, 2))
        used = (
            rows.any(axis=2),
            rows.any(axis=1),
            np.unpackbits(flat[:, None], axis=1, bitorder="little"),
        )
        low, high = np.empty(3, np.int64), np.empty(3, np.int64)
        for axis in range(3):
            brick, offset = np.nonzero(used[axis])
            node = self.index.coordinates[brick, axis] * BRICK + offset
            low[axis], high[axis] = node.min(), node.max()
        return low, high

    def active_mask(self) -> np.ndarray:
        """Return the (b, 8, 8, 8) bool mask of active nodes."""
        return node_mask(self.active)

    def active_ijk(self) -> Ijk:
        """Return the (n, 3) int64 index coordinates of the active nodes, brick by brick."""
        return _nodes_of(self.active, self.index)

    def active_values(self) -> Values:
        """Return the (n,) values of the active nodes, in the order of `active_ijk`."""
        return self.values[self.active_mask()].astype(np.float64)

    def to_world(self, ijk: Ijk) -> Points:
        """Return the (n, 3) world positions of nodes."""
        return self.voxel_size * ijk + self.translation

    def facts(self) -> dict:
        """Return what scripts ask for: kind, voxel_size, shape, active_voxels, n_bricks, …"""
        low, high = self.active_box()
        facts = {
            "kind": "narrow_band",
            "voxel_size": self.voxel_size,
            "translation": self.translation.tolist(),
            "first_node": low.tolist(),
            "shape": (high - low + 1).tolist(),
            "half_width": self.half_width,
            "background": self.background,
            "active_voxels": self.n_active,
            "n_bricks": self.index.n_bricks,
            "sign": self.sign,
            "has_closest_face": self.closest_face is not None,
            "has_hermite": self.hermite is not None,
        }
        if self.uncertain_voxels is not None:
            facts["uncertain_voxels"] = self.uncertain_voxels
        if self.n_inner_faces:
            facts["n_inner_faces"] = self.n_inner_faces
        return facts

    def value_at(self, ijk: Ijk) -> Values:
        """Return the (n,) values at nodes; +-background where there is no brick."""
        local = np.ascontiguousarray(ijk - self.index.origin * BRICK)
        out = np.empty(len(ijk))
        read_nodes(self.index.root, self.index.pages, self.values, self.background, local, out)
        return out


def node_mask(words: BrickMasks) -> Bool[np.ndarray, "b 8 8 8"]:
    """Return what (b, 8) words say of every node: bit ``8 j + k`` of word i is node (i, j, k)."""
    bits = np.unpackbits(words.astype("<u8").view(np.uint8), bitorder="little")
    return bits.view(bool).reshape(-1, BRICK, BRICK, BRICK)


def node_words(mask: Bool[np.ndarray, "b ..."]) -> BrickMasks:
    """Return the (b, 8) words of a mask of the 512 nodes of every brick; see `node_mask`."""
    packed = np.packbits(mask.reshape(len(mask), BRICK, BRICK**2), axis=2, bitorder="little")
    return packed.view("<u8").astype(np.uint64)[:, :, 0]


def _nodes_of(words: BrickMasks, index: BrickIndex) -> Ijk:
    """Index coordinates of the nodes whose bits are set, brick by brick."""
    slot, i, j, k = np.nonzero(node_mask(words))
    return index.coordinates[slot] * BRICK + np.stack([i, j, k], axis=1)
