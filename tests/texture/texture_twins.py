"""Plain, slow twins of the octree's lookup and mipmap, and examples that several tests share."""

import itertools

import numpy as np

from meshsdf.texture.refine import texel_mask
from meshsdf.texture.volume_texture import VolumeTexture

ABSENT = -1


def stored_nodes(texture, layer, channel="base"):
    """One dict per level: node -> its four numbers (float64), or None if it is not stored."""
    octree, nodes = texture.octree, []
    for level in range(octree.n_levels):
        entries = np.arange(*octree.level_first[level : level + 2], dtype=np.int32)
        at_level = {}
        masks = texel_mask(texture, entries)
        for entry, mask in zip(entries, masks, strict=True):
            slot, brick = layer.slots[entry], octree.tables.bricks[entry]
            texels = np.flatnonzero(mask)
            kind = texture.channels[channel]
            if slot >= 0:
                values = kind.decoded(texture.pool.arrays[channel][slot][texels])
            elif slot < ABSENT:
                values = np.tile(
                    kind.decoded(texture.tiles.arrays[channel][[-2 - slot]]), (len(texels), 1)
                )
            for n, t in enumerate(texels):
                node = (*(8 * brick + [t // 64, t // 8 % 8, t % 8]).tolist(),)
                assert node not in at_level, "the twin knows one sheet only"
                at_level[node] = None if slot == ABSENT else values[n].astype(np.float64)
        nodes.append(at_level)
    return nodes


def shown(nodes, level, place):
    """F_level at a place, in nodes of that level: as the header of the lookup kernel defines it."""
    if level == len(nodes):
        return np.zeros(4)
    low = np.floor(place).astype(int)
    corners = []
    for step in itertools.product((0, 1), repeat=3):
        node = (*(low + step).tolist(),)
        if node in nodes[level]:
            weight = np.prod(np.where(step, place - low, 1 - (place - low)))
            corners.append((weight, node, nodes[level][node]))
    if all(value is None for _, _, value in corners):
        return shown(nodes, level + 1, place / 2)
    total, sums = 0.0, np.zeros(4)
    for weight, node, value in corners:
        if weight == 0:
            continue
        if value is None:
            value = shown(nodes, level + 1, np.array(node) / 2)
        total += weight
        sums += weight * value[3] * np.append(value[:3], 1)
    if sums[3] == 0:
        return np.zeros(4)
    return np.append(sums[:3] / sums[3], sums[3] / total)


def mean_below(nodes, level, node):
    """What a texel of a level becomes by the finer one; None if it keeps its value."""
    sums, total = np.zeros(4), 0.0
    for step in itertools.product((-1, 0, 1), repeat=3):
        below = (*(2 * np.array(node) + step).tolist(),)
        if below not in nodes[level - 1]:
            continue
        value = nodes[level - 1][below]
        if value is None:
            return None
        weight = np.prod([2 - abs(s) for s in step])
        sums += weight * value[3] * np.append(value[:3], 1)
        total += weight
    if total == 0:
        return None
    if sums[3] == 0:
        return np.zeros(4)
    return np.append(sums[:3] / sums[3], sums[3] / total)


def random_texture(mesh, resolution, seed, *, base="half", channel="base"):
    """A texture with random texels, a third of its bricks stored, in balance, and that layer."""
    from meshsdf.texture.refine import refine

    random = np.random.default_rng(seed)
    texture = VolumeTexture.around(mesh, resolution=resolution, base=base)
    layer = texture.add_layer(color=(0.2, 0.4, 0.6, 0.5))
    texture.pool.use(channel)
    everything = np.arange(texture.octree.n_entries, dtype=np.int32)
    refine(texture, layer, np.sort(random.choice(everything, len(everything) // 3, False)))
    painted = random.choice(layer.stored, len(layer.stored) // 2, False)
    n = len(texture.places(painted)[0])
    values = random.random((n, 4)).astype(np.float32)
    values[random.random(n) < 0.2, 3] = 0
    texture.put(layer, painted, values, channel=channel)
    return texture, layer


def half_painted(mesh, resolution, *, base="srgb8"):
    """A texture that is grey where x < 0 and a smooth pattern elsewhere; and its layer."""
    from meshsdf.texture.mip import bake

    texture = VolumeTexture.around(mesh, resolution=resolution, base=base)
    layer = texture.add_layer()
    bake(texture, layer, half_pattern)
    return texture, layer


def half_pattern(points):
    """Grey where x < 0, a smooth pattern elsewhere."""
    colors = np.ones((len(points), 4))
    right = points[:, 0] >= 0
    colors[:, :3] = 0.5 + 0.4 * np.sin(7 * points + [0, 1, 2]) * right[:, None]
    return colors
