"""The operations of a project, as rows of its file, and which of them are done."""

import sqlite3
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..errors import TextureError
from .blobs import Damaged
from .journal_schema import FAULTS, Statement, Writer, in_one
from .operations import TURNS, Operation

KERNEL_VERSION = 4
"""Raised whenever an operation leaves other texels than it did before."""

COLUMNS = "seq, client, cseq, kind, layer, params, changed, kernel_version, t, crc32"
INSERT = f"INSERT INTO op ({COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"


@dataclass(frozen=True)
class Entry:
    """One operation of the log, without its parameters."""

    seq: int
    client: str
    cseq: int | None
    kind: str
    changed: bool
    kernel_version: int


def op_row(seq: int, client: str, cseq: int | None, operation: Operation, changed: bool) -> tuple:
    """The row of an operation, with its checksum."""
    row = (
        seq, client, cseq, operation.kind, operation.layer, operation.encoded(), int(changed),
        KERNEL_VERSION, time.time(),
    )  # fmt: skip
    return *row, _checksum(row)


def read_row(row: tuple) -> Entry:
    """What a row says; `Damaged` if its checksum is wrong."""
    if _checksum(row[:-1]) != row[-1]:
        raise Damaged(f"operation {row[0]} has a wrong checksum")
    seq, client, cseq, kind, _, _, changed, version, *_ = row
    return Entry(seq, client, cseq, kind, bool(changed), version)


def read_log(connection: sqlite3.Connection, origin: int) -> tuple[list[Entry], str | None]:
    """The operations after ``origin`` up to the first that cannot be read, and why that is so."""
    entries: list[Entry] = []
    try:
        for row in connection.execute(f"SELECT {COLUMNS} FROM op ORDER BY seq"):
            if row[0] <= origin:
                continue
            if row[0] != origin + len(entries) + 1:
                raise Damaged(f"operation {origin + len(entries) + 1} is missing")
            entries.append(read_row(row))
    except (Damaged, TypeError, *FAULTS) as error:
        return entries, str(error)
    return entries, None


def read_operation(connection: sqlite3.Connection, seq: int) -> Operation:
    """One operation with its parameters."""
    kind, params = connection.execute(
        "SELECT kind, params FROM op WHERE seq = ?", (seq,)
    ).fetchone()
    return Operation.decoded(kind, params)


def steps_of(entries: list[Entry]) -> tuple[list[Entry], int]:
    """The steps that can be undone or redone, oldest first, and how many of them are done."""
    steps: list[Entry] = []
    n_done = 0
    for entry in entries:
        if entry.kind in TURNS:
            n_done += 1 if entry.kind == "redo" else -1
            if not 0 <= n_done <= len(steps):
                raise Damaged(f"operation {entry.seq} undoes or redoes what is not there")
        elif entry.changed:
            steps[n_done:] = [entry]
            n_done += 1
    return steps, n_done


def commit(
    connection: Writer,
    path: Path,
    row: tuple,
    take_back: Callable[[], object],
    *more: Statement,
) -> None:
    """Write an operation's row, and in one go what more there is to write.

    Raises
    ------
    TextureError
        That failed, and its effect was taken back.
    """
    try:
        in_one(connection, (INSERT, row), *more)
    except BaseException as error:
        take_back()
        if not isinstance(error, sqlite3.Error):
            # Ctrl-C may come when all was written already
            connection.execute("DELETE FROM op WHERE seq = ?", row[:1])
            raise
        what = f"operation {row[0]} could not be kept: {error}"
        fix = "free some space, or save the project elsewhere; then do it again"
        raise TextureError(what, str(path), fix) from None


def _checksum(row: tuple) -> int:
    words = [repr(value) for value in row if not isinstance(value, bytes)]
    blobs = [value for value in row if isinstance(value, bytes)]
    return zlib.crc32(b"".join(blobs), zlib.crc32(" ".join(words).encode()))
