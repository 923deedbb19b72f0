"""Random operations that can be done, the same for the same numbers, and what they lead to.

`Twin` is the truth that journals are held against: the same operations without a file, and the
steps that remain done carried out anew from the beginning, without undo, checkpoints or slots.
"""

import numpy as np

from meshsdf.mesh import icosphere
from meshsdf.texture.content import digest
from meshsdf.texture.history import History
from meshsdf.texture.operations import Operation, perform
from meshsdf.texture.volume_texture import VolumeTexture

RESOLUTION = 24
MOST_LAYERS = 3


def small_mesh():
    """What the small projects are around."""
    return icosphere(subdivisions=2)


def direction(rng):
    """A random point of the unit sphere."""
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def random_operation(seed, number, layers, n_done, n_undone):
    """The operation of a number, for a texture with layers of these numbers, bottom first."""
    rng = np.random.default_rng([seed, number])
    color = [float(c) for c in np.round(rng.random(4), 3)]
    if not layers:
        return Operation("add-layer", {"name": f"layer of {number}", "color": color})
    layer = int(rng.choice(layers))
    dice = rng.random()
    if dice < 0.12 and n_done > 1:
        return Operation("undo")
    if dice < 0.24 and n_undone:
        return Operation("redo")
    if dice < 0.28 and len(layers) < MOST_LAYERS:
        return Operation("add-layer", {"color": color})
    if dice < 0.31 and len(layers) > 1:
        return Operation("drop-layer", {"layer": layer})
    if dice < 0.35:
        place = int(rng.integers(len(layers)))
        return Operation("layer", {"layer": layer, "opacity": color[0], "place": place})
    if dice < 0.37:
        return Operation("fill-color", {"layer": layer, "color": color})
    if dice < 0.39:
        params = {"layer": layer, "texture_kind": "checker", "side": 0.3 + color[0], "level": 1}
        return Operation("bake", params)
    if dice < 0.42:
        return Operation("coarsen", {"layer": layer})
    params = {
        "layer": layer,
        "center": direction(rng),
        "radius": float(rng.uniform(0.02, 0.4)),
        "color": color,
    }
    return Operation("paint-ball", params)


def next_of(seed, number, texture, history):
    """`random_operation` for a texture as it is now."""
    n_undone = len(history.steps) - history.n_done
    layers = [layer.number for layer in texture.layers]
    return random_operation(seed, number, layers, history.n_done, n_undone)


class Twin:
    """The same operations in memory alone, without a project."""

    def __init__(self, seed):
        self.seed = seed
        self.texture = VolumeTexture.around(small_mesh(), resolution=RESOLUTION)
        self.history = History(self.texture)
        self.operations = []

    def next(self):
        """Make up the next operation and do it."""
        operation = next_of(self.seed, len(self.operations) + 1, self.texture, self.history)
        self.operations.append(operation)
        if operation.kind == "undo":
            self.history.undo()
        elif operation.kind == "redo":
            self.history.redo()
        else:
            with self.history.record(operation.kind, len(self.operations)):
                perform(self.texture, operation)
        return operation

    def digest(self):
        """What the layers hold."""
        return digest(self.texture)

    def digest_from_scratch(self):
        """What they hold when the steps that are done are done anew, without any undo."""
        texture = VolumeTexture.around(small_mesh(), resolution=RESOLUTION)
        for step in self.history.steps[: self.history.n_done]:
            perform(texture, self.operations[step.number - 1])
        return digest(texture)
