"""Points with their signed distances to a mesh, for learners and for tests.

Of three kinds: near the surface, uniform in a box around the mesh, and on the surface.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float, Int8, Int32

from ..arrays import Number, Points
from ..errors import SdfError
from ..mesh import Mesh
from ..mesh.measures import face_normals
from ..mesh.sampling import SurfaceSampler
from ..mesh.two_set import TwoSetReport
from ..progress import Progress, silent
from .memory import require_memory
from .mesh_distance import MeshDistance
from .normalization import MARGIN, Normalization, NormalizationName, normalization
from .sign import SignMethod

KINDS = ("near", "uniform", "surface")
"""A sample's kind is its number in this list."""

VARIANCES = (0.0025, 0.00025)
"""Of the steps off the surface along x, y and z, where the sphere around the mesh has radius 1
(Park et al. 2019, supplement)."""

NEAR_SHARE = 47 / 50
"""Of all samples, those near the surface; the others are uniform (the authors' published code)."""

FINE = 1e-4  # of the reach of a mesh: steps of the points' type above this are told

PIECE = 1 << 18  # samples at once: a bound on memory, and enough for all cores


@dataclass(frozen=True, eq=False)
class Samples:
    """Points and what was measured there, kind after kind.

    Attributes
    ----------
    points : (n, 3) float32 or float64
        In the normalised space.
    distance : (n,) float32 or float64
        Signed, of exactly the points as they are stored, in the unit of the normalised space. 0 on
        the surface, to the rounding of points to their type.
    kind : (n,) int8
        Number in `KINDS`.
    normals : (n, 3) float32 or float64, or None
        Which way the distance grows: normals of faces on the surface, elsewhere away from the
        closest point, or towards it from inside. None if no sample was drawn on the surface.
    closest_point : (n, 3) float32 or float64, or None
        In the normalised space.
    face_index : (n,) int32 or None
        The face of the mesh with the closest point.
    normalization : Normalization
        Back to the world.
    seed : int
        What they were drawn with.
    sign, reason : str
        How inside was told, and why.
    n_uncertain : int
        Of how many samples the side is not certain, see `PointDistances.uncertain`.
    warnings : tuple of str
        What the user should know.
    """

    points: Float[np.ndarray, "n 3"]
    distance: Float[np.ndarray, " n"]
    kind: Int8[np.ndarray, " n"]
    normals: Float[np.ndarray, "n 3"] | None
    closest_point: Float[np.ndarray, "n 3"] | None
    face_index: Int32[np.ndarray, " n"] | None
    normalization: Normalization
    seed: int
    sign: str
    reason: str = ""
    n_uncertain: int = 0
    warnings: tuple[str, ...] = ()

    @property
    def n(self) -> int:
        """How many there are."""
        return len(self.points)

    def counts(self) -> dict[str, int]:
        """How many there are of every kind."""
        found = np.bincount(self.kind, minlength=len(KINDS)).tolist()
        return dict(zip(KINDS, found, strict=True))


def deepsdf_counts(n: int) -> dict[str, int]:
    """Split n samples as DeepSDF does: 47 of 50 near the surface, the others uniform.

    >>> deepsdf_counts(500_000)
    {'near': 470000, 'uniform': 30000}
    """
    near = int(n * NEAR_SHARE)
    return {"near": near, "uniform": n - near}


