"""What the tests of .exr volumes share: OpenEXR's own view of a file, and files made by hand."""

import json
import struct

import numpy as np
import OpenEXR

from meshsdf.grid import Grid


def images_of(path) -> list[np.ndarray]:
    """The pixels of every part, as OpenEXR reads them."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return [np.array(part.channels["Y"].pixels) for part in file.parts]


def header_of(path, part=0) -> dict:
    """The header of a part, as OpenEXR reads it."""
    with OpenEXR.File(str(path), header_only=True) as file:
        return dict(file.parts[part].header)


def facts_beside(path) -> dict:
    """The JSON file beside an .exr file."""
    return json.loads(path.with_name(f"{path.name}.json").read_text())


def random_grid(seed: int, shape=None, *, gaps: bool = False) -> Grid:
    """Values of either sign and any size, some of them NaN, others 0 and -0."""
    random = np.random.default_rng(seed)
    shape = random.integers(1, 9, 3) if shape is None else shape
    values = random.normal(size=shape) * 10.0 ** random.integers(-20, 20, shape)
    values[values > 1e15] = np.nan if gaps else 0.0
    values[random.random(shape) < 0.1] = -0.0
    size, origin = float(random.uniform(1e-6, 1e6)), random.normal(size=3)
    return Grid(values.astype(np.float32), size, origin, "winding", 3, 1, 2.5)


def ball(shape=(33, 29, 31), center=(0.31, -0.22, 0.17), radius=0.35) -> tuple[Grid, np.ndarray]:
    """Distances to a sphere, and its centre."""
    origin, size, center = np.array([-0.5, -0.9, -0.6]), 0.05, np.array(center)
    nodes = origin + size * np.moveaxis(np.indices(shape), 0, -1)
    values = np.linalg.norm(nodes - center, axis=-1) - radius
    return Grid(values.astype(np.float32), size, origin), center


def center_of(values: np.ndarray, places: np.ndarray, radius=0.35) -> np.ndarray:
    """The centre of a bump that falls off with the distance from the centre of a sphere.

    The bump is smooth and vanishes within the grid, so that sums are integrals to 1e-7.
    """
    weights = np.exp(-(((values.astype(np.float64) + radius) / 0.11) ** 2))
    return (weights[..., None] * places).sum(axis=(0, 1, 2)) / weights.sum()


def attribute(name: str, kind: str, data: bytes) -> bytes:
    """An entry of a header."""
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data


def exr_bytes(facts: dict[str, str], **changes) -> bytes:
    """A single-part file with float pixels, written by hand, of which some parts are replaced.

    ``facts`` are its text attributes; ``size`` width and height; ``chunks`` the chunks (line,
    bytes); ``places`` where they stand.
    """
    width, height = changes.pop("size", (4, 2))
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    parts = {
        "channels": attribute(
            "channels", "chlist", b"Y\0" + struct.pack("<4i", 2, 0, 1, 1) + b"\0"
        ),
        "compression": attribute("compression", "compression", b"\x03"),
        "dataWindow": attribute("dataWindow", "box2i", window),
        "displayWindow": attribute("displayWindow", "box2i", window),
        "lineOrder": attribute("lineOrder", "lineOrder", b"\0"),
    }
    head = changes.pop("head", struct.pack("<II", 20000630, 2))
    chunks = changes.pop("chunks") if "chunks" in changes else [(0, bytes(4 * width * height))]
    places = changes.pop("places", None)
    tail = changes.pop("tail", b"")
    parts |= changes
    header = b"".join(parts.values())
    header += b"".join(attribute(name, "string", text.encode()) for name, text in facts.items())
    start = len(head) + len(header) + 1 + 8 * len(chunks)
    body, found = b"", []
    for line, data in chunks:
        found.append(start + len(body))
        body += struct.pack("<ii", line, len(data)) + data
    table = np.array(found if places is None else places, "<u8").tobytes()
    return head + header + b"\0" + table + body + tail
