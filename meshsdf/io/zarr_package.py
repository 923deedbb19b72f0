"""Zarr arrays in codecs other than our own, opened by the package zarr, imported here alone."""

from pathlib import Path

import numpy as np

from .vdb_stream import UnsuitedError
from .zarr_zip import Folder

PIP_LINE = "pip install '.[scale]', in the folder that meshsdf was installed from"

CODECS = frozenset({"bytes", "transpose", "gzip", "zstd", "blosc", "crc32c", "sharding_indexed"})
"""Those that unpack numbers and do nothing else; the package knows some that run code."""

_ERRORS = (OSError, ValueError, TypeError, KeyError, IndexError, RuntimeError, OverflowError)


def read_with_package(folder: Folder, codecs: tuple[str, ...]) -> np.ndarray:
    """Return a whole array.

    Raises
    ------
    ValueError
        It is damaged, as far as the package sees that.
    UnsuitedError
        A codec is not one of `CODECS`, entries of a zip are packed once more, or the package is not
        installed.
    """
    packing = ", ".join(codecs)
    if not CODECS.issuperset(codecs):
        raise UnsuitedError(f"its chunks are packed with {packing}", "write it with the gzip codec")
    if not (isinstance(folder, Path) or folder.folder.is_plain):
        what = f"chunks packed with {packing} are packed again by its zip"
        raise UnsuitedError(what, "write the zip without compression")
    try:
        import zarr
    except ImportError:
        what = f"its chunks are packed with {packing}, which needs the package zarr"
        raise UnsuitedError(what, PIP_LINE) from None
    try:
        if isinstance(folder, Path):
            return np.asarray(zarr.open_array(str(folder), mode="r", zarr_format=3)[...])
        with zarr.storage.ZipStore(folder.folder.path, mode="r") as store:
            array = zarr.open_array(store, path=folder.name, mode="r", zarr_format=3)
            return np.asarray(array[...])
    except _ERRORS as error:
        raise ValueError(f"the package zarr cannot read it ({error})") from None
