"""An image as a texture: linear light, a pyramid of smaller copies, colours at coordinates.

Everything is averaged in linear light with colours multiplied by alpha (Porter, Duff 1984,
doi:10.1145/964965.808606), so that neither encoding nor what lies under transparent texels tints
a result.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt8

from ..arrays import Number, Points2, writable_alias
from ..errors import TextureError
from ..kernels.image_lookup import CLAMP, MIRROR, REPEAT, TRANSPARENT, sample_pyramid, shrink
from ..kernels.parallel import even_ranges, run_pieces
from ..srgb import linear_from_srgb

Colors = Float32[np.ndarray, "n 4"]
Texels = Float32[np.ndarray, "h w 4"]
Footprint = Number | Float64[np.ndarray, " w"] | Float64[np.ndarray, "w 2"]
Lengths = Float64[np.ndarray, " w"]
Widths = Float64[np.ndarray, "k 2"]

WRAPS = {"repeat": REPEAT, "clamp": CLAMP, "mirror": MIRROR, "transparent": TRANSPARENT}
PER_PIECE = 16384  # lookups: about a millisecond
ROWS_PER_PIECE = 64
WHERE = "Image.sample(uv, footprint_uv, wrap)"


@dataclass(frozen=True, eq=False)
class Pyramid:
    """An image and ever smaller copies of it, down to one texel.

    Attributes
    ----------
    coarse : (k, 4) float32
        Premultiplied texels of all levels but the first, row by row.
    table : (levels, 3) int64
        First texel, height and width of every level; the first starts an array of its own.
    sizes : (levels,) float64
        How many texels of the first level one texel is wide, along the longer way.
    """

    coarse: Float32[np.ndarray, "k 4"]
    table: Int64[np.ndarray, "levels 3"]
    sizes: Float64[np.ndarray, " levels"]


@dataclass(frozen=True, eq=False)
class Image:
    """A texture image; made by `from_srgb` or `from_linear`.

    Attributes
    ----------
    texels : (h, w, 4) float32
        Linear RGB times alpha, and alpha; first row on top.

    Notes
    -----
    Memory: 16 bytes per texel, and 5.3 more once a lookup has asked for a footprint.

    Examples
    --------
    >>> checker = Image.from_srgb(np.array([[[0], [255]], [[255], [0]]], np.uint8))
    >>> checker.sample(np.array([[0.25, 0.75], [0.5, 0.5]]))  # a texel's middle, and between all
    array([[0. , 0. , 0. , 1. ],
           [0.5, 0.5, 0.5, 1. ]], dtype=float32)
    """

    texels: Texels

    @staticmethod
    def from_srgb(image: UInt8[np.ndarray, "h w c"]) -> "Image":
        """Take an image as files store it.

        Parameters
        ----------
        image : (h, w, 1 to 4) uint8
            sRGB grey, grey and alpha, RGB, or RGB and alpha; alpha straight and not encoded.

        Raises
        ------
        TextureError
            No texels, or another number of channels.
        """
        _check_shape(image, "Image.from_srgb(image)")
        decoded = linear_from_srgb(np.arange(256) / 255.0).astype(np.float32)
        alpha = image[..., -1:].astype(np.float32) / np.float32(255.0)
        return _premultiplied(decoded[image], alpha)

    @staticmethod
    def from_linear(image: Float32[np.ndarray, "h w c"]) -> "Image":
        """Take an image in linear light, straight alpha; colours may exceed 1.

        Parameters
        ----------
        image : (h, w, 1 to 4) float32
            Linear grey, grey and alpha, RGB, or RGB and alpha.

        Raises
        ------
        TextureError
            No texels, another number of channels, NaN or infinite values, or alpha beyond [0, 1].
        """
        where = "Image.from_linear(image)"
        _check_shape(image, where)
        n_bad = int((~np.isfinite(image)).any(axis=2).sum())
        if n_bad:
            what = f"{n_bad} of {image.shape[0] * image.shape[1]} texels are NaN or infinite"
            raise TextureError(what, where, "replace them before")
        alpha = image[..., -1:]
        if image.shape[2] in (2, 4) and (alpha.min() < 0 or alpha.max() > 1):
            what = f"alpha runs from {alpha.min():g} to {alpha.max():g}"
            raise TextureError(what, where, "scale alpha to [0, 1]")
        return _premultiplied(image, alpha)

    @property
    def height(self) -> int:
        """Number of rows."""
        return self.texels.shape[0]

    @property
    def width(self) -> int:
        """Number of columns."""
        return self.texels.shape[1]

    @cached_property
    def base(self) -> Float32[np.ndarray, "k 4"]:
        """The texels in one row of memory, as kernels want them."""
        return writable_alias(self.texels).reshape(-1, 4)

    @cached_property
    def flat(self) -> Pyramid:
        """No copies at all: for lookups without a footprint."""
        table = np.array([[0, self.height, self.width]], np.int64)
        return Pyramid(np.empty((0, 4), np.float32), table, np.ones(1))

    @cached_property
    def pyramid(self) -> Pyramid:
        """Copies of half the height and width, rounded down; made once and kept.

        Each texel is the mean over its part of the image, of whatever size: copies have exactly
        the image's mean, up to one rounding to float32 per level.
        """
        shapes = [(self.height, self.width)]
        while shapes[-1] != (1, 1):
            shapes.append(tuple(max(1, n // 2) for n in shapes[-1]))
        starts = np.cumsum([0] + [rows * columns for rows, columns in shapes[1:]])
        coarse = np.empty((starts[-1], 4), np.float32)
        finer, size = self.base, shapes[0]
        for level, smaller in enumerate(shapes[1:]):
            part = coarse[starts[level] : starts[level + 1]]
            _shrink(finer, size, part, smaller)
            finer, size = part, smaller
        firsts = [0, *starts[:-1].tolist()]
        table = np.column_stack([firsts, np.array(shapes)]).astype(np.int64)
        sizes = np.array([max(self.height / h, self.width / w) for h, w in shapes])
        return Pyramid(coarse, table, sizes)

    def sample(
        self,
        uv: Points2,
        footprint_uv: Footprint = 0.0,
        wrap: str | tuple[str, str] = "repeat",
    ) -> Colors:
        """Return colours at texture coordinates.

        Parameters
        ----------
        uv : (n, 2) float64
            (0, 0) is the image's lower left corner, (1, 1) its upper right one.
        footprint_uv : float, (n,) or (n, 2) float64
            How wide an area to average, in units of uv, along both or each of u and v; 0 for the
            image itself.
        wrap : {"repeat", "clamp", "mirror", "transparent"} or two of them
            What lies beyond the borders, along u and v: the image again, its outermost texels, the
            image turned over at each border, or nothing.

        Returns
        -------
        colors : (n, 4) float32
            Linear RGB, straight alpha; all zero where nothing covers.

        Raises
        ------
        TextureError
            Coordinates that are not finite, an unknown wrap, or widths that are negative
            or not finite.

        Notes
        -----
        Method: bilinear between the middles of texels, and between the two levels of the pyramid
        whose texels are next in width (Williams 1983, doi:10.1145/800059.801126). An area longer
        along u or v is covered by up to 16 lookups as wide as its shorter side, or wider where it
        is longer still.
        Accuracy: without a footprint the bilinear interpolant, to rounding of float32.
        """
        wraps = wrap if isinstance(wrap, tuple) else (wrap, wrap)
        check_wraps(wraps, WHERE)
        check_finite(uv, "texture coordinates", WHERE)
        widths = uv_widths(footprint_uv, len(uv), WHERE)
        pyramid = self.levels_for(widths)
        uv, n = writable_alias(np.ascontiguousarray(uv)), len(uv)
        colors, pieces = np.empty((n, 4), np.float32), even_ranges(n, n // PER_PIECE + 1)

        def work(piece: int) -> None:
            begin, end = pieces[piece]
            self.look(pyramid, uv, widths, wraps, begin, end, colors)

        run_pieces(work, len(pieces))
        return colors

    def levels_for(self, widths: Widths) -> Pyramid:
        """The pyramid, or where no width needs it, the image alone."""
        return self.pyramid if widths.any() else self.flat

    def look(
        self,
        pyramid: Pyramid,
        uv: Points2,
        widths: Widths,
        wraps: tuple[str, str],
        begin: int,
        end: int,
        colors: Colors,
    ) -> None:
        """Fill colors[begin:end] as `sample` does, unchecked and on the caller's thread alone."""
        sample_pyramid(
            *(self.base, pyramid.coarse, pyramid.table, pyramid.sizes, uv, widths),
            *(WRAPS[wraps[0]], WRAPS[wraps[1]], begin, end, colors),
        )


