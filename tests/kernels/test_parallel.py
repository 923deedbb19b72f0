"""meshsdf.kernels.parallel: every piece once, the first exception out, Ctrl-C at once."""

import threading
import time
from itertools import pairwise

import pytest

from meshsdf.kernels import parallel
from meshsdf.kernels.parallel import even_ranges, run_pieces


@pytest.mark.parametrize("threads", [1, 3])
def test_every_piece_runs_once_and_progress_ends_at_one(monkeypatch, threads):
    monkeypatch.setattr(parallel, "n_threads", lambda: threads)
    done, told = [], []
    run_pieces(done.append, 20, stage="work", progress=lambda *what: told.append(what))
    assert sorted(done) == list(range(20))
    assert told[-1] == ("work", 1.0)
    assert [fraction for _, fraction in told] == sorted(fraction for _, fraction in told)


@pytest.mark.parametrize("threads", [1, 3])
def test_the_first_exception_comes_out_and_stops_the_rest(monkeypatch, threads):
    monkeypatch.setattr(parallel, "n_threads", lambda: threads)
    begun, has_failed = [], threading.Event()

    def work(piece: int) -> None:
        begun.append(piece)
        if piece == 0:
            has_failed.set()
            raise ValueError("piece 0")
        has_failed.wait(60)
        time.sleep(0.01)  # lets the caller see the failure before a thousand pieces are over

    with pytest.raises(ValueError, match="piece 0"):
        run_pieces(work, 1000)
    assert len(begun) < 1000


def test_ctrl_c_does_not_wait_for_pieces_that_run(monkeypatch):
    monkeypatch.setattr(parallel, "n_threads", lambda: 2)
    may_end = threading.Event()

    def interrupt(stage: str, fraction: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_pieces(lambda piece: piece == 0 or may_end.wait(60), 2, progress=interrupt)
    assert not may_end.is_set()
    may_end.set()


def test_ranges_are_even_and_cover_everything():
    for n_items, n_pieces in ((10, 3), (2, 5), (7, 7), (1000, 16)):
        ranges = even_ranges(n_items, n_pieces)
        assert ranges[0][0] == 0
        assert ranges[-1][1] == n_items
        assert all(a[1] == b[0] for a, b in pairwise(ranges))
        lengths = [b - a for a, b in ranges]
        assert max(lengths) - min(lengths) <= 1
