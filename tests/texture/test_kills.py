"""meshsdf.texture.journal: what was acknowledged survives the death of the process."""

from tests.texture.kills import kill


def test_nothing_acknowledged_is_lost_or_doubled_when_writers_are_killed(tmp_path):
    n_operations = kill(tmp_path, 25)
    assert n_operations > 25  # writers did get to work
