"""mesh -> distance: bands and dense grids."""
