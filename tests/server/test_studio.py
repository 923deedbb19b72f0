"""meshsdf.server.studio: one thread does what is asked in order, and tells pages once."""

import asyncio
import threading

import numpy as np
import pytest

from meshsdf.errors import TextureError
from meshsdf.mesh import icosphere
from meshsdf.server import studio as studio_module
from meshsdf.server.feed import Feed
from meshsdf.server.studio import Studio
from meshsdf.texture import Brush, Operation, Project, housekeeping
from meshsdf.texture.live import LiveStrokes

UP = np.array([[0.0, 0.0, 1.0]])
SAMPLE = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0]])  # point, normal, pressure


class Page:
    """A page without a socket: keeps what it was told."""

    def __init__(self, studio):
        self.states, self.frames, self.replaced = [], [], 0
        self.refill = Feed(studio.bricks, self.frames.append).refill

    def told_state(self, state):
        self.states.append(state)

    def replace(self):
        self.replaced += 1


def studio_of(folder, **options):
    """A studio of a new project with one layer."""
    project = Project.create(folder / "a.mtex", icosphere(subdivisions=2), resolution=32)
    project.apply(Operation("add-layer", {"name": "one"}))
    return Studio(LiveStrokes(project), **options)


def test_what_is_asked_is_done_in_order_on_one_other_thread(tmp_path):
    async def main():
        studio = studio_of(tmp_path)
        done, threads = [], set()

        def note(number):
            done.append(number)
            threads.add(threading.get_ident())
            return 2 * number

        asked = [await studio.ask(note, number) for number in range(100)]
        assert await asyncio.gather(*asked) == [2 * number for number in range(100)]
        assert done == list(range(100))
        assert len(threads) == 1
        assert threading.get_ident() not in threads
        await studio.do(studio.live.apply, Operation("undo"))
        with pytest.raises(TextureError, match="nothing to undo"):
            await studio.do(studio.live.apply, Operation("undo"))
        await studio.close()

    asyncio.run(main())


def test_samples_are_taken_in_while_the_studio_is_busy_and_are_painted_by_whatever_comes_next(
    tmp_path,
):
    async def main():
        studio = studio_of(tmp_path)
        live, gate = studio.live, threading.Event()
        await studio.do(live.begin, "a", 1, 0, Brush(0.2))
        before = await studio.do(studio.project.digest)
        busy = await studio.ask(gate.wait)
        for number in range(20):
            await (await studio.ask_intake(live.keep, "a", 2 + number, SAMPLE))
        found = live.last_cseq("a"), live.n_waiting >= 19, busy.done()
        gate.set()
        assert found == (21, True, False)
        assert await studio.do(studio.project.digest) != before
        assert live.n_waiting == 0
        refused = await studio.ask_intake(live.keep, "b", 1, SAMPLE)
        with pytest.raises(TextureError, match="no stroke open"):
            await refused
        await studio.close()

    asyncio.run(main())


def test_the_log_does_not_grow_with_a_stroke_that_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(housekeeping, "COPY_SECONDS", 0.0)

    async def main():
        studio = studio_of(tmp_path)
        await studio.do(studio.live.begin, "a", 1, 0, Brush(0.2))
        for number in range(300):
            await (await studio.ask_intake(studio.live.keep, "a", 2 + number, SAMPLE))
        size = (tmp_path / "a.mtex-wal").stat().st_size
        await studio.close()
        return size

    page = 4096
    assert asyncio.run(main()) < 150 * page  # of 300 at least that were written


