"""A texture in space: an octree of texels around a surface, painted in layers, without UVs.

DeBry, Gibbs, Petty and Robins 2002 (doi:10.1145/566654.566649) and Benson and Davis 2002
(doi:10.1145/566654.566652) keep colours in an octree around the surface; here the octree's nodes
are bricks, found through the page table that distance bands use, too.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from jaxtyping import Float32, Float64

from ..arrays import Indices, Number, Points
from ..errors import TextureError
from ..kernels.octree_tables import ANY_PART
from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.texel_places import put_texels, texel_bits, texel_places, uniform_entries
from ..kernels.texture_lookup import ABSENT
from ..mesh import Mesh
from ..progress import Progress, silent
from ..spatial import ClosestPoint
from .channels import Numbers, channels_with
from .layer import Layer
from .lookup import Footprint, look_up
from .octree import Entries, Octree, Parts
from .pool import BrickPool, TilePool
from .surface_parts import Feet, parts_at

Normals = Float64[np.ndarray, "n 3"]
Color = tuple[Number, ...] | list[Number] | Float32[np.ndarray, "c"]
TextureFunction = Callable[..., Numbers]

ENTRIES_PER_PIECE = 512


class VolumeTexture:
    """Colours (and more) of a surface, kept by position in space.

    Parameters
    ----------
    octree : Octree
        Where texels are.
    base : "srgb8" or "half"
        How base colours are kept: 8 bits in sRGB, or linear in half precision.

    Attributes
    ----------
    octree : Octree
    pool, tiles : BrickPool, TilePool
        The texels of all layers.
    layers : list of Layer
        Bottom first. Change them through `add_layer`, `drop_layer` and their own attributes.
    surface : Mesh or None
        What the texture was made around; `colors(project=True)` looks up its closest points.
    """

    def __init__(self, octree: Octree, *, base: str = "srgb8") -> None:
        self.octree = octree
        self.channels = channels_with(base)
        self.base = base
        self.pool = BrickPool(self.channels)
        self.tiles = TilePool(self.channels)
        self.layers: list[Layer] = []
        self.surface: Mesh | None = None
        self._closest: ClosestPoint | None = None
        self._feet: Feet | None = None
        self._next_number = 0
        self._layers_ever: WeakValueDictionary[int, Layer] = WeakValueDictionary()
        self.flattened: Any = None  # what `layers.shown` keeps

    @classmethod
    def around(
        cls,
        mesh: Mesh,
        *,
        resolution: Number | None = None,
        texel: Number | None = None,
        base: str = "srgb8",
        divides: bool = False,
        progress: Progress = silent,
    ) -> "VolumeTexture":
        """An empty texture with the texels that a mesh needs; arguments, errors as `Octree.around`.

        ``divides=True`` is for parallel plates, folds and shells that lie closer than two texels.
        """
        octree = Octree.around(
            mesh, resolution=resolution, texel=texel, divides=divides, progress=progress
        )
        texture = cls(octree, base=base)
        texture.surface = mesh
        return texture

    def add_layer(self, name: str = "", *, color: Color = (0.0, 0.0, 0.0, 0.0)) -> Layer:
        """Put a new layer on top, of one linear colour with alpha all over."""
        slots = np.full(self.octree.n_entries, ABSENT, np.int32)
        slots[self.octree.level_first[-2] :] = self.tiles.code({"base": self.encoded_color(color)})
        number, self._next_number = self._next_number, self._next_number + 1
        layer = self.revived(Layer(number, name or f"layer {number + 1}", slots))
        self.layers.append(layer)
        return layer

    def revived(self, layer: Layer) -> Layer:
        """The layer that had this number once, made like this one; if there was none, this one.

        A number comes again only if the layer that had it was undone; changes may know that one.
        """
        old = self._layers_ever.get(layer.number)
        if old is None or old in self.layers:
            self._layers_ever[layer.number] = layer
            return layer
        vars(old).update(vars(layer))
        return old

    def drop_layer(self, layer: Layer) -> None:
        """Take a layer away, with its texels."""
        self.layers.remove(layer)
        self.pool.drop(layer.slots)
        layer.slots = np.full_like(layer.slots, ABSENT)

    def move_layer(self, layer: Layer, place: int) -> None:
        """Put a layer at a place in the list: 0 is the lowest, -1 the highest.

        Raises
        ------
        TextureError
            There is no such place.
        """
        n = len(self.layers)
        if not -n <= place < n:
            what = f"there is no place {place} among {n} layers"
            raise TextureError(what, "move_layer(place=...)", f"use {-n} to {n - 1}")
        self.layers.remove(layer)
        self.layers.insert(place % n, layer)

    def duplicate_layer(self, layer: Layer, name: str = "") -> Layer:
        """Put a copy of a layer above it; they share their texels until one is changed."""
        number, self._next_number = self._next_number, self._next_number + 1
        slots = layer.slots.copy()
        twin = replace(layer, number=number, name=name or f"{layer.name} copy", slots=slots)
        self.pool.hold(slots)
        self.layers.insert(self.layers.index(layer) + 1, twin)
        return twin

    def encoded_color(self, color: Color) -> np.integer:
        """The texel of a linear colour; alpha is 1 if it has none.

        Raises
        ------
        TextureError
            It has not 3 or 4 numbers, or they are not finite.
        """
        values = np.asarray(color, np.float32)
        if values.shape not in ((3,), (4,)) or not np.isfinite(values).all():
            what = f"{color} is no colour"
            raise TextureError(what, "color=...", "give 3 or 4 finite numbers: linear RGB, alpha")
        rgba = np.ones((1, 4), np.float32)
        rgba[0, : len(values)] = values
        return self.channels["base"].encoded(rgba)[0]

    def colors(
        self,
        points: Points,
        normals: Normals | None = None,
        footprint: Footprint = 0.0,
        *,
        channel: str = "base",
        layer: Layer | None = None,
        project: bool = False,
        parts: Parts | None = None,
    ) -> Numbers:
        """What the texture shows at points.

        Parameters
        ----------
        points : (n, 3) float64
            In the texture's space, on the surface or next to it.
        normals : (n, 3) float64, optional
            Which way the surface looks there, of any length: it tells the two sides of thin parts
            apart. Without them the first side answers.
        footprint : float or (n,) float64
            Width to average over, world units; finest texels if 0.
        channel : str
            "base", "normal", "height", "orm" or "mask".
        layer : Layer, optional
            Of this layer alone; else of all that are visible, blended.
        project : bool
            Look up the closest point of the surface (and its normal) in place of the point.
        parts : (n,) int64, optional
            What ``octree.parts_of`` says of the faces that the points lie on: it tells sheets apart
            that look the same way and lie closer than texels. Where it matters and is not given,
            the closest point of the surface tells.

        Returns
        -------
        (n, 4) float32
            Linear RGB (or the channel's values) and alpha (or coverage); NaN where a point is not
            finite. Continuous along the surface, but where sheets part.

        Raises
        ------
        TextureError
            There is no such channel, or nothing to project to.
        """
        if channel not in self.channels:
            what = f"there is no channel {channel!r}"
            raise TextureError(what, "channel=...", f"use one of {', '.join(self.channels)}")
        if project:
            points, normals, faces = self.nearest_places(points)
            parts = self.octree.parts_of(faces) if self.knows_parts else None
        elif parts is None and self.knows_parts:
            parts = self._parts_at(layer, points, footprint)
        self._fill_seen(layer, points, normals, footprint, parts)
        slots = (layer or self._shown()).slots
        pool = self.pool.arrays.get(channel)
        kind = self.channels[channel]
        if pool is None:
            pool = np.zeros((1, 1), kind.dtype)
            slots = np.where(slots >= 0, self._nothing(), slots)
        return look_up(
            self.octree, slots, pool, self.tiles.arrays[channel], kind.kind, points, normals,
            footprint, parts=parts,
        )  # fmt: skip

    def on_surface(self, points: Points) -> tuple[Points, Normals]:
        """The closest points of the surface, and the normals of the faces they lie on.

        Raises
        ------
        TextureError
            The texture knows of no surface.
        """
        return self.nearest_places(points)[:2]

    def nearest_places(self, points: Points) -> tuple[Points, Normals, Indices]:
        """As `on_surface`, and the faces that the points lie on."""
        if self.surface is None:
            what = "the texture does not know its surface"
            raise TextureError(what, "project=True", "set texture.surface to the mesh")
        found = self._closest_point()(points)
        corners = self.surface.vertices[self.surface.faces[found.face_index]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return found.point, normals, found.face_index

    @property
    def knows_parts(self) -> bool:
        """Whether some sheet is divided, and the surface is what the octree was made around."""
        octree, surface = self.octree, self.surface
        return octree.is_divided and surface is not None and surface.n_faces == octree.n_faces

    def feet(self, entries: Entries) -> tuple[Points, Indices]:
        """The surface's places (n, 3) next to the texels of entries, in the order of `places`, and
        the faces (n,) they lie on, each on the texel's own part; errors as `on_surface`."""
        if self.surface is None:
            what = "the texture does not know its surface"
            raise TextureError(what, "feet(entries)", "set texture.surface to the mesh")
        if self._feet is None or self._feet.mesh is not self.surface:
            self._feet = Feet(self.surface, self.octree)
        points, normals = self.places(entries)
        parts = self.texel_parts(entries) if self.knows_parts else np.full(len(points), ANY_PART)
        widths = self.octree.texel * 2.0 ** self.octree.tables.levels[entries]
        spacing = np.repeat(widths, np.diff(self._first(entries)))
        return self._feet(points, normals, parts, spacing)

    def texel_parts(self, entries: Entries) -> Parts:
        """(n,) parts, as bits, of the texels of entries, in the order of `places`."""
        first = self._first(entries)
        parts = np.empty(first[-1], np.int64)
        texel_bits(self.octree.tables, entries, first, parts)
        return parts

    def places(self, entries: Entries) -> tuple[Points, Normals]:
        """Positions and unit normals (n, 3) of the texels of entries, one entry after another."""
        first = self._first(entries)
        points, normals = np.empty((first[-1], 3)), np.empty((first[-1], 3))
        ranges = even_ranges(len(entries), -(-len(entries) // ENTRIES_PER_PIECE))
        run_pieces(
            lambda piece: texel_places(
                self.octree.tables, entries, first, *ranges[piece], points, normals
            ),
            len(ranges) if len(entries) else 0,
        )
        return points, normals

    def put(
        self, layer: Layer, entries: Entries, values: Numbers, *, channel: str = "base"
    ) -> None:
        """Store values, in the order of `places`, in bricks of a layer (each entry once).

        What was stored in those bricks' other channels stays. Bricks that other holders need, too,
        are copied first. Coarser levels are not brought up to date: see `mip.update_mips`.
        """
        slots = self.writable(layer, entries)
        first = self._first(entries)
        pool = self.pool.use(channel)
        kind = self.channels[channel].kind
        ranges = even_ranges(len(entries), -(-len(entries) // ENTRIES_PER_PIECE))
        run_pieces(
            lambda piece: put_texels(
                self.octree.tables, entries, slots, first, *ranges[piece], kind, values, pool
            ),
            len(ranges) if len(entries) else 0,
        )

    def writable(self, layer: Layer, entries: Entries) -> np.ndarray:
        """Slots of the entries that this layer alone needs, made from what it stores there.

        A tile becomes a brick of its colour; a brick that others hold, or that was there when a
        recording began, is copied; an entry that is not stored gets a brick in which nothing was
        written.
        """
        slots = layer.slots[entries]
        fresh = slots < 0
        shared = np.zeros(len(slots), bool)
        shared[~fresh] = self.pool.is_shared(slots[~fresh])
        if fresh.any():
            taken = self.pool.take(int(fresh.sum()))
            self._spread_tiles(slots[fresh], taken)
            slots[fresh] = taken
        if shared.any():
            old = slots[shared]
            slots[shared] = self.pool.copies(old)
            self.pool.drop(old)
        layer.slots[entries] = slots
        return slots

    def collapse_uniform(self, layer: Layer, entries: Entries) -> None:
        """Turn those of the entries whose texels all hold the same numbers into tiles."""
        entries = entries[layer.slots[entries] >= 0]
        slots = layer.slots[entries]
        uniform = np.ones(len(entries), bool)
        ranges = even_ranges(len(entries), -(-len(entries) // ENTRIES_PER_PIECE))
        for array in self.pool.arrays.values():
            one = np.empty(len(entries), bool)
            run_pieces(
                lambda piece, array=array, one=one: uniform_entries(
                    self.octree.tables, entries, slots, array, *ranges[piece], one
                ),
                len(ranges) if len(entries) else 0,
            )
            uniform &= one
        for entry, slot in zip(entries[uniform], slots[uniform], strict=True):
            t = first_texel(self.octree.tables.masks[entry])
            texel = {name: array[slot, t] for name, array in self.pool.arrays.items()}
            layer.slots[entry] = self.tiles.code(texel)
        self.pool.drop(slots[uniform])

    def _spread_tiles(self, codes: np.ndarray, taken: np.ndarray) -> None:
        for code in np.unique(codes[codes != ABSENT]):
            for name, value in self.tiles.texel(int(code)).items():
                if name in self.pool.arrays or value != self.channels[name].nothing:
                    self.pool.use(name)[taken[codes == code]] = value

    def _first(self, entries: Entries) -> np.ndarray:
        first = self.octree.tables.texel_first
        return np.concatenate([[0], np.cumsum(first[entries + 1] - first[entries])])

    def _closest_point(self) -> ClosestPoint:
        if self._closest is None or self._closest.mesh is not self.surface:
            self._closest = ClosestPoint(self.surface)
        return self._closest

    def _parts_at(self, layer: Layer | None, points: Points, footprint: Footprint) -> Parts:
        """Parts that points are on, by the surface's closest points."""
        slots = (layer or self._shown()).slots
        widths = np.atleast_1d(np.asarray(footprint, np.float64))
        return parts_at(self.octree, self._closest_point(), slots, points, widths)

    def _fill_seen(self, layer, points, normals, footprint, parts) -> None:
        """Evaluate what procedural layers show at points."""
        for one in [layer] if layer else self.layers:
            if getattr(one, "function", None) is not None and (layer or one.visible):
                from .procedural_layer import fill_seen  # which imports this module

                fill_seen(self, one, points, normals, footprint, parts)

    def _shown(self) -> Layer:
        from .layers import shown  # which imports this module

        return shown(self)

    def _nothing(self) -> int:
        return self.tiles.code({})


def first_texel(mask: np.ndarray) -> int:
    """The first texel that exists by an entry's (8,) mask."""
    i = int(np.flatnonzero(mask)[0])
    word = int(mask[i])
    return 64 * i + (word & -word).bit_length() - 1
