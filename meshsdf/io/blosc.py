"""Open Blosc frames, as ``.vdb`` files hold them.

OpenVDB packs with LZ4, which `kernels.blosc_frames` opens and `kernels.blosc_pack` packs; frames of
other codecs need the package numcodecs, which is imported here and nowhere else.
"""

import numpy as np
from jaxtyping import Int64

from ..kernels.blosc_frames import DAMAGED, OTHER, open_frames
from .vdb_stream import ByteArray, UnsuitedError

Spans = Int64[np.ndarray, "k 2"]

PIP_LINE = "pip install '.[blosc]', in the folder that meshsdf was installed from"


def blosc_decode(window: ByteArray, frames: Spans, target: ByteArray, places: Spans) -> None:
    """Open frames into their places; both are given by where they begin and end.

    Raises
    ------
    ValueError
        A frame is damaged, or does not hold the bytes that it must.
    UnsuitedError
        A frame is not packed with LZ4, and numcodecs is not installed.
    """
    sizes = places[:, 1] - places[:, 0]
    states = np.empty(len(frames), np.uint8)
    scratch = np.empty(int(sizes.max(initial=0)), np.uint8)
    open_frames(window, frames, target, places, scratch, states)
    if (states == DAMAGED).any():
        worst = int(np.argmax(states == DAMAGED))
        raise ValueError(f"a Blosc frame for {sizes[worst]} bytes is damaged")
    for number in np.flatnonzero(states == OTHER).tolist():
        frame = window[slice(*frames[number])].tobytes()
        try:
            # The kernel has compared the size that the frame claims, so this takes no more
            data = _codec().decompress(frame)
        except RuntimeError as error:
            raise ValueError(f"a Blosc frame is damaged ({error})") from None
        target[slice(*places[number])] = np.frombuffer(data, np.uint8)


def _codec():
    """The package; UnsuitedError if it is not installed."""
    try:
        import numcodecs.blosc
    except ImportError:
        what = "its values are packed with Blosc, which needs the package numcodecs"
        raise UnsuitedError(what, PIP_LINE) from None
    return numcodecs.blosc
