"""Volumes as ``.npz``: our own lossless container, which ``numpy.load`` opens too.

An uncompressed zip of little-endian ``.npy`` arrays, no pickles; the same volume gives the same
bytes. Keys of both kinds, with shape () unless said:

- ``format``: text, ``meshsdf.narrow_band/2`` or ``meshsdf.grid/1``
- ``voxel_size``: float64, world units
- ``sign``: text, how inside was told
- ``n_inner_faces`` int64: faces of the mesh inside the union of overlapping parts, if there are any

Narrow band, b bricks of 8 x 8 x 8 nodes:

- ``translation`` (3,) float64: world position of node (0, 0, 0)
- ``half_width``: float64, voxels; beyond the band the distance is ``half_width * voxel_size``
- ``coordinates`` (b, 3) int64: brick coordinates, rising by x, then y, then z
- ``values`` (b, 8, 8, 8) float32, or float16 when written with ``half``
- ``active`` (b, 8) uint64: bit ``8 j + k`` of word i tells whether node (i, j, k) is in the band
- ``page_origin`` (3,) int64, ``root`` (rx, ry, rz) int32, ``pages`` (p, 16, 16, 16) int32: the
  page table; an entry is a page or slot (>= 0), -1 outside, -2 inside; ``root`` names the upper
  pages, which come first, these name the lower ones, which name the slots
- ``uncertain`` (b, 8) uint64: bits of nodes whose side is not certain, if there are such
- ``closest_face`` (b, 8, 8, 8) int32 and ``barycentric`` (b, 8, 8, 8, 2) float32: if known

- ``hermite_fractions`` (c,), ``hermite_normals`` (c, 3), ``hermite_loops`` (k,) int32,
  ``hermite_loop_points`` (k, 3), ``hermite_arcs`` (t,) int64, ``hermite_arc_points`` (t, 3), else
  float64: what dual contouring needs of the mesh, see `grid.hermite`; all of them or none

Grid:

- ``values`` (ni, nj, nk) float32 or float64, or float16; NaN where there are no data
- ``origin`` (3,) float64: world position of node (0, 0, 0)
- ``uncertain_voxels`` int64: at how many nodes near the surface the side is not certain, if any
- ``half_width`` float64: voxels from the surface beyond which values are clipped, if they are
"""

import os
from pathlib import Path

import numpy as np

from ..errors import GridError, IoError
from ..grid import BrickIndex, Grid, NarrowBand
from ..grid.hermite import Hermite
from .atomic import atomic_write, check_output
from .half import check_half, halved
from .npy_archive import ZIP_ERRORS, ArchiveReader, ArrayHeader, write_archive
from .registry import checked_input
from .volume_checks import check_volume

BAND = "meshsdf.narrow_band/2"
GRID = "meshsdf.grid/1"

# Each stands for one number in all the shapes it occurs in: the length of the array named here
_B, _C, _L, _A = "bricks", "crossings", "loops", "arcs"
_NAMED_BY = {
    _B: "coordinates",
    _C: "hermite_fractions",
    _L: "hermite_loops",
    _A: "hermite_arcs",
}
_FLOATS = ("<f2", "<f4")
BAND_KEYS = {
    "format": ("text", ()),
    "voxel_size": (("<f8",), ()),
    "translation": (("<f8",), (3,)),
    "half_width": (("<f8",), ()),
    "sign": ("text", ()),
    "coordinates": (("<i8",), (_B, 3)),
    "page_origin": (("<i8",), (3,)),
    "root": (("<i4",), (None, None, None)),
    "pages": (("<i4",), (None, 16, 16, 16)),
    "values": (_FLOATS, (_B, 8, 8, 8)),
    "active": (("<u8",), (_B, 8)),
    "uncertain": (("<u8",), (_B, 8)),
    "closest_face": (("<i4",), (_B, 8, 8, 8)),
    "barycentric": (("<f4",), (_B, 8, 8, 8, 2)),
    "n_inner_faces": (("<i8",), ()),
}
_HERMITE_KEYS = {
    "hermite_fractions": (("<f8",), (_C,)),
    "hermite_normals": (("<f8",), (_C, 3)),
    "hermite_loops": (("<i4",), (_L,)),
    "hermite_loop_points": (("<f8",), (_L, 3)),
    "hermite_arcs": (("<i8",), (_A,)),
    "hermite_arc_points": (("<f8",), (_A, 3)),
}
BAND_KEYS |= _HERMITE_KEYS
GRID_KEYS = {
    "format": ("text", ()),
    "voxel_size": (("<f8",), ()),
    "origin": (("<f8",), (3,)),
    "sign": ("text", ()),
    "values": ((*_FLOATS, "<f8"), (None, None, None)),
    "uncertain_voxels": (("<i8",), ()),
    "n_inner_faces": (("<i8",), ()),
    "half_width": (("<f8",), ()),
}
SAMPLE_KEYS = {"pos", "neg"}
"""What DeepSDF's files of samples have, which are ``.npz`` files, too."""

