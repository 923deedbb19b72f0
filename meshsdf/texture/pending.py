"""Strokes that are still being painted, as rows of a project's file.

Every batch of samples is a row of its own, from before it is acknowledged until the stroke has
become an operation. A row has one of three kinds: "begin" says which brush paints on which layer,
"add" holds samples, and "mark" stands for a stroke that was cancelled, so that its sender's
numbers stay known.
"""

import json
import sqlite3
import time
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ..errors import TextureError
from .brush import Brush
from .journal_schema import FAULTS, Statement, Writer, connect, in_one
from .project_lock import ProjectLock

Samples = Float64[np.ndarray, "n 7"]
"""Point, normal and pressure."""

BEGIN, ADD, MARK = "begin", "add", "mark"
COLUMNS = "client, cseq, kind, data, t, crc32"
INSERT = f"INSERT INTO pending ({COLUMNS}) VALUES (?, ?, ?, ?, ?, ?)"
FORGET = "DELETE FROM pending WHERE client = ?"
SAMPLE_BYTES = 56


@dataclass
class PendingStroke:
    """A stroke as its rows tell it; ``cseq`` is the highest number among them."""

    layer: int
    brush: Brush
    cseq: int
    batches: list[Samples] = field(default_factory=list)


@dataclass
class Pending:
    """All that the rows tell.

    Attributes
    ----------
    strokes : dict of str to PendingStroke
        By client, in the order in which they began.
    last : dict of str to int
        The highest number of every client.
    rows : list of tuple
        Those that can be used, as `INSERT` takes them.
    wrong : list of str
        What is the matter with the others.
    """

    strokes: dict[str, PendingStroke] = field(default_factory=dict)
    last: dict[str, int] = field(default_factory=dict)
    rows: list[tuple] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)


class PendingTable:
    """The rows of a project that is open.

    They are written over a connection of their own, on any thread that has the turn; so they do
    not wait for what the project's owner reads.

    Attributes
    ----------
    n_rows : int
    turn : Turn
        To be held while the rows are written and what is known of them.
    """

    def __init__(self, connection: Writer, path: Path, lock: ProjectLock) -> None:
        self._connection, self._path, self._lock = connection, path, lock
        self.turn = connection.turn
        rows = connection.execute("SELECT client, COUNT(*) FROM pending GROUP BY client")
        self._counts: dict[str, int] = dict(rows.fetchall())

    @property
    def n_rows(self) -> int:
        """How many there are."""
        return sum(self._counts.values())

    def read(self) -> Pending:
        """What they tell."""
        return read_pending(self._connection)

    @cached_property
    def writer(self) -> Writer:
        """The connection for writing."""
        return connect(self._path, self.turn)

    def close(self) -> None:
        """Nothing more will be written."""
        if "writer" in vars(self):
            self.writer.close()
            del self.writer

    def append(self, row: tuple) -> None:
        """Write a row; it is on the disk on return.

        Raises
        ------
        TextureError
            It cannot be written.
        """
        with self.turn:
            self._write((INSERT, row))
            self._counts[row[0]] = self._counts.get(row[0], 0) + 1
            self._lock.note(self._lock.seq, self.n_rows)

    def replace(self, client: str, rows: list[tuple]) -> None:
        """Write rows in the place of all that a client has; errors as `append`."""
        with self.turn:
            before = self._counts.pop(client, 0)
            self._lock.note(self._lock.seq, self.n_rows)  # too few for a moment is no damage
            try:
                forget = (self.forget(client),) if before else ()
                self._write(*forget, *((INSERT, row) for row in rows))
                before = len(rows)
            finally:
                self._counts[client] = before
                self._lock.note(self._lock.seq, self.n_rows)

    def forget(self, client: str) -> Statement:
        """What deletes a client's rows; `forgotten` is to be called when it was executed."""
        return FORGET, (client,)

    def forgotten(self, client: str) -> None:
        """A client's rows are gone."""
        self._counts.pop(client, None)

    def _write(self, *statements: Statement) -> None:
        try:
            in_one(self.writer, *statements)
        except sqlite3.Error as error:
            what = f"a stroke could not be kept: {error}"
            fix = "free some space, or save the project elsewhere; then do it again"
            raise TextureError(what, "LiveStrokes", fix) from None


def begin_row(client: str, cseq: int, layer: int, brush: Brush) -> tuple:
    """The row that begins a stroke."""
    data = json.dumps({"layer": layer, "brush": brush.to_dict()}, sort_keys=True)
    return _row(client, cseq, BEGIN, data.encode())


def add_row(client: str, cseq: int, samples: Samples) -> tuple:
    """The row of a batch of samples."""
    return _row(client, cseq, ADD, samples.astype("<f8").tobytes())


def mark_row(client: str, cseq: int) -> tuple:
    """The row that stays of a stroke that was cancelled."""
    return _row(client, cseq, MARK, b"")


def read_pending(connection: sqlite3.Connection) -> Pending:
    """Read all rows that can be read; nothing is raised for the others."""
    found = Pending()
    for id, row in _rows(connection, found.wrong):
        try:
            _take(found, row)
        except (TextureError, KeyError, TypeError, ValueError) as error:
            words = error.what if isinstance(error, TextureError) else error
            found.wrong.append(f"row {id} of the unfinished strokes: {words}")
        else:
            found.rows.append(row)
    return found


def _row(client: str, cseq: int, kind: str, data: bytes) -> tuple:
    row = (client, cseq, kind, data, time.time())
    return *row, _checksum(row)


def _checksum(row: tuple) -> int:
    client, cseq, kind, data, t = row
    return zlib.crc32(data, zlib.crc32(f"{client!r} {cseq!r} {kind!r} {t!r}".encode()))


def _rows(connection: sqlite3.Connection, wrong: list[str]) -> Iterator[tuple[int, tuple]]:
    """Numbers of rows, and the rows, as far as the table can be read from either of its ends."""
    ids: set[int] = set()
    try:
        if not connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'pending'").fetchone():
            return  # of format version 1
        for order in ("ASC", "DESC"):
            for (id,) in connection.execute(f"SELECT id FROM pending ORDER BY id {order}"):
                ids.add(id)
    except FAULTS as error:
        wrong.append(f"unfinished strokes cannot be read: {error}")
    for id in sorted(ids):
        try:
            row = connection.execute(
                f"SELECT {COLUMNS} FROM pending WHERE id = ?", (id,)
            ).fetchone()
        except FAULTS as error:
            wrong.append(f"row {id} of the unfinished strokes: {error}")
        else:
            yield id, row


def _take(found: Pending, row: tuple) -> None:
    """Let one row tell its part; an error if it does not fit."""
    client, cseq, kind, data, _, crc = row
    if not isinstance(data, bytes) or _checksum(row[:-1]) != crc:
        raise ValueError("it has a wrong checksum")
    if kind == BEGIN:
        plain = json.loads(data)
        brush = Brush.from_dict(plain["brush"])
        found.strokes.pop(client, None)
        found.strokes[client] = PendingStroke(int(plain["layer"]), brush, cseq)
    elif kind == ADD:
        if client not in found.strokes:
            raise ValueError(f"the beginning of this stroke of {client!r} is missing")
        samples = np.frombuffer(data, "<f8").astype(np.float64).reshape(-1, SAMPLE_BYTES // 8)
        found.strokes[client].batches.append(samples)
        found.strokes[client].cseq = cseq
    elif kind != MARK:
        raise ValueError(f"there is no kind {kind!r}")
    found.last[client] = max(cseq, found.last.get(client, 0))
