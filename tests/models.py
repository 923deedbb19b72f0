"""Real meshes made by others, in the folder that MESHSDF_MODELS names."""

import os
from pathlib import Path

import pytest

FOLDER = os.environ.get("MESHSDF_MODELS")
needs_models = pytest.mark.skipif(not FOLDER, reason="MESHSDF_MODELS names no folder of meshes")
MESH_SUFFIXES = {".obj", ".stl", ".off", ".glb", ".gltf", ".ply"}


def model(name: str) -> Path:
    """Path of one model."""
    return Path(FOLDER) / name


def all_models() -> list[str]:
    """Names of all models with faces; none without the folder."""
    if not FOLDER:
        return []
    names = sorted(path.name for path in Path(FOLDER).iterdir())
    return [n for n in names if Path(n).suffix.lower() in MESH_SUFFIXES and "empty" not in n]
