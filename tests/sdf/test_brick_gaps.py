"""Gaps between bricks against scipy's labelling of the dense array of missing bricks."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from meshsdf.sdf.brick_gaps import BrickGaps


@given(st.integers(0, 10**6), st.integers(2, 9), st.floats(0.2, 0.97))
def test_regions_are_those_of_the_dense_array(seed, n, share):
    rng = np.random.default_rng(seed)
    stored = rng.random((n, n + 1, n + 2)) < share
    stored[0, 0, 0] = True
    bricks = np.argwhere(stored) - 3
    gaps = BrickGaps.between(bricks)
    regions, _ = ndimage.label(np.pad(~stored, 1, constant_values=True))
    regions = regions[1:-1, 1:-1, 1:-1]
    outer = ndimage.label(np.pad(~stored, 1, constant_values=True))[0][0, 0, 0]
    pairs, covered = set(), np.zeros_like(stored)
    for (x, y, z0, z1), region in zip((gaps.runs + 3).tolist(), gaps.region, strict=True):
        assert not stored[x, y, z0:z1].any()
        assert stored[x, y, z0 - 1]
        assert stored[x, y, z1]
        covered[x, y, z0:z1] = True
        found = set(regions[x, y, z0:z1].tolist())
        assert len(found) == 1
        assert (found == {outer}) == (region < 0)
        if region >= 0:
            pairs.add((int(region), found.pop()))
    assert covered[~stored & (regions != outer)].all()
    inner = set(np.unique(regions[~stored]).tolist()) - {outer}
    assert len(pairs) == len(inner) == len({a for a, _ in pairs}) == len({b for _, b in pairs})
    assert len(gaps.first_bricks()) == len(inner)
