"""Small mesh files, sound and broken."""

import base64
import json
import re
from pathlib import Path

import numpy as np

from meshsdf.io import write_mesh
from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import box_mesh, icosphere

MESH_SUFFIXES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")
EMBEDDED = r'<script type="application/json" id="meshsdf-report">(.*?)</script>'


def ball(path: Path, *, radius: float = 1.0, subdivisions: int = 2) -> Path:
    """A sphere of 320 faces in a file."""
    write_mesh(path, icosphere(radius, subdivisions=subdivisions))
    return path


def box_without_lid(path: Path) -> Path:
    """A box that lacks the two triangles of one side: a hole of 4 edges, 4 units long."""
    box = box_mesh()
    keep = box.triangles[:, :, 2].min(axis=1) < 0.5
    write_mesh(path, Mesh(box.vertices, box.faces[keep]))
    return path


def gltf(path: Path) -> Path:
    """The box as glTF with its numbers inside the text."""
    box = box_mesh()
    positions = box.vertices.astype("<f4").tobytes()
    indices = box.faces.astype("<u4").tobytes()
    data = base64.b64encode(positions + indices).decode()
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": len(positions)},
        {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices)},
    ]
    corners = {"min": [-0.5] * 3, "max": [0.5] * 3}
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"} | corners,
        {"bufferView": 1, "componentType": 5125, "count": 36, "type": "SCALAR"},
    ]
    document = {
        "asset": {"version": "2.0"},
        "buffers": [
            {
                "byteLength": len(positions) + len(indices),
                "uri": f"data:application/octet-stream;base64,{data}",
            }
        ],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    path.write_text(json.dumps(document))
    return path


def any_format(folder: Path, suffix: str) -> Path:
    """A sound mesh in the format of the suffix."""
    path = folder / f"sound{suffix}"
    return gltf(path) if suffix == ".gltf" else ball(path, subdivisions=1)


def random_bytes(path: Path, seed: int) -> Path:
    """A file of noise."""
    path.write_bytes(np.random.default_rng(seed).bytes(2000))
    return path


def embedded(path: Path) -> dict:
    """The JSON that the page of a report holds."""
    return json.loads(re.search(EMBEDDED, path.read_text("utf-8"), flags=re.DOTALL)[1])
