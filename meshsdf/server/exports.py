"""What is painted, written as files beside the project, and nowhere else.

A page names a file, never a place. What was written in this run may be written again; any other
file of that name stays as it is, and a number goes into the new one's name.
"""

import glob
import math
import os
import re
import shutil
import stat
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import IoError
from ..io.texture_files import Layout, mesh_beside, words_of, write_texture
from ..mesh import Mesh
from ..texture.atlas import atlas_for
from ..texture.volume_texture import VolumeTexture
from .limits import Refused

PROJECT = ".mtex"
FORMATS = {
    ".glb": "glTF: mesh and image in one file",
    ".obj": "OBJ: mesh, material and image",
    ".ply": "PLY: mesh with colours at its vertices",
    ".png": "PNG: the image alone, and the mesh that it fits",
    ".exr": "OpenEXR: the image in linear light, and the mesh that it fits",
    ".vdb": "OpenVDB: a volume of colours",
    PROJECT: "a copy of the project with all its layers and steps",
}
"""What can be asked for, in the order of a menu."""

WITH_IMAGE = (".glb", ".obj", ".png", ".exr")

MIME = {
    ".glb": "model/gltf-binary",
    ".obj": "model/obj",
    ".png": "image/png",
    ".mtl": "model/mtl",
}
LONGEST = 100  # bytes of a name; an image's has it twice, and file systems end at 255
MOST_NUMBERS = 1000
XATLAS_SECONDS = 20.0  # somebody waits
LARGEST_IMAGE = 8192
PIXELS_OF_SQUARE = 9  # a side, with what is kept free around it
RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)  # on Windows
WHERE = "the export's name"

SaveProject = Callable[[Path], None]


@dataclass(frozen=True)
class Written:
    """One export.

    Attributes
    ----------
    names : tuple of str
        Its files, the one that was asked for first.
    n_bytes : int
        Of all of them.
    notes : tuple of str
        What people should know about it.
    """

    names: tuple[str, ...]
    n_bytes: int
    notes: tuple[str, ...] = field(default=())


