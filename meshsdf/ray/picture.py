"""Pictures of meshes: rays, a studio's light, and edges without steps."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float32, Int64

from ..arrays import Number
from ..errors import RayError
from ..kernels.parallel import even_ranges, run_pieces
from ..mesh import Mesh
from ..progress import Progress, silent
from .camera import Camera, Pixels
from .framing import frame
from .paint import PointPaint, choose_paint
from .scene import N_RAYS, PER_PIECE, PixelIndices, Scene, Seen, Skylight
from .shading import N_SETS, shade

Picture = Float32[np.ndarray, "h w 4"]
Turns = Int64[np.ndarray, " k"]

TILE = 16  # pixels: rays of a tile stay near each other in the tree
NEAR = 1e-6  # of the largest depth: where points nearer than that appear is not known well
CONTRAST = 0.05  # of square roots of linear colour: neighbours that differ more are an edge
EDGES_AT_ONCE = 2**16
EDGE_RAYS = 1  # to the sky, per place on an edge that needs them
MOST_PIXELS = 2**28
MOST_SAMPLES = 16


def render_mesh(
    mesh: Mesh | Scene,
    camera: Camera | None = None,
    *,
    width: int = 1280,
    height: int = 960,
    paint: np.ndarray | PointPaint | None = None,
    samples: int = 3,
    smooth: bool | None = None,
    occlusion: bool = True,
    even_light: bool | None = None,
    background: Sequence[Number] | np.ndarray | None = None,
    progress: Progress = silent,
) -> Picture:
    """Draw a mesh under a studio's light.

    Parameters
    ----------
    mesh : Mesh or Scene
        A `Scene` of a mesh saves its preparation when several pictures are made.
    camera : Camera, optional
        `frame` makes one that fits; by default a three-quarter view.
    width, height : int
        Pixels.
    paint : (n, 3) linear colours of the vertices, or callable, optional
        ``paint(points, faces)`` gets (k, 3) float64 points on the mesh, world units, and the (k,)
        int32 faces they lie on, and returns (k, 3) linear colours. It is called first for what
        the middles of pixels show, then for what edges show. By default the mesh's own colours
        and textures, or clay.
    samples : int
        Pixels on edges of shape or colour are means of ``samples x samples`` places, the others
        show their middle.
    smooth : bool, optional
        Shade with smooth normals, creases of 40 degrees kept, or show every face; by default as
        suits the size of the faces. A `Scene` has made that choice already.
    occlusion : bool
        Darken what the rest of the mesh hides from the sky.
    even_light : bool, optional
        Change how bright colours are, and little, and not their hue, as suits colours that mean
        something; by default if there is ``paint``.
    background : (3,) linear RGB, optional
        None leaves it transparent.
    progress : Progress
        Called between pieces of work.

    Returns
    -------
    picture : (height, width, 4) float32
        Linear RGB, not multiplied by alpha, and alpha, the share of the pixel that is covered.

    Raises
    ------
    RayError
        Numbers or colours that make no picture.
    SpatialError
        The mesh has no faces.

    Notes
    -----
    Accuracy: the nearest face at every place is exact (`spatial.ray_hits`), and so is ``paint``
    there. Parts thinner than a pixel that fall between middles and touch no edge are missed.
    Cost: a ray per pixel near the mesh, 4 short rays per pixel on it, ``samples²`` more per pixel
    on edges, and as many short ones where no light of a middle is near. The same bytes with any
    number of threads.

    References
    ----------
    Edges are supersampled where neighbours differ as in Mitchell 1987 (doi:10.1145/37401.37410),
    at places that differ in x and in y (Chiu, Shirley, Wang 1994, "Multi-jittered sampling",
    Graphics Gems IV).
    """
    _check(width, height, samples, background)
    scene = mesh if isinstance(mesh, Scene) else Scene(mesh, smooth=smooth)
    camera = camera or frame(scene.mesh, aspect=width / height)
    studio = _Studio(scene, camera, (width, height), paint, has_sky=occlusion)
    if even_light is not None:
        studio.is_painted = even_light
    pixels = _pixels_before(scene.mesh, camera, width, height)
    middles = studio.look(pixels + 0.5, pixels, 0, N_RAYS, progress)
    shown = pixels[middles.place]
    studio.keep(middles, shown)
    picture = np.zeros((height, width, 4), np.float32)
    picture[shown[:, 1], shown[:, 0], :3] = studio.colors(middles, shown)
    picture[shown[:, 1], shown[:, 0], 3] = 1.0
    if samples > 1:
        edges = np.argwhere(_edges(picture))[:, ::-1]
        for begin in range(0, len(edges), EDGES_AT_ONCE):
            _refine(picture, studio, edges[begin : begin + EDGES_AT_ONCE], samples, progress)
    if background is not None:
        fill_background(picture, np.asarray(background, np.float32))
    return picture


class _Studio:
    """A scene with camera, light and paint, and what the middles of pixels show."""

    def __init__(
        self,
        scene: Scene,
        camera: Camera,
        size: tuple[int, int],
        paint: np.ndarray | PointPaint | None,
        *,
        has_sky: bool,
    ) -> None:
        self.scene, self.camera, self.size, self.has_sky = scene, camera, size, has_sky
        self.is_painted = paint is not None
        self.paint = choose_paint(scene.mesh, paint)
        self.light: Skylight | None = None

    def look(
        self,
        places: Pixels,
        pixels: PixelIndices,
        turn: int | Turns,
        n_rays: int,
        progress: Progress,
    ) -> Seen:
        """What is seen at places within pixels; those of a 4 x 4 block have different rays."""
        sets = _sets(pixels, turn)
        options = {"n_rays": n_rays if self.has_sky else 0, "progress": progress}
        return self.scene.look(self.camera, self.size, places, sets, **options)

    def keep(self, middles: Seen, pixels: PixelIndices) -> None:
        """Remember what the middles of pixels show, for the light of their neighbours."""
        if self.has_sky:
            self.light = Skylight(middles, pixels, self.size)

    def colors(
        self, seen: Seen, pixels: PixelIndices, turn: int | Turns = 0
    ) -> Float32[np.ndarray, "k 3"]:
        """The linear colours of what is seen in pixels."""
        shares = np.ones(len(seen))
        if self.light is not None:
            sets = _sets(pixels, turn)

            def send(alone: np.ndarray) -> np.ndarray:
                few = seen.take(alone)
                return self.scene.send_rays(few, sets[alone], self.camera, n_rays=EDGE_RAYS)

            shares = self.light.shares(seen, pixels, send)
        albedo, colors = self.paint(seen), np.empty((len(seen), 3), np.float32)
        pieces = even_ranges(len(seen), len(seen) // PER_PIECE + 1)

        def work(piece: int) -> None:
            here = slice(*pieces[piece])
            colors[here] = shade(
                *(albedo[here], seen.normal[here], seen.toward[here], shares[here], self.camera),
                is_painted=self.is_painted,
            )

        run_pieces(work, len(pieces))
        return colors


def _sets(pixels: PixelIndices, turn: int | Turns) -> Turns:
    """Which set of rays to the sky each place within pixels has."""
    return (pixels[:, 0] % 4 + 4 * (pixels[:, 1] % 4) + turn) % N_SETS


def _pixels_before(mesh: Mesh, camera: Camera, width: int, height: int) -> PixelIndices:
    """The pixels (x, y) that the mesh may touch, tile by tile."""
    rows, columns = np.nonzero(_tiles_before(mesh, camera, width, height))
    within = np.stack(np.meshgrid(np.arange(TILE), np.arange(TILE)), axis=-1).reshape(-1, 2)
    pixels = (TILE * np.column_stack([columns, rows])[:, None] + within).reshape(-1, 2)
    if width % TILE or height % TILE:
        pixels = pixels[(pixels < [width, height]).all(axis=1)]
    return pixels


def _tiles_before(
    mesh: Mesh, camera: Camera, width: int, height: int
) -> Bool[np.ndarray, "rows columns"]:
    """The tiles that the boxes of the faces, as they appear in the picture, touch."""
    shape = -(-height // TILE), -(-width // TILE)
    places, depth = camera.project(mesh.vertices, width, height)
    is_used = np.zeros(mesh.n_vertices, bool)
    is_used[mesh.faces] = True
    if not depth[is_used].min() > NEAR * np.abs(depth[is_used]).max():
        return np.ones(shape, bool)
    corners = places[mesh.faces]
    # A pixel more, for rounding
    lower, upper = corners.min(axis=1) - 1.0, corners.max(axis=1) + 1.0
    is_before = ((upper >= 0) & (lower <= [width, height])).all(axis=1)
    last = np.array(shape[::-1]) - 1
    first = np.clip(lower[is_before] // TILE, 0, last).astype(np.int64)
    behind = np.clip(upper[is_before] // TILE, 0, last).astype(np.int64) + 1
    # Each box adds 1 from its first tile on and takes it away behind its last
    n_columns = shape[1] + 1
    change = np.zeros((shape[0] + 1) * n_columns)
    for x, y, sign in (
        (first, first, 1),
        (behind, behind, 1),
        (first, behind, -1),
        (behind, first, -1),
    ):
        change += sign * np.bincount(y[:, 1] * n_columns + x[:, 0], minlength=len(change))
    return change.reshape(-1, n_columns).cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0


def _edges(picture: Picture) -> Bool[np.ndarray, "h w"]:
    """Which pixels differ from one beside, above or below them."""
    edges = np.zeros(picture.shape[:2], bool)
    for channel in range(4):
        look = np.sqrt(picture[..., channel])
        for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
            differ = np.abs(look[here] - look[there]) > CONTRAST
            edges[here] |= differ
            edges[there] |= differ
    return edges


def _refine(
    picture: Picture, studio: _Studio, edges: PixelIndices, samples: int, progress: Progress
) -> None:
    """Give pixels the mean of many places in them."""
    n, n_places = len(edges), samples * samples
    i, j = np.divmod(np.arange(n_places), samples)
    within = np.column_stack([i + (j + 0.5) / samples, j + (i + 0.5) / samples]) / samples
    owner = np.repeat(np.arange(n), n_places)
    places = (edges[:, None] + within).reshape(-1, 2)
    turns = np.tile(np.arange(n_places), n)
    seen = studio.look(places, edges[owner], turns, 0, progress)
    owner = owner[seen.place]
    colors = studio.colors(seen, edges[owner], turns[seen.place])
    count = np.bincount(owner, minlength=n)
    for channel in range(3):
        total = np.bincount(owner, weights=colors[:, channel], minlength=n)
        picture[edges[:, 1], edges[:, 0], channel] = total / np.maximum(count, 1)
    picture[edges[:, 1], edges[:, 0], 3] = count / n_places


def fill_background(picture: Picture, background: Float32[np.ndarray, "3"]) -> None:
    """Put the picture before a background of one linear colour, in place."""
    alpha = picture[..., 3:].copy()
    picture[..., :3] = alpha * picture[..., :3] + (1.0 - alpha) * background
    picture[..., 3] = 1.0


def _check(
    width: int, height: int, samples: int, background: Sequence[Number] | np.ndarray | None
) -> None:
    where = "render_mesh"
    if width < 1 or height < 1 or width * height > MOST_PIXELS:
        fix = f"pass at least 1 x 1 and at most {MOST_PIXELS} pixels"
        raise RayError(f"the picture would have {width} x {height} pixels", where, fix)
    if not 1 <= samples <= MOST_SAMPLES:
        raise RayError(f"samples is {samples}", where, f"pass 1 to {MOST_SAMPLES}")
    if background is not None:
        color = np.asarray(background, np.float64)
        if color.shape != (3,) or not (color >= 0).all() or not np.isfinite(color).all():
            fix = "pass three linear numbers of at least 0, or None"
            raise RayError(f"the background is {color.tolist()}", where, fix)