def check_wraps(wraps: tuple[str, str], where: str) -> None:
    """Raise TextureError if one of the two has an unknown name."""
    for name in wraps:
        if name not in WRAPS:
            raise TextureError(f"unknown wrap {name!r}", where, f"pass one of {', '.join(WRAPS)}")


def check_finite(rows: Float64[np.ndarray, "n c"], name: str, where: str) -> None:
    """Raise TextureError if any row is not finite."""
    if np.isfinite(rows).all():
        return
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    what = f"{len(bad)} of {len(rows)} {name} are NaN or infinite (first: {bad[0]})"
    raise TextureError(what, where, "leave those places out")


def uv_widths(footprint: Footprint, n: int, where: str) -> Widths:
    """One row (u, v) for all, or n of them; TextureError if they are no widths."""
    given = np.array(footprint, np.float64)
    if given.shape not in ((), (n,), (n, 2), (1, 2)):
        what = f"the footprint has the shape {given.shape} for {n} places"
        raise TextureError(what, where, "pass one width, one per place, or two per place")
    good = (given >= 0) & (given < np.inf)
    if not good.all():
        what = f"{int((~good).sum())} of {given.size} footprints are negative, NaN or infinite"
        raise TextureError(what, where, "pass widths of at least 0")
    if given.ndim == 2:
        return given
    return np.repeat(given.reshape(-1, 1), 2, axis=1)


def _check_shape(image: np.ndarray, where: str) -> None:
    height, width, n_channels = image.shape
    if not (height and width and 1 <= n_channels <= 4):
        what = f"the image has {height} rows, {width} columns and {n_channels} channels"
        raise TextureError(what, where, "pass at least one texel with 1 to 4 channels")


def _premultiplied(values: np.ndarray, alpha: np.ndarray) -> Image:
    """The image of linear values, whose alpha is given if they have any."""
    texels = np.ones((*values.shape[:2], 4), np.float32)
    has_alpha = values.shape[2] in (2, 4)
    texels[..., :3] = values[..., : values.shape[2] - has_alpha]
    if has_alpha:
        texels *= alpha
        texels[..., 3:] = alpha
    texels.flags.writeable = False
    return Image(texels)


def _shrink(finer: np.ndarray, size: tuple, coarser: np.ndarray, smaller: tuple) -> None:
    """Fill a level from the one before."""
    pieces = even_ranges(smaller[0], smaller[0] // ROWS_PER_PIECE + 1)
    run_pieces(lambda piece: shrink(finer, *size, *smaller, *pieces[piece], coarser), len(pieces))
