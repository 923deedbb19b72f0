"""What a volume would lose in another form or format, told before it is converted.

A loss is one sentence. Losses of data are refused unless they are accepted; other things, such as
the name of a grid or notes of other programs, are only told.
"""

import os
from collections.abc import Collection, Mapping

import numpy as np

from ..errors import IoError
from ..grid import Grid, NarrowBand
from .registry import Format, format_of
from .warn import Warn

FIX = "--force accepts the loss; .npz and .zarr hold all that a volume has"

_MOST_NAMES = 20  # in one sentence
_ASKED = {"closest": "closest faces and barycentrics", "half": "16-bit floats"}


def volume_losses(
    volume: NarrowBand | Grid, format: Format, *, is_dense: bool, half: bool = False
) -> list[str]:
    """Return a sentence for all that a volume would lose.

    Parameters
    ----------
    volume : NarrowBand or Grid
        What is there.
    format : Format
        Where it goes.
    is_dense : bool
        Whether it becomes, or stays, a full grid.
    half : bool
        Whether 16-bit floats are asked for.

    Notes
    -----
    That a band becomes a full grid, or a full grid a band, is no loss of this kind: it is what was
    asked for, or all that the format can do.
    """
    holds, holder = format.holds, format.name
    sentences = []
    if isinstance(volume, NarrowBand):
        for word, what in _band_companions(volume).items():
            if is_dense or word not in holds:
                where = "a full grid" if is_dense and word in holds else holder
                sentences.append(f"{where} has no place for {what}")
    elif not is_dense and volume.uncertain_voxels is not None:
        n = volume.uncertain_voxels
        sentences.append(f"a narrow band has no place for the bare count of uncertain nodes ({n})")
    sentences += [f"{holder} has no place for {what}" for what in _words_lost(volume, holds)]
    if volume.values.dtype == np.float64:
        sentences += _number_losses(format, is_dense=is_dense)
    if "transform" not in holds:
        origin = _origin(volume)
        place = ", ".join(f"{x:g}" for x in origin)
        size = f"{volume.voxel_size:g}"
        sentences.append(f"{holder} has no place for the voxel size {size}, nor for {place}")
    if half and "half" not in holds:
        sentences.append(f"{holder} has no 16-bit floats; written with more")
    return sentences


def asked_losses(path: str | os.PathLike, **asked: bool) -> dict[str, str]:
    """Return a sentence for each of the things asked for that a format cannot hold, by its name.

    Parameters
    ----------
    path : path
        The output; its suffix names the format.
    **asked : bool
        ``closest``, ``half``: whether these are wanted.
    """
    format = format_of(path, "volume", "writer")
    return {
        name: f"{format.name} has no place for {_ASKED[name]}"
        for name, is_asked in asked.items()
        if is_asked and name not in format.holds
    }


def file_losses(facts: Mapping, chosen: str | None, *, is_named: bool) -> list[str]:
    """Return a sentence for what of a file is not read: other grids, digits.

    Parameters
    ----------
    facts : mapping
        What `probe_volume` says.
    chosen : str or None
        The grid that is read; None for the one that the file's format says is meant.
    is_named : bool
        Whether the user chose it; then the others are not meant.
    """
    sentences = []
    if "grids" in facts:
        chosen = facts.get("default_grid") if chosen is None else chosen
        doubles = [g for g in facts["grids"] if g["name"] == chosen and g.get("type") == "double"]
        if doubles:
            sentences.append(f"the 64-bit values of the grid {chosen!r} are rounded to 32 bits")
        others = [
            f"'{grid['name']}' ({grid['type']})"
            for grid in facts["grids"]
            if chosen not in (grid["name"], grid.get("part_of"))
        ]
    else:
        others = [f"'{name}'" for name in facts.get("arrays", []) if name != facts.get("array")]
    if others and not is_named:
        listed = ", ".join(others)
        sentences.append(
            f"one grid is converted, so {listed} would be left out; choose with --grid"
        )
    return sentences


def metadata_losses(facts: Mapping, chosen: str | None, format: Format) -> list[str]:
    """Return a sentence for the metadata of a ``.vdb`` file that a format has no place for.

    Parameters
    ----------
    facts : mapping
        What `probe_volume` says of the file.
    chosen : str or None
        The grid that is read; None for the one that is meant.
    format : Format
        Where it goes.

    Notes
    -----
    These are notes of other programs, so they are told, and not refused.
    """
    if "metadata" in format.holds or "grids" not in facts:
        return []
    chosen = facts.get("default_grid") if chosen is None else chosen
    grid = next((grid for grid in facts["grids"] if grid["name"] == chosen), {})
    sentences = []
    for owner, entries in ((f"grid {chosen!r}", grid), ("file", facts)):
        names = [f"'{name}'" for name in entries.get("metadata", {})]
        if names:
            more = [f"{len(names) - _MOST_NAMES} more"] if len(names) > _MOST_NAMES else []
            listed = ", ".join(names[:_MOST_NAMES] + more)
            sentences.append(f"{format.name} has no place for the metadata {listed} of the {owner}")
    return sentences


def require_accepted(
    losses: Collection[str], path: str | os.PathLike, *, force: bool, warn: Warn
) -> None:
    """Tell losses that are accepted; refuse others.

    Raises
    ------
    IoError
        There are losses, and ``force`` is false.
    """
    if losses and not force:
        raise IoError("; ".join(losses), f"output {path}", FIX)
    for sentence in losses:
        warn(sentence)


def _band_companions(band: NarrowBand) -> dict[str, str]:
    """What a band has beside its distances."""
    found = {}
    if band.closest_face is not None:
        found["closest"] = "closest faces and barycentrics"
    if band.hermite is not None:
        found["hermite"] = "crossings, normals and features"
    if band.uncertain is not None:
        found["uncertain"] = f"which nodes have no certain side ({band.uncertain_voxels} of them)"
    return found


def _words_lost(volume: NarrowBand | Grid, holds: Collection[str]) -> list[str]:
    """What formats without room for words lose."""
    lost = []
    if "sign" not in holds:
        lost.append(f"how inside was told ({volume.sign})")
        if volume.n_inner_faces:
            lost.append(f"the number of inner faces ({volume.n_inner_faces})")
        if isinstance(volume, Grid) and volume.uncertain_voxels is not None:
            lost.append(f"the number of uncertain nodes ({volume.uncertain_voxels})")
    if "half_width" not in holds and volume.half_width is not None:
        lost.append(f"the half width at which distances end ({volume.half_width:g} voxels)")
    return lost


def _number_losses(format: Format, *, is_dense: bool) -> list[str]:
    """What becomes of 64-bit floats."""
    if is_dense and "double" in format.holds:
        return []
    holder = format.name if is_dense else "a narrow band"
    return [f"{holder} holds 32-bit floats: the values are rounded"]


def _origin(volume: NarrowBand | Grid) -> list[float]:
    origin = volume.translation if isinstance(volume, NarrowBand) else volume.origin
    return origin.tolist()
