"""meshsdf.texture.flattened: after any edits the picture is, byte for byte, what all composed anew
is, and no more is redone than has to be."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from meshsdf.kernels.texture_lookup import ABSENT, FIRST_TILE
from meshsdf.mesh import box_mesh, icosphere
from meshsdf.texture import flattened
from meshsdf.texture.brush import Brush
from meshsdf.texture.change import recording
from meshsdf.texture.flattened import Flattened
from meshsdf.texture.layers import shown
from meshsdf.texture.mip import bake, parents
from meshsdf.texture.octree import Octree
from meshsdf.texture.refine import coarsen, texel_mask
from meshsdf.texture.stroke import Stroke
from meshsdf.texture.volume_texture import VolumeTexture
from tests.texture.folded_shapes import plates

BALL = Octree.around(icosphere(subdivisions=3), resolution=60)
PLATES = Octree.around(plates(0.4, 0.3)[0], texel=2.0)  # two that look the same way
PLATE = Octree.around(box_mesh((1.0, 1.0, 0.02)), resolution=50)  # two sheets


def bytes_of(texture, layer):
    """Of every stored entry, the texels that exist in every channel that is seen, as kept."""
    out = {}
    for e in layer.stored:
        slot = layer.slots[e]
        exists = texel_mask(texture, np.array([e], np.int32))[0]
        texels = [
            array[slot][exists] if slot >= 0
            else np.full(exists.sum(), texture.tiles.arrays[name][FIRST_TILE - slot])
            for name, array in texture.pool.arrays.items()
            if name != "mask"
        ]  # fmt: skip
        out[int(e)] = [one.tobytes() for one in texels]
    return out


def check(texture, before=None):
    """The picture's bytes, compared with all composed anew and with what is said of changes."""
    kept = texture.flattened
    picture = bytes_of(texture, shown(texture))
    if texture.flattened is None:  # a layer that is alone, used as it is
        return picture
    anew = Flattened(texture)
    expected = bytes_of(texture, anew.up_to_date())
    anew.release()
    assert picture == expected
    if before is not None and kept is not None and texture.flattened is kept:
        redone = set(texture.flattened.redone.tolist())
        for e in set(before) | set(picture):
            assert e in redone or before.get(e) == picture.get(e)
    return picture


