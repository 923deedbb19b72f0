"""Colour in space: textures that are kept where the surface is, and need no UVs."""

from ..spatial.image import Image
from .atlas import atlas_colors, atlas_for, textured, vertex_colored
from .brush import Brush, Stencil
from .displace import displaced_band
from .journal import Project
from .layer import Layer
from .layers import flatten, merge_down
from .live import LiveStrokes
from .mesh_source import MeshSource
from .mip import bake, update_mips
from .octree import Octree
from .operations import Operation
from .procedural import PROCEDURALS, parameters_of, procedural
from .procedural_layer import add_procedural
from .refine import coarsen, refine, refine_to
from .stroke import Stroke, paint, replay
from .stroke_record import StrokeRecord
from .symmetry import Symmetry
from .transfer import Transferred, transfer
from .volume_texture import VolumeTexture
from .watch import Watch

__all__ = [
    "PROCEDURALS",
    "Brush",
    "Image",
    "Layer",
    "LiveStrokes",
    "MeshSource",
    "Octree",
    "Operation",
    "Project",
    "Stencil",
    "Stroke",
    "StrokeRecord",
    "Symmetry",
    "Transferred",
    "VolumeTexture",
    "Watch",
    "add_procedural",
    "atlas_colors",
    "atlas_for",
    "bake",
    "coarsen",
    "displaced_band",
    "flatten",
    "merge_down",
    "paint",
    "parameters_of",
    "procedural",
    "refine",
    "refine_to",
    "replay",
    "textured",
    "transfer",
    "update_mips",
    "vertex_colored",
]
