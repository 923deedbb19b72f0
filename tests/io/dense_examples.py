"""Grids for the formats that hold full grids, and the ways there are to write them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.special import erfc

from meshsdf.grid import Grid
from meshsdf.io.dds import probe_dds, read_dds, write_dds
from meshsdf.io.metaimage import probe_metaimage, read_metaimage, write_metaimage
from meshsdf.io.nrrd import probe_nrrd, read_nrrd, write_nrrd
from meshsdf.io.raw import probe_raw, read_raw, write_raw
from meshsdf.io.sdfgen import probe_sdfgen, read_sdfgen, write_sdfgen
from meshsdf.io.vf import probe_vf, read_vf, write_vf
from meshsdf.io.vti import probe_vti, read_vti, write_vti

CENTER, RADIUS, STEP = np.array([1.37, -2.21, 0.83]), 0.61, 0.1
"""A sphere that lies evenly to no node."""

ORIGIN = CENTER - np.array([1.31, 1.28, 1.35])


@dataclass(frozen=True)
class Way:
    """A format, and options of its writer."""

    suffix: str
    write: Callable
    read: Callable
    probe: Callable
    options: dict = field(default_factory=dict)
    beside: str = ""  # suffix of the second file


_NRRD = (write_nrrd, read_nrrd, probe_nrrd)
_META = (write_metaimage, read_metaimage, probe_metaimage)
_VTI = (write_vti, read_vti, probe_vti)

WAYS = {
    "nrrd": Way(".nrrd", *_NRRD),
    "nrrd plain": Way(".nrrd", *_NRRD, {"encoding": "raw"}),
    "nhdr": Way(".nhdr", *_NRRD, {}, ".raw.gz"),
    "nhdr plain": Way(".nhdr", *_NRRD, {"encoding": "raw"}, ".raw"),
    "mha": Way(".mha", *_META),
    "mha plain": Way(".mha", *_META, {"compressed": False}),
    "mhd": Way(".mhd", *_META, {}, ".zraw"),
    "mhd plain": Way(".mhd", *_META, {"compressed": False}, ".raw"),
    "vti": Way(".vti", *_VTI),
    "vti plain": Way(".vti", *_VTI, {"compressed": False}),
    "raw": Way(".raw", write_raw, read_raw, probe_raw, {}, ".raw.json"),
    "dds": Way(".dds", write_dds, read_dds, probe_dds, {}, ".dds.json"),
    "vf": Way(".vf", write_vf, read_vf, probe_vf),
    "sdf": Way(".sdf", write_sdfgen, read_sdfgen, probe_sdfgen),
}

WORDY = sorted(WAYS.keys() - {"vf", "sdf"})
"""Ways that keep all a grid says."""

DOUBLE = sorted(set(WORDY) - {"dds"})
"""Ways that keep float64."""


def sphere_grid() -> Grid:
    """Distances to the sphere on 27 x 26 x 28 nodes, five voxels and more beyond it."""
    i, j, k = np.indices((27, 26, 28))
    points = ORIGIN + STEP * np.stack([i, j, k], axis=-1)
    distances = np.linalg.norm(points - CENTER, axis=-1) - RADIUS
    return Grid(distances.astype(np.float32), STEP, ORIGIN)


def center_of_inside(values: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Centre of mass of the inside, from values (...,) at positions (..., 3).

    Inside fades out like erfc over a voxel. Its spectrum at the lattice's own frequency is
    exp(-2 pi^2) of the whole, 3e-9, so the sum over nodes is the integral to that, and what is
    missing beyond the grid, five voxels off, weighs erfc(5 / sqrt 2) / 2 = 3e-7 of a node.
    """
    weights = erfc(values.astype(float) / STEP / np.sqrt(2)) / 2
    total = np.tensordot(weights, positions, axes=(range(values.ndim), range(values.ndim)))
    return total / weights.sum()


def assert_centered(values: np.ndarray, positions: np.ndarray) -> None:
    """The inside lies where the sphere does, to 1e-4 voxel."""
    np.testing.assert_allclose(
        center_of_inside(values, positions), CENTER, rtol=0, atol=1e-4 * STEP
    )


def assert_same_grid(a: Grid, b: Grid) -> None:
    """Every fact is equal, every value bit by bit."""
    assert (a.values.dtype, a.values.shape) == (b.values.dtype, b.values.shape)
    assert a.values.flags.c_contiguous
    assert a.values.tobytes() == b.values.tobytes()
    assert a.origin.tobytes() == b.origin.tobytes()
    for name in ("voxel_size", "sign", "uncertain_voxels", "n_inner_faces", "half_width"):
        assert getattr(a, name) == getattr(b, name), name


def written(way: Way, folder: Path, grid: Grid, name: str = "a") -> Path:
    """The file, written anew."""
    path = folder / f"{name}{way.suffix}"
    way.write(path, grid, force=True, **way.options)
    return path


def small_grid() -> Grid:
    """A few random values, and all that a grid can say."""
    random = np.random.default_rng(0)
    values = random.normal(size=(4, 5, 6)).astype(np.float32)
    return Grid(values, 0.5, np.array([1.0, 2.0, 3.0]), "parity", 3, 0, 2.5)


def files_of(key: str, folder: Path) -> tuple[Way, Path, list[Path]]:
    """The way, and the files of a small grid; first that which is read."""
    path = written(WAYS[key], folder, small_grid())
    return WAYS[key], path, [path, *sorted(set(folder.iterdir()) - {path})]
