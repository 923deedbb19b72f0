"""How a texture paints what a picture shows."""

from collections.abc import Callable

import numpy as np

from ..mesh import Mesh
from ..ray.camera import Camera
from ..ray.shading import CLAY
from ..texture.volume_texture import VolumeTexture

SHARE = 0.5  # of a pixel: interpolation averages over two texels' spacing already


def texture_paint(texture: VolumeTexture, mesh: Mesh, camera: Camera, height: int) -> Callable:
    """Return ``paint(points, faces)`` for `ray.render_mesh`: colours over clay.

    Every point is averaged over about what a pixel covers there.
    """
    triangles = mesh.triangles
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = SHARE * camera.pixel_size(height)

    def paint(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        widths = np.full(len(points), size)
        if camera.orthographic_height is None:
            widths *= np.linalg.norm(points - camera.position, axis=1)
        colors = texture.colors(points, normals[faces], widths).astype(np.float64)
        alpha = colors[:, 3:]
        return alpha * colors[:, :3] + (1 - alpha) * CLAY

    return paint
