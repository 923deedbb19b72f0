"""meshsdf.server.limits and apart: how much, how fast, how many at once."""

import asyncio
import threading
import time

import pytest

from meshsdf.mesh.primitives import icosphere
from meshsdf.server.apart import Turnstile, apart
from meshsdf.server.limits import RateLimit, Refused, check_brush, whole_body
from meshsdf.texture.brush import Brush
from meshsdf.texture.volume_texture import VolumeTexture


async def pieces(*parts: bytes, pause: float = 0.0):
    for part in parts:
        await asyncio.sleep(pause)
        yield part


def read(*parts: bytes, most: int = 10, told: str | None = None, **options) -> bytes:
    pause = options.pop("pause", 0.0)
    return asyncio.run(whole_body(pieces(*parts, pause=pause), most, told, **options))


def test_a_body_is_read_up_to_its_limit_and_not_beyond():
    assert read(b"12345", b"", b"67890") == b"1234567890"
    assert read(b"12345", told="5") == b"12345"
    with pytest.raises(Refused, match="longer than 10 bytes") as refused:
        read(b"12345", b"678901")
    assert refused.value.status == 413


@pytest.mark.parametrize("told", ["11", "-1", "1e1", "", "²", "9" * 400])
def test_a_length_that_is_too_much_or_none_is_refused_before_reading(told):
    with pytest.raises(Refused) as refused:
        read(told=told)
    assert refused.value.status == 413


def test_a_body_that_trickles_is_given_up_in_time():
    began = time.monotonic()
    with pytest.raises(Refused, match=r"did not arrive within 0\.05 seconds") as refused:
        read(*[b"1"] * 9, pause=0.02, seconds=0.05)
    assert refused.value.status == 408
    assert time.monotonic() - began < 2


def test_so_many_at_once_and_so_many_a_second():
    limit = RateLimit(20, 3, "tries")
    for _ in range(3):
        limit.take()
    with pytest.raises(Refused, match="too many tries: more than 20 a second") as refused:
        limit.take()
    assert refused.value.status == 429
    time.sleep(0.11)  # two more have become due
    limit.take()
    limit.take()
    with pytest.raises(Refused):
        limit.take()


def test_a_turnstile_counts_who_is_inside_however_they_leave():
    door = Turnstile(2, "guests")
    with door.passed():
        with pytest.raises(KeyError), door.passed():
            _ = {}["they leave in anger"]
        assert door.inside == 1
        with (
            door.passed(),
            pytest.raises(Refused, match="there are 2 guests already"),
            door.passed(),
        ):
            pass
    assert door.inside == 0


def test_work_apart_returns_or_raises_and_the_loop_goes_on_meanwhile():
    async def main() -> None:
        free = threading.Event()
        waiting = asyncio.create_task(apart(free.wait, 10))
        await asyncio.sleep(0.02)
        assert not waiting.done()
        free.set()
        assert await waiting
        with pytest.raises(ZeroDivisionError):
            await apart(lambda: 1 // 0)

    asyncio.run(main())


def test_nobody_waits_in_the_end_for_work_that_goes_on():
    free = threading.Event()

    async def main() -> None:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(apart(free.wait, 30), 0.05)

    began = time.monotonic()
    asyncio.run(main())
    assert time.monotonic() - began < 5
    free.set()


def test_a_brush_may_cover_the_mesh_and_not_the_world():
    texture = VolumeTexture.around(icosphere(2.0, subdivisions=1), resolution=8)
    check_brush(Brush(32.0), texture)
    with pytest.raises(Refused, match=r"a brush of radius 1e\+30 on a mesh of 4"):
        check_brush(Brush(1e30), texture)
