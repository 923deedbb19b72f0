"""Paint that outlives its mesh: a texture carried over to an edited, decimated or remeshed surface.

Texels are keyed by position, so wherever the surface is what it was, the new texture has the same
texels, byte for byte. Elsewhere, a texel that both have keeps its number, and any other takes what
the old texture shows at the closest point of the old surface.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float32
from scipy.spatial import cKDTree

from ..arrays import Indices, Number, Points
from ..errors import TextureError
from ..kernels.face_numbers import MOST_NUMBERS
from ..kernels.octree_tables import ANY_PART
from ..kernels.texture_lookup import ABSENT, FIRST_TILE
from ..mesh import Mesh
from ..progress import Progress, silent
from .layer import Layer
from .lookup import look_up
from .mesh_change import MeshChange, face_normals
from .mip import used_channels
from .octree import Entries, Octree, Parts
from .procedural_layer import ProceduralLayer, fill, is_painted, restart
from .refine import family_of, texel_mask
from .volume_texture import Normals, VolumeTexture

REACH = 8.0
CLEAR = 2.0  # texels from a changed face beyond which nothing is touched
STILL = 0.25  # texels by which the surface may move and texels near it stay: resampling blurs more
INWARD = 1 / 32  # texels by which places on an edge are moved into a face
TINY = 1e-300
HALF_DIAGONAL = 3.5 * 3.0**0.5  # of a brick's nodes


@dataclass(frozen=True, eq=False)
class Transferred:
    """A texture on another mesh, and how far it can be trusted.

    Attributes
    ----------
    texture : VolumeTexture
        Around the new mesh, with the same layers.
    confidence : (t,) float32
        For every texel, in the order of the octree's tables (``texel_first``): 1 if the surface
        there did not change; falling to 0 with the distance from the old surface and with the
        angle between old and new surface. What has 0 was filled from the nearest that has more.
    """

    texture: VolumeTexture
    confidence: Float32[np.ndarray, " t"]

    @property
    def entry_confidence(self) -> Float32[np.ndarray, " e"]:
        """The least confidence in every entry."""
        first = self.texture.octree.tables.texel_first[:-1]
        return np.minimum.reduceat(self.confidence, first)


def transfer(
    texture: VolumeTexture, new_mesh: Mesh, *, reach: Number = REACH, progress: Progress = silent
) -> Transferred:
    """Make a texture around a changed mesh from the texture around what it was.

    Parameters
    ----------
    texture : VolumeTexture
        It knows its surface, ``texture.surface``. It is not changed.
    new_mesh : Mesh
        In the same space: edited, cut, decimated or meshed anew.
    reach : float
        Distance from the old surface, in finest texels, from which on confidence is 0.

    Raises
    ------
    TextureError
        The texture knows of no surface, or the reach is not a positive number.
    MemoryLimitError
        As `Octree.around`.

    Notes
    -----
    Accuracy: bricks of any level that lie farther than two of that level's texels from every face
    that only one of the meshes has (as exact corner positions) are the same bytes.
    Procedural layers go on by their function; bricks of theirs that were painted are carried.
    Cost: closest points on both meshes for the texels of bricks near such faces.
    Limits: which layers store a brick in levels finer than the old texture did is not decided
    anew: detail is carried over, never added.
    """
    if texture.surface is None:
        what = "the texture does not know its surface"
        raise TextureError(what, "transfer(texture, ...)", "set texture.surface to its mesh")
    if not (np.isfinite(reach) and reach > 0):
        what = f"a reach of {reach} texels makes no sense"
        raise TextureError(what, "transfer(reach=...)", "give a positive number")
    known = texture.octree
    octree = Octree.around(new_mesh, texel=known.texel, divides=known.is_divided)
    new = VolumeTexture(octree, base=texture.base)
    new.surface = new_mesh
    change = MeshChange.between(texture.surface, new_mesh)
    levels = []
    for level in range(octree.n_levels):
        levels.append(_plan(texture, new, change, level, float(reach)))
        progress("closest points", (level + 1) / octree.n_levels)
    for number, layer in enumerate(texture.layers):
        new.layers.append(_carried(texture, new, layer, levels))
        progress("layers", (number + 1) / len(texture.layers))
    new._next_number = texture._next_number
    return Transferred(new, np.concatenate([plan.confidence for plan in levels]))


@dataclass(frozen=True, eq=False)
class _Plan:
    """Where the texels of one level (n entries, t texels) come from.

    Attributes
    ----------
    entries, old : (n,) int32
        Entries of the level; the old texture's entry in the same place, or -1.
    copied : (n, 512) bool
        Texels that the old entry has, too.
    whole : (n,) bool
        All of the entry's texels are copied.
    points, normals, parts : (t, 3) float64, (t, 3) float64, (t,) int64
        Where the old texture is looked up for what is not copied.
    confidence : (t,) float32
    """

    entries: Entries
    old: Entries
    copied: np.ndarray
    whole: np.ndarray
    points: Points
    normals: Normals
    parts: Parts
    confidence: np.ndarray


def _plan(texture, new, change: MeshChange, level: int, reach: float) -> _Plan:
    octree, known = new.octree, texture.octree
    entries = np.arange(*octree.level_first[level : level + 2], dtype=np.int32)
    old = np.full(len(entries), -1, np.int32)
    if level < known.n_levels:
        sheets = octree.tables.sheets[entries].astype(np.float64)
        told = _old_parts(texture, new, change, entries)
        old = known.find(level, octree.tables.bricks[entries], sheets, told)
    exists = texel_mask(new, entries)
    points, normals = new.places(entries)
    copied = exists & (old >= 0)[:, None]
    copied[old >= 0] &= texel_mask(texture, old[old >= 0])
    copied &= _same_way(texture, old, exists, copied, normals)
    confidence, parts = np.ones(len(points), np.float32), _parts_before(texture, old, exists)
    rows = np.nonzero(exists)[0]
    spacing = octree.spacing(level)
    middles = spacing * (8.0 * octree.tables.bricks[entries] + 3.5)
    touched = (copied != exists).any(axis=1)
    touched |= change.is_near(middles, (CLEAR + HALF_DIAGONAL) * spacing)
    spot = np.flatnonzero(touched[rows])
    if len(spot):
        keeps = copied[exists]
        here = _next_to(new, change, entries, spot, points)
        place = points, normals, parts, confidence, keeps
        _reproject(change, known, here, *place, spot, spacing, reach * known.texel)
        copied[exists] = keeps
    whole = (copied == exists).all(axis=1)
    return _Plan(entries, old, copied, whole, points, normals, parts, confidence)


def _same_way(texture, old: Entries, exists, copied, normals: Normals) -> np.ndarray:
    """(n, 512) bool: the old texel does not look the opposite way of the new one."""
    same = np.ones(exists.shape, bool)
    found = np.flatnonzero(old >= 0)
    if len(found):
        before = np.zeros((*exists.shape, 3), np.float32)
        own = np.zeros((len(found), 512, 3), np.float32)
        own[texel_mask(texture, old[found])] = texture.places(old[found])[1]
        before[found] = own
        after = np.zeros((*exists.shape, 3), np.float32)
        after[exists] = normals
        same[copied] = (before[copied] * after[copied]).sum(axis=1) >= 0
    return same


def _old_parts(texture, new, change: MeshChange, entries: Entries) -> Parts | None:
    """(n,) the part of the old surface that most texels of each entry are next to, as a bit."""
    known = texture.octree
    if not texture.knows_parts:
        return None
    feet, _ = new.feet(entries)
    numbers = known.face_parts[change.old(feet).face_index].astype(np.int64)
    counts = new.octree.texel_counts(entries)
    rows = MOST_NUMBERS * np.repeat(np.arange(len(entries)), counts) + numbers
    votes = np.bincount(rows, minlength=MOST_NUMBERS * len(entries)).reshape(-1, MOST_NUMBERS)
    return np.left_shift(np.int64(1), votes.argmax(axis=1))


def _parts_before(texture, old: Entries, exists) -> Parts:
    """(t,) the parts of the old texels in the place of new ones that are in ``exists`` (n, 512)."""
    parts = np.full(exists.shape, ANY_PART, np.int64)
    found = np.flatnonzero(old >= 0)
    if texture.octree.is_divided and len(found):
        own = np.full((len(found), exists.shape[1]), ANY_PART, np.int64)
        own[texel_mask(texture, old[found])] = texture.texel_parts(old[found])
        parts[found] = own
    return parts[exists]


def _next_to(new, change: MeshChange, entries: Entries, spot, points) -> tuple[Points, Indices]:
    """The places of the new surface next to the texels ``spot`` of entries, and their faces."""
    if not new.octree.is_divided:
        here = change.new(points[spot])
        return here.point, here.face_index
    feet, faces = new.feet(entries)
    return feet[spot], faces[spot]


def _reproject(
    change: MeshChange, known: Octree, here: tuple[Points, Indices], points, normals, parts,
    confidence, keeps, spot, spacing: float, reach: float,
) -> None:  # fmt: skip
    """For the texels ``spot`` of a level: set the confidence and whether the old texel's number is
    kept, and for the others the place to look up."""
    feet = _off_the_edge(here[0], change.new.mesh.triangles[here[1]], spacing)
    there = change.old(feet)
    old_normals = face_normals(change.old.mesh)[there.face_index]
    new_normals = face_normals(change.new.mesh)[here[1]]
    along = np.clip((old_normals * new_normals).sum(axis=1), 0, 1)
    trust = np.clip(1 - there.distance / reach, 0, 1) * along
    near = change.is_near(points[spot], CLEAR * spacing)
    trust[~near & keeps[spot]] = 1
    confidence[spot] = trust
    keeps[spot] &= ~near | (there.distance <= STILL * spacing)
    moves = ~keeps[spot]
    points[spot[moves]], normals[spot[moves]] = there.point[moves], old_normals[moves]
    if known.n_faces == change.old.mesh.n_faces:
        parts[spot[moves]] = known.parts_of(there.face_index[moves])
    lost = moves & (confidence[spot] == 0)
    good = np.ones(len(points), bool)
    good[spot[lost]] = False
    if lost.any() and good.any():
        source = np.flatnonzero(good)
        nearest = source[cKDTree(points[source]).query(feet[lost])[1]]
        points[spot[lost]], normals[spot[lost]] = points[nearest], normals[nearest]
        parts[spot[lost]] = parts[nearest]


def _off_the_edge(points: Points, corners: np.ndarray, spacing: float) -> Points:
    """Points of triangles (n, 3, 3) moved a little towards the middle of these, so that what is
    closest to them on a surface with the same triangle is in that triangle, not beside it."""
    way = corners.mean(axis=1) - points
    length = np.linalg.norm(way, axis=1, keepdims=True)
    return points + way * np.minimum(INWARD * spacing / np.maximum(length, TINY), 0.5)


def _carried(texture, new, layer: Layer, levels: list[_Plan]) -> Layer:
    """A layer of the new texture with what one of the old one holds."""
    slots = np.full(new.octree.n_entries, ABSENT, np.int32)
    made = replace(layer, slots=slots)
    if isinstance(made, ProceduralLayer) and made.function is not None:
        _carry_painted(texture, new, layer, made, levels)
        return made
    stored = _to_store(texture, new, layer, levels)
    for level, plan in enumerate(levels):
        keep = stored[plan.entries]
        before = np.where(plan.old >= 0, layer.slots[plan.old], ABSENT)
        as_is = keep & plan.whole & (before != ABSENT)
        _copy(texture, new, made, plan.entries[as_is], before[as_is])
        rest = np.flatnonzero(keep & ~as_is)
        if len(rest):
            _fill(texture, new, layer, made, level, plan, rest, before[rest])
    return made


def _to_store(texture, new, layer: Layer, levels: list[_Plan]) -> np.ndarray:
    """(e,) bool: entries that are to be stored for what the old layer stores, balanced."""
    stored = np.zeros(new.octree.n_entries, bool)
    for level, plan in enumerate(levels):
        stored[plan.entries] |= _stored(texture, new, layer, level, plan)
        finer = plan.entries[stored[plan.entries]]
        if level + 1 < len(levels) and len(finer):
            above = family_of(new, finer)
            stored[above[above >= 0]] = True
    return stored


def _carry_painted(
    texture, new, layer: ProceduralLayer, made: ProceduralLayer, levels: list[_Plan]
) -> None:
    """Let the function fill a layer anew, and lay over it what was painted onto the old one."""
    restart(new, made)
    fill(new, made, np.flatnonzero(_to_store(texture, new, layer, levels)).astype(np.int32))
    for level, plan in enumerate(levels):
        before = np.where(plan.old >= 0, layer.slots[plan.old], ABSENT)
        known = np.flatnonzero((before != ABSENT) & (made.slots[plan.entries] != ABSENT))
        whole = known[plan.whole[known]]
        new.pool.drop(made.slots[plan.entries[whole]])
        _copy(texture, new, made, plan.entries[whole], before[whole])
        rest = known[~plan.whole[known]]
        rest = rest[is_painted(texture, layer, plan.old[rest])]
        if len(rest):
            _fill(texture, new, layer, made, level, plan, rest, before[rest])


def _stored(texture, new, layer: Layer, level: int, plan: _Plan) -> np.ndarray:
    """(n,) bool: entries that are to be stored for what the old layer stores at the level."""
    if level >= min(texture.octree.n_levels, new.octree.n_levels - 1):
        return np.ones(len(plan.entries), bool)
    wanted = (plan.old >= 0) & (layer.slots[plan.old] != ABSENT)
    row = np.repeat(np.arange(len(plan.entries)), new.octree.texel_counts(plan.entries))
    some = np.flatnonzero(~(plan.whole | wanted)[row])
    bricks = np.floor(plan.points[some] / (8 * new.octree.spacing(level))).astype(np.int64)
    found = texture.octree.find(level, bricks, plan.normals[some], plan.parts[some])
    hit = (found >= 0) & (layer.slots[found] != ABSENT)
    wanted[row[some[hit]]] = True
    return wanted


def _copy(texture, new, made: Layer, entries: Entries, before: np.ndarray) -> None:
    """Bricks and tiles as they are."""
    bricks = before >= 0
    made.slots[entries[bricks]] = new.pool.take(int(bricks.sum()))
    for name, array in texture.pool.arrays.items():
        new.pool.use(name)[made.slots[entries[bricks]]] = array[before[bricks]]
    for code in np.unique(before[~bricks]):
        made.slots[entries[before == code]] = new.tiles.code(texture.tiles.texel(int(code)))


def _fill(texture, new, layer: Layer, made: Layer, level: int, plan: _Plan, rest, before) -> None:
    """Entries ``plan.entries[rest]``: texels as they are where both have them, else looked up."""
    entries = plan.entries[rest]
    chosen = np.zeros(len(plan.entries), bool)
    chosen[rest] = True
    chosen = np.repeat(chosen, new.octree.texel_counts(plan.entries))
    width = new.octree.spacing(level)
    keeps = plan.copied[rest] & (before != ABSENT)[:, None]
    slots = new.writable(made, entries)
    for name in used_channels(texture):
        pool, tiles = texture.pool.use(name), texture.tiles.arrays[name]
        values = look_up(
            texture.octree, layer.slots, pool, tiles, texture.channels[name].kind,
            plan.points[chosen], plan.normals[chosen], width, parts=plan.parts[chosen],
        )  # fmt: skip
        new.put(made, entries, values, channel=name)
        known = np.where(
            (before >= 0)[:, None], pool[before], tiles[np.maximum(FIRST_TILE - before, 0)][:, None]
        )
        target = new.pool.use(name)
        target[slots] = np.where(keeps, known, target[slots])
    new.collapse_uniform(made, entries)
