"""Strokes that are painted while they are drawn, each batch of samples on the disk first.

A stroke comes from its client in batches. Each is kept in the project's file before it is
acknowledged, and painted at once, or soon; at the end the whole stroke becomes one operation, whose
texels are those that were painted. Whoever opens the project after its owner died finds the stroke
again.
"""

import contextlib
import os
from collections.abc import Iterator

import numpy as np

from ..arrays import Points, Values
from ..errors import TextureError
from .brush import Brush
from .history import BUDGET
from .journal import Project, Warn, unheard
from .live_conflicts import layers_going, layers_touched
from .live_stroke import LiveStroke
from .operation_kinds import layer_numbered
from .operations import Operation
from .pending import PendingStroke, Samples, add_row, begin_row, mark_row
from .pool import Slots
from .stroke_path import Normals


class LiveStrokes:
    """The strokes of a project's clients, one of each at most.

    Parameters
    ----------
    project : Project
        From now on nobody else may change it. Strokes that were left unfinished in its file are
        open again; `open` finds them, too, while `Project.open` ends them.

    Notes
    -----
    A client counts what it sends: batches and operations together, 1, 2, 3 ... What comes again
    with a number that is known is not done again.

    On one layer the first stroke is painted; samples of others wait (on the disk) until it ends.
    An operation that touches the layer of a stroke finds it as if the stroke were not there; the
    stroke is then painted on top again. So the order in which strokes end and operations come is
    the order of the journal, and opening the project gives the same bytes.

    A layer does not go while strokes are open on it.

    `keep` may be called on one other thread while the owner's is at work.
    """

    def __init__(self, project: Project) -> None:
        self.project = project
        self._turn = project.pending.turn  # held for what is told of strokes in memory and file
        self._strokes: dict[str, LiveStroke] = {}  # in the order in which they began
        self._last: dict[str, int] = {}
        self._early: dict[str, int] = {}  # operations of strokes whose clients did not end them
        for client, cseq in project.seqs:
            self._last[client] = max(cseq, self._last.get(client, 0))
        found = project.pending.read()
        for words in found.wrong:
            project.warn(words)
        for client, cseq in found.last.items():
            self._last[client] = max(cseq, self._last.get(client, 0))
        project.painting = self
        for client, told in found.strokes.items():
            self._strokes[client] = LiveStroke(project.texture, told)
        self.paint()

    @classmethod
    def open(
        cls,
        path: str | os.PathLike[str],
        *,
        budget: int = BUDGET,
        warn: Warn = unheard,
    ) -> "LiveStrokes":
        """Open a project, and the strokes that were left unfinished; as `Project.open`."""
        return cls(Project.open(path, budget=budget, warn=warn, finish_strokes=False))

    @property
    def is_painting(self) -> bool:
        """Whether texels may be on a layer that are no operation yet."""
        return bool(self._strokes)

    @property
    def n_waiting(self) -> int:
        """Batches that `paint` would paint; on any thread."""
        return sum(stroke.n_waiting for _, stroke in self._of_layers() if not stroke.trouble)

    def slots_below(self) -> dict[int, Slots]:
        """What layers with paint that is no operation yet would store without it."""
        painted = [stroke for stroke in self._strokes.values() if stroke.is_painted]
        return {stroke.layer: stroke.slots_below for stroke in painted}

    def last_cseq(self, client: str) -> int:
        """The highest number that is known of a client; 0 if it never sent anything."""
        return self._last.get(client, 0)

    def open_clients(self) -> list[str]:
        """Who has a stroke open, in the order in which these began."""
        return list(self._strokes)

    def begin(self, client: str, cseq: int, layer: int, brush: Brush) -> None:
        """Begin a stroke; an open one of the same client ends first.

        Raises
        ------
        TextureError
            There is no such layer, or the stroke cannot be kept.
        """
        if self._is_known(client, cseq):
            return
        layer_numbered(self.project.texture, layer)
        if client in self._strokes:
            self._finish_or_warn(client)
        stroke = LiveStroke(self.project.texture, PendingStroke(layer, brush, cseq))
        with self._turn:
            row = begin_row(client, cseq, layer, stroke.brush)
            self.project.pending.replace(client, [row])
            self._strokes[client], self._last[client] = stroke, cseq

    def add(
        self,
        client: str,
        cseq: int,
        points: Points,
        normals: Normals,
        pressures: Values | None = None,
    ) -> None:
        """Go on with a stroke: the batch is painted, or waits, and is on the disk on return.

        Parameters
        ----------
        client, cseq
            Who sends it, and its number there.
        points, normals, pressures
            As `Stroke.add` takes them.

        Raises
        ------
        TextureError
            No stroke of the client is open, the samples make no sense, or they cannot be kept;
            then nothing has changed.
        """
        pressures = np.ones(len(points)) if pressures is None else pressures
        self.keep(client, cseq, np.column_stack([points, normals, pressures]))
        self.paint()

    def keep(self, client: str, cseq: int, samples: Samples) -> None:
        """As `add`, of rows (n, 7): point, normal, pressure; not painted on return, but by `paint`
        or what comes after."""
        with self._turn:
            if self._is_known(client, cseq):
                return
            stroke = self._stroke_of(client)
            row = add_row(client, cseq, samples)
            stroke.add(cseq, samples, lambda: self.project.pending.append(row))
            self._last[client] = cseq

    def paint(self) -> None:
        """Paint of every layer's strokes what has come of the first."""
        for client, stroke in self._of_layers():
            try:
                stroke.put_on()
            except TextureError as error:
                if stroke.trouble != error.what:
                    stroke.trouble = error.what
                    words = f"the stroke of client {client!r} cannot be painted: {error.what}"
                    self.project.warn(words)

    def end(self, client: str, cseq: int) -> int:
        """End a stroke; the number of the operation that it has become.

        Of a stroke that was ended before its client said so, the number that it got then.

        Raises
        ------
        TextureError
            The client never had a stroke; or the operation cannot be kept, and the stroke stays
            open; or it cannot be painted, and is cancelled.
        """
        if self._is_known(client, cseq):
            return self.project.seqs.get((client, cseq), 0)
        last = self.project.seqs.get((client, self.last_cseq(client)))
        early = self._early.pop(client, last)
        if client not in self._strokes and early is not None:
            self._last[client] = cseq
            return early
        return self._end(client, cseq)

    def finish(self, client: str) -> int:
        """End a stroke whose client no longer says so; errors as `end`."""
        seq = self._end(client, self._stroke_of(client).cseq)
        self._early[client] = seq
        return seq

    def finish_all(self) -> None:
        """End all strokes; ``project.warn`` is told of those that cannot be painted or kept."""
        for client in self.open_clients():
            with contextlib.suppress(TextureError):
                self._finish_or_warn(client)

    def cancel(self, client: str, cseq: int | None = None) -> None:
        """Take a stroke back as if it had never begun; nothing happens if none is open."""
        if cseq is not None and self._is_known(client, cseq):
            return
        cseq = self.last_cseq(client) if cseq is None else cseq
        if client in self._strokes:
            self._drop(client, cseq)
            self.paint()
        self._last[client] = cseq

    def apply(self, operation: Operation, *, client: str = "", cseq: int | None = None) -> int:
        """Do any other operation, as `Project.apply`; 0 for a number known of something else.

        Raises
        ------
        TextureError
            It cannot be done, or a layer would go on which a stroke is open.
        """
        if cseq is not None and self._is_known(client, cseq):
            return self.project.seqs.get((client, cseq), 0)
        going = layers_going(self.project, operation)
        for painter, stroke in self._strokes.items():
            if stroke.layer in going:
                what = f"client {painter!r} is painting on layer {stroke.layer}, which would go"
                raise TextureError(what, f"operation {operation.kind!r}", "wait for the stroke")
        touched = layers_touched(self.project, operation)
        with self._aside([one for one in self._strokes.values() if one.layer in touched]):
            seq = self.project.apply_under(operation, client=client, cseq=cseq)
        if cseq is not None:
            self._last[client] = cseq
        return seq

    def set_aside(self) -> None:
        """Take all strokes off their layers; they stay in the file."""
        for stroke in self._strokes.values():
            stroke.take_off()

    def close(self) -> None:
        """End all strokes and close the project."""
        self.finish_all()
        self.project.close()

    def _is_known(self, client: str, cseq: int) -> bool:
        return cseq <= self.last_cseq(client)

    def _stroke_of(self, client: str) -> LiveStroke:
        stroke = self._strokes.get(client)
        if stroke is None or not stroke.is_open:
            what = f"client {client!r} has no stroke open"
            raise TextureError(what, "LiveStrokes", "begin one first")
        return stroke

    def _of_layers(self) -> list[tuple[str, LiveStroke]]:
        """Of every layer's strokes the first, and whose it is."""
        first: dict[int, tuple[str, LiveStroke]] = {}
        for client, stroke in list(self._strokes.items()):
            if stroke.has_layer:
                first.setdefault(stroke.layer, (client, stroke))
        return list(first.values())

    @contextlib.contextmanager
    def _aside(self, strokes: list[LiveStroke]) -> Iterator[None]:
        """Without the paint of some strokes on their layers."""
        for stroke in strokes:
            stroke.take_off()
        try:
            yield
        finally:
            self.paint()

    def _finish_or_warn(self, client: str) -> None:
        """End a stroke; raises only if it stays open."""
        try:
            self.finish(client)
        except TextureError as error:
            self.project.warn(f"the stroke of client {client!r} could not end: {error.what}")
            if client in self._strokes:
                raise

    def _end(self, client: str, cseq: int) -> int:
        stroke, project = self._stroke_of(client), self.project
        with self._closed(stroke):
            others = [
                other
                for other in self._strokes.values()
                if other is not stroke and other.layer == stroke.layer and other.is_painted
            ]
            with self._aside(others):
                try:
                    stroke.put_on()
                    change = stroke.end()
                except TextureError:
                    self._drop(client, cseq)
                    raise
                try:
                    seq = project.adopt(stroke.operation(), change, client=client, cseq=cseq)
                except BaseException as error:
                    change.release(project.texture)
                    if not isinstance(error, TextureError):
                        # Ctrl-C may come when the rows were gone already
                        project.pending.replace(client, stroke.rows(client))
                    raise
                with self._turn:
                    del self._strokes[client]
                    self._last[client] = max(cseq, self._last[client])
        project.keep_house()
        return seq

    @contextlib.contextmanager
    def _closed(self, stroke: LiveStroke) -> Iterator[None]:
        """Meanwhile nothing more of a stroke is kept."""
        with self._turn:
            stroke.is_open = False
        try:
            yield
        finally:
            stroke.is_open = True

    def _drop(self, client: str, cseq: int) -> None:
        """Forget a stroke, but not its client's numbers."""
        with self._turn:
            self.project.pending.replace(client, [mark_row(client, cseq)])
            stroke = self._strokes.pop(client)
            self._last[client] = max(cseq, self._last[client])
        stroke.take_off()


def finish_pending(project: Project) -> None:
    """Make operations of the strokes that were left unfinished in a project's file."""
    strokes = LiveStrokes(project)
    strokes.finish_all()
    strokes.set_aside()
    project.painting = None
