"""The words in which a report tells what became of the colours."""

COLOR_WORDS = (  # the number of points stands between them
    "The mesh's colours were kept in a texture in space, one texel per voxel, and looked up at ",
    " points of the surface that came back. ΔE is the distance of two colours in CIELAB (CIE76): "
    "about 2.3 is just seen, 100 is black to white.",
)

COLOR_KINDS = (
    ("sharp", "the mesh", "the colour at the mesh's closest point, so all that was lost counts"),
    (
        "filtered",
        "the mesh, averaged",
        "its colours averaged over a voxel there, so the blur that texels of that size cannot "
        "avoid does not count",
    ),
)

COLOR_MEASURES = (
    ("mean", "mean"),
    ("percentile_95", "95 % below"),
    ("largest", "largest seen"),
)
