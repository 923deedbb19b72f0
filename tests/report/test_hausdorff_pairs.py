"""meshsdf.report.hausdorff: random pairs of meshes beside libigl's distances.

`python -m tests.benchmarks.hausdorff --enclosures` does the same with 200 pairs and 10**6 samples.
"""

import numpy as np
import pytest

from meshsdf.report.hausdorff import hausdorff

from .mesh_pairs import PLACES, hold, mesh_pair, placed, samples_of

N_SAMPLES = 20_000
SEEDS = range(0, 96, 4)  # each maker is met, on both sides


@pytest.mark.parametrize("seed", SEEDS)
def test_no_sample_is_beyond_the_upper_end_and_the_witness_reaches_the_lower(seed):
    a, b = mesh_pair(seed)
    place = PLACES[(seed // 4) % len(PLACES)]
    found = hausdorff(placed(a, *place), placed(b, *place), means=False)
    rng = np.random.default_rng(seed)
    for side, source, target in ((found.forward, a, b), (found.backward, b, a)):
        held = hold(side, source, target, place, samples_of(source, N_SAMPLES, rng))
        assert held.is_true, held
        assert side.is_within_tolerance
