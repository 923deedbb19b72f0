"""Volumes to read, with whatever is found wrong in them told as one kind of error."""

import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from ..errors import GridError, IoError
from .registry import checked_input
from .vdb_stream import UnsuitedError, VdbReader


@contextmanager
def opened(path: str | os.PathLike) -> Iterator[tuple[BinaryIO, Path]]:
    """A file to read, and its path; IoError as `refusing`."""
    with refusing(checked_input(path)) as path, open(path, "rb") as file:
        yield file, path


@contextmanager
def opened_reader(path: str | os.PathLike) -> Iterator[VdbReader]:
    """A reader of a file that asks for no more than is there; IoError as `refusing`."""
    with opened(path) as (file, _):
        yield VdbReader(file, os.fstat(file.fileno()).st_size)


@contextmanager
def refusing(path: Path, thing: str = "volume") -> Iterator[Path]:
    """Yield a file, or a volume that is a folder; what is found wrong with it becomes IoError."""
    try:
        yield path
    except UnsuitedError as error:
        raise IoError(f"{path.name}: {error}", _place(path), error.fix) from error
    except GridError as error:
        raise _unreadable(path, thing, error.what) from error
    except MemoryError as error:
        raise _unreadable(path, thing, "it does not fit in memory") from error
    except OSError as error:
        raise _unreadable(path, thing, error.strerror or str(error)) from error
    except RecursionError as error:
        raise _unreadable(path, thing, "its parts are nested too deeply") from error
    except (ValueError, zlib.error, EOFError, OverflowError) as error:
        raise _unreadable(path, thing, str(error)) from error


def _unreadable(path: Path, thing: str, reason: str) -> IoError:
    return IoError(
        f"{path.name} is not a readable {thing}: {' '.join(reason.split())[:300]}",
        _place(path),
        "write it again; if it was copied, copy it again",
    )


def _place(path: Path) -> str:
    return f"folder {path}" if path.is_dir() else f"file {path}"
