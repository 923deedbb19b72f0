"""meshsdf.texture.history: steps back and forth, within a budget."""

import numpy as np
import pytest

from meshsdf.errors import TextureError
from meshsdf.texture.content import Content, digest
from meshsdf.texture.history import History
from meshsdf.texture.operations import Operation, perform
from meshsdf.texture.volume_texture import VolumeTexture
from tests.texture.random_operations import random_operation, small_mesh

BRICK = 512 * 4


def fresh(resolution=16, **options):
    texture = VolumeTexture.around(small_mesh(), resolution=resolution)
    return texture, History(texture, **options)


def do(history, operation):
    with history.record(operation.kind):
        perform(history.texture, operation)


def balls(history, n):
    """Layers and balls; the texture's digests after each."""
    do(history, Operation("add-layer"))
    digests = [digest(history.texture)]
    for i in range(n):
        center = [float(np.cos(i)), float(np.sin(i)), 0.0]
        params = {"layer": 0, "center": center, "radius": 0.4, "color": [0.1 * i, 0.0, 1.0]}
        do(history, Operation("paint-ball", params))
        digests.append(digest(history.texture))
    return digests


def test_every_state_of_1000_random_operations_comes_back_and_memory_is_what_was_touched():
    texture, history = fresh()
    content = Content(texture)

    def now():
        for _ in content.update():
            pass
        return content.digest()

    digests, n_touched = [now()], 0
    for number in range(1000):
        before = {layer: layer.slots.copy() for layer in texture.layers}
        layers = [layer.number for layer in texture.layers]
        n_steps = len(history.steps)
        do(history, random_operation(9, number, layers, 0, 0))
        if len(history.steps) > n_steps:
            digests.append(now())
        n_touched += sum(
            int(((slots >= 0) & (layer.slots != slots)).sum()) for layer, slots in before.items()
        )
    assert len(history.steps) > 800
    assert len(set(digests)) > 800
    assert digests[-1] == digest(texture)
    stored = {int(slot) for layer in texture.layers for slot in layer.slots if slot >= 0}
    assert texture.pool.n_used - len(stored) <= n_touched
    assert history.n_bytes <= 1.1 * n_touched * BRICK
    for expected in digests[-2::-1]:
        history.undo()
        assert now() == expected
    for expected in digests[1:]:
        history.redo()
        assert now() == expected
    assert digest(texture) == digests[-1]


def test_names_are_told_in_order():
    _, history = fresh()
    balls(history, 2)
    assert history.names == ["add-layer", "paint-ball", "paint-ball"]
    assert history.undo() == "paint-ball"
    assert (history.names, history.undone_names) == (["add-layer", "paint-ball"], ["paint-ball"])
    assert history.redo() == "paint-ball"
    assert history.undone_names == []


def test_what_changes_nothing_is_no_step_and_keeps_what_can_be_redone():
    _, history = fresh()
    balls(history, 1)
    history.undo()
    do(history, Operation("layer", {"layer": 0, "opacity": 1.0}))
    do(history, Operation("paint-ball", {"layer": 0, "center": [9, 9, 9], "radius": 1,
                                         "color": [1, 1, 1]}))  # fmt: skip
    assert history.names == ["add-layer"]
    assert history.undone_names == ["paint-ball"]


def test_a_new_step_ends_what_was_undone_and_frees_its_bricks():
    texture, history = fresh()
    balls(history, 5)
    for _ in range(5):
        history.undo()
    do(history, Operation("layer", {"layer": 0, "opacity": 0.5}))
    assert history.undone_names == []
    assert texture.pool.n_used == int((texture.layers[0].slots >= 0).sum())


def test_an_error_is_no_step():
    texture, history = fresh()
    balls(history, 1)
    before = digest(texture)

    def go_wrong():
        with history.record("bad"):
            texture.drop_layer(texture.layers[0])
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        go_wrong()
    assert digest(texture) == before
    assert len(history.steps) == 2


def test_beyond_the_budget_the_oldest_steps_are_let_go():
    _, history = fresh(budget=2 * BRICK)
    digests = balls(history, 30)
    assert history.n_bytes <= 2 * BRICK
    n = sum(step.change is not None for step in history.steps)
    assert 1 <= n < 30
    for expected in digests[-2 : -2 - n : -1]:
        history.undo()
        assert digest(history.texture) == expected
    with pytest.raises(TextureError, match="'paint-ball' was let go: 4096 bytes"):
        history.undo()


def test_steps_that_were_let_go_are_rebuilt_by_whoever_can():
    texture, history = fresh(budget=0)
    asked = []
    history.rebuild = asked.append
    balls(history, 3)
    assert all(step.change is None for step in history.steps)
    history.undo()
    history.undo()
    history.redo()
    assert asked == [3, 2, 3]
    assert history.n_done == 3
    assert texture.layers


def test_there_is_an_end_in_both_directions():
    _, history = fresh()
    with pytest.raises(TextureError, match="nothing to undo"):
        history.undo()
    with pytest.raises(TextureError, match="nothing to redo"):
        history.redo()
