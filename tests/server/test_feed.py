"""meshsdf.server.feed: slow pages miss versions, never the end, and cost no memory."""

import struct

import numpy as np
from numpy.testing import assert_array_equal

from meshsdf.kernels.wire_codes import PICTURES
from meshsdf.mesh import icosphere
from meshsdf.server import feed as feed_module
from meshsdf.server.feed import MOST_BYTES, MOST_RECORDS, MOST_UNDER_WAY, Feed
from meshsdf.server.messages import COMPLETE, decode
from meshsdf.server.wire_bricks import WireBricks
from meshsdf.server.wire_records import brick_records
from meshsdf.texture import Brush, VolumeTexture, paint

from .wire_examples import painted, surface_points, with_relief


def example(resolution=48, n_strokes=8):
    """A texture with many bricks, and what pages see of it."""
    mesh = icosphere(subdivisions=4)
    rng = np.random.default_rng(3)
    texture = painted(mesh, rng, n_layers=1, n_strokes=n_strokes, resolution=resolution)
    return texture, WireBricks(texture), mesh, rng


def all_of(wire, picture="base"):
    """The payload of all bricks of a picture."""
    return wire.range_payload(0, wire.texture.octree.n_entries, picture)


def n_bricks(wire):
    """How many bricks of colours there are."""
    return len(wire.pictures["base"].present)


def dab(texture, mesh, rng, radius=0.05, channel="base"):
    """Paint somewhere."""
    points, normals = surface_points(mesh, 1, rng)
    color, value = tuple(rng.random(3).tolist()), float(rng.uniform(1, 4))
    brush = Brush(radius, color=(*color, 1.0), channel=channel, value=value)
    paint(texture, texture.layers[0], brush, points, normals)
    return points[0]


class Page:
    """What a page would hold: the bricks of all frames that it was sent."""

    def __init__(self, wire, **known):
        self.frames, self.pictures = [], {picture: ({}, {}) for picture in PICTURES}
        self.bricks, self.versions = self.pictures["base"]
        self.feed = Feed(wire, self.frames.append, **known)

    def take(self, *, answer=True):
        """Read the oldest frame and answer it; its message and entries."""
        frame = self.frames.pop(0)
        assert len(frame) <= MOST_BYTES
        message = decode(frame, downward=True)
        records = list(brick_records(message.body))
        assert len(records) == struct.unpack_from("<I", message.body)[0]
        bricks, versions = self.pictures[PICTURES[message.flags >> 1]]
        for entry, version, brick in records:
            assert version > versions.get(entry, 0)
            bricks[entry], versions[entry] = brick, version
        if answer:
            self.feed.shown(message.seq)
        return message, [entry for entry, _, _ in records]

    def take_all(self):
        """Read and answer until nothing comes any more; the last message."""
        message = None
        self.feed.refill()
        while self.frames:
            message, _ = self.take()
            self.feed.refill()
        return message

    def shows(self, wire):
        """Whether this is what a new page would get."""
        return all(
            {e: b for e, b in bricks.items() if b[0]}
            == {entry: brick for entry, _, brick in brick_records(all_of(wire, picture))}
            for picture, (bricks, _) in self.pictures.items()
        )


def test_a_new_page_gets_everything_coarse_levels_first():
    texture, wire, _, _ = example(resolution=96, n_strokes=25)  # more than two messages hold
    page = Page(wire)
    page.feed.refill()
    levels = []
    assert len(page.frames) == 2
    while page.frames:
        message, entries = page.take()
        levels += texture.octree.tables.levels[entries].tolist()
        assert bool(message.flags & COMPLETE) == (len(page.bricks) == n_bricks(wire))
        page.feed.refill()
    assert len(levels) == n_bricks(wire)
    assert levels == sorted(levels, reverse=True)
    assert page.shows(wire)


def test_a_page_that_never_answers_is_sent_two_messages_and_costs_nothing():
    texture, wire, mesh, rng = example()
    page = Page(wire)
    for _ in range(40):
        dab(texture, mesh, rng)
        wire.update()
        page.feed.refill()
    assert len(page.frames) == 2
    feed = page.feed
    arrays = [one for told in feed._told for one in vars(told).values() if hasattr(one, "nbytes")]
    held = sum(array.nbytes for array in arrays)
    assert held <= 3 * 4 * texture.octree.n_entries + 4 * MOST_RECORDS
    assert not [one for one in vars(feed).values() if isinstance(one, list | dict)]
    message = page.take_all()
    assert message.flags & COMPLETE
    assert page.shows(wire)


