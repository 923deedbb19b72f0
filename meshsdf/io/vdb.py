"""OpenVDB's ``.vdb`` files, read and written without OpenVDB.

A file holds grids, each with a name, a class, a transform and a sparse tree of values. How it is
laid out stands where it is done:

- `vdb_archive`: the file and its headers · `vdb_stream`: numbers and texts
- `vdb_metadata`: named values · `vdb_transform`: from index to world
- `vdb_tree_writer`, `vdb_tree_reader`: which nodes there are · `vdb_leaves`: their values
- `vdb_values`: the values of a node, and their layout · `vdb_encode`, `vdb_decode`: into bytes, and
  back · `blosc`: one way to pack them
- `vdb_grid`: a grid in memory · `vdb_band`, `vdb_dense`: what it means as a band or a full grid

A brick of a band is a leaf as it stands, node (i, j, k) is voxel (i, j, k), so a band goes out and
comes in bit by bit. The masks of a tree are never packed: a file of n bytes cannot give more than
some 20 n bytes of floats, 60 n of vectors, whatever is packed within.
"""

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ..errors import IoError
from ..grid import Grid, NarrowBand
from .atomic import atomic_write, check_output
from .half import check_half
from .opened import opened_reader
from .vdb_archive import read_grid, read_headers, write_archive
from .vdb_band import band_to_grids, grid_to_band, with_companions
from .vdb_choice import file_facts, is_band, named_grid, omitted, owner_of, volume_grid
from .vdb_dense import GridClass, dense_to_grid, grid_to_dense
from .vdb_foreign import CREATOR, VdbMetadata, foreign_entries
from .vdb_grid import VdbGrid, check_grid
from .vdb_metadata import Metadata, check_metadata
from .vdb_values import ACTIVE_MASK, BLOSC, ZIP
from .volume_checks import check_volume
from .warn import Warn, ignore

Compression = Literal["none", "active", "zip", "blosc"]

_FLAGS = {"none": 0, "active": ACTIVE_MASK, "zip": ACTIVE_MASK | ZIP, "blosc": ACTIVE_MASK | BLOSC}


def write_vdb(
    path: str | os.PathLike,
    volume: NarrowBand | Grid,
    *,
    half: bool = False,
    force: bool = False,
    compression: Compression = "active",
    name: str | None = None,
    grid_class: GridClass = "level set",
    metadata: VdbMetadata | None = None,
) -> None:
    """Write a band or a full grid as the grid that other programs expect.

    A band reads back bit-equal, unless ``half``; with its closest faces and doubtful nodes, which
    become grids of their own. A full grid reads back bit-equal if it is float32.

    Parameters
    ----------
    path : path
        The ``.vdb`` file.
    volume : NarrowBand or Grid
        What is written. Unsigned distances get the class "unknown", as OpenVDB's own do.
    half : bool
        Round values to float16; see `write_npz`.
    force : bool
        Replace an existing file.
    compression : "none", "active", "zip" or "blosc"
        "none" stores every voxel of a leaf, "active" those in the band, "zip" and "blosc" pack
        these. Exact distances hardly pack, so "active" costs a few percent of size and no time.
    name : str
        Of the grid; "surface" if not given, "density" for fog.
    grid_class : "level set" or "fog volume"
        What a full grid is; a band is always a level set.
    metadata : VdbMetadata
        What the file and the grid say besides, as `read_vdb_metadata` gives it.

    Raises
    ------
    IoError
        The file exists, its folder cannot be written, the disk is full, or the volume cannot be
        said in this format.
    """
    where = f"output {path}"
    beyond = metadata or VdbMetadata()
    check_output(path, force)
    try:
        check_volume(volume)
        if half:
            check_half(volume.values, where)
        if isinstance(volume, NarrowBand):
            if volume.hermite is not None:
                raise ValueError("crossings and normals have no place in .vdb; write .npz, too")
            if grid_class != "level set":
                raise ValueError("a narrow band is a level set; convert it to a full grid of fog")
            grids = band_to_grids(volume, name or "surface", is_half=half)
        else:
            name = name or ("density" if grid_class == "fog volume" else "surface")
            grids = [dense_to_grid(volume, name, grid_class, is_half=half)]
    except ValueError as error:
        raise _unwritable(error, where) from error
    grids[0] = replace(grids[0], metadata=beyond.grid | grids[0].metadata)
    options = {"force": force, "compression": compression, "metadata": beyond.file}
    write_vdb_grids(path, grids, **options)


