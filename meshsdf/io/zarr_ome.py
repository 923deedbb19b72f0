"""The attributes of OME-Zarr 0.5 that say where the values of a Zarr array lie in space.

Axes are z, y, x, as the array's; a scale and a translation lead from an index to the world, and a
value is that of the centre of its voxel, so the translation is the place of the first node.
(OME-Zarr 0.5, ngff.openmicroscopy.org/0.5.)
"""

from collections.abc import Sequence

import numpy as np

from ..arrays import Number, Vector3
from .dense_header import one_spacing
from .vdb_stream import UnsuitedError, printable

VERSION = "0.5"
AXES = ("z", "y", "x")

_FARTHEST = 1e300  # NaN is not below it


def ome_attributes(path: str, voxel_size: Number, first: Vector3) -> dict:
    """What a group says of the array at ``path``, whose first node lies at ``first``."""
    transformations = [
        {"type": "scale", "scale": [float(voxel_size)] * 3},
        {"type": "translation", "translation": first[::-1].tolist()},
    ]
    dataset = {"path": path, "coordinateTransformations": transformations}
    axes = [{"name": name, "type": "space"} for name in AXES]
    return {
        "version": VERSION,
        "multiscales": [{"name": "surface", "axes": axes, "datasets": [dataset]}],
    }


def placed_array(ome: object) -> tuple[str, float, Vector3]:
    """Return path, voxel size and first node of the array of the finest level.

    Raises
    ------
    ValueError
        The attributes make no sense.
    UnsuitedError
        Axes are not z, y, x, or voxels no cubes.
    """
    image = _only(_entry(ome, "multiscales", list), "image")
    names = tuple(_entry(axis, "name", str) for axis in _entry(image, "axes", list))
    if names != AXES:
        what = f"its axes are {', '.join(map(printable, names))}"
        raise UnsuitedError(what, "write one channel of one moment, with the axes z, y, x")
    dataset = _only(_entry(image, "datasets", list), "level")
    path = _entry(dataset, "path", str)
    parts = path.split("/")
    if not path.isprintable() or "\\" in path or any(part in ("", ".", "..") for part in parts):
        raise ValueError(f"its values are at '{printable(path)}'")
    scale, shift = _affine(_entry(dataset, "coordinateTransformations", list))
    if "coordinateTransformations" in image:  # of all levels, after that of each
        outer, more = _affine(_entry(image, "coordinateTransformations", list))
        scale, shift = outer * scale, outer * shift + more
    return path, one_spacing(scale[::-1].tolist()), np.ascontiguousarray(shift[::-1])


def _affine(transformations: list) -> tuple[np.ndarray, np.ndarray]:
    """Scale and translation along z, y, x of a list of transformations, applied in order."""
    scale, shift = np.ones(3), np.zeros(3)
    for one in transformations:
        kind = _entry(one, "type", str)
        if kind == "scale":
            factors = _numbers(one, kind)
            scale, shift = scale * factors, shift * factors
        elif kind == "translation":
            shift = shift + _numbers(one, kind)
        elif kind != "identity":
            raise UnsuitedError(f"it is placed by {printable(kind)}", "write scale and translation")
    return scale, shift


def _numbers(transformation: dict, key: str) -> np.ndarray:
    found = _entry(transformation, key, list)
    if len(found) != 3 or not all(_is_number(value) for value in found):
        raise ValueError(f"its {key} is {printable(str(found))}")
    return np.array(found, np.float64)


def _is_number(value: object) -> bool:
    return type(value) in (int, float) and -_FARTHEST <= value <= _FARTHEST


def _entry(found: object, key: str, kind: type):
    value = found.get(key) if isinstance(found, dict) else None
    if not isinstance(value, kind):
        raise ValueError(f"its OME-Zarr attributes have no sound {key!r}")
    return value


def _only(found: Sequence, what: str) -> object:
    """The first; of levels that is the finest."""
    if not found:
        raise ValueError(f"its OME-Zarr attributes name no {what}")
    return found[0]
