"""meshsdf.texture.journal: projects that keep every operation."""

import os
import sqlite3
import struct
import subprocess
import sys

import numpy as np
import pytest

from meshsdf.errors import TextureError
from meshsdf.texture import checkpoints, journal
from meshsdf.texture.brush import Brush
from meshsdf.texture.journal import Project
from meshsdf.texture.operations import KINDS, Operation
from meshsdf.texture.stroke_record import StrokeRecord
from tests.texture.random_operations import RESOLUTION, Twin, small_mesh

RED = [1.0, 0.0, 0.0]


def fresh(tmp_path, name="a.mtex", **options):
    return Project.create(tmp_path / name, small_mesh(), resolution=RESOLUTION, **options)


def ball(x, radius=0.3, layer=0):
    center = np.array([np.cos(x), np.sin(x), 0.0])
    return Operation(
        "paint-ball", {"layer": layer, "center": center, "radius": radius, "color": RED}
    )


def test_a_project_holds_what_the_same_operations_give_in_memory(tmp_path):
    twin = Twin(2)
    with fresh(tmp_path) as project:
        for seq in range(1, 61):
            assert project.apply(twin.next()) == seq
            assert project.digest() == twin.digest()
        assert twin.digest() == twin.digest_from_scratch()
        assert project.history.names == twin.history.names
    with Project.open(tmp_path / "a.mtex") as project:
        assert project.digest() == twin.digest()
        assert project.history.names == twin.history.names
        assert project.history.undone_names == twin.history.undone_names


@pytest.mark.parametrize("base", ["srgb8", "half"])
def test_colors_after_opening_are_those_before(tmp_path, base):
    points = np.random.default_rng(0).normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    with fresh(tmp_path, base=base) as project:
        project.apply(Operation("add-layer", {"color": [0.2, 0.4, 0.6]}))
        project.apply(ball(0.5))
        colors = project.texture.colors(points)
        assert len(np.unique(colors, axis=0)) > 1
    with Project.open(tmp_path / "a.mtex") as project:
        np.testing.assert_array_equal(project.texture.colors(points), colors)
        vertices = project.texture.surface.vertices
    np.testing.assert_array_equal(vertices, small_mesh().vertices)


def test_the_octree_that_was_kept_is_the_one_that_is_made(tmp_path):
    with fresh(tmp_path) as project:
        made = project.texture.octree
    with Project.open(tmp_path / "a.mtex") as project:
        kept = project.texture.octree
    for name, array in made.tables._asdict().items():
        np.testing.assert_array_equal(getattr(kept.tables, name), array, err_msg=name)
    np.testing.assert_array_equal(kept.level_first, made.level_first)


def test_all_channels_are_kept(tmp_path, monkeypatch):
    def write(texture, *, channel):
        layer = texture.layers[0]
        entries = layer.stored
        n = int(np.diff(texture.octree.tables.texel_first)[entries].sum())
        values = np.random.default_rng(len(channel)).random((n, 4)).astype(np.float32)
        texture.put(layer, entries, values, channel=channel)

    monkeypatch.setitem(KINDS, "write", write)
    with fresh(tmp_path) as project:
        project.apply(Operation("add-layer"))
        for channel in ("normal", "height", "orm", "mask"):
            before = project.digest()
            project.apply(Operation("write", {"channel": channel}))
            assert project.digest() != before
        digest = project.digest()
    with Project.open(tmp_path / "a.mtex") as project:
        assert project.digest() == digest


def test_the_same_sender_s_operation_is_done_once(tmp_path):
    with fresh(tmp_path) as project:
        project.apply(Operation("add-layer"), client="page", cseq=1)
        assert project.apply(ball(0), client="page", cseq=2) == 2
        digest = project.digest()
        assert project.apply(ball(1), client="page", cseq=2) == 2
        assert project.digest() == digest
        assert project.apply(ball(1), client="other", cseq=2) == 3
        assert project.apply(ball(2)) == 4
        assert project.apply(ball(2)) == 5
    with Project.open(tmp_path / "a.mtex") as project:
        assert project.apply(ball(3), client="page", cseq=2) == 2


