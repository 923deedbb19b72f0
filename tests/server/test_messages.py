"""meshsdf.server.messages: every message there and back, nothing but our errors for the rest."""

import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import meshsdf.server
from meshsdf.errors import ServerError
from meshsdf.server.messages import (
    DURABLE,
    Hello,
    OperationAsked,
    Type,
    decode,
    encode,
    encode_ack,
    encode_error,
    encode_hello,
    encode_json,
    encode_view,
)
from meshsdf.server.samples import Samples, octahedral_codes, octahedral_normals

from .wire_examples import frame, good_frames

PROTOCOL = Path(meshsdf.server.__file__).with_name("PROTOCOL.md")
FUZZED = 4000  # frames here; tests/benchmarks/frames.py does a million


def text(words, **more):
    """A frame of JSON that goes up."""
    return frame(words, json.dumps(more).encode(), seq=1)


def test_the_table_of_the_protocol_is_the_program():
    rows = re.findall(
        r"^\| (\d+) \| ([A-Z_]+) \| (up|down)(, durable)? \|", PROTOCOL.read_text(), re.M
    )
    told = {(int(number), name): (way, bool(durable)) for number, name, way, durable in rows}
    real = {(one.value, one.name): ("down" if one >= 64 else "up", one in DURABLE) for one in Type}
    assert told == real


def test_the_requests_of_the_protocol_are_those_that_are_answered():
    told = set(re.findall(r"^\| (?:GET|POST) (/api/\w+)", PROTOCOL.read_text(), re.M))
    routes = re.findall(r'Route\("(/api/\w+)', PROTOCOL.with_name("app.py").read_text())
    assert told == set(routes) - {"/api/socket"}
    assert "/api/socket" in routes


def test_frames_are_as_the_protocol_says():
    assert encode(Type.UNDO, 7) == frame(5, seq=7)
    assert encode(Type.BRICKS, 3, b"abc", 1) == frame(66, b"abc", seq=3, flags=1)
    assert encode_ack(9, 70000) == frame(65, struct.pack("<I", 70000), seq=9)
    hello = Hello("0123456789abcdef" * 2, "run", 5)
    assert decode(encode_hello(hello)).body == hello
    assert decode(encode_hello(Hello(hello.client))).body == Hello(hello.client, "", 0)


def test_every_message_that_goes_up_is_read():
    read = [decode(one) for one in good_frames()]
    assert [one.type for one in read] == list(Type)[:10]
    assert [one.seq for one in read] == list(range(1, 11))
    begin, dabs, operation, view = (read[i].body for i in (1, 2, 6, 7))
    assert begin.layer == 0
    assert begin.brush["radius"] == 0.1
    assert_allclose(dabs.points, [[1.0, -2.0, 0.5]] * 3)
    assert_allclose(dabs.normals, [[1.0, 0.0, 0.0]] * 3)
    assert_array_equal(dabs.pressures, np.ones(3))
    params = {"layer": 0, "texture_kind": "checker"}
    assert operation == OperationAsked("bake", params, True)
    assert_allclose(view.eye, [1, 2, 3])
    assert view.cursor is None
    both = decode(encode_view(np.array([1.0, 2, 3]), np.array([4.0, 5, 6]))).body
    assert_allclose([both.eye, both.cursor], [[1, 2, 3], [4, 5, 6]])


