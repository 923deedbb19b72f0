"""Bytes put by: in memory while they are few, beyond that in a file without a name."""

import contextlib
import tempfile
import weakref
from bisect import bisect_left
from typing import BinaryIO

MEMORY = 4 * 2**20


class Spill:
    """Keeps pieces of bytes under numbers.

    Parameters
    ----------
    memory : int
        Bytes that stay in memory; what comes when these are full goes into a file. The file is
        made in the folder for temporary files when it is first needed, and has no name there: it
        is gone when it is closed, or when the process ends in whatever way.

    Attributes
    ----------
    n_in_memory, n_in_file : int
        Bytes that are kept now.

    Notes
    -----
    What the disk does not take stays in memory; the next piece is tried again.
    """

    def __init__(self, *, memory: int = MEMORY) -> None:
        self.memory = memory
        self.n_in_memory = self.n_in_file = 0
        self._kept: dict[int, bytes | tuple[int, int]] = {}
        self._next = 0
        self._file: BinaryIO | None = None
        self._close = lambda: None
        self._room = _Room()

    def put(self, data: bytes) -> int:
        """Keep bytes; the number that they are asked for by."""
        number, self._next = self._next, self._next + 1
        place = None
        if data and self.n_in_memory + len(data) > self.memory:
            place = self._written(data)
        if place is None:
            self.n_in_memory += len(data)
            self._kept[number] = data
        else:
            self.n_in_file += len(data)
            self._kept[number] = place, len(data)
        return number

    def get(self, number: int) -> bytes:
        """The bytes again; fewer if the file lost some, and OSError if it cannot be read."""
        kept = self._kept[number]
        if isinstance(kept, bytes):
            return kept
        place, n = kept
        self._file.seek(place)
        parts = []
        while n and (part := self._file.read(n)):
            parts.append(part)
            n -= len(part)
        return b"".join(parts)

    def free(self, number: int) -> None:
        """Forget bytes; their room in the file is used again."""
        kept = self._kept.pop(number)
        if isinstance(kept, bytes):
            self.n_in_memory -= len(kept)
            return
        self.n_in_file -= kept[1]
        self._give_back(*kept)

    def close(self) -> None:
        """Forget everything."""
        self._close()
        self._kept.clear()
        self.n_in_memory = self.n_in_file = 0
        self._file, self._room = None, _Room()

    def _written(self, data: bytes) -> int | None:
        """Where in the file the bytes are now; None if it does not take them."""
        place = None
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115, closed by `close`
                self._close = weakref.finalize(self, self._file.close)
            place = self._room.take(len(data))
            self._file.seek(place)
            rest = memoryview(data)
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            if place is not None:
                self._give_back(place, len(data))
            return None
        return place

    def _give_back(self, place: int, n: int) -> None:
        end = self._room.end
        self._room.give_back(place, n)
        if self._room.end < end:
            with contextlib.suppress(OSError):
                self._file.truncate(self._room.end)


class _Room:
    """Which parts of a file are free, up to its end."""

    def __init__(self) -> None:
        self.end = 0
        self._places: list[int] = []  # of holes, in rising order
        self._sizes: dict[int, int] = {}

    def take(self, n: int) -> int:
        """The first place that has room for n bytes."""
        for row, place in enumerate(self._places):
            size = self._sizes[place]
            if size >= n:
                del self._places[row], self._sizes[place]
                if size > n:
                    self._places.insert(row, place + n)
                    self._sizes[place + n] = size - n
                return place
        place, self.end = self.end, self.end + n
        return place

    def give_back(self, place: int, n: int) -> None:
        """These bytes are free; holes beside each other become one, and the last one is the end."""
        row = bisect_left(self._places, place)
        if row < len(self._places) and self._places[row] == place + n:
            n += self._sizes.pop(self._places.pop(row))
        if row and self._places[row - 1] + self._sizes[self._places[row - 1]] == place:
            row -= 1
            before = self._places.pop(row)
            place, n = before, n + self._sizes.pop(before)
        if place + n == self.end:
            self.end = place
        else:
            self._places.insert(row, place)
            self._sizes[place] = n
