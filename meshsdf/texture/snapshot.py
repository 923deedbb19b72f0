"""What a texture shows, copied for good: another thread may look at it while painting goes on."""

import numpy as np

from ..kernels.texture_lookup import ABSENT
from .layers import shown
from .procedural_layer import ProceduralLayer, fill
from .volume_texture import VolumeTexture


def snapshot(texture: VolumeTexture) -> VolumeTexture:
    """A texture of one layer that shows what another shows now.

    Returns
    -------
    VolumeTexture
        It shares the octree and the surface, which never change, and no texels.

    Notes
    -----
    Cost: one copy of the bricks that are seen; layers that hide each other are blended already.

    Examples
    --------
    >>> from meshsdf.mesh import icosphere
    >>> texture = VolumeTexture.around(icosphere(subdivisions=2), resolution=16)
    >>> layer = texture.add_layer(color=(1.0, 0.0, 0.0))
    >>> before = snapshot(texture)
    >>> texture.drop_layer(layer)
    >>> before.colors(np.array([[0.0, 0.0, 1.0]]))
    array([[1., 0., 0., 1.]], dtype=float32)
    """
    everything = np.arange(texture.octree.n_entries, dtype=np.int32)
    for layer in texture.layers:
        if layer.visible and isinstance(layer, ProceduralLayer) and layer.function is not None:
            fill(texture, layer, everything)
    slots = shown(texture).slots
    copy = VolumeTexture(texture.octree, base=texture.base)
    copy.surface = texture.surface
    picture = copy.add_layer("shown")
    picture.slots[:] = ABSENT
    stored = slots >= 0
    bricks, which = np.unique(slots[stored], return_inverse=True)
    taken = copy.pool.take(len(bricks))
    # Masks have had their say in what is shown
    for name in texture.pool.arrays.keys() - {"mask"}:
        copy.pool.use(name)[taken] = texture.pool.arrays[name][bricks]
    picture.slots[stored] = taken[which]
    copy.pool.hold(picture.slots)
    copy.pool.drop(taken)  # which were held when they were taken
    for code in np.unique(slots[slots < ABSENT]):
        texel = texture.tiles.texel(int(code))
        del texel["mask"]
        picture.slots[slots == code] = copy.tiles.code(texel)
    return copy