def sample_distances(
    mesh: Mesh,
    counts: int | Mapping[str, int] = 500_000,
    *,
    normalize: NormalizationName = "none",
    margin: Number = MARGIN,
    variances: Sequence[Number] = VARIANCES,
    seed: int = 0,
    sign: SignMethod = "auto",
    report: TwoSetReport | None = None,
    is_double: bool = False,
    closest: bool = False,
    max_memory: Number | None = None,
    progress: Progress = silent,
) -> Samples:
    """Draw points around a mesh and measure their signed distances to it.

    Parameters
    ----------
    mesh : Mesh
        Any triangles with area.
    counts : int or mapping
        How many of each kind ("near", "uniform", "surface"); a number is split by
        `deepsdf_counts`.
    normalize, margin
        See `normalization`; the points lie in that space.
    variances : sequence of numbers
        Of the Gaussian steps off the surface, in units of the squared radius of the sphere around
        the mesh, grown by the margin. Every point drawn on the surface gets one step of each.
    seed : int
        From 0 on. The same seed gives the same samples, with any number of threads.
    sign, report
        As for `MeshDistance`.
    is_double : bool
        Give float64 instead of float32.
    closest : bool
        Also give closest points and their faces.
    max_memory : number or None
        Bytes that may be taken; None for 80 % of what is free.
    progress : Progress
        Called between pieces of work.

    Raises
    ------
    SdfError
        There is nothing to draw, a number makes no sense, or `MeshDistance` refuses the mesh.
    MeshError
        No face has an area.
    MemoryLimitError
        The samples would not fit.

    Notes
    -----
    Accuracy: points are rounded to their type first and measured then, so a distance belongs to
    its point as stored, to the rounding of `MeshDistance` and to that of the type.
    Memory: that of the samples, and some 100 MB.

    References
    ----------
    Park et al., "DeepSDF: Learning Continuous Signed Distance Functions for Shape Representation",
    2019, doi:10.1109/CVPR.2019.00025.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import icosphere
    >>> found = sample_distances(icosphere(2.0, subdivisions=4), 1000, normalize="unit-sphere")
    >>> radius = np.linalg.norm(found.points, axis=1)
    >>> bool(np.abs(radius - 1 / 1.03 - found.distance).max() < 0.003)
    True
    """
    if not isinstance(counts, Mapping):
        counts = deepsdf_counts(counts)
    _check(counts, variances, seed)
    n = sum(counts.values())
    with_normals = counts.get("surface", 0) > 0
    width = 4 + 3 * with_normals + 3 * closest
    n_bytes = n * ((8 if is_double else 4) * width + 5)
    require_memory(2.0 * n_bytes, max_memory, where=f"{n} samples")  # twice while a file is written
    space = normalization(mesh, normalize, margin=margin)
    drawing = _Drawing(
        space,
        SurfaceSampler(mesh),
        MeshDistance(mesh, sign=sign, report=report),
        face_normals(mesh),
        space.reach * np.sqrt(np.array(list(variances), np.float64)),
        seed,
        np.dtype(np.float64 if is_double else np.float32),
    )
    arrays = _empty(n, drawing.dtype, with_normals=with_normals, closest=closest)
    at = n_uncertain = 0
    for kind, piece, size in _pieces(counts):
        within = partial(_still, progress, at / n)
        found, doubts = drawing.measured(kind, piece, size, within)
        for name, array in arrays.items():
            array[at : at + size] = found[name]
        at, n_uncertain = at + size, n_uncertain + doubts
        progress("samples", at / n)
    measure = drawing.measure
    warnings = measure.warnings + _warnings(arrays, space, measure.sign, n_uncertain)
    facts = {"normalization": space, "seed": seed, "sign": measure.sign, "reason": measure.reason}
    none = dict.fromkeys(("normals", "closest_point", "face_index"))
    return Samples(**none | arrays | facts, n_uncertain=n_uncertain, warnings=warnings)


