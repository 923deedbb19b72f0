"""meshsdf.texture.live: strokes that come in batches, none of which is ever lost."""

import sqlite3

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshsdf.errors import TextureError
from meshsdf.texture import checkpoints, stroke_path
from meshsdf.texture.brush import Brush
from meshsdf.texture.content import digest as digest_of
from meshsdf.texture.journal import Project
from meshsdf.texture.live import LiveStrokes
from meshsdf.texture.operations import Operation
from meshsdf.texture.stroke_record import StrokeRecord
from tests.texture.live_twin import (
    ANNE,
    BERT,
    BRUSHES,
    CARL,
    CLIENTS,
    RED,
    ball,
    crashed,
    fresh,
    operations_of,
    paint,
    pending_of,
    replayed,
    samples_of,
    walk,
)


def split(rng, arrays):
    """Arrays of samples in batches, some of them empty."""
    cuts = np.sort(rng.integers(0, len(arrays[0]) + 1, rng.integers(1, 6)))
    return list(zip(*(np.split(array, cuts) for array in arrays), strict=True))


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """Two projects that are alike: one is painted live, and one by whole operations."""
    folder = tmp_path_factory.mktemp("pair")
    live, whole = fresh(folder, "live.mtex"), fresh(folder, "whole.mtex")
    yield live, whole.project
    live.close()
    whole.close()


@pytest.mark.parametrize("kind", BRUSHES)
@settings(max_examples=6)
@given(seed=st.integers(0, 10**6))
def test_a_stroke_in_any_batches_leaves_the_bytes_of_the_whole_stroke(pair, kind, seed):
    live, whole = pair
    rng = np.random.default_rng(seed)
    samples = walk(rng, int(rng.integers(2, 12)))
    layer, first = int(rng.integers(2)), live.last_cseq(ANNE) + 1
    batches = split(rng, samples)
    seq = paint(live, ANNE, first, layer, BRUSHES[kind], batches)
    record = StrokeRecord(BRUSHES[kind], *samples, layer)
    assert whole.apply(Operation("stroke", record.to_params())) == seq
    assert live.project.digest() == whole.digest()
    live.apply(Operation("undo"))
    whole.undo()
    assert live.project.digest() == whole.digest()


def test_batches_that_bring_no_dab_still_move_the_stroke_on(tmp_path):
    # Dabs that add up lie 0.15 radii apart; these samples go round a corner in smaller steps
    along = np.linspace(0, 0.04, 9)[:, None] * [1.0, 0.0, 0.0]
    across = along[-1] + np.linspace(0, 0.5, 9)[1:, None] * [0.0, 1.0, 0.0]
    points = np.concatenate([along, across])
    points[:, 2] += 1
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    brush = Brush(0.3, color=RED, build_up=True, flow=0.3)
    live = fresh(tmp_path)
    paint(live, ANNE, 1, 0, brush, [(p[None], p[None], np.ones(1)) for p in points])
    digest = live.project.digest()
    live.close()
    assert replayed(tmp_path / "a.mtex") == digest


def test_more_dabs_than_one_batch_may_bring_can_be_done_again(tmp_path, monkeypatch):
    monkeypatch.setattr(stroke_path, "MOST_DABS", 40)
    turn = np.linspace(0, 2, 40)
    points = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    brush = Brush(0.1, color=RED, build_up=True)  # a dab every 0.015
    live = fresh(tmp_path)
    paint(live, ANNE, 1, 0, brush, [(p[None], p[None], np.ones(1)) for p in points])
    live.begin(ANNE, 100, 0, brush)
    with pytest.raises(TextureError, match="more than 40 dabs"):
        live.add(ANNE, 101, points, points)
    live.cancel(ANNE, 102)
    digest = live.project.digest()
    live.close()
    assert replayed(tmp_path / "a.mtex") == digest


