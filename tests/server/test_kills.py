"""The painting server is killed while a client paints; see `tests.benchmarks.kills`, too."""

import pytest

pytest.importorskip("starlette", reason="the extra paint is not installed")

from . import kills


def test_nothing_acknowledged_is_lost_and_nothing_is_done_twice(tmp_path):
    assert kills.kill(tmp_path, 8, seed=3) > 0
