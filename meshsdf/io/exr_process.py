"""Pixels of an OpenEXR file that only the package OpenEXR can unpack: PIZ, PXR24, B44 and DWA.

It is written in C++, goes on after a chunk that it cannot unpack, and leaves zeros there with a
word on the standard output. So it never sees a file from elsewhere: from headers that were checked
and chunks of the right number and size a plain file is made for each part, and a process of its
own, with bounded memory and time, unpacks these. Whatever goes wrong there, and any word that it
prints, means that the file is damaged.
"""

import os
import struct
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from .exr_header import COMPRESSIONS, MAGIC, Part
from .vdb_stream import UnsuitedError

LOSSY = {
    "PXR24": ("float32",),
    "B44": ("float16",),
    "B44A": ("float16",),
    **dict.fromkeys(("DWAA", "DWAB"), ("float16", "float32")),
}
"""Those that change values, and of which type."""

ROOM, ROOM_PER_BYTE = 1 << 31, 6
"""Bytes of address space that the process gets, at the least and for each byte of pixels."""

LEAST_SECONDS, BYTES_PER_SECOND = 60, 2e6
"""How long it may take."""

_LIMITS = """
import sys
try:
    import resource
    room, seconds = int(sys.argv[1]), int(sys.argv[2])
    resource.setrlimit(resource.RLIMIT_AS, (room, room))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except ImportError:
    pass
import numpy, OpenEXR
"""

_SCRIPT = """
with open("pixels", "wb") as out:
    for number in range(int(sys.argv[3])):
        with OpenEXR.File(f"{number}.exr", separate_channels=True) as file:
            (part,) = file.parts
            out.write(numpy.ascontiguousarray(part.channels["Y"].pixels).data)
"""


def unpacked_apart(parts: list[Part], chunks: list[list[bytes]]) -> list[np.ndarray]:
    """Return the pixels of every part, unpacked in another process.

    Parameters
    ----------
    parts : list of Part
        What the headers say.
    chunks : list of list of bytes
        The packed lines of each part, none longer than it would be unpacked.

    Raises
    ------
    ValueError
        They cannot be unpacked, or not within the memory and the time that suit them.
    UnsuitedError
        There is no other process to be had.

    Notes
    -----
    Cost: the start of a Python, some 0.2 s, beyond the work.
    """
    n_bytes = sum(part.n_bytes for part in parts)
    with TemporaryDirectory(prefix="meshsdf-") as name:
        folder = Path(name)
        for number, (part, packed) in enumerate(zip(parts, chunks, strict=True)):
            (folder / f"{number}.exr").write_bytes(plain_file(part, packed))
        run_apart(folder, _SCRIPT, [str(len(parts))], n_bytes)
        pixels = folder / "pixels"
        if not pixels.is_file() or pixels.stat().st_size != n_bytes:
            raise ValueError("a chunk does not give the bytes of its lines")
        with open(pixels, "rb") as file:
            return [
                np.fromfile(file, part.dtype, part.shape[0] * part.shape[1]).reshape(part.shape)
                for part in parts
            ]


def plain_file(part: Part, packed: list[bytes]) -> bytes:
    """Return a file of one part with these chunks, and no more in its header than must be."""
    height, width = part.shape
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = {
        "channels": ("chlist", part.channels),
        "compression": ("compression", bytes([COMPRESSIONS.index(part.compression)])),
        "dataWindow": ("box2i", window),
        "displayWindow": ("box2i", window),
        "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", struct.pack("<f", 1)),
        "screenWindowCenter": ("v2f", bytes(8)),
        "screenWindowWidth": ("float", struct.pack("<f", 1)),
    }
    head = MAGIC + struct.pack("<I", 2)
    for name, (kind, data) in attributes.items():
        head += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data
    head += b"\0"
    ends = np.cumsum([0, *(8 + len(data) for data in packed)]) + len(head) + 8 * len(packed)
    body = [
        struct.pack("<ii", number * part.lines, len(data)) + data
        for number, data in enumerate(packed)
    ]
    return head + ends[:-1].astype("<u8").tobytes() + b"".join(body)


def run_apart(folder: Path, script: str, arguments: list[str], n_bytes: int) -> None:
    """Run a script that unpacks ``n_bytes`` of pixels with OpenEXR, in a folder, within limits.

    Raises
    ------
    ValueError
        It does not end well, or not without a word, or not in time.
    UnsuitedError
        There is no other process to be had.
    """
    room = ROOM + ROOM_PER_BYTE * n_bytes
    seconds = int(LEAST_SECONDS + n_bytes / BYTES_PER_SECOND)
    command = [sys.executable, "-c", _LIMITS + script, str(room), str(seconds), *arguments]
    # Its libraries need no threads, whose stacks would count as memory
    quiet = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=os.environ | quiet,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ValueError(f"its pixels were not unpacked in {seconds} s") from None
    except OSError as error:
        what = f"its pixels need a process of their own, and none can be started ({error})"
        raise UnsuitedError(what, "save it with ZIP compression") from error
    if done.returncode or done.stdout or done.stderr:
        raise ValueError("a chunk is damaged (OpenEXR cannot unpack it)")
