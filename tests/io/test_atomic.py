"""meshsdf.io.atomic: the old file, or the new one, and never anything between."""

import contextlib
import errno
import os
import stat

import pytest

from meshsdf.errors import IoError
from meshsdf.io.atomic import atomic_path, atomic_write, check_output, make_folder, write_text


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def write(path, content, *, stop=None, force=True):
    """Write the content; then raise ``stop``, or call it to do what others might do."""
    with atomic_write(path, force) as temporary:
        temporary.write_bytes(content)
        if isinstance(stop, (type, Exception)):
            raise stop
        if stop is not None:
            stop()


def test_the_file_appears_with_what_was_written_and_nothing_else_stays(tmp_path):
    with atomic_write(tmp_path / "a.bin") as temporary:
        temporary.write_bytes(b"new")
        assert not (tmp_path / "a.bin").exists()
        assert temporary.suffix == ".bin"
    assert (tmp_path / "a.bin").read_bytes() == b"new"
    assert names(tmp_path) == ["a.bin"]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError, SystemExit, MemoryError])
def test_whatever_stops_the_writing_leaves_the_old_file_and_no_scraps(tmp_path, stop):
    (tmp_path / "a.bin").write_bytes(b"old")
    with pytest.raises(stop):
        write(tmp_path / "a.bin", b"half", stop=stop)
    assert (tmp_path / "a.bin").read_bytes() == b"old"
    assert names(tmp_path) == ["a.bin"]


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_is_said_and_the_old_file_stays(tmp_path, number):
    (tmp_path / "a.bin").write_bytes(b"old")
    with pytest.raises(IoError, match=r"disk full.*old file, if any, is intact"):
        write(tmp_path / "a.bin", b"half", stop=OSError(number, os.strerror(number)))
    assert (tmp_path / "a.bin").read_bytes() == b"old"
    assert names(tmp_path) == ["a.bin"]


