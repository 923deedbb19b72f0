"""The slow twin of painting: every dab at every texel, in plain NumPy and float64."""

from itertools import pairwise

import numpy as np

from meshsdf.texture.brush import Brush
from meshsdf.texture.refine import refine_to
from meshsdf.texture.volume_texture import VolumeTexture


def finest(texture: VolumeTexture) -> np.ndarray:
    """The entries of the finest level."""
    return np.arange(texture.octree.level_first[1], dtype=np.int32)


def painted_layer(texture: VolumeTexture, color=(1.0, 1.0, 1.0, 1.0)):
    """A new layer of one colour, stored at the finest level."""
    layer = texture.add_layer(color=color)
    refine_to(texture, layer, 0)
    return layer


def stored_texels(texture, layer, entries=None, channel: str = "base") -> np.ndarray:
    """Texels of entries that are stored, in the order of `VolumeTexture.places`."""
    entries = finest(texture) if entries is None else entries
    out = []
    for entry in entries:
        slot = layer.slots[entry]
        assert slot != -1
        bits = np.unpackbits(texture.octree.tables.masks[entry].view(np.uint8), bitorder="little")
        if slot >= 0:
            brick = texture.pool.use(channel)[slot]
        else:
            brick = np.full(512, texture.tiles.arrays[channel][-2 - slot])
        out.append(brick[bits == 1])
    return np.concatenate(out)


def stored_values(texture, layer, entries=None, channel: str = "base") -> np.ndarray:
    """What those texels mean, (n, 4)."""
    return texture.channels[channel].decoded(stored_texels(texture, layer, entries, channel))


def arc(n: int, start=0.0, end=0.8, tilt=0.0) -> tuple[np.ndarray, np.ndarray]:
    """n points of the ball over its pole, and the normals there."""
    a = np.linspace(start, end, n)
    points = np.stack([np.sin(a), np.sin(tilt) * np.cos(a), np.cos(tilt) * np.cos(a)], axis=1)
    return points, points.copy()


def everything(texture: VolumeTexture, layer) -> bytes:
    """All texels that a layer stores, and where."""
    stored = layer.stored
    return stored.tobytes() + stored_texels(texture, layer, stored).tobytes()


def capsule_weight(brush: Brush, points, normals, a, b) -> np.ndarray:
    """Weight of the band from sample a to sample b at points; a sample is (p, n, radius, flow)."""
    way = b[0] - a[0]
    t = np.zeros(len(points))
    if way @ way > 0:
        t = np.clip((points - a[0]) @ way / (way @ way), 0, 1)
    radius = a[2] + t * (b[2] - a[2])
    away = np.linalg.norm(points - a[0] - t[:, None] * way, axis=1)
    d = np.divide(away, radius, out=np.full(len(points), 2.0), where=radius > 0)
    x = np.clip((d - brush.hardness) / max(1 - brush.hardness, 1e-300), 0, 1)
    shape = {"smooth": 1 - x * x * (3 - 2 * x), "linear": 1 - x, "round": np.sqrt(1 - x * x)}
    look = a[1] + t[:, None] * (b[1] - a[1])
    cosine = (normals * look).sum(axis=1) / np.linalg.norm(look, axis=1)
    y = np.clip((cosine - brush.angle[0]) / (brush.angle[1] - brush.angle[0]), 0, 1)
    gate = np.where((normals == 0).all(axis=1), 1, y * y * (3 - 2 * y))
    return np.where(d < 1, shape[brush.falloff], 0) * gate * (a[3] + t * (b[3] - a[3]))


def samples_of(brush: Brush, points, normals, pressures) -> list:
    """(p, unit n, radius, flow) of every sample."""
    radius = brush.radius * np.interp(pressures, *np.transpose(brush.pressure_radius))
    flow = brush.flow * np.interp(pressures, *np.transpose(brush.pressure_flow))
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return list(zip(points, unit, radius, flow, strict=True))


def spaced(brush: Brush, samples: list) -> list:
    """Dabs every ``spacing`` radii along the way."""
    dabs = [samples[0]]
    rest = brush.spacing * samples[0][2]
    for a, b in pairwise(samples):
        length = np.linalg.norm(b[0] - a[0])
        gone = 0.0
        while length - gone >= rest:
            gone += rest
            t = gone / length
            p, n, r, f = (x + t * (y - x) for x, y in zip(a, b, strict=True))
            dabs.append((p, n / np.linalg.norm(n), r, f))
            rest = brush.spacing * r
        rest -= length - gone
    return dabs


def mirrored(sample, matrix, center) -> tuple:
    """One copy of a sample."""
    return center + matrix @ (sample[0] - center), matrix @ sample[1], *sample[2:]


def coverage(brush: Brush, places, looks, points, normals, pressures=None) -> np.ndarray:
    """How much of a stroke there is at places."""
    pressures = np.ones(len(points)) if pressures is None else pressures
    samples = samples_of(brush, points, normals, pressures)
    if brush.build_up:
        steps = [(dab, dab) for dab in spaced(brush, samples)]
    else:
        steps = [(samples[0], samples[0]), *pairwise(samples)]
    center = np.array(brush.symmetry.center, float)
    k = np.zeros(len(places))
    for a, b in steps:
        w = np.zeros(len(places))
        for matrix in brush.symmetry.matrices():
            one = [mirrored(sample, matrix, center) for sample in (a, b)]
            w = np.maximum(w, capsule_weight(brush, places, looks, *one))
        k = k + w * (1 - k) if brush.build_up else np.maximum(k, w)
    return k


def over(below: np.ndarray, color, share: np.ndarray) -> np.ndarray:
    """A colour (normal mode) over (n, 4) straight colours."""
    alpha = share * color[3]
    out = np.empty_like(below)
    out[:, 3] = alpha + below[:, 3] * (1 - alpha)
    sums = alpha[:, None] * color[:3] + below[:, :3] * (below[:, 3] * (1 - alpha))[:, None]
    out[:, :3] = sums / np.maximum(out[:, 3:], 1e-30)
    return out


def code_distance(texture, texels: np.ndarray, values: np.ndarray) -> int:
    """Largest difference of 8-bit numbers between texels and those of values, where seen."""
    wanted = texture.channels["base"].encoded(values.astype(np.float32))
    a, b = (t.view(np.uint8).reshape(-1, 4).astype(int) for t in (texels, wanted))
    apart = np.abs(a - b)
    apart[:, :3][a[:, 3] == 0] = 0  # nobody sees the colour of what is not there
    return int(apart.max())