def test_what_comes_twice_is_done_once(tmp_path):
    live = fresh(tmp_path)
    rng = np.random.default_rng(0)
    one, two = walk(rng, 4), walk(rng, 4)
    assert live.last_cseq(ANNE) == 0
    live.begin(ANNE, 1, 0, BRUSHES["dabs"])
    live.begin(ANNE, 1, 1, BRUSHES["blur"])
    live.add(ANNE, 2, *one)
    live.add(ANNE, 2, *two)
    live.add(ANNE, 1, *two)
    live.add(ANNE, 3, *two)
    assert live.last_cseq(ANNE) == 3
    seq = live.end(ANNE, 4)
    digest = live.project.digest()
    assert live.end(ANNE, 4) == seq
    assert live.end(ANNE, 3) == 0
    assert live.apply(ball(), client=ANNE, cseq=4) == seq
    assert live.apply(ball(), client=ANNE, cseq=2) == 0
    assert live.project.digest() == digest
    assert live.apply(ball(), client=ANNE, cseq=5) == seq + 1
    assert live.last_cseq(ANNE) == 5
    assert live.last_cseq(BERT) == 0
    live.close()
    client, cseq, operation = operations_of(tmp_path / "a.mtex")[-2]
    assert (client, cseq) == (ANNE, 4)
    expected = np.concatenate([np.column_stack(one), np.column_stack(two)])
    np.testing.assert_array_equal(samples_of(operation), expected)
    live = LiveStrokes.open(tmp_path / "a.mtex")
    assert live.last_cseq(ANNE) == 5
    assert live.end(ANNE, 4) == seq
    live.close()


def test_strokes_of_a_dead_owner_are_open_again_and_go_on(tmp_path):
    live = fresh(tmp_path)
    rng = np.random.default_rng(1)
    batches = [walk(rng, 3) for _ in range(4)]
    live.begin(BERT, 1, 1, BRUSHES["band"])
    live.begin(ANNE, 7, 0, BRUSHES["dabs"])
    live.add(ANNE, 8, *batches[0])
    live.add(BERT, 3, *batches[1])
    live.add(ANNE, 9, *batches[2])
    live.begin(CARL, 1, 0, BRUSHES["erase"])  # waits for ANNE
    live.add(CARL, 2, *batches[3])
    shown = live.project.digest()
    path = crashed(live, tmp_path / "copy")
    words = []
    again = LiveStrokes.open(path, warn=words.append)
    assert not words
    assert again.open_clients() == [BERT, ANNE, CARL]
    assert [again.last_cseq(client) for client in (ANNE, BERT, CARL)] == [9, 3, 2]
    assert again.project.digest() == shown
    for one in (live, again):
        one.add(ANNE, 10, *batches[1])
        one.end(CARL, 3)
        one.end(ANNE, 11)
        one.end(BERT, 4)
        assert not one.is_painting
    digest = live.project.digest()
    assert again.project.digest() == digest
    live.close()
    again.close()
    assert not pending_of(path)
    assert replayed(path) == digest


def test_others_who_open_the_project_find_strokes_as_operations(tmp_path):
    live = fresh(tmp_path)
    rng = np.random.default_rng(2)
    samples = {client: walk(rng, 5) for client in CLIENTS}
    for client, layer in zip(CLIENTS, (0, 1, 0), strict=True):
        live.begin(client, 1, layer, BRUSHES["dabs"])
        live.add(client, 2, *samples[client])
    path = crashed(live, tmp_path / "copy")
    live.finish_all()
    words = []
    with Project.open(path, warn=words.append) as project:
        assert not words
        assert project.digest() == live.project.digest()
        assert project.history.names[-3:] == ["stroke"] * 3
    found = {(c, n): samples_of(operation) for c, n, operation in operations_of(path)[-3:]}
    for client in CLIENTS:
        np.testing.assert_array_equal(found[client, 2], np.column_stack(samples[client]))
    live.close()


