"""Read a project's file, if all of it that is needed is sound."""

import sqlite3
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from .blobs import Damaged
from .journal_log import Entry, read_log
from .journal_schema import connect, header_damage, integrity, lost_commits, upgrade
from .pending import read_pending
from .project_lock import ProjectLock
from .project_parts import read_parts


def open_sound(
    path: Path, lock: ProjectLock, warn: Callable[[str], None], restored: Callable[..., Any]
) -> Any:
    """The project of a file in which nothing but checkpoints may be damaged.

    ``restored(entries, connection, texture, origin)`` makes it, in the state after the last of
    its operations.

    Raises
    ------
    Damaged
        Something else is.
    """
    if found := header_damage(path):
        raise Damaged(found)
    n_lost = lost_commits(path)
    connection = connect(path)
    helper = ThreadPoolExecutor(1)
    try:
        upgrade(connection)
        verdict = helper.submit(integrity, path)
        texture, origin, sound = read_parts(connection, warn)
        if not sound:
            raise Damaged("mesh or octree are not as they were written")
        entries, n_pending = _sound_rows(connection, origin)
        project = restored(entries, connection, texture, origin)
        if verdict.result() != "ok":
            raise Damaged(verdict.result())
        if words := missing(lock, project.last_seq, n_pending, n_lost):
            warn(f"{path}: {words}")
    except BaseException:
        helper.shutdown()
        connection.close()
        raise
    helper.shutdown()
    return project


def _sound_rows(connection: sqlite3.Connection, origin: int) -> tuple[list[Entry], int]:
    """The operations, and how many rows there are of strokes that are none yet."""
    entries, wrong = read_log(connection, origin)
    pending = read_pending(connection)
    if wrong or pending.wrong:
        raise Damaged(wrong or "; ".join(pending.wrong))
    return entries, len(pending.rows)


def missing(lock: ProjectLock, last_seq: int, n_pending: int, n_lost: int) -> str | None:
    """What is not there of what was acknowledged before the last owner died, if anything."""
    left = lock.left_seq
    if left > last_seq:
        return f"operations {last_seq + 1} to {left} were acknowledged and are missing"
    if left == last_seq and n_pending < lock.left_pending:
        n = lock.left_pending - n_pending
        return f"batches of unfinished strokes were acknowledged and are missing: {n}"
    if n_lost > 1 or (n_lost and not left):
        return f"{n_lost} damaged commits in the log were passed over"
    return None
