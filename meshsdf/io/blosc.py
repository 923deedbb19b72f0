"""Blosc frames, as ``.vdb`` files hold them: opened by a kernel, packed by numcodecs.

OpenVDB packs with LZ4, which `kernels.blosc_frames` opens; frames of other codecs, and all
packing, need the package numcodecs, which is imported here and nowhere else.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from ..arrays import writable_alias
from ..errors import IoError
from ..kernels.blosc_frames import DAMAGED, OTHER, open_frames
from ..kernels.parallel import even_ranges, run_pieces
from .vdb_stream import UnsuitedError

FRAMES_PER_TASK = 1024
PIP_LINE = "pip install 'meshsdf[blosc]'"


def require_blosc(where: str) -> None:
    """IoError unless Blosc frames can be made."""
    try:
        _codec()
    except UnsuitedError as error:
        raise IoError("packing with Blosc needs the package numcodecs", where, error.fix) from None


def blosc_encoder(width: int) -> Callable[[memoryview], bytes]:
    """What packs values of ``width`` bytes as OpenVDB does: LZ4 on shuffled bytes."""
    codec = _codec()
    compress, shuffle = codec.compress, codec.SHUFFLE
    type_ = np.dtype(f"V{width}")  # Blosc takes the size of a value from its type
    return lambda data: compress(np.frombuffer(data, type_), b"lz4", 9, shuffle)


@contextmanager
def without_blosc_threads() -> Iterator[None]:
    """Keep Blosc from its threads, which cost more than they gain on data as small as a leaf's."""
    codec = _codec()
    before, codec.use_threads = codec.use_threads, False
    try:
        yield
    finally:
        codec.use_threads = before


def blosc_decode(window: bytes, frames: list[tuple[int, int]], sizes: list[int]) -> bytes:
    """Open frames, given by where they begin and end; return what they hold, one after another.

    Raises
    ------
    ValueError
        A frame is damaged, or does not hold the bytes that it must.
    UnsuitedError
        A frame is not packed with LZ4, and numcodecs is not installed.
    """
    if not frames:
        return b""
    ends = np.cumsum(sizes)
    places = np.stack([ends - sizes, ends], axis=1)
    target = np.empty(int(ends[-1]), np.uint8)
    states = np.empty(len(frames), np.uint8)
    source = writable_alias(np.frombuffer(window, np.uint8))
    spans, room = np.array(frames, np.int64), max(sizes)
    ranges = even_ranges(len(frames), len(frames) // FRAMES_PER_TASK + 1)

    def work(task: int) -> None:
        part = slice(*ranges[task])
        scratch = np.empty(room, np.uint8)
        open_frames(source, spans[part], target, places[part], scratch, states[part])

    run_pieces(work, len(ranges))
    if (states == DAMAGED).any():
        worst = int(np.argmax(states == DAMAGED))
        raise ValueError(f"a Blosc frame for {sizes[worst]} bytes is damaged")
    for number in np.flatnonzero(states == OTHER).tolist():
        frame = window[slice(*frames[number])]
        try:
            # The kernel has compared the size that the frame claims, so this takes no more
            data = _codec().decompress(frame)
        except RuntimeError as error:
            raise ValueError(f"a Blosc frame is damaged ({error})") from None
        target[slice(*places[number])] = np.frombuffer(data, np.uint8)
    return target.tobytes()


def _codec():
    """The package; UnsuitedError if it is not installed."""
    try:
        import numcodecs.blosc
    except ImportError:
        what = "its values are packed with Blosc, which needs the package numcodecs"
        raise UnsuitedError(what, PIP_LINE) from None
    return numcodecs.blosc
