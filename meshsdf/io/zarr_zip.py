"""Zarr volumes in one file: a zip whose entries are the files of the folder.

Entries are stored as they are, because chunks are packed already, in the order of their names but
with the root's ``zarr.json`` first; so a reader at the far end of a wire finds the rest from the
zip's directory. Read are zips of others too, also with deflated entries. Nothing is unpacked to the
disk: names lead to entries and to nothing else, and an entry is read only if it claims no more
bytes than are asked for. (Zarr zip store, zarr.readthedocs.io; PKWARE APPNOTE 6.3.)
"""

import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from .atomic import atomic_folder, atomic_write
from .npy_archive import EPOCH, ZIP_ERRORS
from .vdb_stream import UnsuitedError, printable

SUFFIX = ".zip"

_METADATA = "zarr.json"
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED = 1
_PIECE = 1 << 20


class ZipFolder:
    """An open zip, in which `ZipPlace` finds files as in a folder.

    ValueError says what is wrong with it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._zip = zipfile.ZipFile(path)
        except ZIP_ERRORS as error:
            raise ValueError(f"it is no sound zip ({printable(str(error))})") from None
        self.entries: dict[str, zipfile.ZipInfo] = {}
        self.folders = {""}
        for entry in self._zip.infolist():
            name = entry.filename.rstrip("/")
            if not entry.is_dir():
                self.entries[name] = entry  # of several the last, for nothing in a zip is replaced
                name = name.rpartition("/")[0]
            while name not in self.folders:
                self.folders.add(name)
                name = name.rpartition("/")[0]

    def close(self) -> None:
        """Close the file."""
        self._zip.close()

    def read(self, name: str, most: int) -> bytes | None:
        """The bytes of an entry of a likely size, compared with their checksum; None without it."""
        entry = self.entries.get(name)
        if entry is None:
            return None
        if entry.file_size > most:
            raise ValueError(f"{printable(name)} is no entry of up to {most} bytes")
        if entry.compress_type not in _METHODS or entry.flag_bits & _ENCRYPTED:
            what = f"its entry {printable(name)!r} is encrypted, or packed by another method"
            raise UnsuitedError(what, "write the zip without compression")
        try:
            # No more than the claimed bytes come out, however many are packed
            data = self._zip.read(entry)
        except ZIP_ERRORS as error:
            what = f"its entry {printable(name)!r} is damaged ({printable(str(error))})"
            raise ValueError(what) from None
        if len(data) != entry.file_size:
            raise ValueError(f"its entry {printable(name)!r} is cut off")
        return data

    @property
    def is_plain(self) -> bool:
        """Whether every entry is stored as it is, so that none can unpack to more."""
        stored = zipfile.ZIP_STORED
        return all(entry.compress_type == stored for entry in self.entries.values())


@dataclass(frozen=True)
class ZipPlace:
    """A file or folder in a zip, asked as a `Path` is."""

    folder: ZipFolder
    name: str = ""

    def __truediv__(self, name: str) -> "ZipPlace":
        return ZipPlace(self.folder, f"{self.name}/{name}" if self.name else name)

    @property
    def parts(self) -> tuple[str, ...]:
        """The zip's name, then those within."""
        return (self.folder.path.name, *filter(None, self.name.split("/")))

    def is_file(self) -> bool:
        """Whether there is such an entry."""
        return self.name in self.folder.entries

    def is_dir(self) -> bool:
        """Whether an entry lies in it."""
        return self.name in self.folder.folders

    def exists(self) -> bool:
        """Whether it is one or the other."""
        return self.is_file() or self.is_dir()


Folder = Path | ZipPlace
"""Where an array or a group lies, for reading."""


@contextmanager
def folder_at(path: Path) -> Iterator[Folder]:
    """The folder of a volume: a real one, or what its zip holds."""
    if path.suffix.lower() != SUFFIX:
        yield path
        return
    found = ZipFolder(path)
    try:
        yield ZipPlace(found)
    finally:
        found.close()


@contextmanager
def new_folder(path: Path, force: bool) -> Iterator[Path]:
    """A folder to be filled, which takes its place, zipped if it is to be so, when the block ends.

    Raises
    ------
    IoError
        As `atomic_folder` and `atomic_write`.
    """
    if path.suffix.lower() != SUFFIX:
        with atomic_folder(path, force) as folder:
            yield folder
        return
    with (
        atomic_write(path, force) as temporary,
        # Beside the file, where there is room for it
        tempfile.TemporaryDirectory(prefix=".meshsdf-", dir=temporary.parent) as folder,
    ):
        yield Path(folder)
        _zip_folder(Path(folder), temporary)


def _zip_folder(folder: Path, path: Path) -> None:
    """Write the files of a folder to a zip; the same files give the same bytes."""
    files = {file.relative_to(folder).as_posix(): file for file in folder.rglob("*")}
    names = sorted(name for name, file in files.items() if file.is_file())
    names.sort(key=lambda name: name != _METADATA)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name in names:
            # Neither the clock nor the operating system may leave a trace
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.create_system, entry.external_attr = 3, 0o644 << 16
            entry.file_size = files[name].stat().st_size
            with open(files[name], "rb") as source, archive.open(entry, "w") as target:
                while data := source.read(_PIECE):
                    target.write(data)
