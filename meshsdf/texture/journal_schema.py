"""The tables of a project's file, and what its first bytes tell.

A project is one SQLite database. Operations are appended and never removed; checkpoints keep what
the layers held after some of them. Strokes that are no operations yet have a table of their own,
which files of format version 1 lack and get when they are opened.
"""

import contextlib
import os
import sqlite3
import struct
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..errors import TextureError
from ..kernels.log_checksum import log_checksum

APPLICATION_ID = 0x4D544558  # "MTEX"
FORMAT_VERSION = 2
Statement = tuple[str, tuple]
"""SQL, and its values."""
Turn = type(threading.RLock())
"""A lock that its holder may take again."""

MAGIC = b"SQLite format 3\0"
FRAMES_PER_COPY = 1000  # pages, 4 MB
LONGEST_LOG = 16 * 2**20  # bytes of the log's file, once all of it was copied
FAULTS = (sqlite3.Error, UnicodeDecodeError)  # what reading a damaged database raises
HEADER = 100  # bytes of a database's header
WAL_MAGIC = 0x377F0682  # or one more, if checksums are big-endian
WAL_HEADER, FRAME_HEADER = 32, 24

SCHEMA = """
CREATE TABLE project(
    id INTEGER PRIMARY KEY CHECK (id = 1), texel REAL NOT NULL, base TEXT NOT NULL,
    kernel_version INTEGER NOT NULL, origin INTEGER NOT NULL, n_vertices INTEGER NOT NULL,
    n_faces INTEGER NOT NULL, sha256 TEXT NOT NULL);
CREATE TABLE part(
    name TEXT NOT NULL, piece INTEGER NOT NULL, codec INTEGER NOT NULL, crc32 INTEGER NOT NULL,
    data BLOB NOT NULL, PRIMARY KEY (name, piece));
CREATE TABLE op(
    seq INTEGER PRIMARY KEY, client TEXT NOT NULL, cseq INTEGER, kind TEXT NOT NULL,
    layer INTEGER, params BLOB NOT NULL, changed INTEGER NOT NULL, kernel_version INTEGER NOT NULL,
    t REAL NOT NULL, crc32 INTEGER NOT NULL, UNIQUE (client, cseq));
CREATE TABLE checkpoint(
    seq INTEGER PRIMARY KEY, tip INTEGER NOT NULL, sha256 TEXT NOT NULL, layers TEXT NOT NULL);
CREATE TABLE layer(
    seq INTEGER NOT NULL REFERENCES checkpoint(seq) ON DELETE CASCADE, number INTEGER NOT NULL,
    codec INTEGER NOT NULL, crc32 INTEGER NOT NULL, data BLOB NOT NULL,
    PRIMARY KEY (seq, number));
CREATE TABLE brick(
    layer INTEGER NOT NULL, channel TEXT NOT NULL, chunk INTEGER NOT NULL, seq INTEGER NOT NULL,
    codec INTEGER NOT NULL, crc32 INTEGER NOT NULL, data BLOB NOT NULL,
    PRIMARY KEY (layer, channel, chunk, seq));
"""
PENDING = """
CREATE TABLE pending(
    id INTEGER PRIMARY KEY, client TEXT NOT NULL, cseq INTEGER NOT NULL, kind TEXT NOT NULL,
    data BLOB NOT NULL, t REAL NOT NULL, crc32 INTEGER NOT NULL);
"""


class Writer(sqlite3.Connection):
    """A connection to a project.

    Attributes
    ----------
    turn : Turn
        Held by whoever writes; the connections of one owner share it, so that they wait for one
        another no longer than a transaction lasts.
    """

    turn: Turn

    def copy_log_on_commit(self, does: bool) -> None:
        """Whether a commit copies the log into the file when it has become long."""
        self.execute(f"PRAGMA wal_autocheckpoint = {FRAMES_PER_COPY if does else 0}")


def connect(path: Path, turn: Turn | None = None) -> Writer:
    """A connection that commits by itself, and whose commits are on the disk when they return."""
    connection = sqlite3.connect(
        path, isolation_level=None, check_same_thread=False, factory=Writer
    )
    connection.turn = threading.RLock() if turn is None else turn
    connection.execute("PRAGMA busy_timeout = 5000")
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute("PRAGMA foreign_keys = ON")
    connection.execute("PRAGMA secure_delete = FAST")  # else rows that go are written as zeros
    connection.execute(f"PRAGMA journal_size_limit = {LONGEST_LOG}")
    connection.copy_log_on_commit(True)
    return connection