_OPTIONAL = {"closest_face", "barycentric", "uncertain", "uncertain_voxels", "n_inner_faces"}
_OPTIONAL |= _HERMITE_KEYS.keys()


def write_npz(
    path: str | os.PathLike, volume: NarrowBand | Grid, *, half: bool = False, force: bool = False
) -> None:
    """Write a volume; every field reads back bit-equal, values too unless ``half``.

    Parameters
    ----------
    path : path
        The ``.npz`` file.
    volume : NarrowBand or Grid
        What is written.
    half : bool
        Round values to float16: half the size, a relative error of at most 2**-11. Read back
        they are float32. A distance nearer to 0 than 3e-8 loses its sign.
    force : bool
        Replace an existing file.

    Raises
    ------
    IoError
        The file exists, its folder cannot be written, the disk is full, a number in the volume
        could not be read back, or the distances do not fit float16.
    """
    check_output(path, force)
    where = f"output {path}"
    try:
        check_volume(volume)
    except ValueError as error:
        raise IoError(f"the volume cannot be written: {error}", where, "build it anew") from error
    if half:
        check_half(volume.values, where)
    arrays = band_arrays(volume) if isinstance(volume, NarrowBand) else grid_arrays(volume)
    if half:
        arrays["values"] = halved(arrays["values"])
    with atomic_write(path, force) as temporary:
        write_archive(temporary, arrays)


def read_npz(path: str | os.PathLike) -> NarrowBand | Grid:
    """Read a volume that `write_npz` wrote; its kind is that of the file.

    Raises
    ------
    IoError
        There is no such file, or it is damaged, cut off, compressed, or no volume. Nothing
        larger than the file itself is ever allocated.
    """
    path = checked_input(path)
    try:
        with ArchiveReader(path) as archive:
            kind = _kind(archive, path)
            check_headers(archive.headers, kind)
            arrays = {name: archive.read(name) for name in archive.headers}
        volume = band_of(arrays) if kind == BAND else grid_of(arrays)
        check_volume(volume)
    except GridError as error:
        raise _unreadable(path, error.what) from error
    except MemoryError as error:
        raise _unreadable(path, "it does not fit in memory") from error
    except OSError as error:
        raise _unreadable(path, error.strerror or str(error)) from error
    except ZIP_ERRORS as error:
        raise _unreadable(path, str(error) or type(error).__name__) from error
    return volume


def probe_npz(path: str | os.PathLike) -> dict:
    """Return what the headers say: ``kind``, ``format``, ``dtype``, ``shape`` and more.

    ``kind`` is "narrow_band" or "grid"; both have ``voxel_size`` and ``sign``. A band has
    ``n_bricks``, ``half_width``, ``translation``, ``has_closest_face`` and ``has_hermite``; a grid
    has ``origin``.
    ``shape`` is that of the stored values. The values themselves are neither read nor checked.
    """
    path = checked_input(path)
    try:
        with ArchiveReader(path) as archive:
            kind = _kind(archive, path)
            check_headers(archive.headers, kind)
            small = ["voxel_size", "sign"]
            small += ["translation"] if kind == BAND else ["origin"]
            small += ["half_width"] if "half_width" in archive.headers else []
            facts = {name: archive.read(name).tolist() for name in small}
            values = archive.headers["values"]
    except OSError as error:
        raise _unreadable(path, error.strerror or str(error)) from error
    except ZIP_ERRORS as error:
        raise _unreadable(path, str(error) or type(error).__name__) from error
    facts |= {"format": kind, "dtype": values.dtype.name, "shape": list(values.shape)}
    if kind == BAND:
        has_face = "closest_face" in archive.headers
        return {"kind": "narrow_band", "n_bricks": values.shape[0], **facts} | {
            "has_closest_face": has_face,
            "has_hermite": "hermite_fractions" in archive.headers,
        }
    return {"kind": "grid", **facts}


def band_arrays(band: NarrowBand) -> dict[str, np.ndarray]:
    index = band.index
    arrays = {
        "format": np.array(BAND),
        "voxel_size": np.array(band.voxel_size, np.float64),
        "translation": band.translation,
        "half_width": np.array(band.half_width, np.float64),
        "sign": np.array(band.sign),
        "coordinates": index.coordinates,
        "page_origin": index.page_origin,
        "root": index.root,
        "pages": index.pages,
        "values": band.values,
        "active": band.active,
    }
    for name in ("closest_face", "barycentric", "uncertain"):
        if getattr(band, name) is not None:
            arrays[name] = getattr(band, name)
    if band.hermite is not None:
        arrays |= {name: getattr(band.hermite, name[8:]) for name in _HERMITE_KEYS}
    if band.n_inner_faces:
        arrays["n_inner_faces"] = np.array(band.n_inner_faces, np.int64)
    return arrays


