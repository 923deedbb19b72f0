"""Zarr version 3 with the attributes of OME-Zarr 0.5: a folder that viewers open and clouds keep.

``NAME.zarr`` is a group, and ``NAME.zarr.zip`` the same in one file (`zarr_zip`). Its array ``0``
[k, j, i] has the values, as any viewer shows them: of a band only the chunks near the surface and
inside it are there, the fill value is the background.
The attribute ``ome`` tells where it lies, the attribute ``meshsdf`` all else under the keys of
`npz`, with ``first_node``, the index of the first node of ``0``. What of a band is no volume of
nodes, such as its page table, lies in the group ``band``, again under the keys of `npz`; so a band
comes back as it was. Arrays of others come in as full grids.
"""

import os
from pathlib import Path

import numpy as np

from ..errors import IoError
from ..grid import BrickIndex, Grid, NarrowBand
from .atomic import check_output
from .half import check_half, halved
from .npy_archive import ArrayHeader
from .npz import (
    BAND,
    BAND_KEYS,
    GRID,
    GRID_KEYS,
    band_arrays,
    band_of,
    check_headers,
    grid_arrays,
    grid_of,
)
from .opened import refusing
from .registry import checked_input, stored_bytes
from .unpacking import check_claim
from .vdb_stream import UnsuitedError, printable
from .volume_checks import check_index, check_volume
from .warn import Warn, ignore
from .zarr_array import ArraySpec, read_metadata, read_spec, read_whole, write_group, write_rows
from .zarr_ome import ome_attributes, placed_array
from .zarr_values import brick_box, read_band_values, write_band_values, write_grid_values
from .zarr_zip import Folder, folder_at, new_folder

VALUES, REST = "0", "band"
"""The array of values, and the group with what else a band has."""

_HALF, _FLOAT = np.dtype("<f2"), np.dtype("<f4")


def write_zarr(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    warn: Warn = ignore,
) -> None:
    """Write a volume; every field reads back bit-equal, values too unless ``half``.

    Parameters
    ----------
    path : path
        The ``.zarr`` folder, or a ``.zarr.zip`` file with what would be in it.
    volume : NarrowBand or Grid
        What is written.
    half : bool
        Round values to float16; see `write_npz`.
    force : bool
        Replace an existing file, or a folder if it is a Zarr one.
    warn : callable
        Never called: nothing is lost. Other formats have something to say.

    Raises
    ------
    IoError
        The folder exists, that around it cannot be written, the disk is full, or the volume cannot
        be said in this format.

    Notes
    -----
    Memory: some chunks of 64^3 nodes beyond the volume, however large it is. A zip is made of a
    folder beside it, so the disk holds both for a moment.
    """
    check_output(path, force)
    where = f"output {path}"
    is_band = isinstance(volume, NarrowBand)
    try:
        check_volume(volume)
        if half:
            check_half(volume.values, where)
            check_half(np.array([volume.background if is_band else 0.0]), where)
        with new_folder(Path(path), force) as folder:
            _write_group(folder, volume, half)
    except ValueError as error:
        raise IoError(f"the volume cannot be written: {error}", where, "build it anew") from error


def read_zarr(path: str | os.PathLike, *, warn: Warn = ignore) -> NarrowBand | Grid:
    """Read a volume that `write_zarr` wrote, or the finest level of an OME-Zarr image.

    Parameters
    ----------
    path : path
        The folder, or a zip of it.
    warn : callable
        Told of attributes that a volume has no place for.

    Raises
    ------
    IoError
        There is no such folder or file, it is damaged, or does not suit a volume: version 2 of
        Zarr, axes other than z, y, x, voxels that are no cubes; or it is packed with a codec other
        than gzip, and the package zarr is not installed. No more memory is taken than some 1000
        times the bytes that are there, or 64 MiB.
    """
    with refusing(checked_input(path)) as path, folder_at(path) as folder:
        attributes = _attributes(folder)
        n_there = stored_bytes(path)
        if "meshsdf" not in attributes:
            volume = _foreign(folder, attributes, n_there)
        else:
            small, specs = _described(folder, attributes["meshsdf"])
            large = {
                name: read_whole(folder / REST / name, spec, n_there, is_full=True)
                for name, spec in specs.items()
                if name != "values"
            }
            build = _band if small["format"] == BAND else _grid
            volume = build(folder / VALUES, small | large, specs["values"], n_there)
        check_volume(volume)
    if foreign := sorted(attributes.keys() - {"meshsdf", "ome"}):
        warn(f"attributes are not kept: {', '.join(map(printable, foreign[:20]))}")
    return volume


def probe_zarr(path: str | os.PathLike) -> dict:
    """Return what is said of a volume: as `probe_npz`, with the ``shape`` of the array.

    Of an array that others wrote: ``kind``, ``format``, ``voxel_size``, ``origin``, ``shape`` and
    ``dtype``. Values are not read.
    """
    with refusing(checked_input(path)) as path, folder_at(path) as folder:
        attributes = _attributes(folder)
        if "meshsdf" not in attributes:
            name, voxel_size, origin = placed_array(attributes.get("ome"))
            spec = read_spec(folder / name)
            facts = {"kind": "grid", "format": "OME-Zarr", "voxel_size": voxel_size}
            facts |= {"origin": origin.tolist()}
        else:
            small, specs = _described(folder, attributes["meshsdf"])
            spec = specs["values"]
            facts = {"kind": small["format"].item().split(".")[1].split("/")[0]}
            facts |= {name: value.tolist() for name, value in small.items()}
            if "coordinates" in specs:
                del facts["page_origin"]
                facts |= {"n_bricks": specs["coordinates"].shape[0]}
                facts |= {"has_closest_face": "closest_face" in specs}
                facts |= {"has_hermite": "hermite_fractions" in specs}
    return facts | {"shape": list(spec.shape[::-1]), "dtype": spec.dtype.name}


