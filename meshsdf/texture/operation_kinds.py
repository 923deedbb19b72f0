"""The operations that `operations.perform` knows, as functions of a texture and parameters."""

from typing import Any

import numpy as np

from ..arrays import Number
from ..errors import TextureError
from ..kernels.texture_lookup import ABSENT
from ..progress import Progress, silent
from .ball import paint_ball_on
from .detail import Level, bake_level
from .layer import Layer
from .procedural import procedural, sees_shape
from .refine import coarsen
from .shape_distance import ShapeDistance
from .volume_texture import Color, VolumeTexture


def layer_numbered(texture: VolumeTexture, number: int) -> Layer:
    """The layer of a number.

    Raises
    ------
    TextureError
        There is none.
    """
    for layer in texture.layers:
        if layer.number == number:
            return layer
    numbers = ", ".join(str(layer.number) for layer in texture.layers) or "none"
    raise TextureError(f"there is no layer {number!r}", "layer=...", f"use one of: {numbers}")


def add_layer(
    texture: VolumeTexture, *, name: str = "", color: Color = (0.0, 0.0, 0.0, 0.0)
) -> None:
    """Put a layer of one colour on top; it gets the next number, counted from 0."""
    texture.add_layer(name, color=color)


def drop_layer(texture: VolumeTexture, *, layer: int) -> None:
    """Take a layer away."""
    texture.drop_layer(layer_numbered(texture, layer))


def change_layer(
    texture: VolumeTexture, *, layer: int, place: int | None = None, **attributes: Any
) -> None:
    """Set ``name``, ``opacity``, ``mode`` or ``visible``, or move it to a place from the bottom.

    Raises
    ------
    TextureError
        There is no such layer or attribute, or it cannot have that value.
    """
    found = layer_numbered(texture, layer)
    allowed = {
        "name": lambda v: isinstance(v, str),
        "opacity": lambda v: isinstance(v, int | float) and 0 <= v <= 1,
        "mode": lambda v: isinstance(v, str),
        "visible": lambda v: isinstance(v, bool),
    }
    for attribute, value in attributes.items():
        if attribute not in allowed or not allowed[attribute](value):
            what = f"a layer cannot have {attribute}={value!r}"
            fix = "set name, opacity from 0 to 1, mode, visible or place"
            raise TextureError(what, "operation 'layer'", fix)
    if place is not None and not 0 <= place < len(texture.layers):
        what = f"there is no place {place} among {len(texture.layers)} layers"
        raise TextureError(what, "operation 'layer'", "count from 0, the bottom")
    for attribute, value in attributes.items():
        setattr(found, attribute, float(value) if attribute == "opacity" else value)
    if place is not None:
        texture.layers.remove(found)
        texture.layers.insert(place, found)


def fill_color(texture: VolumeTexture, *, layer: int, color: Color) -> None:
    """Make a layer one linear colour all over; what it held in any channel is gone."""
    found = layer_numbered(texture, layer)
    tile = texture.tiles.code({"base": texture.encoded_color(color)})
    texture.pool.drop(found.slots)
    found.slots[:] = ABSENT
    found.slots[texture.octree.level_first[-2] :] = tile


def bake(
    texture: VolumeTexture,
    *,
    layer: int,
    texture_kind: str,
    level: Level = 0,
    progress: Progress = silent,
    **parameters: Any,
) -> None:
    """Make a layer's colour a procedural texture, see `detail.bake_level`.

    Kinds that see the shape they are on are asked of the texture's surface.

    Raises
    ------
    TextureError
        There is no such layer, level or texture, or it has other parameters.
    """
    found = layer_numbered(texture, layer)
    distance = surface_distance(texture, progress) if sees_shape(texture_kind) else None
    solid = procedural(texture_kind, signed_distance=distance, **parameters)
    bake_level(texture, found, solid, level=level, progress=progress)


def surface_distance(texture: VolumeTexture, progress: Progress = silent) -> ShapeDistance:
    """The signed distance of the surface that a texture was made around.

    Raises
    ------
    TextureError
        The texture knows of no surface.
    """
    if texture.surface is None:
        what = "the texture does not know its surface"
        raise TextureError(what, "operation 'bake'", "set texture.surface to the mesh")
    return ShapeDistance(texture.surface, progress=progress)


def paint_ball(
    texture: VolumeTexture,
    *,
    layer: int,
    center: list[Number] | tuple[Number, ...] | np.ndarray,
    radius: Number,
    color: Color,
    level: int = 0,
) -> None:
    """Give all texels within a ball one colour, see `ball.paint_ball_on`."""
    paint_ball_on(texture, layer_numbered(texture, layer), center, radius, color, level=level)


def coarsen_layer(texture: VolumeTexture, *, layer: int, tolerance: Number = 0.0) -> None:
    """Store no finer than needed, see `refine.coarsen`."""
    coarsen(texture, layer_numbered(texture, layer), tolerance=float(tolerance))


def stroke(texture: VolumeTexture, **record: Any) -> None:
    """Paint a stroke again from its record, see `stroke.replay`."""
    from .stroke import StrokeRecord, replay

    replay(texture, StrokeRecord.from_params(record))
