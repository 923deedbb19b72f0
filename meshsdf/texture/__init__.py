"""Colour in space: textures that are kept where the surface is, and need no UVs."""
