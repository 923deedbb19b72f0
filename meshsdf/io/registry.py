"""The file formats: what each is called, how its files end, and who reads and writes them.

A format's module is imported when its first file is touched, so asking for suffixes is cheap.
"""

import difflib
import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Literal

from ..errors import IoError, OutputError

Kind = Literal["mesh", "volume"]


@dataclass(frozen=True)
class Format:
    """One file format; functions are named, and looked up in its module when called.

    Attributes
    ----------
    name : str
        As people say it, such as "PLY".
    suffixes : tuple of str
        In lower case, with the dot.
    kind : "mesh" or "volume"
        What its files hold.
    module : str
        Module of this package that knows the format.
    reader, writer, prober : str
        Functions of that module; empty if it cannot.
    has_names : bool
        Whether a file may hold several things, and the reader takes ``grid`` and ``warn``.
    has_warnings : bool
        Whether reader and writer take ``warn``, to say what they could not keep.
    marker : str
        Of a format whose volumes are folders: the file that each of them has.
    holds : frozenset of str
        What the writer keeps of a volume, in the words below; what is missing is lost.

    Notes
    -----
    Words of ``holds``:

    - ``band``: narrow bands as such; ``grid``: full grids
    - ``half``: float16; ``double``: float64; ``gaps``: nodes without a value (NaN)
    - ``transform``: voxel size and place in the world
    - ``sign``: how inside was told; ``half_width``: where the distances of a grid are clipped
    - ``closest``: closest faces and barycentrics; ``hermite``: crossings, normals and features;
      ``uncertain``: which nodes of a band have no certain side
    - ``vectors``: three numbers a node, by functions of the format's own module
    - ``metadata``: what a ``.vdb`` file says beyond its volume, whoever put it there
    """

    name: str
    suffixes: tuple[str, ...]
    kind: Kind
    module: str
    reader: str = ""
    writer: str = ""
    prober: str = ""
    has_names: bool = False
    has_warnings: bool = False
    marker: str = ""
    holds: frozenset[str] = frozenset()

    def function(self, name: str) -> Callable:
        """Return a function of the format's module, which is imported now."""
        return getattr(import_module(f".{self.module}", __package__), name)


_SPELLED = frozenset({"grid", "transform"})
_UNPLACED = frozenset({"grid", "gaps"})
_PLACED = _UNPLACED | {"double", "transform", "sign", "half_width"}
_IMAGES = (_PLACED | {"half"}) - {"double"}
_SPARSE = frozenset({"band", "grid", "half", "gaps", "transform", "sign", "half_width"})
_SPARSE |= {"closest", "uncertain"}


def _volume(
    name: str, suffixes: tuple[str, ...], module: str, holds: frozenset[str], **options: bool
) -> Format:
    """A volume format whose functions are named after its module."""
    names = (f"{verb}_{module}" for verb in ("read", "write", "probe"))
    return Format(name, suffixes, "volume", module, *names, holds=holds, **options)


FORMATS = (
    Format("OBJ", (".obj",), "mesh", "obj", "read_obj", "write_obj"),
    Format("PLY", (".ply",), "mesh", "ply", "read_ply", "write_ply"),
    Format("STL", (".stl",), "mesh", "stl", "read_stl", "write_stl"),
    Format("OFF", (".off",), "mesh", "off", "read_off", "write_off"),
    Format("GLB", (".glb",), "mesh", "gltf", "read_gltf", "write_glb"),
    Format("glTF", (".gltf",), "mesh", "gltf", "read_gltf"),
    _volume("NPZ volume", (".npz",), "npz", _SPARSE | {"double", "hermite"}),
    _volume("OpenVDB", (".vdb",), "vdb", _SPARSE | {"vectors", "metadata"}, has_names=True),
    _volume("NRRD", (".nrrd", ".nhdr"), "nrrd", _PLACED, has_warnings=True),
    _volume("MetaImage", (".mha", ".mhd"), "metaimage", _PLACED, has_warnings=True),
    _volume("VTK ImageData", (".vti",), "vti", _PLACED, has_names=True, has_warnings=True),
    _volume("raw with JSON", (".raw",), "raw", _PLACED | {"half"}, has_warnings=True),
    _volume("Unity volume", (".vf",), "vf", _UNPLACED | {"vectors"}, has_warnings=True),
    _volume("DDS texture", (".dds",), "dds", _IMAGES, has_warnings=True),
    _volume("SDFGen grid", (".sdf",), "sdfgen", _SPELLED, has_warnings=True),
    _volume("OpenEXR", (".exr",), "exr", _IMAGES, has_warnings=True),
    Format(
        *("Zarr", (".zarr",), "volume", "zarr_volume", "read_zarr", "write_zarr", "probe_zarr"),
        has_warnings=True,
        marker="zarr.json",
        holds=_SPARSE | {"double", "hermite"},
    ),
    Format(
        *("Zarr in a zip", (".zarr.zip",), "volume", "zarr_volume"),
        *("read_zarr", "write_zarr", "probe_zarr"),
        has_warnings=True,
        holds=_SPARSE | {"double", "hermite"},
    ),
)


