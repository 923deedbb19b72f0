"""Only one process writes a project: the lock, and what it leaves behind when its owner dies.

The file ``PROJECT-lock`` is locked by the operating system as long as its owner lives. It says who
that is and up to which operation was acknowledged; a project that knows fewer has been damaged.
"""

import os
from pathlib import Path

from ..errors import TextureError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None
    import msvcrt

RECORD = 40  # bytes, so that every record overwrites the one before
LOCKED_BYTE = 1 << 20  # Windows keeps others from reading locked bytes


class ProjectLock:
    """Held from when it is made until `release`.

    Attributes
    ----------
    left_seq : int
        The last operation that an owner who died had acknowledged; 0 if there was none.
    left_pending : int
        How many batches of unfinished strokes it had acknowledged besides.
    seq, n_pending : int
        What was noted last.

    Raises
    ------
    TextureError
        Another process holds it, or its file cannot be written.
    """

    def __init__(self, project: Path) -> None:
        self.path = Path(f"{project}-lock")
        while True:
            self._file = self._opened(project)
            if not _try_lock(self._file):
                pid, *_ = self._record()
                os.close(self._file)
                what = f"the project is open in process {pid}"
                raise TextureError(what, str(project), "close it there, or open a copy")
            if self._is_in_place():
                break
            os.close(self._file)  # its owner removed it in the meantime
        _, self.left_seq, self.left_pending = self._record()
        self.note(self.left_seq, self.left_pending)

    def note(self, seq: int, n_pending: int) -> None:
        """Note which operation was acknowledged last, and how many batches are no operations."""
        self.seq, self.n_pending = seq, n_pending
        record = f"{os.getpid()} {seq} {n_pending}\n".encode().ljust(RECORD)
        if hasattr(os, "pwrite"):
            os.pwrite(self._file, record, 0)
        else:
            os.lseek(self._file, 0, os.SEEK_SET)
            os.write(self._file, record)

    def release(self, *, keep: bool = False) -> None:
        """Let others open the project; ``keep`` leaves the note."""
        if not keep:
            self.path.unlink(missing_ok=True)
        os.close(self._file)

    def _opened(self, project: Path) -> int:
        try:
            return os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            what = f"the project's lock cannot be written: {error.strerror}"
            fix = "make its folder writable, or copy the project elsewhere"
            raise TextureError(what, str(project), fix) from None

    def _record(self) -> tuple[int, int, int]:
        os.lseek(self._file, 0, os.SEEK_SET)
        words = os.read(self._file, RECORD).split()
        numbers = [int(word) for word in words[:3] if word.isdigit()]
        if len(numbers) != len(words[:3]) or len(numbers) < 2:
            return 0, 0, 0
        return numbers[0], numbers[1], numbers[2] if len(numbers) > 2 else 0

    def _is_in_place(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self._file), os.stat(self.path))
        except OSError:
            return False


def _try_lock(file: int) -> bool:
    try:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        else:
            os.lseek(file, LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
    except OSError:
        return False
    return True
