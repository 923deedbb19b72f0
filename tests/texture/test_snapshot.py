"""meshsdf.texture.snapshot: what is seen, for good."""

import threading

import numpy as np

from meshsdf.mesh.primitives import icosphere
from meshsdf.texture.operations import Operation, perform
from meshsdf.texture.snapshot import snapshot
from meshsdf.texture.volume_texture import VolumeTexture

BALL = {"center": [0.0, 0.0, 1.0], "radius": 0.5, "color": [0.1, 0.8, 0.2, 1.0]}


def layered() -> VolumeTexture:
    """A ball with three layers: marble, a half transparent one above, and a hidden one."""
    texture = VolumeTexture.around(icosphere(subdivisions=3), resolution=48)
    for name in ("stone", "glaze", "hidden"):
        texture.add_layer(name)
    perform(texture, Operation("bake", {"layer": 0, "texture_kind": "marble"}))
    perform(texture, Operation("paint-ball", {"layer": 1, **BALL}))
    perform(texture, Operation("layer", {"layer": 1, "opacity": 0.5, "mode": "multiply"}))
    perform(texture, Operation("fill-color", {"layer": 2, "color": [0.0, 0.0, 0.0, 1.0]}))
    perform(texture, Operation("layer", {"layer": 2, "visible": False}))
    return texture


def places(n: int = 4000) -> np.ndarray:
    points = np.random.default_rng(7).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def test_it_shows_what_all_layers_show_together_at_every_width():
    texture, points = layered(), places()
    copy = snapshot(texture)
    for width in (0.0, 0.1, 0.5):
        assert np.array_equal(
            copy.colors(points, points, width), texture.colors(points, points, width)
        )
    assert len(copy.layers) == 1
    assert copy.surface is texture.surface


def test_a_single_layer_is_copied_as_it_is():
    texture, points = VolumeTexture.around(icosphere(subdivisions=2), resolution=24), places()
    texture.add_layer(color=(0.2, 0.4, 0.6))
    copy = snapshot(texture)
    assert np.array_equal(copy.colors(points), texture.colors(points))
    assert copy.pool.n_used == 0  # one colour takes no bricks


def test_painting_on_changes_nothing_of_it_and_it_takes_nothing_from_the_texture():
    texture, points = layered(), places()
    texture.colors(points)  # the picture of all layers is kept from now on
    bricks = texture.pool.n_used
    copy = snapshot(texture)
    assert texture.pool.n_used == bricks
    before = copy.colors(points, points)
    perform(texture, Operation("paint-ball", {"layer": 1, **BALL, "radius": 3.0}))
    perform(texture, Operation("drop-layer", {"layer": 0}))
    assert np.array_equal(copy.colors(points, points), before)
    assert not np.array_equal(texture.colors(points, points), before)


def test_a_mask_has_had_its_say():
    texture, points = layered(), places()
    unmasked = texture.colors(points, points)
    mask = np.zeros((1, 4), np.float32)
    mask[0, 3] = 1.0
    entries = texture.layers[1].stored
    n = len(texture.places(entries)[0])
    texture.put(texture.layers[1], entries, np.repeat(mask, n, axis=0), channel="mask")
    shown = texture.colors(points, points)
    assert not np.array_equal(shown, unmasked)
    assert np.array_equal(snapshot(texture).colors(points, points), shown)


def test_another_thread_may_look_while_painting_goes_on():
    texture, points = layered(), places()
    copy = snapshot(texture)
    before, seen = copy.colors(points, points), []

    def look() -> None:
        seen.extend(copy.colors(points, points) for _ in range(20))

    thread = threading.Thread(target=look)
    thread.start()
    for step in range(20):
        color = [step / 20, 0.5, 0.5, 1.0]
        perform(texture, Operation("paint-ball", {"layer": 0, **BALL, "color": color}))
        texture.colors(points, points)
    thread.join()
    assert len(seen) == 20
    assert all(np.array_equal(one, before) for one in seen)