def grid_arrays(grid: Grid) -> dict[str, np.ndarray]:
    arrays = {
        "format": np.array(GRID),
        "voxel_size": np.array(grid.voxel_size, np.float64),
        "origin": grid.origin,
        "sign": np.array(grid.sign),
        "values": grid.values,
    }
    if grid.uncertain_voxels is not None:
        arrays["uncertain_voxels"] = np.array(grid.uncertain_voxels, np.int64)
    if grid.half_width is not None:
        arrays["half_width"] = np.array(grid.half_width, np.float64)
    if grid.n_inner_faces:
        arrays["n_inner_faces"] = np.array(grid.n_inner_faces, np.int64)
    return arrays


def band_of(arrays: dict[str, np.ndarray]) -> NarrowBand:
    tables = [arrays[name] for name in ("coordinates", "page_origin", "root", "pages")]
    return NarrowBand(
        BrickIndex(*tables),
        arrays["values"].astype(np.float32, copy=False),
        arrays["active"],
        float(arrays["voxel_size"]),
        arrays["translation"],
        float(arrays["half_width"]),
        str(arrays["sign"]),
        arrays.get("closest_face"),
        arrays.get("barycentric"),
        arrays.get("uncertain"),
        hermite=_hermite(arrays),
        n_inner_faces=int(arrays.get("n_inner_faces", 0)),
    )


def _hermite(arrays: dict[str, np.ndarray]) -> Hermite | None:
    if "hermite_fractions" not in arrays:
        return None
    return Hermite(*(arrays[name] for name in _HERMITE_KEYS))


def grid_of(arrays: dict[str, np.ndarray]) -> Grid:
    values = arrays["values"]
    if values.dtype == np.float16:
        values = values.astype(np.float32)
    doubts, width = arrays.get("uncertain_voxels"), arrays.get("half_width")
    return Grid(
        values,
        float(arrays["voxel_size"]),
        arrays["origin"],
        str(arrays["sign"]),
        None if doubts is None else int(doubts),
        int(arrays.get("n_inner_faces", 0)),
        None if width is None else float(width),
    )


def _kind(archive: ArchiveReader, path: Path) -> str:
    header = archive.headers.get("format")
    if archive.headers.keys() >= SAMPLE_KEYS or {"points", "distance"} <= archive.headers.keys():
        what = f"{path.name} holds samples of distances at scattered points, not a volume"
        raise IoError(what, f"file {path}", "look at it with meshsdf info, or read it with numpy")
    if header is None or header.dtype.kind != "U" or header.shape != ():
        raise ValueError("it has no 'format' key, so it is not a volume of meshsdf")
    kind = str(archive.read("format"))
    if kind not in (BAND, GRID):
        raise ValueError(f"its format is {kind!r}; known are {BAND!r} and {GRID!r}")
    return kind


def check_headers(headers: dict[str, ArrayHeader], kind: str) -> None:
    keys = BAND_KEYS if kind == BAND else GRID_KEYS
    missing = keys.keys() - headers.keys() - _OPTIONAL
    if kind == GRID:
        missing -= {"half_width"}  # of distances that are not clipped
    if some := _HERMITE_KEYS.keys() & headers.keys():
        missing |= _HERMITE_KEYS.keys() - some if kind == BAND else set()
    unknown = headers.keys() - keys.keys()
    if missing or unknown:
        word, names = ("lacks", missing) if missing else ("holds the unknown", unknown)
        raise ValueError(f"it {word} {', '.join(map(repr, sorted(names)))}")
    sizes = {side: headers[n].shape[:1] for side, n in _NAMED_BY.items() if n in headers}
    for name, header in headers.items():
        dtypes, shape = keys[name]
        expected = tuple((sizes.get(side) or [side])[0] for side in shape)
        fits = len(header.shape) == len(shape) and all(
            want is None or want == side for want, side in zip(expected, header.shape, strict=True)
        )
        is_right = header.dtype.kind == "U" if dtypes == "text" else header.dtype.str in dtypes
        if not fits or not is_right:
            raise ValueError(f"{name!r} is {header.dtype.name} of shape {header.shape}")


def _unreadable(path: Path, reason: str) -> IoError:
    return IoError(
        f"{path.name} is not a readable volume: {' '.join(reason.split())[:300]}",
        f"file {path}",
        "write it again; if it was copied, copy it again",
    )
