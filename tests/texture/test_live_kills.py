"""meshsdf.texture.live: what was acknowledged survives the death of the process."""

import numpy as np

from meshsdf.texture.journal import Project
from tests.texture.kills import Worker
from tests.texture.live_twin import (
    copied,
    operations_of,
    pending_of,
    replayed,
    samples_of,
)
from tests.texture.live_worker import create, message_of


def strokes_after(seed, n):
    """(client, samples) of the strokes of n messages, those that are not ended last."""
    ended, open_ones = [], {}
    for number in range(1, n + 1):
        client, kind, samples = message_of(seed, number)
        if kind == "begin":
            open_ones[client] = np.empty((0, 7))
        elif kind == "add" and client in open_ones:
            open_ones[client] = np.concatenate([open_ones[client], np.column_stack(samples)])
        elif kind == "end" and client in open_ones:
            ended.append((client, open_ones.pop(client)))
        elif kind == "cancel":
            open_ones.pop(client, None)
    return ended + list(open_ones.items())


def same_strokes(found, expected):
    return len(found) == len(expected) and all(
        a == c and np.array_equal(b, d) for (a, b), (c, d) in zip(found, expected, strict=True)
    )


def test_no_acknowledged_sample_is_lost_or_doubled_when_painters_are_killed(tmp_path):
    path, acknowledged = tmp_path / "a.mtex", tmp_path / "acknowledged"
    create(path)
    acknowledged.write_text("")
    dice, n_open = np.random.default_rng(0), 0
    with Worker("tests.texture.live_worker") as worker:
        for n in range(10):
            seconds = float(dice.exponential(0.03))
            worker.kill_one(path, acknowledged, 1, seconds, from_first=n % 4 > 0)
            lines = acknowledged.read_text().split()
            assert lines == [str(number + 1) for number in range(len(lines))]
            copy = copied(path, tmp_path / "copy")
            n_open += len(pending_of(copy)) > 0
            words = []
            with Project.open(copy, warn=words.append) as project:
                digest = project.digest()
            assert not words
            found = [
                (client, samples_of(operation))
                for client, _, operation in operations_of(copy)
                if operation.kind == "stroke"
            ]
            # The last message may have been done and not acknowledged
            assert any(same_strokes(found, strokes_after(1, len(lines) + k)) for k in (0, 1))
            assert replayed(copy) == digest
    assert len(lines) > 7  # painters did get to work
    assert n_open > 0