@dataclass(frozen=True, eq=False)
class _Drawing:
    """What does not change from piece to piece."""

    space: Normalization
    sampler: SurfaceSampler
    measure: MeshDistance
    face_normals: Points
    steps: np.ndarray  # standard deviations, world units
    seed: int
    dtype: np.dtype

    def draw(self, kind: str, piece: int, n: int) -> Points:
        """World points; each piece has random numbers of its own."""
        key = (KINDS.index(kind), piece)
        random = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=key))
        if kind == "surface":
            return self.sampler(n, random).points
        if kind == "uniform":
            box = self.space.domain
            return self.space.world(box.lower + random.random((n, 3)) * box.size)
        n_steps = len(self.steps)
        on_surface = self.sampler(-(-n // n_steps), random).points
        steps = random.standard_normal((len(on_surface), n_steps, 3)) * self.steps[:, None]
        return (on_surface[:, None] + steps).reshape(-1, 3)[:n]

    def measured(
        self, kind: str, piece: int, n: int, progress: Progress
    ) -> tuple[dict[str, np.ndarray], int]:
        """The fields of `Samples`, and of how many the side is not certain."""
        space = self.space
        with np.errstate(over="ignore"):
            stored = space.normalized(self.draw(kind, piece, n)).astype(self.dtype)
        if not np.isfinite(stored).all():
            where, fix = "sample_distances(...)", "normalize, or ask for float64"
            raise SdfError("coordinates do not fit float32", where, fix)
        points = space.world(stored.astype(np.float64))
        found = self.measure(points, progress=progress)
        # Twice the rounding of a point as stored, beside that of the measure
        rounding = 2 * np.finfo(self.dtype).eps * np.abs(stored).max(axis=1).astype(np.float64)
        is_on = np.abs(found.distance) <= rounding / space.scale + self.measure.rounding_bound(
            points
        )
        doubts = 0 if found.uncertain is None else np.count_nonzero(found.uncertain & ~is_on)
        away = points - found.closest_point
        away /= np.where(is_on, 1.0, found.distance)[:, None]
        distance = found.distance
        if kind == "surface":
            distance[is_on] = 0.0
        return {
            "points": stored,
            "distance": space.scale * distance,
            "kind": np.full(n, KINDS.index(kind), np.int8),
            "normals": np.where(is_on[:, None], self.face_normals[found.face_index], away),
            "closest_point": space.normalized(found.closest_point),
            "face_index": found.face_index,
        }, int(doubts)


def _still(progress: Progress, share: float, stage: str, fraction: float) -> None:
    """Within a piece only Ctrl-C is looked for."""
    progress("samples", share)


def _empty(n: int, dtype: np.dtype, *, with_normals: bool, closest: bool) -> dict[str, np.ndarray]:
    arrays = {
        "points": np.empty((n, 3), dtype),
        "distance": np.empty(n, dtype),
        "kind": np.empty(n, np.int8),
    }
    if with_normals:
        arrays["normals"] = np.empty((n, 3), dtype)
    if closest:
        arrays["closest_point"] = np.empty((n, 3), dtype)
        arrays["face_index"] = np.empty(n, np.int32)
    return arrays


def _pieces(counts: Mapping[str, int]) -> Iterator[tuple[str, int, int]]:
    """Kind, number of the piece within it, and size."""
    for kind in KINDS:
        n = counts.get(kind, 0)
        for piece in range(-(-n // PIECE)):
            yield kind, piece, min(PIECE, n - piece * PIECE)


def _check(counts: Mapping[str, int], variances: Sequence[Number], seed: int) -> None:
    where = "sample_distances(...)"
    unknown = sorted(counts.keys() - set(KINDS))
    if unknown:
        raise SdfError(f"there is no kind {unknown[0]!r}", where, f"choose {', '.join(KINDS)}")
    if min(counts.values(), default=0) < 0 or sum(counts.values()) < 1:
        what = f"{sum(counts.values())} samples are asked for"
        raise SdfError(what, where, "ask for one at least")
    if not len(variances) or not all(0 < value < np.inf for value in variances):
        what = f"the variances are {', '.join(f'{value:g}' for value in variances) or 'none'}"
        raise SdfError(what, where, "pass numbers above 0")
    if seed < 0:
        raise SdfError(f"the seed is {seed}", where, "pass a number from 0 on")


def _warnings(
    arrays: dict[str, np.ndarray], space: Normalization, sign: str, n_uncertain: int
) -> tuple[str, ...]:
    found = []
    if n_uncertain:
        n = "1 sample" if n_uncertain == 1 else f"{n_uncertain} samples"
        found.append(f"{n}: the side is not certain")
    off = arrays["distance"][arrays["kind"] != KINDS.index("surface")]
    if sign != "unsigned" and len(off) and not (off < 0).any():
        found.append("no sample is inside")
    inner = np.count_nonzero(arrays["distance"][arrays["kind"] == KINDS.index("surface")])
    if inner:
        found.append(f"{inner} samples on faces that bound no inside have a distance that is not 0")
    largest = np.abs(arrays["points"]).max()
    spacing = float(np.spacing(largest)) / space.scale
    if spacing > FINE * space.reach:
        found.append(
            f"coordinates reach {largest:.3g}, where {arrays['points'].dtype.name} has steps of "
            f"{spacing:.2g}: normalise, or take float64"
        )
    return tuple(found)