def _write_group(folder: Path, volume: NarrowBand | Grid, half: bool) -> None:
    is_band = isinstance(volume, NarrowBand)
    arrays = band_arrays(volume) if is_band else grid_arrays(volume)
    del arrays["values"]
    told = {name: array.tolist() for name, array in arrays.items() if _is_small(name)}
    first = brick_box(volume.index.coordinates)[0] if is_band else np.zeros(3, np.int64)
    start = volume.to_world(first[None])[0] if is_band else volume.origin
    ome = ome_attributes(VALUES, volume.voxel_size, start)
    write_group(folder, {"ome": ome, "meshsdf": told | {"first_node": first.tolist()}})
    if is_band:
        write_group(folder / REST, {})
        for name in sorted(arrays.keys() - told.keys()):
            write_rows(folder / REST / name, arrays[name])
        write_band_values(folder / VALUES, volume, _HALF if half else _FLOAT)
    else:
        write_grid_values(folder / VALUES, halved(volume.values) if half else volume.values)


def _is_small(name: str) -> bool:
    """Whether an entry stands in the attributes: one number, one text, or three numbers."""
    return (BAND_KEYS | GRID_KEYS)[name][1] in ((), (3,))


def _attributes(folder: Folder) -> dict:
    found = read_metadata(folder)
    if found.get("node_type") != "group":
        fix = "name the group around it, whose attributes say where it lies"
        raise UnsuitedError("this is an array without a place in space", fix)
    attributes = found.get("attributes", {})
    if not isinstance(attributes, dict):
        raise ValueError("its attributes are damaged")
    return attributes


def _described(folder: Folder, told: object) -> tuple[dict[str, np.ndarray], dict[str, ArraySpec]]:
    """What the attributes say, and what is said of the arrays; both as they must be."""
    if not isinstance(told, dict) or told.get("format") not in (BAND, GRID):
        raise ValueError(f"its attributes name none of the formats {BAND!r}, {GRID!r}")
    keys = BAND_KEYS if told["format"] == BAND else GRID_KEYS
    small = {
        name: _typed(name, value, keys[name][0])
        for name, value in told.items()
        if name in keys and _is_small(name)
    }
    specs = {"values": read_spec(folder / VALUES)}
    if told["format"] == BAND:
        specs |= {
            name: read_spec(folder / REST / name)
            for name in keys
            if not _is_small(name) and name != "values" and (folder / REST / name).is_dir()
        }
    headers = {name: ArrayHeader(value.dtype, value.shape, 0) for name, value in small.items()}
    for name, spec in specs.items():
        headers[name] = ArrayHeader(spec.dtype.newbyteorder("<"), spec.shape, 0)
    if told["format"] == BAND and "coordinates" in specs:
        bricks = (specs["coordinates"].shape[0], 8, 8, 8)
        headers["values"] = ArrayHeader(headers["values"].dtype, bricks, 0)
    check_headers(headers, told["format"])
    return small, specs


def _typed(name: str, value: object, dtypes: object) -> np.ndarray:
    if dtypes == "text":
        if not isinstance(value, str):
            raise ValueError(f"its {name} is {printable(str(value))}")
        return np.array(value)
    try:
        return np.array(value, dtypes[0])
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"its {name} is {printable(str(value))}") from None


def _band(
    folder: Folder, arrays: dict[str, np.ndarray], spec: ArraySpec, n_there: int
) -> NarrowBand:
    tables = [arrays[name] for name in ("coordinates", "page_origin", "root", "pages")]
    check_index(BrickIndex(*tables))
    check_claim(2048 * len(arrays["coordinates"]), n_there, is_packed=True)
    values = read_band_values(folder, spec, arrays["coordinates"])
    return band_of(arrays | {"values": values})


def _grid(folder: Folder, arrays: dict[str, np.ndarray], spec: ArraySpec, n_there: int) -> Grid:
    values = read_whole(folder, spec, n_there, is_full=spec.fill == spec.fill)  # unless it is NaN
    return grid_of(arrays | {"values": _nodes(values)})


def _foreign(folder: Folder, attributes: dict, n_there: int) -> Grid:
    name, voxel_size, origin = placed_array(attributes.get("ome"))
    spec = read_spec(folder / name)
    if len(spec.shape) != 3 or spec.dtype.kind != "f":
        what = f"its values are {spec.dtype.name} of shape {spec.shape}"
        raise UnsuitedError(what, "write distances as floats, with the axes z, y, x")
    values = _nodes(read_whole(folder / name, spec, n_there))
    if values.dtype == np.float16:
        values = values.astype(np.float32)
    sign = "winding" if np.fmin.reduce(values, axis=None, initial=0) < 0 else "unsigned"
    return Grid(values, voxel_size, origin, sign)


def _nodes(array: np.ndarray) -> np.ndarray:
    """The array [i, j, k] of an array [k, j, i]."""
    return np.ascontiguousarray(array.transpose(2, 1, 0))
