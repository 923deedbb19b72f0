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

from ..errors import IoError

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
    """

    name: str
    suffixes: tuple[str, ...]
    kind: Kind
    module: str
    reader: str = ""
    writer: str = ""
    prober: str = ""
    has_names: bool = False

    def function(self, name: str) -> Callable:
        """Return a function of the format's module, which is imported now."""
        return getattr(import_module(f".{self.module}", __package__), name)


FORMATS = (
    Format("OBJ", (".obj",), "mesh", "obj", "read_obj", "write_obj"),
    Format("PLY", (".ply",), "mesh", "ply", "read_ply", "write_ply"),
    Format("STL", (".stl",), "mesh", "stl", "read_stl", "write_stl"),
    Format("OFF", (".off",), "mesh", "off", "read_off", "write_off"),
    Format("GLB", (".glb",), "mesh", "gltf", "read_gltf", "write_glb"),
    Format("glTF", (".gltf",), "mesh", "gltf", "read_gltf"),
    Format("NPZ volume", (".npz",), "volume", "npz", "read_npz", "write_npz", "probe_npz"),
    Format("OpenVDB", (".vdb",), "volume", "vdb", "read_vdb", "write_vdb", "probe_vdb", True),
)


def suffixes(kind: Kind | None = None) -> tuple[str, ...]:
    """Return the known suffixes, all or those of one kind."""
    return tuple(s for f in FORMATS if kind in (None, f.kind) for s in f.suffixes)


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
        No such format; the message lists those there are and suggests the nearest.
    """
    suffix = Path(path).suffix.lower()
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
    near = difflib.get_close_matches(suffix, known, n=1, cutoff=0.5)
    hint = f"; did you mean {near[0]}?" if near and suffix not in suffixes() else ""
    if others and kind is not None:
        what = f"a {kind} with suffix {suffix!r} cannot be {verb}: that is a {others[0]}"
    raise IoError(what, f"file {path}", f"use one of {', '.join(known)}{hint}")


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
    """Return the path as a `Path`; IoError if there is no regular file to read."""
    path = Path(path)
    try:
        if path.is_file():
            return path
        if path.is_dir():
            raise IoError("this is a folder, not a file", f"file {path}", "name a file in it")
        if path.exists():
            raise IoError("this is not a regular file", f"file {path}", "copy it to a file first")
    except (OSError, ValueError) as error:  # a name with a NUL, or too long
        raise IoError(f"no file can have this name ({error})", f"file {path}", "check it") from None
    raise IoError("no such file", f"file {path}", _nearest_file(path))


def _nearest_file(path: Path) -> str:
    """What to do about a name that does not exist: the file of that folder nearest to it."""
    try:
        names = os.listdir(path.parent)
    except OSError:
        return "check the folder"
    near = difflib.get_close_matches(path.name, names, n=1, cutoff=0.75)
    return f"did you mean {path.with_name(near[0])}?" if near else "check the name and the folder"
