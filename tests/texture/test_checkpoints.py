"""meshsdf.texture.checkpoints: kept while painting goes on, in pieces, and broken off anywhere."""

import contextlib
import sqlite3
import threading
import time

import numpy as np
import pytest

from meshsdf.texture import checkpoint_write, checkpoints, housekeeping
from meshsdf.texture.brush import Brush
from meshsdf.texture.change import recording
from meshsdf.texture.content import Content, digest
from meshsdf.texture.journal import Project
from meshsdf.texture.live import LiveStrokes
from meshsdf.texture.operations import Operation, perform
from meshsdf.texture.volume_texture import VolumeTexture
from tests.texture.live_twin import (
    ANNE,
    BERT,
    BRUSHES,
    ball,
    copied,
    fresh,
    operations_of,
    replayed,
    samples_of,
    walk,
)
from tests.texture.random_operations import RESOLUTION, random_operation, small_mesh

FULL = """
CREATE TEMP TRIGGER full_disk BEFORE INSERT ON checkpoint
BEGIN SELECT RAISE(ABORT, 'the disk is full'); END
"""


def done(texture, operation):
    """Do an operation as a project does it."""
    with recording(texture):
        perform(texture, operation)


def test_what_is_frozen_stays_whatever_is_done_later():
    texture = VolumeTexture.around(small_mesh(), resolution=RESOLUTION)
    content, n_changed = Content(texture), 0
    for number in range(60):
        layers = [layer.number for layer in texture.layers]
        done(texture, random_operation(3, number, layers, 0, 0))
        if number % 6:
            continue
        wanted, frozen = digest(texture), content.freeze()
        for later in range(5):
            layers = [layer.number for layer in texture.layers]
            done(texture, random_operation(4, 5 * number + later, layers, 0, 0))
        n_changed += sum(1 for _ in frozen.chunks())
        assert frozen.digest(frozen.codes()) == wanted != digest(texture)
        content.know_frozen(frozen)
        frozen.release()
    assert n_changed > 40


def test_what_is_frozen_needs_no_memory_once_it_is_let_go():
    texture = VolumeTexture.around(small_mesh(), resolution=RESOLUTION)
    done(texture, Operation("add-layer", {"color": [0.2, 0.3, 0.4, 1.0]}))
    done(texture, ball())
    holders, n_used = texture.pool.holders.copy(), texture.pool.n_used
    frozen = Content(texture).freeze()
    assert (texture.pool.holders > holders).any()
    frozen.release()
    np.testing.assert_array_equal(texture.pool.holders, holders)
    assert texture.pool.n_used == n_used


def test_a_checkpoint_that_is_broken_off_is_no_part_of_the_next(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoint_write, "BYTES_AT_ONCE", 1)
    path = tmp_path / "a.mtex"
    with Project.create(path, small_mesh(), resolution=RESOLUTION) as project:
        project.apply(Operation("add-layer", {"color": [0.2, 0.3, 0.4, 1.0]}))
        project.apply(ball())
        project.checkpoint()
        before = project.digest()
        project.apply(ball(0, 2.0, (0.9, 0.1, 0.1, 1.0)))
        connection = project._connection
        connection.execute(FULL)
        with pytest.raises(sqlite3.Error, match="full"):
            project.checkpoint()
        (n_left,) = connection.execute("SELECT COUNT(*) FROM brick WHERE seq = 3").fetchone()
        assert n_left
        connection.execute("DROP TRIGGER full_disk")
        for end in ("opened", "gone on"):
            copy = copied(path, tmp_path / end)
            with Project.open(copy) as again:
                assert again.last_seq == 3
                assert again.digest() == project.digest()
        project.undo()
        assert project.digest() == before
    with contextlib.closing(sqlite3.connect(path)) as connection:
        assert connection.execute("SELECT 1 FROM brick WHERE seq = 3").fetchall() == []
        assert connection.execute("SELECT MAX(seq) FROM checkpoint").fetchone() == (4,)
    words = []
    with Project.open(path, warn=words.append) as project:
        assert project.digest() == before
    assert not words


