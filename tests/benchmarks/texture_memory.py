"""How many bytes does a painted texture take, beside a dense grid, and where do they go?

python -m tests.benchmarks.texture_memory [RESOLUTION ...]

A ball in its box, one layer, every brick of every level random colours of 8 bits, so that nothing
is a tile. "packed" is what the same texels take side by side, as files and the history keep them
before they are compressed.
"""

import sys

import numpy as np

from meshsdf.mesh import icosphere
from meshsdf.texture.volume_texture import VolumeTexture

from .alternate import machine

MB = 1e6
AT_ONCE = 4096  # bricks


def painted(resolution: int) -> VolumeTexture:
    """A ball whose texels all differ."""
    texture = VolumeTexture.around(icosphere(subdivisions=6), resolution=resolution)
    layer, dice = texture.add_layer(), np.random.default_rng(0)
    slots = texture.writable(layer, np.arange(texture.octree.n_entries, dtype=np.int32))
    for begin in range(0, len(slots), AT_ONCE):
        part = slots[begin : begin + AT_ONCE]
        texture.pool.arrays["base"][part] = dice.integers(0, 2**32, (len(part), 512), np.uint32)
    return texture


def main(resolutions: list[str]) -> None:
    """Print a table of bytes."""
    print(machine())
    for resolution in map(int, resolutions):
        texture = painted(resolution)
        octree, tables, pool = texture.octree, texture.octree.tables, texture.pool
        dense, n, finest = 4 * resolution**3, octree.n_entries, int(octree.level_first[1])
        assert pool.n_bytes == 2048 * n
        parts = {"bricks": pool.n_bytes, "slots": texture.layers[0].slots.nbytes}
        parts["pool"] = pool.holders.nbytes + pool.born.nbytes + 4 * len(pool.holders)
        parts |= {
            f"tables.{name}": array.nbytes
            for name, array in tables._asdict().items()
            if isinstance(array, np.ndarray)
        }
        print(
            f"{resolution}: {n} bricks, {finest} of them finest, {len(tables.texel_normals)} texels"
        )
        for name, n_bytes in sorted(parts.items(), key=lambda item: -item[1]):
            print(f"    {name:22} {n_bytes / MB:8.2f} MB {n_bytes / n:8.1f} a brick")
        whole, texels = sum(parts.values()), 4 * len(tables.texel_normals)
        print(f"    all                    {whole / MB:8.2f} MB {whole / n:8.1f} a brick")
        print(f"    packed                 {texels / MB:8.2f} MB {texels / n:8.1f} a brick")
        fine, every = dense / finest / 2048, dense / whole
        print(f"    a dense grid           {dense / MB:8.0f} MB")
        print(f"    finest bricks 1/{fine:.1f} of it, all levels and tables 1/{every:.1f}")


if __name__ == "__main__":
    main(sys.argv[1:] or ["1024"])
