"""What the tests of .zarr volumes share."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest


def assert_equal(a, b):
    """Every field, and every field of fields, has the same type and the same bits."""
    assert type(a) is type(b)
    if dataclasses.is_dataclass(a):
        for field in dataclasses.fields(a):
            assert_equal(getattr(a, field.name), getattr(b, field.name))
    elif isinstance(a, np.ndarray):
        assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
    else:
        assert a == b


def foreign(path, values, compressors="auto", axes="zyx", transformations=None, **options):
    """An OME-Zarr image that the package zarr wrote, to a folder or a store of its own."""
    zarr = pytest.importorskip("zarr", reason="the package zarr is not installed")
    if transformations is None:
        transformations = [{"type": "scale", "scale": [0.5, 0.5, 0.5]}]
    is_path = isinstance(path, Path)
    group = zarr.create_group(str(path) if is_path else path, zarr_format=3, overwrite=is_path)
    array = group.create_array(
        "s0", shape=values.shape, dtype=values.dtype, compressors=compressors, **options
    )
    array[...] = values
    dataset = {"path": "s0", "coordinateTransformations": transformations}
    image = {"axes": [{"name": a, "type": "space"} for a in axes], "datasets": [dataset]}
    group.attrs["ome"] = {"version": "0.5", "multiscales": [image]}
    return path