@pytest.mark.parametrize("seed", [0, 1])
def test_samples_are_kept_on_one_thread_while_another_paints_and_keeps_house(
    tmp_path, monkeypatch, seed
):
    monkeypatch.setattr(checkpoints, "OPERATIONS_PER_CHECKPOINT", 3)
    monkeypatch.setattr(checkpoint_write, "BYTES_AT_ONCE", 1)
    monkeypatch.setattr(housekeeping, "COPY_SECONDS", 0.0)
    live, rng = fresh(tmp_path), np.random.default_rng(seed)
    live.project.keep_house_apart()
    sent = [walk(rng, int(rng.integers(1, 4))) for _ in range(60)]
    live.begin(ANNE, 1, 0, BRUSHES["dabs"])

    def send():
        for cseq, samples in enumerate(sent, 2):
            live.keep(ANNE, cseq, np.column_stack(samples))

    thread = threading.Thread(target=send)
    thread.start()
    cseq = 0
    while thread.is_alive() or cseq < 30:
        live.begin(BERT, cseq + 1, int(rng.integers(2)), BRUSHES["band"])
        live.add(BERT, cseq + 2, *walk(rng, 2))
        live.end(BERT, cseq + 3)
        live.paint()
        name = Operation("layer", {"layer": 0, "name": f"name {cseq}"})
        live.apply(Operation("undo") if rng.random() < 0.4 else name)
        cseq += 3
    thread.join()
    live.end(ANNE, 100)
    wanted = live.project.digest()
    live.close()
    path = tmp_path / "a.mtex"
    of_anne = [one for client, _, one in operations_of(path) if client == ANNE]
    expected = np.concatenate([np.column_stack(samples) for samples in sent])
    np.testing.assert_array_equal(samples_of(of_anne[0]), expected)
    assert replayed(path) == wanted
    with contextlib.closing(sqlite3.connect(path)) as connection:
        assert len(connection.execute("SELECT * FROM checkpoint").fetchall()) == 2
    words = []
    with Project.open(path, warn=words.append) as project:
        assert project.digest() == wanted
    assert not words


def test_a_stroke_that_goes_on_is_in_no_checkpoint_and_stays_on_its_layer(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoints, "OPERATIONS_PER_CHECKPOINT", 1)
    live, rng = fresh(tmp_path), np.random.default_rng(5)
    live.begin(ANNE, 1, 0, Brush(0.4, color=(1.0, 1.0, 0.0, 1.0)))
    live.add(ANNE, 2, *walk(rng, 5))
    stroke = live._strokes[ANNE]
    painted = stroke._stroke
    for n in range(4):
        live.apply(ball(1, 0.3 * n))
    assert stroke._stroke is painted
    shown = live.project.digest()
    copy = copied(live.project.path, tmp_path / "copy")
    with contextlib.closing(sqlite3.connect(copy)) as connection:
        assert connection.execute("SELECT MAX(seq) FROM checkpoint").fetchone() == (8,)
    again = LiveStrokes.open(copy)
    assert again.project.digest() == shown
    again.cancel(ANNE)
    live.cancel(ANNE)
    assert again.project.digest() == live.project.digest() != shown
    again.close()
    live.close()


def test_the_log_stays_short_though_no_commit_copies_it(tmp_path, monkeypatch):
    monkeypatch.setattr(housekeeping, "COPY_SECONDS", 0.0)
    sizes = {}
    for apart in (True, False):
        path = tmp_path / f"{apart}.mtex"
        with Project.create(path, small_mesh(), resolution=RESOLUTION) as project:
            project.apply(Operation("add-layer"))
            if apart:
                project.keep_house_apart()
            else:
                project._connection.copy_log_on_commit(False)
            for n in range(100):
                project.apply(ball(0, 0.01 * n))
            sizes[apart] = path.with_name(f"{path.name}-wal").stat().st_size
    assert sizes[True] < 0.5 * sizes[False]


def test_what_is_written_beside_painting_rests_until_somebody_waits_for_it(tmp_path, monkeypatch):
    monkeypatch.setattr(housekeeping, "REST", 1e9)
    monkeypatch.setattr(housekeeping, "LONGEST_REST", 600.0)
    live = fresh(tmp_path)
    house = housekeeping.Housekeeping(live.project.path, live.project.pending.turn)
    left = []

    def write(connection):
        connection.execute("UPDATE op SET t = t + 1")
        house.rest()
        left.append(connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone())

    written = house.do(write)
    time.sleep(0.5)
    assert not written.done()
    with house.hurry():
        written.result(30)
    _, n_frames, n_copied = left[0]
    assert n_frames == n_copied
    house.close()
    live.close()