def test_samples_wait_when_too_many_are_not_painted_yet(tmp_path, monkeypatch):
    monkeypatch.setattr(studio_module, "MOST_UNPAINTED", 8)

    async def main():
        studio = studio_of(tmp_path)
        live, gate = studio.live, threading.Event()
        await studio.do(live.begin, "a", 1, 0, Brush(0.2))
        busy = await studio.ask(gate.wait)

        async def send():
            for number in range(30):
                await (await studio.ask_intake(live.keep, "a", 2 + number, SAMPLE))

        sending = asyncio.create_task(send())
        await asyncio.wait([sending], timeout=0.5)
        n_kept = live.last_cseq("a") - 1
        gate.set()
        await sending
        assert 9 <= n_kept <= 10  # one may have been painted before the studio was busy
        assert live.last_cseq("a") == 31
        await busy
        await studio.close()

    asyncio.run(main())


def test_what_is_asked_beyond_the_room_waits(tmp_path):
    async def main():
        studio = studio_of(tmp_path)
        gate = threading.Event()
        first = await studio.ask(gate.wait)
        many = [asyncio.create_task(studio.ask(len, [number])) for number in range(1000)]
        await asyncio.sleep(0.05)
        assert studio.is_busy
        assert sum(task.done() for task in many) == 255
        gate.set()
        await first
        assert [await (await task) for task in many] == 1000 * [1]
        await studio.close()

    asyncio.run(main())


def test_pages_are_told_once_for_many_changes_and_of_the_last_state(tmp_path, monkeypatch):
    monkeypatch.setattr(studio_module, "TICK", 60.0)  # however slow this machine is

    async def main():
        studio = studio_of(tmp_path)
        page = Page(studio)
        studio.subscribe(page)
        for _ in range(2):  # after the first it is sure that the page comes next to be told
            await studio.do(len, [])
        page.states.clear()
        gate = threading.Event()
        asked = [await studio.ask(gate.wait)]
        for number in range(20):
            name = Operation("layer", {"layer": 0, "name": f"name {number}"})
            asked.append(await studio.ask(studio.live.apply, name))
        gate.set()
        await asyncio.gather(*asked)
        await studio.do(len, [])
        assert len(page.states) == 1
        assert page.states[-1]["layers"][0]["name"] == "name 19"
        assert page.states[-1]["seq"] == page.states[-1]["saved"] == 21
        await studio.close()

    asyncio.run(main())


def test_the_stroke_of_a_page_that_stays_away_ends_and_that_of_one_that_is_back_does_not(tmp_path):
    async def main():
        studio = studio_of(tmp_path, patience=0.2)
        page = Page(studio)
        for client in ("here", "away"):
            studio.arrive(client, page)
            await studio.do(studio.live.begin, client, 1, 0, Brush(0.2))
            await studio.do(studio.live.add, client, 2, UP, UP)
            studio.depart(client, page)
        again = Page(studio)
        studio.arrive("here", again)
        studio.depart("here", page)  # the old connection's end comes late
        await asyncio.sleep(0.5)
        assert await studio.do(studio.live.open_clients) == ["here"]
        await studio.close()

    asyncio.run(main())
    with Project.open(tmp_path / "a.mtex") as project:
        assert project.history.names == ["add-layer", "stroke", "stroke"]


def test_a_second_page_of_a_client_takes_the_place_of_the_first(tmp_path):
    async def main():
        studio = studio_of(tmp_path)
        first, second = Page(studio), Page(studio)
        studio.arrive("one", first)
        studio.arrive("one", second)
        assert (first.replaced, second.replaced) == (1, 0)
        await studio.close()

    asyncio.run(main())


def test_steps_say_whose_they_are(tmp_path):
    async def main():
        studio = studio_of(tmp_path)
        for client in ("a", "b"):
            await studio.do(studio.live.begin, client, 1, 0, Brush(0.2))
            await studio.do(studio.live.add, client, 2, UP, UP)
            await studio.do(studio.live.end, client, 3)
        await studio.do(studio.live.apply, Operation("undo"), client="b", cseq=4)
        history = studio.state["history"]
        assert [(step["name"], step["client"]) for step in history["done"]] == [
            ("add-layer", ""),
            ("stroke", "a"),
        ]
        assert history["undone"] == [{"name": "stroke", "client": "b", "seq": 3}]
        await studio.close()

    asyncio.run(main())