def test_a_disk_that_fills_up_when_the_file_is_flushed_is_said_too(tmp_path, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(IoError, match="disk full"), atomic_write(tmp_path / "a.bin"):
        pass
    assert names(tmp_path) == []


def test_a_really_full_device_is_said(tmp_path):
    if not os.path.exists("/dev/full"):
        pytest.skip("there is no /dev/full here")

    def fill():
        with open("/dev/full", "wb", buffering=0) as file:
            file.write(b"x" * 4096)

    with pytest.raises(IoError, match="disk full"):
        write(tmp_path / "a.bin", b"new", stop=fill)
    assert names(tmp_path) == []


def test_an_existing_file_is_refused_without_force_and_told_how(tmp_path):
    (tmp_path / "a.bin").write_bytes(b"old")
    with pytest.raises(IoError, match=r"(?s)the output exists.*--force"):
        check_output(tmp_path / "a.bin", force=False)
    check_output(tmp_path / "a.bin", force=True)


def test_a_file_that_appears_during_the_work_is_not_overwritten_without_force(tmp_path):
    def intrude():
        (tmp_path / "a.bin").write_bytes(b"theirs")

    with pytest.raises(IoError, match="the output exists"):
        write(tmp_path / "a.bin", b"mine", stop=intrude, force=False)
    assert (tmp_path / "a.bin").read_bytes() == b"theirs"
    assert names(tmp_path) == ["a.bin"]


@pytest.mark.parametrize("force", [False, True])
def test_a_file_system_without_links_still_gets_its_file(tmp_path, monkeypatch, force):
    def no_link(*_):
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", no_link)
    with atomic_write(tmp_path / "a.bin", force) as temporary:
        temporary.write_bytes(b"new")
    assert (tmp_path / "a.bin").read_bytes() == b"new"
    assert names(tmp_path) == ["a.bin"]


def test_places_that_cannot_be_written_are_refused_before_any_work(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(IoError, match="missing does not exist"):
        check_output(tmp_path / "missing" / "a.bin", force=True)
    with pytest.raises(IoError, match="is a folder"):
        check_output(tmp_path, force=True)
    with pytest.raises(IoError, match="not a folder"):
        check_output(tmp_path / "file" / "a.bin", force=True)
    with pytest.raises(IoError, match="not a regular file"):
        check_output("/dev/null", force=True)
    with pytest.raises(IoError, match="cannot write"):
        check_output(tmp_path / ("a" * 300), force=True)
    with pytest.raises(IoError, match="zero byte"):
        check_output("a\0b", force=True)


def test_a_folder_without_permission_is_refused_before_any_work(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(IoError, match="not writable"):
        check_output(tmp_path / "a.bin", force=False)


def test_a_folder_that_refuses_new_files_only_when_asked_is_said(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(IoError, match="not writable"), atomic_write(tmp_path / "a.bin"):
        pass


def test_the_users_mask_and_the_old_files_mode_are_kept(tmp_path):
    mask = os.umask(0o027)
    try:
        with atomic_write(tmp_path / "a.bin") as temporary:
            temporary.write_bytes(b"new")
    finally:
        os.umask(mask)
    assert stat.S_IMODE((tmp_path / "a.bin").stat().st_mode) == 0o640
    (tmp_path / "a.bin").chmod(0o604)
    with atomic_write(tmp_path / "a.bin", force=True) as temporary:
        temporary.write_bytes(b"newer")
    assert stat.S_IMODE((tmp_path / "a.bin").stat().st_mode) == 0o604


def test_a_symbolic_link_stays_a_link_to_the_new_content(tmp_path):
    (tmp_path / "real.bin").write_bytes(b"old")
    (tmp_path / "link.bin").symlink_to("real.bin")
    with atomic_write(tmp_path / "link.bin", force=True) as temporary:
        temporary.write_bytes(b"new")
    assert (tmp_path / "link.bin").is_symlink()
    assert (tmp_path / "real.bin").read_bytes() == b"new"


def test_text_is_written_whole_and_not_over_an_old_file(tmp_path):
    write_text(tmp_path / "a.json", "größe\n")
    assert (tmp_path / "a.json").read_bytes() == "größe\n".encode()
    with pytest.raises(IoError, match="the output exists"):
        write_text(tmp_path / "a.json", "")
    write_text(tmp_path / "a.json", "new", force=True)
    assert (tmp_path / "a.json").read_text() == "new"


def test_a_folder_is_made_with_its_parents_or_the_obstacle_is_named(tmp_path, monkeypatch):
    assert make_folder(tmp_path / "a" / "b") == tmp_path / "a" / "b"
    assert make_folder(tmp_path / "a" / "b").is_dir()
    (tmp_path / "file").write_bytes(b"")
    for place in (tmp_path / "file", tmp_path / "file" / "c"):
        with pytest.raises(IoError, match="a file stands where the folder should be"):
            make_folder(place)
    with pytest.raises(IoError, match="cannot be made: File name too long"):
        make_folder(tmp_path / ("a" * 300))


def test_a_suffix_that_does_not_suit_is_refused_before_any_work(tmp_path):
    check_output(tmp_path / "a.npz", kind="volume")
    check_output(tmp_path / "a.txt")
    with pytest.raises(IoError, match=r"a volume with suffix '\.obj' cannot be written"):
        check_output(tmp_path / "a.obj", kind="volume")
    with pytest.raises(IoError, match=r"a mesh with suffix '\.gltf' cannot be written"):
        check_output(tmp_path / "a.gltf", kind="mesh")


@pytest.mark.parametrize("stop", [None, KeyboardInterrupt])
def test_what_a_writer_puts_beside_its_file_goes_with_the_block(tmp_path, stop):
    (tmp_path / "a.db").write_bytes(b"old")
    with (
        contextlib.suppress(KeyboardInterrupt),
        atomic_path(tmp_path / "a.db", force=True) as place,
    ):
        assert place.name == "a.db"
        place.write_bytes(b"new")
        place.with_name("a.db-wal").write_bytes(b"log")
        place.with_name("a.db.d").mkdir()
        if stop is not None:
            raise stop
    assert (tmp_path / "a.db").read_bytes() == (b"new" if stop is None else b"old")
    assert names(tmp_path) == ["a.db"]
    with pytest.raises(IoError, match="the output exists"), atomic_path(tmp_path / "a.db"):
        pass
