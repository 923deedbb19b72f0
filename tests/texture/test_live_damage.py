"""meshsdf.texture.live: batches in files that were damaged, and files of earlier formats."""

import sqlite3

import numpy as np
import pytest

from meshsdf.errors import TextureError
from meshsdf.texture.journal import Project
from meshsdf.texture.live import LiveStrokes
from tests.texture.live_twin import (
    ANNE,
    BRUSHES,
    crashed,
    fresh,
    operations_of,
    paint,
    samples_of,
    walk,
)


def changed_rows(path, statement):
    with sqlite3.connect(path) as connection:
        connection.execute(statement)
    connection.close()


WRONG = "of the unfinished strokes: it has a wrong checksum"
DAMAGE = {
    "UPDATE pending SET data = x'00' WHERE cseq = 3": (f"row 3 {WRONG}", [2, 4]),
    "UPDATE pending SET data = data || x'ff' WHERE cseq = 3": ("row 3 of the unfinished", [2, 4]),
    "UPDATE pending SET data = 'text' WHERE cseq = 3": (f"row 3 {WRONG}", [2, 4]),
    "UPDATE pending SET cseq = 30 WHERE cseq = 3": (f"row 3 {WRONG}", [2, 4]),
    "UPDATE pending SET crc32 = 'x' WHERE cseq = 4": (f"row 4 {WRONG}", [2, 3]),
    "UPDATE pending SET data = x'7b7d' WHERE cseq = 1": ("the beginning of this stroke", None),
    "DELETE FROM pending WHERE cseq = 4": ("acknowledged and are missing: 1", [2, 3]),
}


@pytest.mark.parametrize("statement", DAMAGE)
def test_damaged_batches_are_named_and_the_others_are_there(tmp_path, statement):
    words, left = DAMAGE[statement]
    live = fresh(tmp_path)
    rng = np.random.default_rng(10)
    batches = {n: walk(rng, 3) for n in (2, 3, 4)}
    live.begin(ANNE, 1, 0, BRUSHES["band"])
    for n, batch in batches.items():
        live.add(ANNE, n, *batch)
    path = crashed(live, tmp_path / "copy")
    changed_rows(path, statement)
    said = []
    with Project.open(path, warn=said.append) as project:
        assert project.last_seq == 4 + (left is not None)
    assert any(words in one for one in said), said
    if left is not None:
        expected = np.concatenate([np.column_stack(batches[n]) for n in left])
        np.testing.assert_array_equal(samples_of(operations_of(path)[-1][2]), expected)
    live.close()


def test_flipped_bytes_in_the_log_lose_no_batch_without_a_word(tmp_path):
    live = fresh(tmp_path)
    live.project._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    rng = np.random.default_rng(11)
    live.begin(ANNE, 1, 0, BRUSHES["band"])
    n = 12
    for cseq in range(2, n + 2):
        live.add(ANNE, cseq, *walk(rng, 2))
    opened = 0
    for place in [40, *rng.integers(32, (tmp_path / "a.mtex-wal").stat().st_size, 16)]:
        path = crashed(live, tmp_path / "copy")
        log = path.with_name("a.mtex-wal")
        data = bytearray(log.read_bytes())
        data[place] ^= 1 << int(rng.integers(8))
        log.write_bytes(bytes(data))
        words = []
        with Project.open(path, warn=words.append):
            pass
        strokes = [samples_of(o) for _, _, o in operations_of(path) if o.kind == "stroke"]
        kept = sum(map(len, strokes))
        opened += kept == 2 * n
        assert words or kept == 2 * n
    assert opened < 17  # some were lost
    live.close()


def test_flipped_bytes_in_the_file_lose_no_batch_without_a_word(tmp_path):
    live = fresh(tmp_path, n_layers=1)
    rng, n = np.random.default_rng(12), 40
    live.begin(ANNE, 1, 0, BRUSHES["band"])
    for cseq in range(2, n + 2):
        live.add(ANNE, cseq, *walk(rng, 6))
    live.project.close()
    whole = (tmp_path / "a.mtex").read_bytes()
    # Half of the flips among the last pages, which hold most batches
    places = [*rng.integers(100, len(whole), 8), *rng.integers(len(whole) - 30000, len(whole), 8)]
    kept_all = 0
    for place in places:
        data, path, words = bytearray(whole), tmp_path / "copy.mtex", []
        data[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(data)
        try:
            Project.open(path, warn=words.append).close()
        except TextureError as error:
            words.append(error.what)
            continue
        strokes = [samples_of(o) for _, _, o in operations_of(path) if o.kind == "stroke"]
        assert words or sum(map(len, strokes)) == 6 * n
        kept_all += sum(map(len, strokes)) == 6 * n
    assert 0 < kept_all < len(places)


def test_projects_of_format_1_are_opened_and_get_the_table(tmp_path):
    live = fresh(tmp_path)
    digest = live.project.digest()
    live.close()
    path = tmp_path / "a.mtex"
    changed_rows(path, "DROP TABLE pending")
    changed_rows(path, "PRAGMA user_version = 1")
    words = []
    live = LiveStrokes.open(path, warn=words.append)
    assert not words
    assert live.project.digest() == digest
    paint(live, ANNE, 1, 0, BRUSHES["band"], [walk(np.random.default_rng(0), 3)])
    live.close()
    assert operations_of(path)[-1][:2] == (ANNE, 3)
    with sqlite3.connect(path) as connection:
        assert connection.execute("PRAGMA user_version").fetchone() == (2,)
    connection.close()