def test_what_goes_down_is_read_by_the_painter_alone():
    state = {"seq": 3, "layers": []}
    assert decode(encode_json(Type.STATE, state), downward=True).body == state
    assert decode(encode_ack(2, 5), downward=True).body == 5
    told = decode(encode_error(4, ServerError("a", "b", "c")), downward=True)
    assert told.seq == 4
    assert told.body == {"cseq": 4, "what": "a", "where": "b", "fix": "c"}
    with pytest.raises(ServerError, match="no message of type 67 in this direction"):
        decode(encode_json(Type.STATE, state))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "a frame of 0 bytes has no header"),
        (bytes(15), "a frame of 15 bytes has no header"),
        (bytes(2**20 + 1), "a frame of 1048577 bytes"),
        (frame(5, seq=1, version=1), "version 1 of the protocol"),
        (frame(5, seq=1, length=4), "0 bytes of payload where 4 are announced"),
        (frame(5, seq=1, checksum=1), "not what its checksum says"),
        (frame(5, seq=1, flags=1), "UNDO has flags 1"),
        (frame(5), "UNDO has no number"),
        (frame(5, b"x", seq=1), "UNDO carries 1 bytes"),
        (frame(0), "no message of type 0"),
        (frame(11), "no message of type 11"),
        (frame(255), "no message of type 255"),
        (text(1, client="a" * 31, version=2), "the client's name is none"),
        (text(1, client="g" * 32, version=2), "the client's name is none"),
        (text(1, client="a" * 32, version=1), "version 1 of the protocol"),
        (text(1, client="a" * 32, version=True), "'version' is a bool"),
        (text(1, client="a" * 32), "'version' is missing"),
        (text(1, client="a" * 32, version=2, since=-1), "a version of -1"),
        (text(1, client="a" * 32, version=2, more=1), "'more' is unknown"),
        (text(2, layer="0", brush={}), "'layer' is a str"),
        (text(7, kind="k" * 65, params={}), "name of 65 letters"),
        (text(7, kind="bake", params=[]), "'params' is a list"),
        (frame(7, b"[]", seq=1), "a JSON list"),
        (frame(7, b"{", seq=1), "no JSON"),
        (frame(7, b"\xff{}", seq=1), "no JSON"),
        (frame(7, b'{"kind":NaN}', seq=1), "NaN is no number of JSON"),
        (frame(7, b'{"kind":"a","params":{"x":1e999}}', seq=1), "the number inf"),
        (frame(7, b'{"kind":"a","params":{"x":9007199254740993}}', seq=1), "beyond 2"),
        (frame(7, b'{"kind":"\\ud800","params":{}}', seq=1), "half a character"),
        (frame(7, b'{"kind":"a","params":' + b"[" * 20 + b"]" * 20 + b"}", seq=1), "16 deep"),
        (frame(7, b"[" * 500_000, seq=1), "16 deep|no JSON"),
        (frame(3, b"", seq=1), "DABS of 0 bytes"),
        (frame(3, bytes(19), seq=1), "DABS of 19 bytes"),
        (frame(3, bytes(2049 * 20), seq=1), "DABS of 40980 bytes"),
        (frame(3, bytes(20) + struct.pack("<f", np.nan) + bytes(16), seq=1), r"sample 1 lies at"),
        (frame(3, struct.pack("<f", np.inf) + bytes(16), seq=1), "sample 0 lies at"),
        (frame(8, bytes(23)), "a VIEW of 23 bytes"),
        (frame(8, struct.pack("<6f", np.nan, 0, 0, 0, 0, 0)), "a VIEW from nowhere"),
        (frame(8, struct.pack("<6f", 0, 0, 0, np.inf, 0, 0)), "a VIEW from nowhere"),
    ],
    ids=lambda value: value[:28] if isinstance(value, str) else "",
)
def test_what_is_no_message_is_refused(data, words):
    with pytest.raises(ServerError, match=words):
        decode(data)


def test_full_frames_are_accepted():
    assert len(decode(frame(3, bytes(2048 * 20), seq=1)).body.points) == 2048
    room = 2**20 - 16 - len(b'{"kind":"a","params":{"x":""}}')
    payload = b'{"kind":"a","params":{"x":"' + b"x" * room + b'"}}'
    assert len(decode(frame(7, payload, seq=1)).body.params["x"]) == room


def test_samples_keep_what_their_bits_can():
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(2000, 3))
    normals[:26] = [
        [i, j, k] for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1) if i or j or k
    ]
    points, pressures = rng.uniform(-50, 50, (2000, 3)), rng.random(2000)
    back = Samples.unpacked(Samples(points, normals, pressures).packed())
    assert_allclose(back.points, points, atol=50 * 2.0**-24)
    assert_allclose(back.pressures, pressures, atol=0.5 / 65535)
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    angle = np.degrees(2 * np.arcsin(np.linalg.norm(back.normals - unit, axis=1) / 2))
    # Half a step along both axes moves a point of the octahedron by sqrt(6) halves of a step; its
    # faces are 1 / sqrt(3) from the middle
    assert angle.max() < np.degrees(np.sqrt(3) * np.sqrt(6) / 2 / 32767)
    any_codes = rng.integers(-32768, 32768, (1000, 2))
    assert_allclose(np.linalg.norm(octahedral_normals(any_codes), axis=1), 1, atol=1e-12)
    assert_array_equal(octahedral_codes(np.zeros((1, 3))), [[0, 0]])


def test_no_bytes_raise_anything_but_our_error():
    rng = np.random.default_rng(1)
    n_read = 0
    for data in fuzzed(rng, FUZZED):
        try:
            decode(data)
            n_read += 1
        except ServerError:
            pass
    assert FUZZED / 20 < n_read < FUZZED  # some mutations leave a message a message


def fuzzed(rng, n):
    """Random frames, frames of random payloads, and good frames with a few bytes altered."""
    good = good_frames()
    for number in range(n):
        if number % 4 == 0:
            yield rng.bytes(int(rng.integers(0, 200)))
        elif number % 4 == 1:
            payload = rng.bytes(int(rng.integers(0, 100)))
            yield frame(int(rng.integers(0, 12)), payload, seq=int(rng.integers(0, 3)))
        else:
            one = good[int(rng.integers(len(good)))]
            head, payload = one[:16], bytearray(one[16:])
            for _ in range(int(rng.integers(0, 4))):
                if payload:
                    payload[int(rng.integers(len(payload)))] = int(rng.integers(256))
            if number % 8 == 3:  # the header is altered, too
                damaged = bytearray(head)
                damaged[int(rng.integers(16))] ^= 1 << int(rng.integers(8))
                yield bytes(damaged) + bytes(payload)
            else:
                yield frame(head[0], bytes(payload), seq=int(rng.integers(1, 9)))