def integrity(path: Path) -> str:
    """What SQLite says of the pages of a file: "ok", or what is wrong first."""
    connection = connect(path)
    try:
        (verdict,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
    finally:
        connection.close()
    return verdict


def create(path: Path) -> Writer:
    """A new database with empty tables."""
    connection = connect(path)
    connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    connection.execute(f"PRAGMA user_version = {FORMAT_VERSION}")
    connection.executescript(f"BEGIN; {SCHEMA} {PENDING} COMMIT;")
    return connection


def upgrade(connection: Writer) -> None:
    """Give a project of an earlier format what it lacks."""
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version < FORMAT_VERSION:
        in_one(connection, (PENDING, ()), (f"PRAGMA user_version = {FORMAT_VERSION}", ()))


@contextlib.contextmanager
def transaction(connection: Writer) -> Iterator[None]:
    """All that the body writes, or, if it raises, nothing."""
    with connection.turn:
        connection.execute("BEGIN IMMEDIATE")
        try:
            yield
            connection.execute("COMMIT")
        except BaseException:
            if connection.in_transaction:
                connection.execute("ROLLBACK")
            raise


def in_one(connection: Writer, *statements: Statement) -> None:
    """Execute statements, all of them or, if one fails, none."""
    if len(statements) == 1:  # is a transaction already; every call waits for the interpreter
        with connection.turn:
            connection.execute(*statements[0])
        return
    with transaction(connection):
        for statement, values in statements:
            connection.execute(statement, values)


def copy_to(connection: sqlite3.Connection, path: Path) -> None:
    """Write a compact copy of a database to a file that is not there yet.

    Raises
    ------
    TextureError
        There is such a file, or it cannot be written.
    """
    if path.exists():
        raise TextureError("there is such a file already", str(path), "choose another name")
    beside = path.with_name(f".{path.name}.new")
    try:
        forget(beside)
        connection.execute("VACUUM INTO ?", (str(beside),))
        os.replace(beside, path)
    except (sqlite3.Error, OSError) as error:
        what = f"the copy cannot be written: {error}"
        raise TextureError(what, str(path), "check the folder and its free space") from None
    finally:
        forget(beside)


def forget(path: Path) -> None:
    """Remove a database that is not finished, with what SQLite keeps beside it, if it is there."""
    for end in ("", "-journal", "-wal", "-shm"):
        with contextlib.suppress(OSError):
            Path(f"{path}{end}").unlink(missing_ok=True)


def check_header(path: Path) -> None:
    """Tell by its first bytes whether a file is a project that can be read.

    Raises
    ------
    TextureError
        It is not there, is no project, is cut off, or is of a later version of meshsdf.
    """
    where = str(path)
    try:
        with path.open("rb") as file:
            head = file.read(HEADER)
    except OSError as error:
        what = f"the project cannot be read: {error.strerror}"
        raise TextureError(what, where, "check the path and its permissions") from None
    if head[: len(MAGIC)] != MAGIC[: len(head)]:
        what = "the file is no project: it does not begin as projects do"
        raise TextureError(what, where, "open a .mtex file, or create a project")
    if len(head) < HEADER:
        what = f"the project is cut off after {len(head)} bytes"
        raise TextureError(what, where, "bring back a copy of the file")
    version, application = struct.unpack_from(">i", head, 60)[0], struct.unpack_from(">I", head, 68)
    if application[0] != APPLICATION_ID:
        what = f"the database is of another program: application_id {application[0]:#x}"
        raise TextureError(what, where, f"open a .mtex file ({APPLICATION_ID:#x})")
    if version > FORMAT_VERSION:
        what = f"the project has format {version}, and this meshsdf reads up to {FORMAT_VERSION}"
        raise TextureError(what, where, "use a newer meshsdf")


def header_damage(path: Path) -> str | None:
    """Whether the file is shorter than its header says; the log may hold what is missing."""
    with path.open("rb") as file:
        head = file.read(HEADER)
    size = struct.unpack_from(">H", head, 16)[0]
    size = 65536 if size == 1 else size
    promised = size * struct.unpack_from(">I", head, 28)[0]
    log = Path(f"{path}-wal")
    if path.stat().st_size >= promised or (log.exists() and log.stat().st_size > WAL_HEADER):
        return None
    return f"the file is cut off: {path.stat().st_size} bytes of {promised}"


def lost_commits(path: Path) -> int:
    """Commits in the write-ahead log beside a project that SQLite skips, as they are damaged.

    A writer that was killed may leave one that was never acknowledged. Commits whose bytes are not
    there at all are not counted.
    """
    log = Path(f"{path}-wal")
    data = log.read_bytes() if log.exists() else b""
    if len(data) < WAL_HEADER:
        return int(len(data) > 0)
    magic, _, size, _, *salts, sum_a, sum_b = struct.unpack_from(">8I", data)
    order = ">" if magic & 1 else "<"
    sums = _checksum(data[: WAL_HEADER - 8], order, (0, 0))
    if magic & ~1 != WAL_MAGIC or sums != (sum_a, sum_b):
        return int(len(data) > WAL_HEADER)
    lost, whole = 0, True
    for at in range(WAL_HEADER, len(data) - FRAME_HEADER - size + 1, FRAME_HEADER + size):
        frame = struct.unpack_from(">6I", data, at)
        if list(frame[2:4]) != salts:  # from before the log was begun anew, or damaged
            whole = False
            continue
        if whole:
            body = data[at : at + 8] + data[at + FRAME_HEADER : at + FRAME_HEADER + size]
            sums = _checksum(body, order, sums)
            whole = sums == frame[4:6]
        lost += not whole and frame[1] != 0
    return lost


def _checksum(data: bytes, order: str, sums: tuple[int, int]) -> tuple[int, int]:
    """The checksum of SQLite's log, carried on from ``sums``."""
    carried = np.array(sums, np.uint64)
    log_checksum(np.frombuffer(data, f"{order}u4").astype(np.uint32), carried)
    return int(carried[0]), int(carried[1])
