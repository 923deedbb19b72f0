"""What the headers of files of samples say; see `samples` for what stands in them."""

import os

from .npy_archive import ZIP_ERRORS, ArchiveReader
from .npz import SAMPLE_KEYS
from .ply_elements import Header, header_and_body
from .registry import checked_input

_WORDS = ("format", "normalization", "sign", "seed", "n_uncertain", "center", "scale")
_LONGEST_PLY_HEADER = 1 << 16


def probe_samples(path: str | os.PathLike) -> dict | None:
    """Return what the header of a file of samples says; None if it is no such file.

    ``kind`` is "samples"; ``format``, ``n``, and what `samples` lists. Of files that
    DeepSDF's own program wrote only ``n``, ``n_pos`` and ``n_neg`` are known.
    """
    path = checked_input(path)
    if path.suffix.lower() == ".ply":
        with open(path, "rb") as file:
            start = file.read(_LONGEST_PLY_HEADER)
        if b"\ncomment meshsdf_format meshsdf.samples/" not in start:
            return None
        header = _header(start)
        if header is None:
            return None
        names = [one.name for one in header.declarations[0].properties]
        told = _told_by_comments(header)
        dtype = header.declarations[0].properties[0].dtype.name
        return _facts(told, header.declarations[0].count, dtype, set(names))
    try:
        with ArchiveReader(path) as archive:
            names = set(archive.headers)
            told = {name: archive.read(name).tolist() for name in _WORDS if name in names}
            headers = archive.headers
    except (OSError, *ZIP_ERRORS):
        return None
    if names >= SAMPLE_KEYS:
        n_pos, n_neg = (headers[name].shape[0] for name in ("pos", "neg"))
        head = {"format": "DeepSDF"} | told | {"n_pos": n_pos, "n_neg": n_neg}
        return _facts(head, n_pos + n_neg, headers["pos"].dtype.name, names)
    if not str(told.get("format", "")).startswith("meshsdf.samples/") or "points" not in names:
        return None
    points = headers["points"]
    return _facts(told, points.shape[0], points.dtype.name, names)


def _facts(told: dict, n: int, dtype: str, names: set[str]) -> dict:
    has = {
        "has_normals": bool({"normals", "nx"} & names),
        "has_closest_point": bool({"closest_point", "closest_x"} & names),
    }
    return {"kind": "samples", "n": n, "dtype": dtype} | told | has


def _header(data: bytes) -> Header | None:
    try:
        header, _ = header_and_body(data)
    except ValueError:
        return None
    return header if header.declarations and header.declarations[0].properties else None


def _told_by_comments(header: Header) -> dict:
    """What comments say, as far as it can be understood."""
    words = [line.split() for line in header.comments_with("meshsdf_")]
    found = {line[0].removeprefix("meshsdf_"): line[1:] for line in words}
    told = {name: " ".join(found.get(name, [])) for name in ("format", "normalization", "sign")}
    for name, kind, count in (
        ("seed", int, 1),
        ("n_uncertain", int, 1),
        ("center", float, 3),
        ("scale", float, 1),
    ):
        try:
            numbers = [kind(word) for word in found.get(name, [])]
        except ValueError:
            continue
        if len(numbers) == count:
            told[name] = numbers if count > 1 else numbers[0]
    return told
