"""Samples of signed distances in files: ``.npz``, also as DeepSDF has them, and ``.ply``.

Uncompressed ``.npz``, plain; the keys that say it all stand in both layouts:

- ``format``: text, ``meshsdf.samples/1``, or ``meshsdf.deepsdf_samples/1``
- ``normalization``: text, "none", "unit-sphere" or "unit-cube"
- ``center`` (3,) and ``scale`` (), float64: point = scale * (world - center), and distances are
  scale times those in world units
- ``sign``: text, how inside was told · ``seed``, ``n_uncertain``: int64

Plain, n samples, each float32 or float64:

- ``points`` (n, 3), ``distance`` (n,), ``kind`` (n,) int8: 0 near, 1 uniform, 2 surface
- ``normals`` (n, 3), if any is on the surface · ``closest_point`` (n, 3), ``face_index`` (n,)
  int32, if asked for

DeepSDF's (Park et al. 2019, doi:10.1109/CVPR.2019.00025), whose loader takes the first two:

- ``pos``, ``neg`` (k, 4) float32: x, y, z and distance of samples outside, and of those inside or
  on the surface
- ``offset`` (3,) float64: -center; with ``scale`` what it keeps in files of normalisation
  parameters: world = point / scale - offset

``.ply``: binary points with the properties ``distance``, ``kind`` and, if any is on the surface,
``nx``, ``ny``, ``nz``; further those of the closest point, ``closest_x`` … and ``face_index``.
Comments ``meshsdf_KEY value`` tell the rest.
"""

import os
from pathlib import Path
from typing import Literal

import numpy as np

from ..errors import OutputError
from ..sdf.samples import KINDS, Samples
from .atomic import atomic_write, check_output
from .npy_archive import write_archive

Layout = Literal["plain", "deepsdf"]

PLAIN, DEEPSDF = "meshsdf.samples/1", "meshsdf.deepsdf_samples/1"
SUFFIXES = (".npz", ".ply")

_COLUMNS = {
    "points": ("x", "y", "z"),
    "normals": ("nx", "ny", "nz"),
    "distance": ("distance",),
    "kind": ("kind",),
    "closest_point": ("closest_x", "closest_y", "closest_z"),
    "face_index": ("face_index",),
}
_PLY_TYPES = {"f4": "float", "f8": "double", "i1": "char", "i4": "int"}


def check_samples_output(
    path: str | os.PathLike, *, layout: Layout = "plain", force: bool = False
) -> None:
    """OutputError if samples could not be written there, before any work starts."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        what = f"samples cannot be written with suffix {suffix!r}"
        raise OutputError(what, f"output {path}", f"use one of {', '.join(SUFFIXES)}")
    if layout == "deepsdf" and suffix != ".npz":
        what = f"DeepSDF's layout is that of .npz files, not of {suffix}"
        raise OutputError(what, f"output {path}", "give the output the suffix .npz")
    check_output(path, force)


def write_samples(
    path: str | os.PathLike, samples: Samples, *, layout: Layout = "plain", force: bool = False
) -> None:
    """Write samples; the same samples give the same bytes.

    Parameters
    ----------
    path : path
        A ``.npz`` or ``.ply`` file.
    samples : Samples
        What is written.
    layout : "plain" or "deepsdf"
        DeepSDF's, for ``.npz``, has points and distances only, as float32.
    force : bool
        Replace an existing file.

    Raises
    ------
    IoError
        Unknown suffix, the layout does not suit it, the file exists, its folder cannot be written,
        the disk is full.

    Examples
    --------
    >>> import tempfile
    >>> from meshsdf.sdf import sample_distances
    >>> from meshsdf.mesh.primitives import icosphere
    >>> path = tempfile.mkdtemp() + "/ball.npz"
    >>> write_samples(path, sample_distances(icosphere(), 1000), layout="deepsdf")
    >>> with np.load(path) as found:
    ...     len(found["pos"]) + len(found["neg"]), bool((found["neg"][:, 3] <= 0).all())
    (1000, True)
    """
    check_samples_output(path, layout=layout, force=force)
    with atomic_write(path, force) as temporary:
        if Path(path).suffix.lower() == ".ply":
            _write_ply(temporary, samples)
        else:
            arrays = _deepsdf(samples) if layout == "deepsdf" else _arrays(samples)
            write_archive(temporary, _told(samples, layout) | arrays)


def _told(samples: Samples, layout: Layout) -> dict[str, np.ndarray]:
    space = samples.normalization
    return {
        "format": np.array(DEEPSDF if layout == "deepsdf" else PLAIN),
        "normalization": np.array(space.name),
        "sign": np.array(samples.sign),
        "seed": np.array(samples.seed, np.int64),
        "n_uncertain": np.array(samples.n_uncertain, np.int64),
        "center": space.center,
        "scale": np.array(space.scale, np.float64),
    }


def _arrays(samples: Samples) -> dict[str, np.ndarray]:
    found = {name: getattr(samples, name) for name in _COLUMNS}
    return {name: array for name, array in found.items() if array is not None}


def _deepsdf(samples: Samples) -> dict[str, np.ndarray]:
    table = np.column_stack([samples.points, samples.distance]).astype(np.float32, copy=False)
    outside = table[:, 3] > 0
    return {
        "pos": table[outside],
        "neg": table[~outside],
        "offset": 0.0 - samples.normalization.center,
    }


def _write_ply(path: Path, samples: Samples) -> None:
    arrays = _arrays(samples)
    fields = [
        (column, array.dtype.newbyteorder("<").str)
        for name, array in arrays.items()
        for column in _COLUMNS[name]
    ]
    told = _told(samples, "plain").items()
    lines = ["ply", "format binary_little_endian 1.0"]
    lines += [f"comment meshsdf_{name} {_spelled(value)}" for name, value in told]
    lines += [f"comment kind {number} is {name}" for number, name in enumerate(KINDS)]
    lines += [f"element vertex {samples.n}"]
    lines += [f"property {_PLY_TYPES[code[1:]]} {column}" for column, code in fields]
    with open(path, "wb") as file:
        file.write("\n".join([*lines, "end_header\n"]).encode("ascii"))
        for first in range(0, samples.n, 1 << 18):
            some = {name: array[first : first + (1 << 18)] for name, array in arrays.items()}
            table = np.empty(len(some["points"]), fields)
            for name, array in some.items():
                columns = _COLUMNS[name]
                for number, column in enumerate(columns):
                    table[column] = array[:, number] if len(columns) > 1 else array
            file.write(table.tobytes())


def _spelled(value: np.ndarray) -> str:
    return " ".join(map(str if value.dtype.kind == "U" else repr, value.reshape(-1).tolist()))
