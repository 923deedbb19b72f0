"""meshsdf.texture.journal: files that were cut off or whose bytes changed.

The law of all these tests: a project that opens is in the state after its last operation, as it was
then; and if that is not the last operation there was, this is said.
"""

import shutil
import sqlite3
import struct
from pathlib import Path

import numpy as np
import pytest

from meshsdf.errors import TextureError
from meshsdf.texture.journal import Project
from meshsdf.texture.journal_schema import FRAME_HEADER, WAL_HEADER
from meshsdf.texture.operations import Operation
from tests.texture.random_operations import RESOLUTION, Twin, small_mesh

N_OPERATIONS = 40
CHECKPOINTS = (12, 24, 33)
ENDS = ("", "-wal", "-lock")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Files of a project that was closed, and of one whose owner died; digests by operation."""
    folder = tmp_path_factory.mktemp("whole")
    twin, digests = Twin(5), {}
    with Project.create(folder / "a.mtex", small_mesh(), resolution=RESOLUTION) as project:
        digests[0] = project.digest()
        for seq in range(1, N_OPERATIONS + 1):
            project.apply(twin.next())
            digests[seq] = project.digest()
            if seq in CHECKPOINTS:
                project.checkpoint()
            if seq == CHECKPOINTS[-1]:
                project._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        died = {end: Path(f"{folder}/a.mtex{end}").read_bytes() for end in ENDS}
    return {"": (folder / "a.mtex").read_bytes()}, died, digests


def put(folder, files):
    """Write a project's files; return its path."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for end, data in files.items():
        Path(f"{folder}/a.mtex{end}").write_bytes(data)
    return folder / "a.mtex"


def holds(path, digests, refusals=None):
    """Open a project and hold it against the law; return its last operation, None if refused."""
    words, refused = [], None
    try:
        project = Project.open(path, warn=words.append)
    except TextureError as error:
        refused = error
    if refused is not None:
        assert refused.what
        assert str(path) in refused.where
        assert refused.fix
        assert path.exists(), "what cannot be read must stay where it is"
        if refusals is not None:
            refusals.append(refused.what)
        return None
    with project:
        assert project.digest() == digests[project.last_seq], words
        assert words or project.last_seq == N_OPERATIONS
    if any("kept as" in word for word in words):
        assert list(path.parent.glob("a.mtex.damaged-1"))
    return project.last_seq


def test_untouched_files_open_at_the_last_operation(whole, tmp_path):
    closed, died, digests = whole
    for files in (closed, died):
        words = []
        with Project.open(put(tmp_path / "p", files), warn=words.append) as project:
            assert project.last_seq == N_OPERATIONS
            assert project.digest() == digests[N_OPERATIONS]
        assert not words


def test_a_file_cut_off_anywhere_is_told_and_never_taken_for_whole(whole, tmp_path):
    closed, _, digests = whole
    size = len(closed[""])
    cuts = [0, 1, 15, 16, 99, 100, 4095, 4096, size - 4096, size - 1]
    cuts += np.random.default_rng(0).integers(100, size, 15).tolist()
    refusals, opened = [], []
    for cut in cuts:
        path = put(tmp_path / "p", {"": closed[""][:cut]})
        opened.append(holds(path, digests, refusals))
    assert refusals
    assert any(seq is not None for seq in opened)  # the last pages hold late bricks alone
    assert opened[0] is None
    assert opened[2] is None


def test_flipped_bytes_in_a_file_are_told_or_make_no_difference(whole, tmp_path):
    closed, _, digests = whole
    rng = np.random.default_rng(1)
    opened = []
    for place in rng.integers(100, len(closed[""]), 60):
        data = bytearray(closed[""])
        data[place] ^= int(rng.integers(1, 256))
        opened.append(holds(put(tmp_path / "p", {"": bytes(data)}), digests))
    full = sum(seq == N_OPERATIONS for seq in opened)
    assert full > 30  # checkpoints, operations and octree stand in for each other


def test_flipped_bytes_in_the_header_are_told(whole, tmp_path):
    closed, _, digests = whole
    for place in range(0, 100, 2):
        data = bytearray(closed[""])
        data[place] ^= 0x55
        holds(put(tmp_path / "p", {"": bytes(data)}), digests)


