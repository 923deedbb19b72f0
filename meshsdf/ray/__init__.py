"""What is seen? Pictures of meshes, by rays."""

from .camera import Camera
from .color_maps import color_map
from .distance_paint import DistancePaint
from .distance_picture import DistancePicture, render_distances
from .framing import VIEWS, frame
from .images import jpeg_bytes, png_bytes
from .legend import legend_width, with_legend
from .picture import render_mesh
from .scene import Scene

__all__ = [
    "VIEWS",
    "Camera",
    "DistancePaint",
    "DistancePicture",
    "Scene",
    "color_map",
    "frame",
    "jpeg_bytes",
    "legend_width",
    "png_bytes",
    "render_distances",
    "render_mesh",
    "with_legend",
]