def write_vdb_grids(
    path: str | os.PathLike,
    grids: Sequence[VdbGrid],
    *,
    force: bool = False,
    compression: Compression = "active",
    metadata: Metadata | None = None,
) -> None:
    """Write any number of grids to one file; the same grids give the same bytes.

    Parameters
    ----------
    path : path
        The ``.vdb`` file.
    grids : sequence of VdbGrid
        In the order in which other programs list them.
    force : bool
        Replace an existing file.
    compression : "none", "active", "zip" or "blosc"
        As for `write_vdb`.
    metadata : dict
        What the file says of itself.

    Raises
    ------
    IoError
        As `write_vdb`.

    Notes
    -----
    Memory: at most some 40 MB beyond the grids, however large they are.

    Examples
    --------
    A level set and colours in its bricks:

    >>> import tempfile
    >>> from meshsdf import mesh_to_band
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> path = tempfile.mkdtemp() + "/box.vdb"
    >>> write_vdb(path, mesh_to_band(box_mesh(), voxel_size=0.1))
    >>> (surface,) = read_vdb_grids(path)
    >>> black = np.zeros(3, np.float32)
    >>> colours = np.full((*surface.values.shape, 3), 0.5, np.float32)
    >>> tint = replace(surface, name="Cd", values=colours, background=black, grid_class="unknown")
    >>> write_vdb_grids(path, [surface, tint], force=True)
    >>> [(grid["name"], grid["type"]) for grid in probe_vdb(path)["grids"]]
    [('surface', 'float'), ('Cd', 'vec3s')]
    """
    where = f"output {path}"
    check_output(path, force)
    metadata = {"creator": CREATOR} | (metadata or {})
    try:
        check_metadata(metadata)
        for grid in grids:
            check_grid(grid)
    except ValueError as error:
        raise _unwritable(error, where) from error
    for grid in grids:
        if grid.is_half and isinstance(grid.values, np.ndarray):
            check_half(grid.values, where)
    with atomic_write(path, force) as temporary, open(temporary, "wb") as file:
        write_archive(file, list(grids), metadata, _FLAGS[compression])


def read_vdb(
    path: str | os.PathLike, *, grid: str | None = None, warn: Warn = ignore
) -> NarrowBand | Grid:
    """Read one grid: a level set as a band, anything else as a full grid.

    Parameters
    ----------
    path : path
        The ``.vdb`` file.
    grid : str or None
        Which grid. None takes the first level set of floats, or the first grid of floats if there
        is no level set.
    warn : callable
        Told what was left out.

    Raises
    ------
    IoError
        There is no such file or grid, it is damaged, holds no numbers, or does not suit a volume:
        voxels that are no cubes, a sparse grid whose box is far larger than the file.

    Notes
    -----
    A level set that another program made counts as ``winding``: inside is where it is negative.
    """
    where = f"file {path}"
    notes: list[str] = []
    with opened_reader(path) as reader:
        header = read_headers(reader)
        chosen = volume_grid(header, grid, where)
        if grid is None:
            notes += omitted(header, chosen)
        found = read_grid(reader, chosen)
        if is_band(chosen):
            beside = [g for g in header.grids if owner_of(g) == chosen.name and not g.problem]
            volume = grid_to_band(found, notes.append)
            volume = with_companions(volume, [read_grid(reader, g) for g in beside], notes.append)
        else:
            volume = grid_to_dense(found, reader.size)
        check_volume(volume)
    for note in notes:
        warn(note)
    return volume


def read_vdb_metadata(path: str | os.PathLike, *, grid: str | None = None) -> VdbMetadata:
    """Return what a file says beyond the volume that `read_vdb` reads; IoError as there.

    Examples
    --------
    >>> import tempfile
    >>> from meshsdf import mesh_to_band
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> path = tempfile.mkdtemp() + "/box.vdb"
    >>> words = VdbMetadata(file={"shot": "a10"}, grid={"frame": 7})
    >>> write_vdb(path, mesh_to_band(box_mesh(), voxel_size=0.1), metadata=words)
    >>> read_vdb_metadata(path)
    VdbMetadata(file={'shot': 'a10'}, grid={'frame': 7})
    """
    with opened_reader(path) as reader:
        header = read_headers(reader)
        return foreign_entries(header, volume_grid(header, grid, f"file {path}"))


def read_vdb_grids(
    path: str | os.PathLike, names: Sequence[str] | None = None, *, warn: Warn = ignore
) -> list[VdbGrid]:
    """Read grids as they are: vectors, any affine transform, any class.

    Parameters
    ----------
    path : path
        The ``.vdb`` file.
    names : sequence of str
        Which, and in which order; None for all that can be read.
    warn : callable
        Told which grids are of unknown types and left out.

    Raises
    ------
    IoError
        There is no such file or grid, or it is damaged.
    """
    notes: list[str] = []
    with opened_reader(path) as reader:
        header = read_headers(reader)
        if names is None:
            notes = omitted(header, None)
            wanted = [grid for grid in header.grids if not grid.problem]
        else:
            wanted = [named_grid(header, name, f"file {path}") for name in names]
        # Grids that share a tree in the file share it in memory
        trees = {grid.tree_at: grid for grid in wanted}
        trees = {at: read_grid(reader, grid) for at, grid in trees.items()}
    for note in notes:
        warn(note)
    return [
        replace(
            trees[grid.tree_at],
            name=grid.name,
            matrix=grid.matrix,
            grid_class=grid.grid_class,
            metadata=grid.metadata,
        )
        for grid in wanted
    ]


def probe_vdb(path: str | os.PathLike) -> dict:
    """Return what the headers say; values are not read.

    ``kind`` is "vdb"; ``grids`` lists every grid with ``name``, ``type``, ``class``,
    ``voxel_size``, ``translation``, ``background``, ``dtype``, ``compression``, and where the file
    tells them ``active_voxels``, ``first_node`` and ``last_node``; ``problem`` says why a grid
    cannot be read. ``default_grid`` is the one that `read_vdb` takes. ``metadata``, of the file and
    of a grid, is what stands there besides, if anything does.
    """
    with opened_reader(path) as reader:
        return file_facts(read_headers(reader))


def _unwritable(error: ValueError, where: str) -> IoError:
    return IoError(f"the volume cannot be written: {error}", where, "build it anew")