def test_a_slow_page_skips_versions_and_always_gets_the_last():
    texture, wire, mesh, rng = example()
    page = Page(wire)
    page.take_all()
    n_changed = n_told = 0
    for number in range(60):
        dab(texture, mesh, rng, radius=0.3)
        n_changed += len(wire.update()["base"])
        page.feed.refill()
        if number % 12 == 11:
            n_told += len(page.take()[1])
    assert n_told < n_changed / 2
    page.take_all()
    assert page.shows(wire)


def test_what_changed_comes_nearest_to_the_cursor_first():
    texture, wire, mesh, rng = example()
    page = Page(wire)
    page.take_all()
    for _ in range(20):
        dab(texture, mesh, rng, radius=0.1)
    wire.update()
    cursor = np.array([0.0, 1.0, 0.0])
    page.feed.look(np.array([9.0, 0.0, 0.0]), cursor)
    page.feed.refill()
    _, entries = page.take()
    tables = texture.octree.tables
    size = 8 * texture.octree.texel * 2.0 ** tables.levels[entries][:, None]
    low = tables.bricks[entries] * size
    nearest = np.clip(cursor, low, low + size)
    away = np.linalg.norm(nearest - cursor, axis=1)
    assert (np.diff(away) >= -1e-12).all()
    assert away[0] < away[-1]


def test_a_page_that_comes_back_gets_what_is_newer():
    texture, wire, mesh, rng = example()
    page = Page(wire)
    page.take_all()
    since = max(page.versions.values())
    dab(texture, mesh, rng)
    changed = wire.update()["base"]
    back = Page(wire, run_is_known=True, since=since)
    back.take_all()
    assert_array_equal(sorted(back.bricks), changed)
    page.bricks.update(back.bricks)
    assert page.shows(wire)
    unknown = Page(wire, since=since)
    unknown.take_all()
    assert unknown.shows(wire)


def test_a_page_is_told_that_it_has_everything_even_if_there_is_nothing():
    texture = VolumeTexture.around(icosphere(subdivisions=1), resolution=16)
    wire = WireBricks(texture)
    page = Page(wire, run_is_known=True, since=wire.revision)
    message = page.take_all()
    assert message.flags == COMPLETE
    page.feed.refill()
    assert not page.frames


def test_every_message_is_of_one_picture_and_colours_come_before_relief():
    texture, _, mesh, rng = example(resolution=96, n_strokes=25)
    with_relief(texture, mesh, rng)
    wire = WireBricks(texture)
    page = Page(wire)
    page.feed.refill()
    order, n_sent = [], 0
    n_all = sum(len(picture.present) for picture in wire.pictures.values())
    while page.frames:
        assert len(page.frames) <= MOST_UNDER_WAY
        message, entries = page.take()
        order.append(message.flags >> 1)
        n_sent += len(entries)
        assert bool(message.flags & COMPLETE) == (n_sent == n_all)
        page.feed.refill()
    assert order == sorted(order)
    assert set(order) == {0, 1, 2}
    assert page.shows(wire)


def test_what_changed_in_any_picture_comes_before_what_a_page_never_had(monkeypatch):
    monkeypatch.setattr(feed_module, "MOST_BYTES", MOST_BYTES // 8)
    texture, wire, mesh, rng = example(resolution=96, n_strokes=25)
    page = Page(wire)
    page.feed.refill()
    page.take(answer=False)
    dab(texture, mesh, rng, channel="height")
    told = wire.update()
    assert len(told["height"])
    while page.frames:
        page.take()
    page.feed.shown(1)
    page.feed.refill()
    flags = []
    while page.frames:
        message, entries = page.take()
        flags.append(message.flags)
        if message.flags >> 1 == 2:
            assert set(told["height"].tolist()) <= set(entries)
        page.feed.refill()
    # Colours that came to be stored, then heights, then the other colours
    assert [one >> 1 for one in flags[:2]] == [0, 2]
    assert {one >> 1 for one in flags[2:]} == {0}
    assert flags[-1] == COMPLETE
    assert page.shows(wire)


def test_a_page_that_comes_back_gets_what_is_newer_in_every_picture():
    texture, wire, mesh, rng = example()
    dab(texture, mesh, rng, channel="height")
    wire.update()
    page = Page(wire)
    page.take_all()
    since = max(max(versions.values()) for _, versions in page.pictures.values() if versions)
    dab(texture, mesh, rng, channel="height")
    dab(texture, mesh, rng, channel="normal")
    changed = wire.update()
    back = Page(wire, run_is_known=True, since=since)
    assert back.take_all().flags & COMPLETE
    for picture, (bricks, _) in back.pictures.items():
        assert_array_equal(sorted(bricks), changed[picture])
        page.pictures[picture][0].update(bricks)
    assert page.shows(wire)