def test_a_cancelled_stroke_was_never_there_but_its_numbers_stay_known(tmp_path):
    live = fresh(tmp_path)
    pool = live.project.texture.pool
    before, slots = live.project.digest(), [x.slots.copy() for x in live.project.texture.layers]
    holders, used = pool.holders.copy(), pool.n_used
    cseq = 0
    for kind, brush in BRUSHES.items():
        live.begin(ANNE, cseq + 1, 0, brush)
        live.add(ANNE, cseq + 2, *walk(np.random.default_rng(3), 6))
        cseq += 3
        assert live.project.digest() != before or kind in ("fill", "gradient")
        live.cancel(ANNE, cseq)
        assert live.project.digest() == before
    for layer, slot in zip(live.project.texture.layers, slots, strict=True):
        np.testing.assert_array_equal(layer.slots, slot)
    assert pool.n_used == used
    np.testing.assert_array_equal(pool.holders[: len(holders)], holders)
    live.cancel(BERT)  # has none
    assert live.last_cseq(ANNE) == cseq
    path = crashed(live, tmp_path / "copy")
    again = LiveStrokes.open(path)
    assert again.last_cseq(ANNE) == cseq
    assert not again.open_clients()
    assert again.project.digest() == before
    again.close()
    live.begin(ANNE, cseq + 1, 0, BRUSHES["band"])
    live.end(ANNE, cseq + 2)
    live.close()
    assert not pending_of(tmp_path / "a.mtex")


def test_a_batch_that_cannot_be_kept_is_taken_back(tmp_path):
    live = fresh(tmp_path)
    writers = live.project._connection, live.project.pending.writer
    rng = np.random.default_rng(5)
    live.begin(ANNE, 1, 0, BRUSHES["smudge"])
    live.add(ANNE, 2, *walk(rng, 4))
    live.begin(BERT, 1, 0, BRUSHES["dabs"])
    shown, samples = live.project.digest(), walk(rng, 4)
    for writer in writers:
        writer.execute("PRAGMA query_only = ON")
    for client in (ANNE, BERT):
        with pytest.raises(TextureError, match="a stroke could not be kept"):
            live.add(client, 3, *samples)
        with pytest.raises(TextureError, match="could not be kept"):
            live.end(client, 3)
        with pytest.raises(TextureError, match="could not be kept"):
            live.cancel(client, 3)
        with pytest.raises(TextureError, match="could not be kept"):
            live.begin(client, 3, 1, BRUSHES["band"])
        assert live.project.digest() == shown
    with pytest.raises(TextureError, match="could not be kept"):
        live.begin(CARL, 1, 1, BRUSHES["band"])
    assert live.open_clients() == [ANNE, BERT]
    assert [live.last_cseq(client) for client in CLIENTS] == [2, 1, 0]
    for writer in writers:
        writer.execute("PRAGMA query_only = OFF")
    for client in (ANNE, BERT):
        live.add(client, 3, *samples)
        live.end(client, 4)
    digest = live.project.digest()
    live.close()
    assert replayed(tmp_path / "a.mtex") == digest


def test_bad_input_is_refused_and_changes_nothing(tmp_path):
    live = fresh(tmp_path)
    points, normals, pressures = walk(np.random.default_rng(6), 3)
    live.begin(ANNE, 1, 0, BRUSHES["band"])
    live.begin(BERT, 1, 0, BRUSHES["band"])  # waits
    shown = live.project.digest()
    for client in (ANNE, BERT):
        with pytest.raises(TextureError, match=r"sample 0 at .* makes no sense"):
            live.add(client, 2, points * np.nan, normals, pressures)
        with pytest.raises(TextureError, match=r"a pressure of 1\.5"):
            live.add(client, 2, points, normals, pressures * 0 + 1.5)
    with pytest.raises(TextureError, match=f"client '{CARL}' has no stroke open"):
        live.add(CARL, 1, points, normals, pressures)
    with pytest.raises(TextureError, match=f"client '{CARL}' has no stroke open"):
        live.end(CARL, 1)
    with pytest.raises(TextureError, match="there is no layer 9"):
        live.begin(CARL, 1, 9, BRUSHES["band"])
    with pytest.raises(TextureError, match="there is no operation 'fly'"):
        live.apply(Operation("fly"), client=CARL, cseq=1)
    with pytest.raises(TextureError, match="strokes are being painted"):
        live.project.apply(ball())
    assert live.project.digest() == shown
    assert live.last_cseq(CARL) == 0
    assert pending_of(tmp_path / "a.mtex") == [(ANNE, 1, "begin"), (BERT, 1, "begin")]
    live.begin(CARL, 1, 1, BRUSHES["gradient"])
    live.add(CARL, 2, points[:1], normals[:1])
    with pytest.raises(TextureError, match="the gradient begins and ends at"):
        live.end(CARL, 3)
    assert CARL not in live.open_clients()
    assert live.last_cseq(CARL) == 3
    live.close()


