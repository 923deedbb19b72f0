"""meshsdf.kernels.distance_integrals and tangent_distance: no sample contradicts them."""

import numpy as np
import pytest

from meshsdf.kernels.distance_integrals import (
    LOWER,
    UPPER,
    add_shares,
    finish_shares,
    positive_moments,
    share_below,
)
from meshsdf.kernels.tangent_distance import tangent_bounds
from meshsdf.mesh.primitives import box_mesh, icosphere
from meshsdf.spatial import ClosestPoint

N = 40_000
WEIGHTS = np.random.default_rng(0).dirichlet(np.ones(3), N)
CORNERS = [
    (1.0, 2.0, 3.0),
    (-1.0, 2.0, 3.0),
    (-1.0, -2.0, 3.0),
    (0.0, 0.0, 1.0),
    (0.0, -1.0, 1.0),
    (2.0, 2.0, 2.0),
    (-3.0, -1.0, 0.0),
]


@pytest.mark.parametrize("values", [v for c in CORNERS for v in (c, c[::-1], (c[1], c[2], c[0]))])
def test_moments_of_the_positive_part_are_those_of_samples(values):
    samples = np.maximum(WEIGHTS @ np.array(values), 0.0)
    mean, square = positive_moments(*values)
    error = 5 / np.sqrt(N)
    assert mean == pytest.approx(samples.mean(), abs=error * samples.std() + 1e-12)
    assert square == pytest.approx((samples**2).mean(), abs=error * (samples**2).std() + 1e-12)


@pytest.mark.parametrize("values", CORNERS)
def test_shares_below_thresholds_are_those_of_samples_and_add_up(values):
    samples = WEIGHTS @ np.array(values)
    thresholds = np.linspace(-3.5, 3.5, 29) + 1e-3
    seen = (samples[:, None] <= thresholds).mean(axis=0)
    found = [share_below(*values, t) for t in thresholds]
    np.testing.assert_allclose(found, seen, atol=2.5 / np.sqrt(N))
    below = np.zeros((4, len(thresholds)))
    for row in (LOWER, UPPER):
        add_shares(*values, 2.0, thresholds, 0.0, row, below)
    for row in finish_shares(below):
        np.testing.assert_allclose(row, 2 * np.array(found), atol=1e-12)


@pytest.mark.parametrize("body", [box_mesh(), icosphere(subdivisions=2)])
@pytest.mark.parametrize("size", [0.01, 0.1, 1.0])
def test_no_sample_is_outside_the_two_linear_functions(body, size):
    rng, k = np.random.default_rng(1), 200
    closest = ClosestPoint(body)
    places = rng.uniform(-1.5, 1.5, (k, 1, 3))
    pieces = places + size * rng.normal(size=(k, 3, 3))
    four = np.concatenate([pieces, pieces.mean(axis=1, keepdims=True)], axis=1)
    slots = closest.search(four.reshape(-1, 3), np.empty(0, np.int32))[1].reshape(k, 4)
    lower, upper = np.empty((k, 3)), np.empty((k, 3))
    tangent_bounds(
        *(pieces, slots, 0, k, closest.frames, closest.corners, closest.face_of_slot),
        *(*closest.tree, lower, upper),
    )
    weights = np.vstack([np.eye(3), rng.dirichlet(np.ones(3), 50)])
    points = np.einsum("wc,kcx->kwx", weights, pieces).reshape(-1, 3)
    distances = closest.distances(points + closest.center).distance.reshape(k, -1)
    assert (lower @ weights.T <= distances + 1e-12).all()
    assert (upper @ weights.T >= distances - 1e-12).all()
    if size == 0.01:
        # Second order in the size against the distance
        far = distances.min(axis=1) > 0.2
        assert (upper - lower)[far].max() < 0.05
