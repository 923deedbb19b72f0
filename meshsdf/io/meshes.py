"""Mesh files in and out: OBJ, PLY, STL, OFF, GLB and glTF.

Nothing is welded, moved or cleaned: a mesh holds what its file says, scenes with their parts in
place. Colours become linear light: those of OBJ and PLY are taken as sRGB, those of glTF are
linear already.
"""

import os
import struct
import zlib
from json import JSONDecodeError
from pathlib import Path

import numpy as np

from ..errors import IoError, MeshError
from ..mesh import Mesh
from .atomic import atomic_write, check_output
from .mtl import has_library, write_materials
from .registry import Format, checked_input, format_of
from .warn import Warn, ignore

PARSER_ERRORS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    JSONDecodeError,
    LookupError,
    MemoryError,
    NameError,
    OSError,
    RecursionError,
    TypeError,
    UnicodeError,
    ValueError,
    struct.error,
    zlib.error,
)
"""What a parser may raise when it meets bytes that are not what it expects."""


def read_mesh(path: str | os.PathLike, *, warn: Warn = ignore) -> Mesh:
    """Read a mesh; the suffix names the format.

    Parameters
    ----------
    path : path
        An ``.obj``, ``.ply``, ``.stl``, ``.off``, ``.glb`` or ``.gltf`` file.
    warn : callable
        Receives a sentence for everything that could not be kept: a missing material file, an
        unreadable image, positions that no face uses. ``warn=notes.append`` collects them.

    Returns
    -------
    mesh : Mesh
        All parts of the file as one mesh, polygons as triangle fans. Positions are float64, as
        precise as the file.

    Raises
    ------
    IoError
        There is no such file, it holds no faces, it is cut off, or it is not what its suffix
        says. The sentence names the file and the reason.
    """
    format = format_of(path, "mesh", "reader")
    path = checked_input(path)
    try:
        # Absurd numbers are judged once, when the mesh is made; on the way they may overflow.
        with np.errstate(all="ignore"):
            return format.function(format.reader)(path, warn)
    except MeshError as error:
        raise _unreadable(path, format, error.what) from error
    except PARSER_ERRORS as error:
        raise _unreadable(path, format, _reason(error)) from error


def write_mesh(path: str | os.PathLike, mesh: Mesh, *, force: bool = False) -> None:
    """Write a mesh; the suffix names the format. The same mesh gives the same bytes.

    Parameters
    ----------
    path : path
        An ``.obj``, ``.ply``, ``.stl``, ``.off`` or ``.glb`` file.
    mesh : Mesh
        At least one face.
    force : bool
        Replace an existing file.

    Raises
    ------
    IoError
        Unknown suffix, no faces, attributes that do not match, a coordinate too large for float32
        where the format wants it, the file exists, its folder cannot be written, the disk is full.

    Notes
    -----
    Accuracy: OBJ, OFF and PLY give float64 positions back bit-equal; STL and GLB round to float32,
    as their formats want. Kept besides positions and faces: uv and colours in OBJ, PLY (8-bit
    colours) and GLB; materials with images in GLB and OBJ, where they
    are files beside it (``cow.mtl``, ``cow-hide.png``).
    """
    format = format_of(path, "mesh", "writer")
    check_output(path, force)
    if mesh.n_faces == 0:
        raise IoError("the mesh has no faces", f"output {path}", "write a mesh with faces")
    _check_attributes(mesh, f"output {path}")
    further = ()
    if format.name == "OBJ" and has_library(mesh):
        further = (write_materials(Path(path), mesh, force),)
    with atomic_write(path, force) as temporary:
        format.function(format.writer)(temporary, mesh, *further)


def _check_attributes(mesh: Mesh, where: str) -> None:
    """What lies beside vertices and faces must match them, or the file would be corrupt."""
    sizes = (("uv", mesh.n_vertices), ("vertex_colors", mesh.n_vertices))
    for name, expected in (*sizes, ("material_index", mesh.n_faces)):
        values = getattr(mesh, name)
        if values is not None and len(values) != expected:
            what = f"{name} has {len(values)} entries where {expected} are needed"
            raise IoError(what, where, "give one for every vertex, or every face")
    index, n_materials = mesh.material_index, len(mesh.materials)
    if index is not None and n_materials and not _is_within(index, n_materials):
        what = (
            f"material_index runs from {index.min()} to {index.max()} for {n_materials} materials"
        )
        raise IoError(what, where, "use -1 for none and 0 to n - 1 for the others")


def _is_within(index: np.ndarray, n_materials: int) -> bool:
    return bool(((index >= -1) & (index < n_materials)).all())


def _unreadable(path: Path, format: Format, reason: str) -> IoError:
    return IoError(
        f"{path.name} is not a readable {format.name} file: {reason}",
        f"file {path}",
        "check that the file is whole, or write it again from the program it came from",
    )


def _reason(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return "it asks for more memory than there is"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, KeyError):
        return f"{error} is missing, or says what is not known"
    words = " ".join(str(error).split())
    return words[:300] or type(error).__name__
