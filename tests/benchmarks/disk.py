"""What the disk alone takes for a page, so that one can tell its own waits from a program's.

Pages are due at a steady rate, as dabs are, and a wait counts from when its page is due: what comes
while the disk stands still waits, too.
"""

import os
import tempfile
import threading
import time

import numpy as np

PAGE = 4096
RATE = 60.0  # pages per second


class Disk:
    """How long the disk takes for a page, while something else goes on."""

    def __init__(self):
        self.waits = []
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._write)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._is_over.set()
        self._thread.join()

    def _write(self):
        with tempfile.TemporaryFile(buffering=0) as file:
            file.write(bytes(2 * PAGE))
            os.fsync(file.fileno())
            begin, due = time.perf_counter(), 0.0
            while not self._is_over.wait(max(0.0, begin + due - time.perf_counter())):
                file.seek(0)
                file.write(os.urandom(PAGE))
                os.fdatasync(file.fileno())
                self.waits.append((due, 1e3 * (time.perf_counter() - begin - due)))
                due += 1 / RATE

    def parts(self, ends):
        """Milliseconds in the parts of the time that these are the ends of."""
        at, waits = np.array(self.waits).T
        return [part for part in np.split(waits, np.searchsorted(at, ends)) if len(part)]
