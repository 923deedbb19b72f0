"""Make a sound project of what can be read of a damaged one, which stays beside it."""

import contextlib
import os
import shutil
import sqlite3
import tempfile
from collections.abc import Callable
from pathlib import Path

from .blobs import Damaged
from .checkpoint import install, load_checkpoint
from .checkpoint_write import write_checkpoint
from .content import Content
from .journal_log import COLUMNS, Entry, read_row, steps_of
from .journal_schema import FAULTS, create
from .pending import INSERT as INSERT_PENDING
from .pending import read_pending
from .project_parts import read_parts, write_parts

PLACES = ", ".join("?" for _ in COLUMNS.split(","))


def salvage(path: Path, warn: Callable[[str], None]) -> None:
    """Put a sound project in the place of a damaged one, as late a state as can be had.

    Raises
    ------
    Damaged
        Nothing can be read; then the file stays where it is.
    """
    folder = Path(tempfile.mkdtemp(prefix=".salvage-", dir=path.parent))
    try:
        damaged, new = folder / "damaged", folder / "new"
        for end in ("", "-wal"):
            if Path(f"{path}{end}").exists():
                shutil.copyfile(f"{path}{end}", f"{damaged}{end}")
        with contextlib.closing(sqlite3.connect(damaged, isolation_level=None)) as source:
            _copy(source, new, warn)
        kept = _free_name(path)
        for end in ("", "-wal", "-shm"):
            if Path(f"{path}{end}").exists():
                os.rename(f"{path}{end}", f"{kept}{end}")
        os.replace(new, path)
        warn(f"the damaged file is kept as {kept}")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _copy(source: sqlite3.Connection, new: Path, warn: Callable[[str], None]) -> None:
    """Write all that is sound, up to the latest state, into a new file."""
    texture, origin, _ = read_parts(source, warn)
    rows = _rows_from(source, origin + 1)
    steps, n_done = steps_of([read_row(row) for row in rows])
    last = origin + len(rows)
    tips = {0: 0} | {step.seq: index + 1 for index, step in enumerate(steps[:n_done])}
    checkpoint = None
    for seq, tip in _checkpoints(source, warn):
        is_later = seq > last
        if not is_later and tip not in tips:
            continue
        try:
            install(texture, load_checkpoint(source, texture, seq))
        except Damaged as error:
            warn(str(error))
            continue
        checkpoint = (seq, tip)
        if is_later:
            # What came before it cannot be undone, but the state is later than the rows tell
            checkpoint, origin, rows = (seq, 0), seq, _rows_from(source, seq + 1)
        break
    if origin and checkpoint is None:
        raise Damaged(f"the state after operation {origin} cannot be read")
    _say_what_is_lost(source, origin, rows, warn)
    pending = read_pending(source)
    for words in pending.wrong:
        warn(words)
    with contextlib.closing(create(new)) as target:
        target.execute("BEGIN")
        write_parts(target, texture, origin)
        target.executemany(f"INSERT INTO op ({COLUMNS}) VALUES ({PLACES})", rows)
        target.executemany(INSERT_PENDING, pending.rows)
        target.execute("COMMIT")
        if checkpoint is not None:
            write_checkpoint(target, Content(texture).freeze(), *checkpoint, origin)
        target.execute("PRAGMA wal_checkpoint(TRUNCATE)")


def _rows_from(source: sqlite3.Connection, seq: int) -> list[tuple]:
    """Rows of operations from one on, up to the first that is missing or damaged."""
    rows: list[tuple] = []
    entries: list[Entry] = []
    question = f"SELECT {COLUMNS} FROM op WHERE seq = ?"
    with contextlib.suppress(Damaged, TypeError, *FAULTS):
        while row := source.execute(question, (seq + len(rows),)).fetchone():
            entries.append(read_row(row))
            rows.append(row)
    return rows[: _n_consistent(entries)]


def _n_consistent(entries: list[Entry]) -> int:
    """How many operations do not undo or redo what came before the first of them."""
    n = len(entries)
    while True:
        try:
            steps_of(entries[:n])
        except Damaged:
            n -= 1
        else:
            return n


def _checkpoints(source: sqlite3.Connection, warn: Callable[[str], None]) -> list[tuple[int, int]]:
    try:
        return source.execute("SELECT seq, tip FROM checkpoint ORDER BY seq DESC").fetchall()
    except FAULTS as error:
        warn(f"checkpoints cannot be read: {error}")
        return []


def _say_what_is_lost(
    source: sqlite3.Connection, origin: int, rows: list[tuple], warn: Callable[[str], None]
) -> None:
    last = origin + len(rows)
    try:
        (known,) = source.execute("SELECT MAX(seq) FROM op").fetchone()
    except FAULTS:
        known = None
    if origin:
        warn(f"operations up to {origin} can no longer be undone one by one")
    if known is None or known > last:
        warn(f"operations from {last + 1} on are lost")


def _free_name(path: Path) -> Path:
    number = 1
    while (kept := Path(f"{path}.damaged-{number}")).exists():
        number += 1
    return kept
