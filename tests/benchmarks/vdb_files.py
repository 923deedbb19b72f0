"""Run as a process of its own: a band to a ``.vdb`` file and back, timed around the calls.

Usage: vdb_files.py active|blosc|openvdb FOLDER; the folder holds band.npz and band.vdb; prints one
JSON object. Ours run once before the clock starts, which loads kernels and modules.
"""

import json
import os
import sys
import time

from peak import peak_bytes


def resident_bytes() -> int:
    """What this process holds now."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def measured(write, read, n_bytes, out):
    """Seconds of both, and how much memory writing adds to a band of so many bytes."""
    before = resident_bytes()
    with open("/proc/self/clear_refs", "w") as file:  # the peak begins anew
        file.write("5")
    begin = time.perf_counter()
    write()
    middle = time.perf_counter()
    added = peak_bytes() - before
    start = time.perf_counter()
    n_active = read()
    return {
        "write": middle - begin,
        "read": time.perf_counter() - start,
        "n_active": n_active,
        "bytes": os.path.getsize(out),
        "memory": 1 + added / n_bytes,
    }


def ours(folder, compression):
    """Write and read with meshsdf."""
    from meshsdf.io.npz import read_npz
    from meshsdf.io.vdb import read_vdb, write_vdb
    from meshsdf.mesh.primitives import box_mesh
    from meshsdf.sdf import mesh_to_band

    out = f"{folder}/{compression}.vdb"
    write_vdb(out, mesh_to_band(box_mesh(), resolution=16), compression=compression, force=True)
    read_vdb(out)
    band = read_npz(f"{folder}/band.npz")
    size = band.values.nbytes + band.active.nbytes + band.index.pages.nbytes
    return measured(
        lambda: write_vdb(out, band, compression=compression, force=True),
        lambda: read_vdb(out).n_active,
        size,
        out,
    )


def theirs(folder):
    """Write and read with OpenVDB."""
    import pyopenvdb as vdb

    grids, _ = vdb.readAll(f"{folder}/band.vdb")
    out = f"{folder}/theirs.vdb"
    return measured(
        lambda: vdb.write(out, grids=grids),
        lambda: vdb.readAll(out)[0][0].activeVoxelCount(),
        grids[0].memUsage(),
        out,
    )


def main(way, folder):
    print(json.dumps(theirs(folder) if way == "openvdb" else ours(folder, way)))


main(*sys.argv[1:])
