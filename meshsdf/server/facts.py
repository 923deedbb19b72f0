"""What a page must know of a project before it can paint, and the mesh that it draws."""

import dataclasses
import struct
from typing import Any

import numpy as np

from ..arrays import Vector3
from ..errors import ServerError
from ..kernels.blending import MODES
from ..kernels.brush import FALLOFFS
from ..kernels.wire_codes import PICTURES
from ..mesh import Mesh
from ..texture.brush import CHANNELS, KINDS, SHAPES, Brush
from ..texture.colors import linear_color
from ..texture.journal import Project
from ..texture.parameters import RANGES
from ..texture.procedural import PROCEDURALS, lengths_for, sees_shape
from ..texture.projection import Projection
from ..texture.sdf_patterns import ON_SHAPE
from ..texture.source_kinds import PROJECTIONS
from ..texture.volume_texture import VolumeTexture
from .exports import FORMATS
from .limits import MOST_IMAGE, MOST_PIXELS
from .messages import VERSION

DISPLAYS = ("color", "normal", "displacement")  # how pages can show what is painted
BRUSH_SHARE = 0.04  # of the box's longest side: the radius of the first brush
MOST_FACES = 20_000_000
BARE = (0.0, 0.0, 0.0, 0.0)  # what is seen where nothing was ever painted
PATTERNS: dict[str, type] = {**PROCEDURALS, **ON_SHAPE}
GIVEN = ("image", "hides", "texel")  # of a projection: known without asking


def project_facts(project: Project, name: str, origin: Vector3) -> dict[str, Any]:
    """The answer to GET /api/project; `PROTOCOL.md` lists it.

    Parameters
    ----------
    project : Project
    name : str
        Of what is painted, for people.
    origin : (3,) float64
        Where coordinates on the wire count from.
    """
    texture = project.texture
    mesh = texture.surface
    octree = texture.octree
    longest = float(mesh.box.size.max())
    return {
        "version": VERSION,
        "name": name,
        "file": project.path.name,
        "units": "",
        "texel": octree.texel,
        "origin": origin.tolist(),
        "box": [mesh.box.lower.tolist(), mesh.box.upper.tolist()],
        "levels": octree.n_levels,
        "entries": octree.n_entries,
        "texels": octree.n_texels(0),
        "vertices": mesh.n_vertices,
        "faces": mesh.n_faces,
        "resolution": round(longest / octree.texel),
        "base": texture.base,
        "base_color": list(BARE),
        "procedurals": [_procedural(*known, longest) for known in PATTERNS.items()],
        "blend_modes": list(MODES),
        "pictures": list(PICTURES),
        "displays": list(DISPLAYS),
        "brush": {
            "kinds": list(KINDS),
            "channels": list(CHANNELS),
            "falloffs": list(FALLOFFS),
            "shapes": list(SHAPES),
            "defaults": Brush(BRUSH_SHARE * longest or 1.0).to_dict(),
        },
        "projections": [_projection(kind, type_) for kind, type_ in PROJECTIONS.items()],
        "exports": [{"suffix": suffix, "words": words} for suffix, words in FORMATS.items()],
        "limits": {"image_bytes": MOST_IMAGE, "image_pixels": MOST_PIXELS},
    }


def mesh_bytes(mesh: Mesh, origin: Vector3) -> bytes:
    """The answer to GET /api/mesh.

    ``u32`` vertices, ``u32`` faces, positions less the origin as ``f32``, faces as ``u32``; all
    little endian.
    """
    points = (mesh.vertices - origin).astype("<f4")
    head = struct.pack("<II", mesh.n_vertices, mesh.n_faces)
    return head + points.tobytes() + mesh.faces.astype("<u4").tobytes()


def check_paintable(texture: VolumeTexture) -> None:
    """Refuse what no page could show.

    Raises
    ------
    ServerError
        The mesh has more faces than a browser draws.
    """
    n_faces = texture.surface.n_faces
    if n_faces > MOST_FACES:
        what = f"the mesh has {n_faces} faces, and pages draw up to {MOST_FACES}"
        fix = "decimate it: a texture fits any mesh of its surface"
        raise ServerError(what, "the painted mesh", fix)


def _procedural(kind: str, type_: type, longest: float) -> dict[str, Any]:
    """What a panel needs to offer a procedural fill, with lengths that suit the mesh."""
    lengths = lengths_for(kind, longest)
    known = [one for one in dataclasses.fields(type_) if "values" in one.metadata]
    return {
        "kind": kind,
        "words": _first_line(type_),
        "sees_shape": sees_shape(kind),
        "parameters": [_parameter(one, lengths.get(one.name, one.default)) for one in known],
    }


def _parameter(one: dataclasses.Field, default: Any) -> dict[str, Any]:
    kind, _, choices = one.metadata["values"].partition(":")
    least, most = RANGES.get(kind, (0.0 if kind == "length" else None, None))
    if kind == "color":
        default = [float(part) for part in np.asarray(linear_color(default)).ravel()]
    found = {
        "name": one.name,
        "type": kind,
        "default": list(default) if isinstance(default, tuple) else default,
        "least": least,
        "most": most,
        "words": one.metadata["meaning"],
    }
    return found | ({"choices": choices.split("|")} if choices else {})


def _projection(kind: str, type_: type[Projection]) -> dict[str, Any]:
    """What a panel needs to offer a projection: its options, None for those that must be given."""
    options = []
    for one in dataclasses.fields(type_):
        if one.name in GIVEN or not one.init:
            continue
        default = None if one.default is dataclasses.MISSING else one.default
        if one.default_factory is not dataclasses.MISSING:
            default = np.asarray(one.default_factory()).tolist()
        options.append({"name": one.name, "default": default})
    return {"kind": kind, "words": _first_line(type_), "options": options}


def _first_line(type_: type) -> str:
    return (type_.__doc__ or "").strip().splitlines()[0]
