"""What EXACT and BOUND mean, as tests that any shape can be put to."""

import numpy as np

ROUNDING = 1e-12  # of coordinates below 10, through a few roots


def random_points(n=3000, size=4.0, seed=1):
    return np.random.default_rng(seed).uniform(-size, size, (n, 3))


def assert_one_lipschitz(shape, points):
    """Values change by no more than one moves, over short ways and long ones."""
    values = shape(points)
    for other in (np.roll(points, 1, axis=0), points + 0.01 * np.roll(points, 1, axis=0)):
        moved = np.linalg.norm(points - other, axis=1)
        assert (np.abs(values - shape(other)) <= moved + ROUNDING).all()


def assert_exact(shape, points):
    """The distance is no less, because values are 1-Lipschitz, and no more, because a point of the
    surface lies so far down the gradient."""
    assert_one_lipschitz(shape, points)
    slope = shape.gradient(points)
    np.testing.assert_allclose(np.linalg.norm(slope, axis=1), 1, atol=ROUNDING)
    feet = points - shape(points)[:, None] * slope
    np.testing.assert_allclose(shape(feet), 0, atol=10 * ROUNDING)


def assert_gradient(shape, points):
    """Gradients are those of the values, wherever these have no kink nearby."""
    step = 1e-5
    offset = step * np.eye(3)
    ends = [shape((points[:, None] + s * offset).reshape(-1, 3)).reshape(-1, 3) for s in (1, -1)]
    middle = shape(points)[:, None]
    is_smooth = (np.abs(ends[0] + ends[1] - 2 * middle) < 1e-8).all(axis=1)
    assert is_smooth.mean() > 0.9
    difference = (ends[0] - ends[1]) / (2 * step) - shape.gradient(points)
    assert np.abs(difference[is_smooth]).max() < 1e-6
