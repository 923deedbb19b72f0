"""What colour a mesh says it has: texture image, material and vertex colours, filtered.

Vertex colours, base colour and image are factors of one product, as glTF 2.0 has them; what a mesh
lacks is white, and a face that has none of them is grey.
"""

from functools import cached_property

import numpy as np
from jaxtyping import Float64

from ..arrays import Barycentrics, Indices, Number, writable_alias
from ..errors import TextureError
from ..kernels.image_lookup import blend_corners
from ..kernels.parallel import even_ranges, run_pieces
from ..mesh import Mesh
from .image import Colors, Image, Lengths, check_finite, uv_widths

GREY = 0.8  # linear; of a face without any colour
PER_PIECE = 16384
FLAT = 1e-24  # square of the sine between two edges of a face without area
WHERE = "MeshColors(mesh)(face_index, barycentric, footprint)"


class MeshColors:
    """Colours at places on a mesh, given by face and barycentric coordinates.

    Parameters
    ----------
    mesh : Mesh
        Textured, coloured, or neither.

    Raises
    ------
    TextureError
        Texture coordinates of faces that are not finite, or materials that are not there.

    Notes
    -----
    Accuracy: without a footprint bilinear in linear light, to rounding of float32. Footprints are
    first order: the texture map of a triangle is affine, so their width along u and v is exact,
    but they reach beyond the face in the image and not on the surface.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> MeshColors(box_mesh())(np.array([0], np.int32), np.array([[0.2, 0.3, 0.5]]))
    array([[0.8, 0.8, 0.8, 1. ]], dtype=float32)
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.faces = writable_alias(mesh.faces)
        self.material = np.full(mesh.n_faces, -1, np.int32)
        if mesh.material_index is not None:
            self.material = mesh.material_index
        self._check()
        self.images = _images(mesh)
        self.uv = None if mesh.uv is None else writable_alias(mesh.uv)
        self.vertex_colors = None
        if mesh.vertex_colors is not None:
            self.vertex_colors = mesh.vertex_colors.astype(np.float64)

    @cached_property
    def density(self) -> Float64[np.ndarray, "m 2"]:
        """`uv_density` of the mesh; zeros if there are no images."""
        if any(self.images) and self.mesh.n_faces:
            return uv_density(self.mesh)
        return np.zeros((self.mesh.n_faces, 2))

    def __call__(
        self,
        face_index: Indices,
        barycentric: Float64[np.ndarray, "rows 3"],
        footprint: Number | Lengths = 0.0,
    ) -> Colors:
        """Return colours at places on the mesh.

        Parameters
        ----------
        face_index : (n,) int32
            The faces.
        barycentric : (n, 3) float64
            Weights of their corners.
        footprint : float or (n,) float64
            Diameter of what to average on the surface, world units.

        Returns
        -------
        colors : (n, 4) float32
            Linear RGB, straight alpha.

        Raises
        ------
        TextureError
            Faces that are not there, weights that are not finite, a footprint that is no width.
        """
        face, weights, widths = self._asked(face_index, barycentric, footprint)
        colors = np.ones((len(face), 4), np.float32)
        if self.vertex_colors is not None:
            colors *= self._blended(self.vertex_colors, face, weights)
        material = self.material[face]
        if self.vertex_colors is None:
            colors[material < 0, :3] = GREY
        for number, look in enumerate(self.mesh.materials):
            here = np.flatnonzero(material == number)
            if len(here) == 0:
                continue
            base = look.base_color
            if self.images[number] is not None:
                picked = slice(None) if len(here) == len(face) else here
                uv = self._blended(self.uv, face[picked], weights[picked])
                wide = widths if len(widths) == 1 else widths[picked]
                wide = wide * self.density[face[picked]] if wide.any() else wide
                base = base * self.images[number].sample(uv, wide)
                colors[picked] *= base
            else:
                colors[here] *= base
        return colors

    def _blended(
        self, attributes: Float64[np.ndarray, "v c"], face: Indices, weights: Barycentrics
    ) -> Float64[np.ndarray, "n c"]:
        n = len(face)
        out, pieces = np.empty((n, attributes.shape[1])), even_ranges(n, n // PER_PIECE + 1)
        run_pieces(
            lambda piece: blend_corners(attributes, self.faces, face, weights, *pieces[piece], out),
            len(pieces),
        )
        return out

    def _asked(
        self, face: Indices, weights: Float64[np.ndarray, "rows 3"], footprint: Number | Lengths
    ) -> tuple[Indices, Barycentrics, Float64[np.ndarray, "k 2"]]:
        """The places as kernels want them; TextureError if they are none."""
        if len(face) != len(weights):
            what = f"{len(face)} faces and {len(weights)} rows of barycentric coordinates"
            raise TextureError(what, WHERE, "pass one row per face")
        if len(face) and not 0 <= face.min() <= face.max() < self.mesh.n_faces:
            outside = (face < 0) | (face >= self.mesh.n_faces)
            what = f"{int(outside.sum())} of {len(face)} faces are not among {self.mesh.n_faces}"
            raise TextureError(what, WHERE, "leave places without a face out")
        check_finite(weights, "barycentric coordinates", WHERE)
        widths = uv_widths(footprint, len(face), WHERE)
        contiguous = (np.ascontiguousarray(array) for array in (face, weights))
        return *(writable_alias(array) for array in contiguous), widths

    def _check(self) -> None:
        mesh, where = self.mesh, "MeshColors(mesh)"
        highest = int(self.material.max(initial=-1))
        if highest >= len(mesh.materials) or len(self.material) != mesh.n_faces:
            what = f"{len(self.material)} material indices up to {highest} for {mesh.n_faces} faces"
            fix = f"use one of {len(mesh.materials)} materials for every face, or -1"
            raise TextureError(what, where, fix)
        for name, values in (("uv", mesh.uv), ("vertex_colors", mesh.vertex_colors)):
            if values is None:
                continue
            if len(values) != mesh.n_vertices:
                what = f"{len(values)} {name} for {mesh.n_vertices} vertices"
                raise TextureError(what, where, "give one row per vertex")
            check_finite(values.astype(np.float64), f"{name} of vertices", where)


def uv_density(mesh: Mesh) -> Float64[np.ndarray, "m 2"]:
    """How fast u and v grow at most along each face, per world unit; 0 on faces without area."""
    corners, uv = mesh.triangles, mesh.uv[mesh.faces]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    aa, ab, bb = (np.einsum("mi,mi->m", x, y) for x, y in ((a, a), (a, b), (b, b)))
    square = aa * bb - ab * ab  # of twice the area
    du, dv = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    # |gradient|^2 = d^T G^-1 d with the edges' Gram matrix G
    grown = bb[:, None] * du * du - 2 * ab[:, None] * du * dv + aa[:, None] * dv * dv
    flat = square <= FLAT * aa * bb
    grown = np.maximum(grown, 0.0) / np.where(flat, 1.0, square)[:, None]
    return np.where(flat[:, None], 0.0, np.sqrt(grown))


def _images(mesh: Mesh) -> list[Image | None]:
    """One for each material; those that share an array share it here, too."""
    made: dict[int, Image] = {}
    images: list[Image | None] = []
    for material in mesh.materials:
        pixels = material.image
        if pixels is None or mesh.uv is None:
            images.append(None)
            continue
        if id(pixels) not in made:
            made[id(pixels)] = Image.from_srgb(pixels)
        images.append(made[id(pixels)])
    return images
