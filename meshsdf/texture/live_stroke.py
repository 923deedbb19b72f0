"""A stroke that is being painted, and that can be set aside for a while."""

import json
from collections.abc import Callable

import numpy as np

from ..arrays import Points, Values
from .brush import Brush
from .change import Change, changed_since, put_back
from .layer import Layer
from .operation_kinds import layer_numbered
from .operations import Operation
from .pending import PendingStroke, Samples, add_row, begin_row
from .pool import Slots
from .stroke import Stroke, add_all
from .stroke_path import Normals, StrokePath
from .stroke_record import StrokeRecord
from .volume_texture import VolumeTexture


class LiveStroke:
    """One client's stroke: its samples, and the paint of these while it is shown.

    Samples may come on another thread than that which paints.

    Parameters
    ----------
    texture : VolumeTexture
    told : PendingStroke
        Brush, layer and the samples so far; they are not painted yet.

    Attributes
    ----------
    layer : int
        Number of the layer it is for.
    brush : Brush
        As the operation will have it.
    batches : list of (n, 7) float64
        Samples as they came.
    cseq : int
        The client's number of the last of them, or of the beginning.
    is_open : bool
        Whether more may come; for the owner's use.
    trouble : str
        Why it could not be painted, if that was told.
    """

    def __init__(self, texture: VolumeTexture, told: PendingStroke) -> None:
        self.texture = texture
        self.layer, self.cseq = told.layer, told.cseq
        self.brush = Brush.from_dict(json.loads(json.dumps(told.brush.to_dict())))
        self.batches: list[Samples] = list(told.batches)
        self.is_open = True
        self.trouble = ""
        self._stroke: Stroke | None = None
        self._n_laid = 0  # batches of the stroke that is painted
        self._on: Layer | None = None
        self._before = np.empty(0, np.int32)
        self._path: StrokePath | None = None

    @property
    def is_painted(self) -> bool:
        """Whether the samples are on the layer; it stores what it did before when they are not."""
        return self._stroke is not None

    @property
    def has_layer(self) -> bool:
        """Whether the layer it is for is there."""
        return any(layer.number == self.layer for layer in self.texture.layers)

    @property
    def slots_below(self) -> Slots:
        """What the layer would store without the stroke, if this is painted; held as long."""
        return self._before

    @property
    def n_waiting(self) -> int:
        """Batches that are not painted."""
        return len(self.batches) - self._n_laid

    def put_on(self) -> None:
        """Paint what is not painted yet: all samples, on the layer as it is now, or the latest.

        Raises
        ------
        TextureError
            The layer is not there, or the samples left after damage are too far apart; then the
            stroke is taken off.
        """
        if not self.is_painted:
            self._begin()
        batches = self.batches[self._n_laid :]
        if not batches:
            return
        try:
            add_all(self._stroke, *_columns(np.concatenate(batches)))
        except BaseException:  # some of it may be painted
            self.take_off()
            raise
        self._n_laid += len(batches)

    def _begin(self) -> None:
        layer = layer_numbered(self.texture, self.layer)
        self._on, self._before = layer, layer.slots.copy()
        # What is held now is never written: the stroke gets slots of its own
        self.texture.pool.hold(self._before)
        # Whoever follows slots knows by their generation that those hold something new
        self.texture.pool.begin_recording()
        self.texture.pool.end_recording()
        self._stroke, self._n_laid = Stroke(self.texture, layer, self.brush), 0

    def take_off(self) -> None:
        """Let the layer be as if the stroke had never been."""
        if self._stroke is not None:
            self._stroke.cancel()
            self._put_back()

    def add(self, cseq: int, samples: Samples, keep: Callable[[], None]) -> None:
        """Go on, once the samples are checked and ``keep()`` has put them into the file.

        Raises
        ------
        TextureError
            The samples make no sense; or what ``keep`` raises. Then nothing has changed.
        """
        try:
            self._followed().follow(*_columns(samples))
            keep()
        except BaseException:
            self._path = None
            raise
        self.batches.append(samples)
        self.cseq = cseq

    def end(self) -> Change:
        """End the stroke, which must be painted; what it changed.

        Raises
        ------
        TextureError
            It cannot be ended; then it is taken off.
        """
        try:
            self._stroke.end()
        except BaseException:
            self._put_back()
            raise
        change = changed_since(self.texture, self._on, self._before)
        self._let_go()
        return change

    def operation(self) -> Operation:
        """The whole stroke as an operation."""
        record = StrokeRecord(self.brush, *_columns(self._samples()), self.layer)
        return Operation("stroke", record.to_params())

    def rows(self, client: str) -> list[tuple]:
        """The whole stroke as rows of the file."""
        begin = begin_row(client, self.cseq, self.layer, self.brush)
        return [begin, add_row(client, self.cseq, self._samples())]

    def _samples(self) -> Samples:
        return np.concatenate([np.empty((0, 7)), *self.batches])

    def _put_back(self) -> None:
        put_back(self.texture, self._on, self._before)
        self._let_go()

    def _let_go(self) -> None:
        self.texture.pool.drop(self._before)
        self._stroke, self._on, self._before = None, None, np.empty(0, np.int32)
        self._n_laid = 0

    def _followed(self) -> StrokePath:
        """The path as far as it has come."""
        if self._path is None:
            self._path = StrokePath(self.brush, self.texture.octree.texel)
            for batch in self.batches:
                self._path.follow(*_columns(batch))
        return self._path


def _columns(samples: Samples) -> tuple[Points, Normals, Values]:
    """Points, normals and pressures."""
    points, normals = samples[:, :3].copy(), samples[:, 3:6].copy()
    return points, normals, samples[:, 6].copy()