def test_an_operation_that_fails_changes_nothing(tmp_path):
    with fresh(tmp_path) as project:
        project.apply(Operation("add-layer"))
        digest = project.digest()
        for kind, params, words in [
            ("fly", {}, "there is no operation 'fly'"),
            ("drop-layer", {"layer": 7}, "there is no layer 7"),
            ("drop-layer", {}, "missing a required argument: 'layer'"),
            ("layer", {"layer": 0, "opacity": 2}, "cannot have opacity=2"),
            ("layer", {"layer": 0, "place": 1}, "no place 1 among 1 layers"),
            ("fill-color", {"layer": 0, "color": [1.0]}, "is no colour"),
            ("bake", {"layer": 0, "texture_kind": "checker", "level": 99}, "no level 99"),
            ("paint-ball", {"layer": 0, "center": [0, 0], "radius": 1, "color": RED}, "ball of"),
            ("add-layer", {"name": {1}}, "a parameter is a set"),
            ("add-layer", {"color": [float("nan")] * 3}, "a parameter is nan"),
            ("redo", {}, "nothing to redo"),
        ]:
            with pytest.raises(TextureError, match=words):
                project.apply(Operation(kind, params))
        assert project.digest() == digest
        assert project.last_seq == 1


def test_an_operation_that_cannot_be_kept_is_taken_back(tmp_path):
    with fresh(tmp_path) as project:
        project.apply(Operation("add-layer"))
        digest = project.digest()
        project._connection.execute("PRAGMA query_only = ON")
        for operation in (ball(0), Operation("undo")):
            with pytest.raises(TextureError, match="operation 2 could not be kept"):
                project.apply(operation)
            assert project.digest() == digest
        project._connection.execute("PRAGMA query_only = OFF")
        assert project.apply(ball(0)) == 2


def test_undo_reaches_back_beyond_memory_and_checkpoints(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoints, "OPERATIONS_PER_CHECKPOINT", 8)
    digests = []
    with fresh(tmp_path, budget=2_000) as project:
        project.apply(Operation("add-layer"))
        digests.append(project.digest())
        for n in range(20):
            project.apply(ball(n, 0.2 + 0.01 * n))
            digests.append(project.digest())
        assert project.history.n_bytes <= 2_000
        assert project.history.steps[0].change is None
    with Project.open(tmp_path / "a.mtex", budget=2_000) as project:
        for digest in digests[-2::-1]:
            project.undo()
            assert project.digest() == digest
        for digest in digests[1:]:
            project.redo()
            assert project.digest() == digest
            assert project.history.n_bytes <= 2_000


def test_layers_keep_their_identity_through_rebuilding(tmp_path):
    with fresh(tmp_path, budget=0) as project:
        project.apply(Operation("add-layer"))
        layer = project.texture.layers[0]
        project.apply(ball(0))
        project.apply(ball(1))
        project.undo()
        project.undo()
        project.undo()
        assert project.texture.layers == []
        project.redo()
        assert project.texture.layers == [layer]


def test_at_least_two_checkpoints_are_kept_and_no_brick_that_none_needs(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoints, "OPERATIONS_PER_CHECKPOINT", 5)
    with fresh(tmp_path) as project:
        project.apply(Operation("add-layer"))
        for n in range(50):
            project.apply(ball(0.01 * n))
        query = project._connection.execute
        kept = query("SELECT seq FROM checkpoint").fetchall()
        assert len(kept) == 2
        older = query("SELECT COUNT(*) FROM brick WHERE seq < ?", min(kept)).fetchone()
        newer = query("SELECT COUNT(DISTINCT layer || channel || chunk) FROM brick").fetchone()
        assert older <= newer


def test_a_copy_is_the_same_project(tmp_path):
    twin = Twin(3)
    with fresh(tmp_path) as project:
        for _ in range(20):
            project.apply(twin.next())
        project.save_as(tmp_path / "b.mtex")
        with pytest.raises(TextureError, match="such a file already"):
            project.save_as(tmp_path / "b.mtex")
    with Project.open(tmp_path / "b.mtex") as project:
        assert project.digest() == twin.digest()
        assert project.last_seq == 20