def test_a_stroke_that_ended_early_is_told_to_its_client_and_a_new_one_ends_the_old(tmp_path):
    words = []
    live = fresh(tmp_path, warn=words.append)
    samples = walk(np.random.default_rng(7), 3)
    live.begin(ANNE, 1, 0, BRUSHES["band"])
    live.add(ANNE, 2, *samples)
    live.apply(Operation("layer", {"layer": 1, "opacity": 0.5}), client=ANNE, cseq=3)
    seq = live.finish(ANNE)
    assert live.end(ANNE, 4) == seq
    assert live.last_cseq(ANNE) == 4
    live.begin(ANNE, 5, 0, BRUSHES["dabs"])
    live.add(ANNE, 6, *samples)
    live.begin(ANNE, 7, 1, BRUSHES["gradient"])
    live.add(ANNE, 8, *(array[:1] for array in samples))
    live.begin(ANNE, 9, 1, BRUSHES["band"])
    assert words == [
        f"the stroke of client '{ANNE}' could not end: the gradient begins and ends at "
        f"{samples[0][0]}"
    ]
    live.close()
    ends = [(n, o.kind) for c, n, o in operations_of(tmp_path / "a.mtex") if c == ANNE]
    assert ends == [(3, "layer"), (2, "stroke"), (6, "stroke"), (9, "stroke")]


def test_the_digest_is_of_now_even_if_bricks_are_used_again(tmp_path):
    live = fresh(tmp_path)
    pole = np.array([[0.0, 0.0, 1.0]])
    for cseq, undoes in ((1, True), (4, False), (7, False), (10, True), (13, True)):
        brush = Brush(0.4, color=(0.1 * cseq % 1, 0.5, 0.0, 1.0))
        paint(live, ANNE, cseq, 0, brush, [(pole, pole, np.ones(1))])
        if cseq != 4:  # what is freed by the stroke before is taken unseen
            assert live.project.digest() == digest_of(live.project.texture)
        if undoes:
            live.apply(Operation("undo"))
    live.close()


def test_checkpoints_hold_no_stroke_that_is_still_painted(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoints, "OPERATIONS_PER_CHECKPOINT", 3)
    live = fresh(tmp_path)
    rng = np.random.default_rng(8)
    live.begin(ANNE, 1, 0, BRUSHES["band"])
    for n in range(8):
        live.add(ANNE, 2 + n, *walk(rng, 2))
        paint(live, BERT, 4 * n + 1, 1, BRUSHES["dabs"], [walk(rng, 3)])
        live.project.checkpoint()
        live.project.digest()
    path = crashed(live, tmp_path / "copy")
    live.end(ANNE, 100)
    digest = live.project.digest()
    live.close()
    again = LiveStrokes.open(path)
    assert again.project._checkpoints.seq > 4 + 3  # there were some
    again.end(ANNE, 100)
    assert again.project.digest() == digest
    again.close()


def test_a_project_that_is_closed_under_strokes_keeps_them(tmp_path):
    live = fresh(tmp_path)
    live.begin(ANNE, 1, 0, BRUSHES["band"])
    live.add(ANNE, 2, *walk(np.random.default_rng(9), 4))
    shown = live.project.digest()
    live.project.save_as(tmp_path / "saved.mtex")
    live.project.close()
    assert len(pending_of(tmp_path / "a.mtex")) == 2
    with sqlite3.connect(tmp_path / "a.mtex") as connection:
        assert connection.execute("SELECT MAX(seq) FROM checkpoint").fetchone() == (4,)
    connection.close()
    for name in ("a.mtex", "saved.mtex"):
        again = LiveStrokes.open(tmp_path / name)
        assert again.project.digest() == shown
        again.close()
