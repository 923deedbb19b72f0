"""Texture coordinates by xatlas (extra ``unwrap``), in a process of its own with a time limit.

Some meshes keep it busy for hours; a process can be stopped.
"""

import importlib.util
import io
import subprocess
import sys
from dataclasses import replace

import numpy as np

from ..errors import TextureError
from ..mesh import Mesh

WHERE = "unwrapping with xatlas"


def unwrap(mesh: Mesh, size: int, time_limit: float) -> Mesh:
    """The mesh with coordinates for a picture of about ``size`` texels a side.

    Vertices are doubled along seams.

    Raises
    ------
    TextureError
        xatlas is not installed, takes longer than ``time_limit`` seconds, or fails.
    """
    if importlib.util.find_spec("xatlas") is None:
        fix = "pip install '.[unwrap]' in meshsdf's folder, or lay out in squares"
        raise TextureError("xatlas is not installed", WHERE, fix)
    given = io.BytesIO()
    np.savez(given, vertices=mesh.vertices, faces=mesh.faces, size=size)
    command = [sys.executable, "-m", __name__]
    try:
        done = subprocess.run(
            command, input=given.getvalue(), capture_output=True, timeout=time_limit, check=False
        )
    except subprocess.TimeoutExpired:
        what = f"xatlas was not done in {time_limit:g} seconds"
        raise TextureError(what, WHERE, 'allow more time, or use method="squares"') from None
    if done.returncode != 0:
        words = done.stderr.decode(errors="replace").strip().splitlines()
        what = f"xatlas failed: {words[-1] if words else f'exit {done.returncode}'}"
        raise TextureError(what, WHERE, 'use method="squares"')
    with np.load(io.BytesIO(done.stdout)) as found:
        source, faces, uv = found["source"], found["faces"], found["uv"]
    colors = None if mesh.vertex_colors is None else mesh.vertex_colors[source]
    return replace(
        mesh,
        vertices=np.array(mesh.vertices[source]),
        faces=faces.astype(np.int32),
        uv=uv.astype(np.float64),
        vertex_colors=colors,
    )


def _serve() -> None:
    """Read a mesh from stdin, write its coordinates to stdout."""
    import xatlas

    with np.load(io.BytesIO(sys.stdin.buffer.read())) as given:
        vertices, faces, size = given["vertices"], given["faces"], int(given["size"])
    center = vertices.mean(axis=0)
    scale = float(np.abs(vertices - center).max()) or 1.0
    atlas = xatlas.Atlas()
    atlas.add_mesh(((vertices - center) / scale).astype(np.float32), faces.astype(np.uint32))
    options = xatlas.PackOptions()
    options.padding, options.resolution, options.bilinear = 3, size, True
    atlas.generate(xatlas.ChartOptions(), options)
    source, index, uv = atlas[0]
    out = io.BytesIO()
    np.savez(out, source=source, faces=index, uv=uv)
    sys.stdout.buffer.write(out.getvalue())


if __name__ == "__main__":
    _serve()
