"""meshsdf.kernels.blosc_frames: what C-Blosc packs is opened, and damage is told, not obeyed."""

import struct

import numpy as np
import pytest

from meshsdf.io.blosc import blosc_decode
from meshsdf.kernels.blosc_frames import DAMAGED, GOOD, OTHER, open_frames


def opened(frame: bytes, size: int) -> tuple[int, bytes]:
    """State of one frame and what it gives, with a margin on both sides that must stay."""
    target = np.full(size + 64, 77, np.uint8)
    states = np.empty(1, np.uint8)
    source = np.frombuffer(bytes(32) + frame + bytes(32), np.uint8).copy()
    frames, places = np.array([[32, 32 + len(frame)]]), np.array([[32, 32 + size]])
    open_frames(source, frames, target, places, np.empty(size, np.uint8), states)
    assert (target[:32] == 77).all()
    assert (target[32 + size :] == 77).all()
    return int(states[0]), target[32 : 32 + size].tobytes()


def framed(stream: bytes, size: int, *, flags: int = 0x20 | 0x10, width: int = 1) -> bytes:
    """A frame of one block in one stream, as the format describes it."""
    body = struct.pack("<ii", 20, len(stream)) + stream
    return struct.pack("<BBBBIII", 2, 1, flags, width, size, size, 16 + len(body)) + body


def test_sequences_of_lz4_give_what_its_description_says():
    # 3 literals, then 7 bytes repeated from 2 back; then 2 literals
    stream = b"\x33abc" + struct.pack("<H", 2) + b"\x20xy"
    assert opened(framed(stream, 12), 12) == (GOOD, b"abc" + b"bcbcbcb" + b"xy")
    # Lengths of 15 and more go on in further bytes: 300 literals, 274 + 4 repeated, 1 literal
    letters = bytes(range(250)) + bytes(50)
    stream = b"\xff\xff\x1e" + letters + struct.pack("<H", 300) + b"\xff\x04" + b"\x10!"
    expected = letters + letters[:278] + b"!"
    assert opened(framed(stream, 579), 579) == (GOOD, expected)


def test_shuffled_bytes_come_back_in_order_with_the_rest_behind():
    # Four values of 3 bytes, and 2 bytes that are no value; a stream of its own length is a copy
    plain = bytes(range(14))
    shuffled = plain[0:12:3] + plain[1:12:3] + plain[2:12:3] + plain[12:]
    assert opened(framed(shuffled, 14, flags=0x31, width=3), 14) == (GOOD, plain)


def test_what_c_blosc_packs_is_opened():
    codec = pytest.importorskip("numcodecs.blosc")
    random = np.random.default_rng(0)
    for size in [0, 1, 2, 15, 16, 17, 100, 511, 2048, 6144, 16384, 131072, 393216]:
        for width in [1, 2, 4, 8, 12, 16, 17, 255]:
            kind = random.integers(3)
            data = [
                random.integers(0, 256, size),
                np.repeat(random.integers(0, 256, size // 50 + 1), 50)[:size],
                np.zeros(size),
            ][kind].astype(np.uint8)[: size // width * width]
            values = data.view(f"V{width}") if len(data) else data
            for shuffle, level, block in [(0, 1, 0), (1, 9, 0), (1, 5, 256), (0, 9, 1000)]:
                frame = codec.compress(values, b"lz4", level, shuffle, block)
                assert opened(frame, len(data)) == (GOOD, data.tobytes()), (size, width, kind)


def test_other_codecs_are_left_to_their_library():
    codec = pytest.importorskip("numcodecs.blosc")
    values = np.arange(1000, dtype=np.float32)
    for name, shuffle in [(b"zstd", 1), (b"zlib", 1), (b"blosclz", 1), (b"lz4", 2)]:
        frame = codec.compress(values, name, 5, shuffle)
        assert opened(frame, 4000)[0] == OTHER
        window, target = np.frombuffer(bytearray(b"--" + frame), np.uint8), np.zeros(4002, np.uint8)
        blosc_decode(window, np.array([[2, 2 + len(frame)]]), target, np.array([[1, 4001]]))
        assert target.tobytes() == b"\0" + values.tobytes() + b"\0"


def test_no_damage_reaches_beyond_its_frame():
    stream = b"\x33abc" + struct.pack("<H", 2) + b"\x20xy"
    frame = framed(stream, 12)
    for cut in range(len(frame)):
        assert opened(frame[:cut], 12)[0] == DAMAGED
    for size in (0, 11, 13):
        assert opened(frame, size)[0] == DAMAGED
    bad = [
        b"\x33abc" + struct.pack("<H", 4) + b"\x20xy",  # repeats what is before the beginning
        b"\x33abc" + struct.pack("<H", 0) + b"\x20xy",
        b"\xf3\xff\xff\xff\xff" + b"abcdef",  # more literals than there are
        b"\x3fabc" + struct.pack("<H", 2) + b"\xff\xff",  # a length without an end
        b"\x33abc" + struct.pack("<H", 2),  # nothing after the last repetition
    ]
    for stream in bad:
        assert opened(framed(stream, 12), 12)[0] == DAMAGED


def test_random_damage_ends_in_a_state_and_touches_nothing_else():
    codec = pytest.importorskip("numcodecs.blosc")
    random = np.random.default_rng(1)
    values = np.repeat(random.integers(0, 9, 300), 3).astype(np.float32)
    frame = codec.compress(values, b"lz4", 9, 1)
    states = set()
    for _ in range(3000):
        bad = bytearray(frame)
        for place in random.integers(0, len(bad), random.integers(1, 4)):
            bad[place] ^= random.integers(1, 256)
        states.add(opened(bytes(bad), values.nbytes)[0])
    assert states == {GOOD, DAMAGED, OTHER}
