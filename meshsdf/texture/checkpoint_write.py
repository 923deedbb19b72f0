"""Write what a texture's layers hold into a project's file, in short transactions.

Only chunks that changed since the checkpoint before are written. Their rows bear the number of the
checkpoint's operation, which nobody asks for before the last transaction says that it is a
checkpoint; of one that was broken off, the next one removes the rows, and so does whoever opens the
project. Rows that no kept checkpoint needs are removed, too.
"""

import zlib
from collections.abc import Callable, Iterator

from .blobs import pack, pack_all
from .content import Frozen
from .journal_schema import Writer, in_one, transaction

KEPT = 2
BYTES_AT_ONCE = 1 << 19  # others may write after so many
ROWS_AT_ONCE = 128  # removed

INSERT = "INSERT OR REPLACE INTO brick VALUES (?, ?, ?, ?, ?, ?, ?)"
BROKEN_OFF = "DELETE FROM brick WHERE seq > IFNULL((SELECT MAX(seq) FROM checkpoint), -1)"
UNNEEDED = """
WITH latest AS (
    SELECT rowid AS id, seq, LEAD(seq) OVER (
        PARTITION BY layer, channel, chunk ORDER BY seq) AS next FROM brick)
SELECT id FROM latest WHERE NOT EXISTS (
    SELECT 1 FROM checkpoint AS c
    WHERE c.seq >= latest.seq AND (latest.next IS NULL OR c.seq < latest.next))
"""
FORGET_CHUNKS = """
INSERT INTO brick
SELECT DISTINCT layer, channel, chunk, :seq, 0, :crc, x'0000' FROM brick AS old
WHERE layer = :layer AND NOT EXISTS (
    SELECT 1 FROM brick WHERE layer = old.layer AND channel = old.channel
    AND chunk = old.chunk AND seq = :seq)
"""


def write_checkpoint(
    connection: Writer,
    frozen: Frozen,
    seq: int,
    tip: int,
    origin: int,
    *,
    rest: Callable[[], None] | None = None,
) -> None:
    """Keep what a texture held after operation ``seq``; on any thread.

    Parameters
    ----------
    connection : Writer
        No other thread may use it meanwhile.
    frozen : Frozen
        What it held.
    seq, tip, origin : int
        ``tip`` is the latest step that was done; the checkpoint of ``origin`` is never removed.
    rest : callable, optional
        Called between transactions, if others are painting; one core has to do then, too.
    """
    in_one(connection, (BROKEN_OFF, ()))
    for rows in _slices(frozen, seq, rest is not None):
        with transaction(connection):
            connection.executemany(INSERT, rows)
        if rest is not None:
            rest()
    codes = frozen.codes()
    layers = [(seq, number, *pack(data)) for number, data in codes.items()]
    digest = frozen.digest(codes)
    with transaction(connection):
        for number in frozen.new:
            # Another layer may have had its number, and rows, before that was undone
            values = {"seq": seq, "layer": number, "crc": zlib.crc32(b"\0\0")}
            connection.execute(FORGET_CHUNKS, values)
        connection.execute(
            "INSERT INTO checkpoint VALUES (?, ?, ?, ?)", (seq, tip, digest, frozen.listed)
        )
        connection.executemany("INSERT INTO layer VALUES (?, ?, ?, ?, ?)", layers)
        connection.execute(
            "DELETE FROM checkpoint WHERE seq != ? AND seq NOT IN "
            "(SELECT seq FROM checkpoint ORDER BY seq DESC LIMIT ?)",
            (origin, KEPT),
        )
    _prune(connection, rest)


def _slices(frozen: Frozen, seq: int, alone: bool) -> Iterator[list[tuple]]:
    """Rows of all chunks that changed, some at a time."""
    rows, n_bytes = [], 0
    for key, blob in pack_all(frozen.chunks(), at_once=16 if alone else 512, alone=alone):
        rows.append((key.layer, key.channel, key.chunk, seq, *blob))
        n_bytes += len(blob[2])
        if n_bytes >= BYTES_AT_ONCE:
            yield rows
            rows, n_bytes = [], 0
    if rows:
        yield rows


def _prune(connection: Writer, rest: Callable[[], None] | None) -> None:
    """Remove the rows that no checkpoint needs."""
    ids = connection.execute(UNNEEDED).fetchall()
    for begin in range(0, len(ids), ROWS_AT_ONCE):
        with transaction(connection):
            some = ids[begin : begin + ROWS_AT_ONCE]
            connection.executemany("DELETE FROM brick WHERE rowid = ?", some)
        if rest is not None:
            rest()
