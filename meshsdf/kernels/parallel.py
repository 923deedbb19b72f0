"""Run pieces of work on all cores, with progress and with Ctrl-C between pieces.

Kernels are compiled with ``nogil=True`` and called from a thread pool, not with numba's own
parallel loops: these compile several times slower, cannot be interrupted and cannot tell how far
they are. Pieces write to disjoint places, so the outcome is the same with any number of threads.
"""

import os
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from itertools import pairwise

from ..progress import Progress, silent


def n_threads() -> int:
    """Number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_pieces(
    work: Callable[[int], None], n_pieces: int, *, stage: str = "", progress: Progress = silent
) -> None:
    """Call ``work(0) ... work(n_pieces - 1)``, each once, on all cores.

    The first exception stops the rest: pieces not yet begun are dropped, those begun are waited
    for, and the exception is raised here. Ctrl-C waits for nothing: a piece may be compiling.
    """
    threads = min(n_threads(), n_pieces)
    if threads <= 1:
        for piece in range(n_pieces):
            work(piece)
            progress(stage, (piece + 1) / n_pieces)
        return
    pool = ThreadPoolExecutor(threads)
    try:
        pending = {pool.submit(work, piece) for piece in range(n_pieces)}
        n_done = 0
        while pending:
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for future in done:
                future.result()
            n_done += len(done)
            progress(stage, n_done / n_pieces)
    except BaseException as error:
        pool.shutdown(wait=not isinstance(error, KeyboardInterrupt), cancel_futures=True)
        raise
    pool.shutdown()


def even_ranges(n_items: int, n_pieces: int) -> list[tuple[int, int]]:
    """Split ``range(n_items)`` into at most ``n_pieces`` ranges of nearly equal length."""
    n_pieces = max(1, min(n_pieces, n_items))
    bounds = [n_items * piece // n_pieces for piece in range(n_pieces + 1)]
    return list(pairwise(bounds))
