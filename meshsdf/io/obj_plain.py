"""Large OBJ files of positions and triangles alone, by a compiled reader on all cores.

The outcome is that of `obj.read_obj`, bit for bit. Whatever a plain file does not hold, and
whatever is wrong with one, is left to that.
"""

import numpy as np

from ..arrays import writable_alias
from ..kernels.parallel import even_ranges, n_threads, run_pieces
from ..kernels.plain_obj import NOT_PLAIN, count_plain, fill_plain
from ..mesh import Mesh
from .warn import Warn

SMALL = 2**17  # bytes: less is read before a kernel is loaded
ROOM = 16  # one in so many numbers may need exact arithmetic; of random ones, one in a thousand


def read_plain_obj(text: bytes, warn: Warn) -> Mesh | None:
    """Return the mesh that a file's bytes hold; None if they are small, not plain, or wrong."""
    if len(text) < SMALL or b"\\" in text or b"\n" not in text:
        return None
    letters = writable_alias(np.frombuffer(text, np.uint8))
    pieces = _cut(text, n_threads())
    counts = np.zeros((len(pieces), 2), np.int64)
    run_pieces(lambda piece: count_plain(letters, *pieces[piece], counts[piece]), len(pieces))
    n_vertices, n_faces = counts.sum(axis=0).tolist()
    if (counts == NOT_PLAIN).any() or n_faces == 0 or not 0 < n_vertices <= np.iinfo(np.int32).max:
        return None
    starts = np.cumsum(counts, axis=0) - counts
    places, faces = np.empty((n_vertices, 3)), np.empty((n_faces, 3), np.int32)
    hard = [np.empty((3 * n // ROOM + ROOM, 3), np.int64) for n in counts[:, 0].tolist()]
    n_hard = np.zeros(len(pieces), np.int64)

    def work(piece: int) -> None:
        n_hard[piece] = fill_plain(
            letters, *pieces[piece], *starts[piece], places, faces, hard[piece]
        )

    run_pieces(work, len(pieces))
    if (n_hard == NOT_PLAIN).any():
        return None
    for some, n in zip(hard, n_hard.tolist(), strict=True):
        for number, begin, end in some[:n].tolist():
            places.ravel()[number] = float(text[begin:end])
    return _mesh_in_use(places, faces, warn)


def _cut(text: bytes, n_pieces: int) -> list[tuple[int, int]]:
    """Ranges of whole lines."""
    ends = [text.find(b"\n", end) + 1 or len(text) for _, end in even_ranges(len(text), n_pieces)]
    return list(zip([0, *ends], ends, strict=False))


def _mesh_in_use(places: np.ndarray, faces: np.ndarray, warn: Warn) -> Mesh:
    """The mesh, without positions that no face uses."""
    is_used = np.zeros(len(places), bool)
    is_used[faces] = True
    unused = len(places) - np.count_nonzero(is_used)
    if unused:
        warn(f"{unused} of {len(places)} positions are used by no face; left out")
        faces = (np.cumsum(is_used, dtype=np.int32) - 1)[faces].astype(np.int32)
        places = places[is_used]
    return Mesh(places, faces)