def test_only_one_process_writes_and_a_dead_one_does_not_count(tmp_path):
    path = tmp_path / "a.mtex"
    with fresh(tmp_path), pytest.raises(TextureError, match=f"open in process {os.getpid()}"):
        Project.open(path)
    script = (
        "import sys, time; from meshsdf.texture.journal import Project;"
        "p = Project.open(sys.argv[1]); print(flush=True); time.sleep(600)"
    )
    command = [sys.executable, "-c", script, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as owner:
        owner.stdout.readline()
        with pytest.raises(TextureError, match=f"open in process {owner.pid}"):
            Project.open(path)
        owner.kill()
    words = []
    Project.open(path, warn=words.append).close()
    assert not words
    assert os.listdir(tmp_path) == ["a.mtex"]


def test_what_is_no_project_is_told_by_words(tmp_path):
    path = tmp_path / "a.mtex"
    with pytest.raises(TextureError, match="cannot be read: No such file"):
        Project.open(path)
    path.write_bytes(b"PNG" * 100)
    with pytest.raises(TextureError, match="the file is no project: it does not begin as"):
        Project.open(path)
    with pytest.raises(TextureError, match="such a file already"):
        fresh(tmp_path)
    path.unlink()
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE t(x)")
    connection.close()
    with pytest.raises(TextureError, match="of another program: application_id 0x0"):
        Project.open(path)


def test_a_later_format_is_refused(tmp_path):
    fresh(tmp_path).close()
    path = tmp_path / "a.mtex"
    data = bytearray(path.read_bytes())
    struct.pack_into(">i", data, 60, 3)
    path.write_bytes(data)
    with pytest.raises(TextureError, match="format 3, and this meshsdf reads up to 2"):
        Project.open(path)
    assert path.read_bytes() == data


def test_a_closed_project_says_so(tmp_path):
    project = fresh(tmp_path)
    project.close()
    project.close()
    with pytest.raises(TextureError, match="the project is closed"):
        project.apply(Operation("add-layer"))


def test_replay_by_other_kernels_is_told(tmp_path, monkeypatch):
    project = fresh(tmp_path)
    project.apply(Operation("add-layer"))
    project._connection.close()
    project._lock.release()
    monkeypatch.setattr(journal, "KERNEL_VERSION", journal.KERNEL_VERSION + 1)
    words = []
    Project.open(tmp_path / "a.mtex", warn=words.append).close()
    assert "another version of meshsdf" in words[0]
    words.clear()
    Project.open(tmp_path / "a.mtex", warn=words.append).close()
    assert not words  # nothing is done again after a checkpoint


def test_commits_are_on_the_disk_before_they_are_acknowledged(tmp_path):
    with fresh(tmp_path) as project:
        query = project._connection.execute
        assert query("PRAGMA journal_mode").fetchone() == ("wal",)
        assert query("PRAGMA synchronous").fetchone() == (2,)  # FULL
        project.apply(Operation("add-layer"))
        other = sqlite3.connect(tmp_path / "a.mtex")
        assert other.execute("SELECT kind FROM op").fetchall() == [("add-layer",)]
        other.close()


def test_strokes_are_painted_again_from_their_records(tmp_path):
    angle = np.linspace(0.0, 1.0, 12)
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    brush = Brush(radius=0.2, color=(0.8, 0.1, 0.1, 1.0))
    record = StrokeRecord(brush, points, points.copy(), np.linspace(0.2, 1.0, 12), 0)
    with fresh(tmp_path) as project:
        project.apply(Operation("add-layer"))
        empty = project.digest()
        project.apply(Operation("stroke", record.to_params()))
        painted = project.digest()
        assert painted != empty
        project._connection.execute("DELETE FROM checkpoint")
        project.checkpoint = lambda: None  # so that opening has to paint
    with Project.open(tmp_path / "a.mtex") as project:
        assert project.digest() == painted
        project.undo()
        assert project.digest() == empty


def test_parameters_of_operations_come_back_as_they_were():
    params = {
        "text": "Ä", "none": None, "yes": True, "number": 0.1, "list": [1, [2.5, "x"]],
        "points": np.random.default_rng(0).normal(size=(40, 3)),
        "small": np.array([1, 2], np.int32), "inside": {"u": np.zeros((0, 2), np.float32)},
    }  # fmt: skip
    data = Operation("stroke", params).encoded()
    found = Operation.decoded("stroke", data).params
    assert Operation("stroke", dict(reversed(params.items()))).encoded() == data
    assert found.keys() == params.keys()
    for name in ("text", "none", "yes", "number", "list"):
        assert found[name] == params[name]
    for a, b in [(found["points"], params["points"]), (found["small"], params["small"]),
                 (found["inside"]["u"], params["inside"]["u"])]:  # fmt: skip
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)


def test_a_project_that_is_stopped_while_it_is_written_leaves_nothing(tmp_path, monkeypatch):
    def stopped(connection, texture):
        connection.execute("CREATE TABLE half (n INTEGER)")
        raise KeyboardInterrupt

    monkeypatch.setattr("meshsdf.texture.project_parts.write_parts", stopped)
    with pytest.raises(KeyboardInterrupt):
        fresh(tmp_path)
    assert os.listdir(tmp_path) == []