class Exports:
    """The exports of one project, into its own folder.

    What an earlier owner of the project left half written when it was killed is deleted.

    Parameters
    ----------
    project : Path
        The project, which nobody else has open.
    size : int
        Of images, pixels a side; more where a mesh has more faces than fit.
    """

    def __init__(self, project: Path, size: int = 2048) -> None:
        self.folder = Path(os.path.realpath(project.parent))
        self._prefix = f".meshsdf-{project.name}-"
        for left in self.folder.glob(f"{glob.escape(self._prefix)}*"):
            shutil.rmtree(left, ignore_errors=True)
        self.size = size
        self._own: dict[str, tuple[int, ...]] = {}  # what tells the files that we wrote
        self._lock = threading.Lock()
        self._beside: str | None = None
        self._laid: tuple[Mesh, tuple[Mesh, Layout, dict[str, str]]] | None = None

    def write(self, name: str, texture: VolumeTexture, mesh: Mesh) -> Written:
        """Write what a texture shows on a mesh.

        Parameters
        ----------
        name : str
            Of the file: no folders, and one of `FORMATS`.
        texture, mesh : VolumeTexture, Mesh
            Nobody may change them meanwhile, see `texture.snapshot`.

        Raises
        ------
        Refused
            The name is none of a file, or of no format that is written.
        IoError, TextureError
            As `write_texture`.
        """
        notes: list[str] = []

        def fill(path: Path) -> None:
            if path.suffix.lower() in WITH_IMAGE:
                laid, layout, how = self._laid_out(mesh)
                facts = write_texture(path, texture, laid, layout=layout) | how
            else:
                facts = write_texture(path, texture, mesh)
            notes[:] = [words_of(facts)]

        return self._write(checked_name(name, but=PROJECT), fill, notes)

    def save_project(self, name: str, save: SaveProject) -> Written:
        """Write a copy of the project by ``save(path)``; errors as `write`."""
        checked_name(name)
        if Path(name).suffix.lower() != PROJECT:
            raise Refused(400, f"a project's copy is no {Path(name).suffix}", WHERE, "end in .mtex")
        return self._write(name, save, [])

    def find(self, name: str) -> Path:
        """A file that was written in this run; Refused if it was not, or is another one now."""
        path = self.folder / name
        if name not in self._own or not self._is_own(name):
            raise Refused(404, f"there is no export {name[:100]!r}", "this run", "export it first")
        return path

    def stop(self) -> None:
        """Leave nothing half written, even if somebody still writes."""
        beside, self._beside = self._beside, None
        if beside is not None:
            shutil.rmtree(beside, ignore_errors=True)

    def _write(self, name: str, fill: Callable[[Path], None], notes: list[str]) -> Written:
        """Fill a folder of its own within the project's, then give the files their places."""
        with self._lock:
            for free in self._names(name):
                with self._folder_beside() as beside:
                    fill(beside / free)
                    made = sorted(os.listdir(beside), key=lambda one: one != free)
                    if not self._are_free(made):
                        continue
                    n_bytes = sum((beside / one).stat().st_size for one in made)
                    for one in reversed(made):  # what others point to first
                        self._place(beside / one)
                if free != name:
                    notes.append(f"{name} was there already, so this is {free}")
                return Written(tuple(made), n_bytes, tuple(notes))
        what = f"there are {MOST_NUMBERS} files of this name"
        raise IoError(what, WHERE, "choose another one")

    def _laid_out(self, mesh: Mesh) -> tuple[Mesh, Layout, dict[str, str]]:
        """The mesh with coordinates on an image, found once, and how they were found."""
        if self._laid is None or self._laid[0] is not mesh:
            size = image_size(mesh, self.size)
            atlas = atlas_for(mesh, size, time_limit=XATLAS_SECONDS)
            how = {"atlas": atlas.method, "without_xatlas": atlas.without_xatlas}
            self._laid = mesh, (atlas.mesh, Layout(size, "own"), how)
        return self._laid[1]

    @contextmanager
    def _folder_beside(self) -> Iterator[Path]:
        """A folder for unfinished files, on the disk where they are to be."""
        self._beside = tempfile.mkdtemp(prefix=self._prefix, dir=self.folder)
        try:
            yield Path(self._beside)
        finally:
            self.stop()

    def _names(self, name: str) -> Iterator[str]:
        """The name, and the same with numbers, as far as their files are free."""
        path = Path(name)
        for number in range(1, MOST_NUMBERS + 1):
            one = name if number == 1 else f"{path.stem}-{number}{path.suffix}"
            suffix = path.suffix.lower()
            likely = [one]
            if suffix in (".png", ".exr"):
                likely.append(mesh_beside(one).name)
            elif suffix == ".obj":
                likely += [f"{Path(one).stem}.mtl", f"{Path(one).stem}-{Path(one).stem}.png"]
            if self._are_free(likely):
                yield one

    def _are_free(self, names: list[str]) -> bool:
        return all(not os.path.lexists(self.folder / one) or self._is_own(one) for one in names)

    def _is_own(self, name: str) -> bool:
        """Whether what has this name now is what we wrote: not a link, another file, or edited."""
        try:
            found = os.lstat(self.folder / name)
        except OSError:
            return False
        return stat.S_ISREG(found.st_mode) and self._own.get(name) == _identity(found)

    def _place(self, path: Path) -> None:
        """Move a finished file into the folder; a link of its name is never followed."""
        with open(path, "rb+") as file:
            os.fsync(file.fileno())
        found = _identity(os.stat(path))
        target = self.folder / path.name
        if self._is_own(path.name):
            os.replace(path, target)
        else:
            try:
                os.link(path, target)  # a rename would replace what came there in the meantime
            except FileExistsError:
                what = f"a file {path.name} has just been made by somebody else"
                raise IoError(what, WHERE, "export again") from None
            except OSError:  # some file systems have no links
                os.replace(path, target)
        self._own[path.name] = found


def _identity(found: os.stat_result) -> tuple[int, ...]:
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def image_size(mesh: Mesh, least: int) -> int:
    """Pixels a side of an image on which every two faces can have a square of their own."""
    size = least
    while size < LARGEST_IMAGE and size < PIXELS_OF_SQUARE * math.sqrt(mesh.n_faces / 2):
        size *= 2
    return size


def checked_name(name: object, but: str = "") -> str:
    """A name under which an export may be written.

    Parameters
    ----------
    name : object
    but : str
        A suffix that it may not have, though it is one of `FORMATS`.

    Raises
    ------
    Refused
        It is no name of a file in a folder, or of no format that is written.
    """
    if not isinstance(name, str) or not 1 <= len(name.encode(errors="replace")) <= LONGEST:
        what = f"this is no name: {str(name)[:60]!r}"
        raise Refused(400, what, WHERE, f"use 1 to {LONGEST} letters")
    known = ", ".join(FORMATS)
    allowed = all(letter.isprintable() and letter not in '/\\:*?"<>|' for letter in name)
    if not allowed or name[0] in ".-~ " or name[-1] in ". " or RESERVED.fullmatch(name):
        what = f"{name!r} is no plain name of a file"
        raise Refused(400, what, WHERE, "use letters, digits, spaces and -, no folders")
    suffix = Path(name).suffix.lower()
    if suffix not in FORMATS or suffix == but:
        raise Refused(400, f"nothing is written as {suffix or name!r}", WHERE, f"use {known}")
    return name