def dab(texture, layer, rng, *, kind="paint"):
    """A short stroke, of half of all sizes that matter."""
    low, high = texture.octree.tables.bricks.min(), 0.5
    way = rng.normal(size=(2, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    if texture.octree is PLATES:
        way = rng.uniform([0, 0], [60, 40], (2, 2)) @ np.eye(2, 3) + [0, 0, rng.choice([0.3, 0.7])]
        normals = np.tile([0.0, 0.0, 1.0], (2, 1))
    elif texture.octree is PLATE:
        way = rng.uniform(-high, high, size=(2, 3)) * [1, 1, 0] + [0, 0, 0.01]
        normals = np.tile([0.0, 0.0, rng.choice([-1.0, 1.0])], (2, 1))
    else:
        normals = way
    assert low < 0 or texture.octree is PLATES
    radius = float(rng.choice([2.0, 5.0, 12.0])) * texture.octree.texel
    color = (*rng.uniform(size=3).tolist(), float(rng.choice([1.0, 0.5])))
    channel = str(rng.choice(["base", "base", "mask"]))
    brush = Brush(radius, kind=kind, color=color, hardness=float(rng.uniform()), channel=channel)
    n = int(rng.integers(1, 3)) if texture.octree is not BALL else 1
    with Stroke(texture, layer, brush) as stroke:
        stroke.add(way[:n], normals[:n])


EDITS = st.lists(
    st.tuples(
        st.sampled_from(["paint", "paint", "erase", "undo", "redo", "look", "hide", "move", "drop",
                         "add", "coarsen"]),
        st.integers(0, 2), st.integers(0, 2**32 - 1),
    ),
    min_size=2, max_size=9,
)  # fmt: skip


@settings(max_examples=15)
@given(EDITS, st.sampled_from(["ball", "plate", "plates"]), st.booleans())
def test_strokes_undo_and_layers_leave_the_bytes_of_composing_anew(edits, shape, is_grounded):
    texture = VolumeTexture({"ball": BALL, "plate": PLATE, "plates": PLATES}[shape])
    if shape == "plates":
        texture.surface = plates(0.4, 0.3)[0]
    for color in ((0.0, 0.0, 0.0, 0.0), (0.0, 0.4, 0.0, 0.5), (0.0, 0.0, 0.0, 0.0)):
        texture.add_layer(color=color)
    if is_grounded:
        bake(texture, texture.layers[0], lambda p: np.abs(np.sin(9 * p @ np.ones((3, 4)))), level=1)
    done, undone, before = [], [], check(texture)
    for kind, number, seed in edits:
        if kind == "undo" and done:
            done[-1].undo(texture)
            undone.append(done.pop())
        elif kind == "redo" and undone:
            undone[-1].redo(texture)
            done.append(undone.pop())
        elif kind not in ("undo", "redo"):
            for change in undone:
                change.release(texture)
            undone = []
            with recording(texture) as change:
                edit(texture, kind, number, np.random.default_rng(seed))
            done.append(change)
        before = check(texture, before)


def edit(texture, kind, number, rng):
    layer = texture.layers[number % len(texture.layers)]
    if kind in ("paint", "erase"):
        dab(texture, layer, rng, kind=kind)
    elif kind == "look":
        layer.opacity, layer.mode = float(rng.uniform()), str(rng.choice(["normal", "multiply"]))
    elif kind == "hide":
        layer.visible = not layer.visible
    elif kind == "move":
        texture.move_layer(layer, int(rng.integers(len(texture.layers))))
    elif kind == "drop" and len(texture.layers) > 2:
        texture.drop_layer(layer)
    elif kind == "add":
        texture.add_layer(color=(0.2, 0.2, 0.9, 0.3))
    elif kind == "coarsen":
        coarsen(texture, layer, 0.1)


@pytest.mark.parametrize("octree", [BALL, PLATE])
def test_entries_that_no_layer_stores_any_longer_vanish_and_those_above_are_no_means_of_them(
    octree,
):
    texture = VolumeTexture(octree)
    texture.add_layer(color=(0.7, 0.7, 0.7))
    paint = texture.add_layer()
    first = check(texture)
    with recording(texture) as one:
        dab(texture, paint, np.random.default_rng(1))
    second = check(texture, first)
    with recording(texture) as other:
        dab(texture, paint, np.random.default_rng(5))
    check(texture)
    other.undo(texture)
    assert check(texture) == second
    kept = texture.flattened
    one.undo(texture)
    assert check(texture, second) == first
    gone = np.array(sorted(set(second) - set(first)), np.int32)
    assert len(gone) > 8
    assert (kept.layer.slots[gone] == ABSENT).all()
    assert set(gone.tolist()) <= set(kept.redone.tolist())


def test_a_coarse_texel_is_composed_again_when_the_finer_ones_it_was_a_mean_of_vanish():
    """Finer bricks go from a layer whose coarser ones stay as they are, and are not its means."""
    texture = VolumeTexture(BALL)
    texture.add_layer(color=(0.2, 0.2, 0.2, 1.0))
    layer = texture.add_layer()
    bake(texture, layer, lambda p: np.abs(np.sin(40 * p @ np.ones((3, 4)))))
    texture.layers[0].opacity = 0.5
    check(texture)
    finest = np.arange(BALL.level_first[1], dtype=np.int32)
    slots = layer.slots[finest].copy()
    layer.slots[finest] = ABSENT
    before = bytes_of(texture, texture.flattened.layer)
    after = check(texture, before)
    above = np.unique(parents(texture, finest))
    assert sum(before[int(e)] != after[int(e)] for e in above) > 0.5 * len(above)
    layer.slots[finest] = slots
    assert check(texture) == before


def test_a_dab_composes_the_bricks_that_it_covers_and_no_others():
    octree = Octree.around(icosphere(subdivisions=3), resolution=200)
    texture, rng = VolumeTexture(octree), np.random.default_rng(2)
    ground = texture.add_layer()
    bake(texture, ground, lambda p: np.abs(np.sin(30 * p @ np.ones((3, 4)))))
    texture.add_layer()
    paint = texture.add_layer()
    shown(texture)
    for _ in range(4):
        point = rng.normal(size=(1, 3))
        point /= np.linalg.norm(point)
        with Stroke(texture, paint, Brush(12 * octree.texel, color=(1.0, 0, 0, 1.0))) as stroke:
            stroke.add(point, point)
        shown(texture)
        middle = (octree.tables.bricks[: octree.level_first[1]] + 0.5) * 8 * octree.texel
        near = np.linalg.norm(middle - point, axis=1) < (12 + 8 * 3**0.5) * octree.texel
        composed = texture.flattened.n_composed
        assert 0 < composed <= near.sum()
        # Every coarser brick is a mean of finer ones, and changed only where one of them did
        redone = texture.flattened.redone
        assert (redone < octree.level_first[1]).sum() == composed
        assert len(redone) < 3 * composed


def test_nothing_is_redone_where_nothing_changed():
    texture = VolumeTexture(BALL)
    texture.add_layer(color=(0.5, 0.5, 0.5))
    paint = texture.add_layer()
    dab(texture, paint, np.random.default_rng(0))
    picture = shown(texture)
    assert texture.flattened.n_composed > 0
    slots = picture.slots.copy()
    assert shown(texture) is picture
    assert texture.flattened.n_composed == 0
    assert len(texture.flattened.redone) == 0
    assert_array_equal(picture.slots, slots)


def test_a_picture_that_could_not_be_finished_is_made_anew(monkeypatch):
    texture = VolumeTexture(BALL)
    texture.add_layer(color=(0.5, 0.5, 0.5))
    paint = texture.add_layer()
    shown(texture)
    dab(texture, paint, np.random.default_rng(0))
    with monkeypatch.context() as patch:
        patch.setattr(flattened, "remake_means", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            shown(texture)
    check(texture)


def test_a_picture_let_go_of_holds_no_brick():
    texture = VolumeTexture(BALL)
    texture.add_layer(color=(0.5, 0.5, 0.5))
    paint = texture.add_layer()
    dab(texture, paint, np.random.default_rng(0))
    used = texture.pool.n_used
    shown(texture)
    assert texture.pool.n_used > used
    texture.flattened.release()
    assert texture.pool.n_used == used