def test_a_log_cut_off_anywhere_loses_only_what_is_told(whole, tmp_path):
    _, died, digests = whole
    size = len(died["-wal"])
    assert size > 10_000
    cuts = [0, 1, 31, 32, 33, size - 1, *np.random.default_rng(2).integers(33, size, 15).tolist()]
    for cut in cuts:
        path = put(tmp_path / "p", died | {"-wal": died["-wal"][:cut]})
        last = holds(path, digests)
        assert last is not None
        assert CHECKPOINTS[-1] <= last < N_OPERATIONS


def test_flipped_bytes_in_a_log_lose_only_what_is_told(whole, tmp_path):
    _, died, digests = whole
    rng = np.random.default_rng(3)
    opened = []
    for place in [0, 3, 8, 16, 24, 31, *rng.integers(32, len(died["-wal"]), 25).tolist()]:
        data = bytearray(died["-wal"])
        data[place] ^= int(rng.integers(1, 256))
        opened.append(holds(put(tmp_path / "p", died | {"-wal": bytes(data)}), digests))
    assert all(seq is not None for seq in opened)
    assert min(opened) < N_OPERATIONS


def test_damage_in_the_log_is_seen_without_the_lock_file(whole, tmp_path):
    _, died, _ = whole
    (size,) = struct.unpack_from(">I", died["-wal"], 8)
    data = bytearray(died["-wal"])
    data[WAL_HEADER + FRAME_HEADER + size // 2] ^= 1  # in the first page
    words = []
    path = put(tmp_path / "p", {"": died[""], "-wal": bytes(data)})
    Project.open(path, warn=words.append).close()
    assert "damaged commits in the log" in words[0]


def test_a_bad_checkpoint_is_passed_over_for_an_earlier_one_and_operations(whole, tmp_path):
    closed, _, digests = whole
    path = put(tmp_path / "p", closed)
    with sqlite3.connect(path) as connection:
        seqs = [seq for (seq,) in connection.execute("SELECT seq FROM checkpoint ORDER BY seq")]
        assert len(seqs) >= 2
        connection.execute("UPDATE brick SET crc32 = crc32 + 1 WHERE seq = ?", seqs[-1:])
        connection.execute("UPDATE layer SET data = x'00' WHERE seq = ?", seqs[-1:])
    connection.close()
    words = []
    with Project.open(path, warn=words.append) as project:
        assert project.digest() == digests[N_OPERATIONS]
        assert f"checkpoint {seqs[-1]}" in words[0]
        assert "wrong checksum" in words[0]
        # All goes on as if nothing had been
        project.apply(Operation("add-layer"))
        after = project.digest()
    with Project.open(path, warn=words.append) as project:
        assert project.digest() == after
    assert len(words) == 1


def test_without_any_checkpoint_operations_alone_lead_back(whole, tmp_path):
    closed, _, digests = whole
    path = put(tmp_path / "p", closed)
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE checkpoint SET sha256 = 'wrong'")
    connection.close()
    words = []
    with Project.open(path, warn=words.append) as project:
        assert project.digest() == digests[N_OPERATIONS]
    assert all("SHA-256" in word for word in words)
    assert words


def test_a_bad_operation_before_a_checkpoint_costs_undo_but_not_the_state(whole, tmp_path):
    closed, _, digests = whole
    path = put(tmp_path / "p", closed)
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE op SET params = x'00' WHERE seq = 3")
    connection.close()
    words = []
    with Project.open(path, warn=words.append) as project:
        assert project.digest() == digests[N_OPERATIONS]
        assert project.last_seq == N_OPERATIONS
        assert any("operation 3 has a wrong checksum" in word for word in words)
        assert any("can no longer be undone" in word for word in words)
        layer = project.texture.layers[0].number
        project.apply(Operation("fill-color", {"layer": layer, "color": [1.0, 0.0, 0.0]}))
        project.undo()
        assert project.digest() == digests[N_OPERATIONS]
        with pytest.raises(TextureError, match="nothing to undo"):
            project.undo()
    with Project.open(path) as project:
        assert project.digest() == digests[N_OPERATIONS]


def test_a_bad_operation_after_the_last_checkpoint_ends_the_story_before_it(whole, tmp_path):
    _, died, digests = whole
    path = put(tmp_path / "p", died)
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE op SET kind = 'bake' WHERE seq = 37")
    connection.close()
    words = []
    with Project.open(path, warn=words.append) as project:
        assert project.last_seq == 36
        assert project.digest() == digests[36]
    assert any("operations from 37 on are lost" in word for word in words)