def suffixes(kind: Kind | None = None) -> tuple[str, ...]:
    """Return the known suffixes, all or those of one kind."""
    return tuple(s for f in FORMATS if kind in (None, f.kind) for s in f.suffixes)


def able_suffixes(kind: Kind, task: str) -> tuple[str, ...]:
    """Return the suffixes of the formats that can do something: "reader", "writer", "prober"."""
    return tuple(s for f in FORMATS if f.kind == kind and getattr(f, task) for s in f.suffixes)


def suffix_of(path: str | os.PathLike) -> str:
    """Return the suffix that names the format of a file, in lower case: ``.npz``, ``.zarr.zip``."""
    words = Path(path).suffixes[-2:]
    double = "".join(words).lower()
    return double if double in suffixes() else "".join(words[-1:]).lower()


def format_of(path: str | os.PathLike, kind: Kind | None = None, task: str = "reader") -> Format:
    """Return the format that the suffix of ``path`` names.

    Parameters
    ----------
    path : path
        Only its suffix matters; upper and lower case are the same.
    kind : "mesh", "volume" or None
        What is wanted; None for either.
    task : "reader", "writer" or "prober"
        What the format must be able to do.

    Raises
    ------
    IoError
        No such format (`OutputError` for a writer); the message lists those there are and suggests
        the nearest.
    """
    suffix = suffix_of(path)
    able = [f for f in FORMATS if kind in (None, f.kind) and getattr(f, task)]
    for candidate in able:
        if suffix in candidate.suffixes:
            return candidate
    known = [s for f in able for s in f.suffixes]
    verb = {"reader": "read", "writer": "written", "prober": "probed"}[task]
    what = f"a {kind or 'file'} with suffix {suffix!r} cannot be {verb}"
    if not suffix:
        what = f"the name has no suffix, so the format of the {kind or 'file'} is unknown"
    others = [f.kind for f in FORMATS if suffix in f.suffixes and f.kind != kind]
    # Without the dots, which all have: .png is nothing like .ply
    near = difflib.get_close_matches(suffix[1:], [one[1:] for one in known], n=1, cutoff=0.6)
    hint = f"; did you mean .{near[0]}?" if near and suffix not in suffixes() else ""
    if others and kind is not None:
        what = f"a {kind} with suffix {suffix!r} cannot be {verb}: that is a {others[0]}"
    error = OutputError if task == "writer" else IoError
    raise error(what, f"file {path}", f"use one of {', '.join(known)}{hint}")


def kind_of(path: str | os.PathLike) -> Kind:
    """Return what the suffix of ``path`` says it holds; IoError if the suffix is unknown."""
    return format_of(path).kind


def check_input(path: str | os.PathLike, *, kind: Kind | None = None) -> None:
    """Refuse what cannot be read, before any work starts.

    Raises
    ------
    IoError
        There is no such file, it is a folder or a device, or its suffix does not suit the kind.
    """
    format_of(checked_input(path), kind, "reader")


def checked_input(path: str | os.PathLike) -> Path:
    """Return the path as a `Path`; IoError if there is no regular file to read, nor a volume that
    is a folder."""
    path = Path(path)
    try:
        if path.is_file():
            return path
        if path.is_dir():
            if folder_marker(path):
                return path
            raise IoError("this is a folder, not a file", f"file {path}", "name a file in it")
        if path.exists():
            raise IoError("this is not a regular file", f"file {path}", "copy it to a file first")
    except (OSError, ValueError) as error:  # a name with a NUL, or too long
        raise IoError(f"no file can have this name ({error})", f"file {path}", "check it") from None
    raise IoError("no such file", f"file {path}", _nearest_file(path))


def folder_marker(path: str | os.PathLike) -> str:
    """The file that each folder of a format has; empty if the suffix names no such format."""
    suffix = Path(path).suffix.lower()
    return next((f.marker for f in FORMATS if suffix in f.suffixes), "")


def stored_bytes(path: str | os.PathLike) -> int:
    """Return the bytes of a file, or of all files of a volume that is a folder."""
    path = Path(path)
    if path.is_file():
        return path.stat().st_size
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file())


def _nearest_file(path: Path) -> str:
    """What to do about a name that does not exist: the file of that folder nearest to it."""
    try:
        names = os.listdir(path.parent)
    except OSError:
        return "check the folder"
    near = difflib.get_close_matches(path.name, names, n=1, cutoff=0.75)
    return f"did you mean {path.with_name(near[0])}?" if near else "check the name and the folder"
