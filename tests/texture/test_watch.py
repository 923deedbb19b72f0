"""meshsdf.texture.watch: which bricks of the picture changed, held against a plain comparison."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshsdf.kernels.texture_lookup import ABSENT, FIRST_TILE
from meshsdf.mesh import icosphere
from meshsdf.texture.brush import Brush
from meshsdf.texture.history import History
from meshsdf.texture.layers import shown
from meshsdf.texture.octree import Octree
from meshsdf.texture.operations import Operation, perform
from meshsdf.texture.refine import refine_to
from meshsdf.texture.stroke import Stroke
from meshsdf.texture.volume_texture import VolumeTexture
from meshsdf.texture.watch import Watch
from tests.texture.live_twin import walk

BALL = Octree.around(icosphere(subdivisions=2), resolution=24)
RED = (1.0, 0.0, 0.0, 1.0)
BRUSHES = (
    Brush(0.3, color=RED), Brush(0.2, color=(0.0, 1.0, 0.0, 0.5), build_up=True),
    Brush(0.4, kind="erase"), Brush(0.4, kind="blur"), Brush(0.4, channel="height", value=1.0),
)  # fmt: skip


def contents(texture):
    """What is stored of every entry of what is shown, texel by texel; None where nothing is."""
    layer, out = shown(texture), []
    for entry, slot in enumerate(layer.slots):
        if slot == ABSENT:
            out.append(None)
            continue
        mask = texture.octree.tables.masks[entry].view(np.uint8)
        needed = np.unpackbits(mask, bitorder="little").astype(bool)
        texels = []
        for name, channel in texture.channels.items():
            brick = np.full(512, channel.nothing, channel.dtype)
            if slot <= FIRST_TILE:
                brick[:] = texture.tiles.arrays[name][FIRST_TILE - slot]
            elif name in texture.pool.arrays:
                brick[:] = texture.pool.arrays[name][slot]
            texels.append(brick[needed].tobytes())
        out.append(b"".join(texels))
    return out


def new_texture(n_layers=2):
    texture = VolumeTexture(BALL)
    for n in range(n_layers):
        texture.add_layer(color=(0.1 * n, 0.5, 0.2, 0.6))
    return texture


class Editor:
    """Edits a texture by dice, with strokes that go on and an undo."""

    def __init__(self, texture, rng):
        self.texture, self.rng, self.history = texture, rng, History(texture)
        self.stroke = None

    def edit(self):
        dice = self.rng.random()
        if self.stroke is not None:
            if dice < 0.7:
                self.stroke.add(*walk(self.rng, 2))
            else:
                self.stroke.end() if dice < 0.9 else self.stroke.cancel()
                self.stroke = None
            return
        layers = [layer.number for layer in self.texture.layers]
        layer = int(self.rng.choice(layers))
        if dice < 0.3:
            brush = BRUSHES[int(self.rng.integers(len(BRUSHES)))]
            on = next(one for one in self.texture.layers if one.number == layer)
            # Undoing knows nothing of a stroke without a record
            self.history = History(self.texture)
            self.stroke = Stroke(self.texture, on, brush)
        elif dice < 0.5 and self.history.n_done:
            self.history.undo()
        elif dice < 0.6 and self.history.undone_names:
            self.history.redo()
        else:
            with self.history.record("edit"):
                perform(self.texture, self.operation(layer, len(layers)))

    def operation(self, layer, n_layers):
        x = float(self.rng.uniform(0, 6))
        center = [np.cos(x), np.sin(x), 0.0]
        color = [float(c) for c in self.rng.random(4)]
        choices = [
            Operation(
                "paint-ball", {"layer": layer, "center": center, "radius": 0.4, "color": color}
            ),
            Operation("layer", {"layer": layer, "visible": bool(self.rng.random() < 0.6)}),
            Operation("layer", {"layer": layer, "opacity": float(self.rng.choice([0.5, 1.0]))}),
            Operation(
                "layer", {"layer": layer, "mode": str(self.rng.choice(["multiply", "normal"]))}
            ),
            Operation("coarsen", {"layer": layer}),
            Operation("fill-color", {"layer": layer, "color": color}),
            Operation("add-layer", {"color": color}),
        ]
        if n_layers > 1:
            choices.append(Operation("drop-layer", {"layer": layer}))
        return choices[int(self.rng.integers(len(choices)))]


@settings(max_examples=8)
@given(seed=st.integers(0, 10**6), n_layers=st.integers(1, 3))
def test_changed_tells_just_what_a_plain_comparison_does(seed, n_layers):
    texture, rng = new_texture(n_layers), np.random.default_rng(seed)
    editor, watch = Editor(texture, rng), Watch(texture)
    before = contents(texture)
    for _ in range(12):
        for _ in range(rng.integers(1, 4)):
            editor.edit()
        now = contents(texture)
        expected = [e for e, (a, b) in enumerate(zip(before, now, strict=True)) if a != b]
        assert watch.changed().tolist() == expected
        assert watch.layer is shown(texture)
        before = now


@settings(max_examples=4)
@given(seed=st.integers(0, 10**6))
def test_colours_change_only_at_bricks_that_are_told_and_beside_them(seed):
    texture, rng = new_texture(2), np.random.default_rng(seed)
    for layer in texture.layers:
        refine_to(texture, layer, 0)
    watch = Watch(texture)
    points = rng.normal(size=(400, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    bricks = np.floor(points / (8 * BALL.texel)).astype(int)
    n_changed = 0
    for _ in range(8):
        before = texture.colors(points)
        brush = BRUSHES[int(rng.integers(3))]
        on = texture.layers[int(rng.integers(2))]
        with Stroke(texture, on, brush) as stroke:
            stroke.add(*walk(rng, 2))
        changed = watch.changed()
        moved = (texture.colors(points) != before).any(axis=1)
        n_changed += moved.sum()
        # A point is blended of nodes of its own brick and of those up to one further
        told = {tuple(b) for b in BALL.tables.bricks[changed[BALL.tables.levels[changed] == 0]]}
        around = np.stack(np.meshgrid(*[[0, 1]] * 3), axis=-1).reshape(-1, 3)
        for brick in bricks[moved]:
            assert any(tuple(brick + step) in told for step in around)
    assert n_changed > 0


def test_a_painted_brick_is_told_at_every_batch_and_no_more_often():
    texture = new_texture(1)
    watch = Watch(texture)
    assert len(watch.changed()) == 0
    stroke = Stroke(texture, texture.layers[0], Brush(0.3, color=RED, build_up=True, flow=0.1))
    pole = np.array([[0.0, 0.0, 1.0]])
    told = []
    for step in range(4):
        stroke.add(pole + 0.06 * step * np.eye(3)[:1], pole)
        told.append(set(watch.changed().tolist()))
        assert len(watch.changed()) == 0
    assert set.intersection(*told)  # bricks that every batch painted
    stroke.cancel()
    back = set(watch.changed().tolist())
    assert back <= set.union(*told)
    assert set.intersection(*told) <= back


def test_a_watch_that_is_over_holds_no_brick():
    texture = new_texture(2)
    with Stroke(texture, texture.layers[0], Brush(0.5, color=RED)) as stroke:
        stroke.add(*walk(np.random.default_rng(0), 5))
    holders = texture.pool.holders.copy()
    watch = Watch(texture)
    shown(texture)
    texture.flattened.release()
    texture.flattened = None
    assert texture.pool.holders.sum() > holders.sum()
    watch.release()
    np.testing.assert_array_equal(texture.pool.holders[: len(holders)], holders)
    assert texture.pool.holders[len(holders) :].sum() == 0


@pytest.mark.parametrize("n_layers", [1, 2])
def test_what_was_seen_is_kept_while_others_write_over_it(n_layers):
    texture = new_texture(n_layers)
    refine_to(texture, texture.layers[0], 0)
    watch = Watch(texture)
    seen = watch.layer.slots.copy()
    bricks = seen >= 0
    before = texture.pool.arrays["base"][seen[bricks]].copy()
    texture.put(
        texture.layers[0],
        np.arange(BALL.level_first[1], dtype=np.int32),
        np.full((BALL.n_texels(0), 4), 0.25, np.float32),
    )
    np.testing.assert_array_equal(texture.pool.arrays["base"][seen[bricks]], before)
    assert set(np.arange(BALL.level_first[1])) <= set(watch.changed().tolist())
