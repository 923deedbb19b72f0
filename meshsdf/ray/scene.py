"""What is seen through places of a picture: points, faces, normals, and rays to the sky."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float64, Int32, Int64

from ..kernels.parallel import even_ranges, run_pieces
from ..kernels.sky_light import mean_sums, sky_sums
from ..mesh import Mesh
from ..mesh.measures import face_normals
from ..progress import Progress, silent
from ..spatial.ray_hits import RayHits
from .camera import Camera, Pixels
from .normals import is_fine, smooth_normals
from .shading import ray_sets, sky

N_RAYS = 4  # to the sky, per pixel
LONGEST = 0.5  # of the box's diagonal: how far away things cast shadows
LIFT = 0.25  # of a pixel: where rays to the sky start above the surface
LEAST_LIFT = 1e-7  # of the box's diagonal
REACH = 12.0  # lifts: neighbours so far from the tangent plane lie elsewhere
PER_PIECE = 8192

Vectors = Float64[np.ndarray, "k 3"]
Numbers = Float64[np.ndarray, " k"]
Sets = Int64[np.ndarray, " k"]
Sums = Float64[np.ndarray, "k 2"]
PixelIndices = Int64[np.ndarray, "k 2"]
Send = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Seen:
    """The places of a picture where something is seen.

    Attributes
    ----------
    place : (k,) int64
        Which of the places asked for; rising.
    point : (k, 3) float64
        World units.
    face, barycentric : (k,) int32, (k, 3) float64
        Where that is on the mesh.
    toward : (k, 3) float64
        Unit vector to the eye.
    normal, facet : (k, 3) float64
        Unit normals for shading and of the face, both on the side seen.
    lift : (k,) float64
        A quarter of what a pixel covers there, world units.
    sums : (k, 2) float64
        The sky's light along a few rays, and what of it arrives.
    """

    place: Int64[np.ndarray, " k"]
    point: Vectors
    face: Int32[np.ndarray, " k"]
    barycentric: Vectors
    toward: Vectors
    normal: Vectors
    facet: Vectors
    lift: Numbers
    sums: Sums

    def __len__(self) -> int:
        return len(self.place)

    def take(self, which: Int64[np.ndarray, " few"]) -> "Seen":
        """Return some of the places."""
        return Seen(*(getattr(self, field.name)[which] for field in fields(Seen)))


class Scene:
    """A mesh that is ready to be looked at, from anywhere.

    Parameters
    ----------
    mesh : Mesh
        At least one face.
    smooth : bool or None
        Shade with smooth normals, creases kept, or show every face; None decides by the faces'
        size.

    Raises
    ------
    SpatialError
        The mesh has no faces.
    """

    def __init__(self, mesh: Mesh, *, smooth: bool | None = None) -> None:
        self.mesh = mesh
        # Building the tree takes one core as long as the normals take the other
        steps = [self._prepare_rays, lambda: self._prepare_normals(smooth)]
        run_pieces(lambda piece: steps[piece](), len(steps))

    def _prepare_rays(self) -> None:
        self.rays = RayHits(self.mesh)
        self.homes, self.parents = self.rays.homes_and_parents()

    def _prepare_normals(self, smooth: bool | None) -> None:
        self.face_normals = face_normals(self.mesh)
        is_smooth = is_fine(self.mesh) if smooth is None else smooth
        self.corner_normals = None
        if is_smooth:
            self.corner_normals = smooth_normals(self.mesh, of_faces=self.face_normals)

    def look(
        self,
        camera: Camera,
        size: tuple[int, int],
        pixels: Pixels,
        sets: Sets,
        *,
        n_rays: int = N_RAYS,
        progress: Progress = silent,
    ) -> Seen:
        """Return what is seen at places of a picture.

        Parameters
        ----------
        camera : Camera
            From where.
        size : (width, height)
            Of the picture, pixels.
        pixels : (k, 2) float64
            Pixel coordinates; near ones together are faster.
        sets : (k,) int64
            Which of the 16 sets of rays goes to the sky.
        n_rays : int
            How many rays each place sends to the sky; without any, ``sums`` are zero.
        progress : Progress
            Called between pieces of work.
        """
        pieces = even_ranges(len(pixels), len(pixels) // PER_PIECE + 1)
        parts: list[Seen | None] = [None] * len(pieces)
        light, directions = sky(camera), ray_sets(n_rays)

        def work(piece: int) -> None:
            begin, end = pieces[piece]
            seen = self._look(camera, size, pixels[begin:end], begin)
            if n_rays > 0:
                self._send_rays(seen, sets[seen.place], 0, len(seen), directions, light)
            parts[piece] = seen

        run_pieces(work, len(pieces), stage="rays", progress=progress)
        return _joined(parts)

    def _look(self, camera: Camera, size: tuple[int, int], pixels: Pixels, begin: int) -> Seen:
        origins, directions = camera.rays(*size, pixels)
        hits = self.rays.search(origins, directions)
        place = np.flatnonzero(hits.face_index >= 0)
        face, weights = hits.face_index[place], hits.barycentric[place]
        toward, facet = -directions[place], self.face_normals[face]
        side = np.where(np.einsum("kx,kx->k", facet, toward) < 0, -1.0, 1.0)[:, None]
        normal = facet * side
        facet = normal
        if self.corner_normals is not None:
            # Within the crease angle of the face's own normal, so the sum is not short
            normal = np.einsum("kc,kcx->kx", weights, self.corner_normals[face]) * side
            normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 0.5)
        covered = np.full(len(place), camera.pixel_size(size[1]))
        if camera.orthographic_height is None:
            covered *= hits.distance[place]
        corners = self.mesh.vertices[self.mesh.faces[face]]
        return Seen(
            *(place + begin, np.einsum("kc,kcx->kx", weights, corners), face, weights),
            *(toward, normal, facet),
            np.maximum(LIFT * covered, LEAST_LIFT * 2.0 * self.rays.radius),
            np.zeros((len(place), 2)),
        )

    def send_rays(self, seen: Seen, sets: Sets, camera: Camera, *, n_rays: int) -> Sums:
        """Return ``sums``, the sky's light along rays, of places that were seen without."""
        light, directions = sky(camera), ray_sets(n_rays)
        pieces = even_ranges(len(seen), len(seen) // PER_PIECE + 1)

        def work(piece: int) -> None:
            self._send_rays(seen, sets, *pieces[piece], directions, light)

        run_pieces(work, len(pieces))
        return seen.sums

    def _send_rays(
        self,
        seen: Seen,
        sets: Sets,
        begin: int,
        end: int,
        directions: Float64[np.ndarray, "s r 3"],
        light: Float64[np.ndarray, "9"],
    ) -> None:
        sky_sums(
            *(seen.point, seen.normal, seen.facet, seen.lift, sets, self.homes[seen.face]),
            *(begin, end, self.rays.center, LONGEST * 2.0 * self.rays.radius, directions, light),
            *(self.rays.corners, *self.rays.tree, self.parents, seen.sums),
        )


class Skylight:
    """How much of the sky's light arrives at the middles of pixels, and at other places.

    Parameters
    ----------
    middles : Seen
        What is seen at the middles of pixels.
    pixels : (k, 2) int64
        Which pixels (x, y) those are.
    size : (width, height)
        Of the picture, pixels.
    """

    def __init__(self, middles: Seen, pixels: PixelIndices, size: tuple[int, int]) -> None:
        self.middles = middles
        self.index = np.full(size[::-1], -1, np.int32)
        self.index[pixels[:, 1], pixels[:, 0]] = np.arange(len(middles), dtype=np.int32)
        # Twice: a block around, then one around those, the other way round
        self.means = self._means(middles, pixels, middles.sums, back=2)
        self.smooth = self._means(middles, pixels, self.means, back=1)

    def shares(self, seen: Seen, pixels: PixelIndices, send: Send | None = None) -> Numbers:
        """Return how much of the sky's light arrives, from 0 to 1, at places within pixels.

        Only places that lie beside no middle on the same piece of surface need rays of their own:
        ``send`` gets their numbers and returns their sums.
        """
        sums = self.smooth
        if seen is not self.middles:
            sums = self._means(seen, pixels, self.means, back=2)
            alone = np.flatnonzero(sums[:, 0] == 0)
            if len(alone) and send is not None:
                sums[alone] = send(alone)
        everything = sums[:, 0]
        lit = everything > 0
        return np.where(lit, sums[:, 1] / np.where(lit, everything, 1.0), 1.0)

    def _means(
        self, seen: Seen, pixels: PixelIndices, sums: Float64[np.ndarray, "near 2"], *, back: int
    ) -> Sums:
        n = len(seen)
        result = np.empty((n, 2))
        columns, rows = (np.ascontiguousarray(column) for column in pixels.T)
        pieces = even_ranges(n, n // PER_PIECE + 1)

        def work(piece: int) -> None:
            mean_sums(
                *(columns, rows, seen.point, seen.normal, seen.lift),
                *(*pieces[piece], back, REACH, self.index),
                *(self.middles.point, self.middles.normal, sums, result),
            )

        run_pieces(work, len(pieces))
        return result


def _joined(parts: Sequence[Seen]) -> Seen:
    if len(parts) == 1:
        return parts[0]
    columns = ([getattr(part, field.name) for part in parts] for field in fields(Seen))
    return Seen(*(np.concatenate(column) for column in columns))
