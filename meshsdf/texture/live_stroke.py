"""A stroke that is being painted, and that can be set aside for a while."""

import json

import numpy as np

from ..arrays import Points, Values
from ..errors import TextureError
from .brush import Brush
from .change import Change, changed_since, put_back
from .layer import Layer
from .operation_kinds import layer_numbered
from .operations import Operation
from .pending import PendingStroke, Samples, add_row, begin_row
from .stroke import Stroke, add_all
from .stroke_path import Normals, StrokePath
from .stroke_record import StrokeRecord
from .volume_texture import VolumeTexture


class LiveStroke:
    """One client's stroke: its samples, and the paint of these while it is shown.

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
    """

    def __init__(self, texture: VolumeTexture, told: PendingStroke) -> None:
        self.texture = texture
        self.layer, self.cseq = told.layer, told.cseq
        self.brush = Brush.from_dict(json.loads(json.dumps(told.brush.to_dict())))
        self.batches: list[Samples] = list(told.batches)
        self._stroke: Stroke | None = None
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

    def put_on(self) -> None:
        """Paint all samples on the layer as it is now, if they are not there already.

        Raises
        ------
        TextureError
            The layer is not there, or the samples left after damage are too far apart.
        """
        if self.is_painted:
            return
        layer = layer_numbered(self.texture, self.layer)
        self._on, self._before = layer, layer.slots.copy()
        # What is held now is never written: the stroke gets slots of its own
        self.texture.pool.hold(self._before)
        # Whoever follows slots knows by their generation that those hold something new
        self.texture.pool.begin_recording()
        self.texture.pool.end_recording()
        self._stroke, self._path = Stroke(self.texture, layer, self.brush), None
        try:
            add_all(self._stroke, *_columns(self._samples()))
        except BaseException:
            self.take_off()
            raise

    def take_off(self) -> None:
        """Let the layer be as if the stroke had never been."""
        if self._stroke is not None:
            self._stroke.cancel()
            self._put_back()

    def add(self, cseq: int, samples: Samples) -> None:
        """Go on, and paint if the stroke is painted.

        Raises
        ------
        TextureError
            The samples make no sense; then nothing has changed.
        """
        way = self._followed().follow if self._stroke is None else self._stroke.add
        try:
            way(*_columns(samples))
        except TextureError:
            raise
        except BaseException:  # some of it may be painted
            self.take_off()
            self._path = None
            raise
        self.batches.append(samples)
        self.cseq = cseq

    def forget_last(self, cseq: int) -> None:
        """Take the last batch back; ``cseq`` is the number of the one before it."""
        self.batches.pop()
        self.cseq = cseq
        self._path = None
        if self.is_painted:
            self.take_off()
            self.put_on()

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

    def _followed(self) -> StrokePath:
        """The path of a stroke that waits, as far as it has come."""
        if self._path is None:
            self._path = StrokePath(self.brush, self.texture.octree.texel)
            for batch in self.batches:
                self._path.follow(*_columns(batch))
        return self._path


def _columns(samples: Samples) -> tuple[Points, Normals, Values]:
    """Points, normals and pressures."""
    points, normals = samples[:, :3].copy(), samples[:, 3:6].copy()
    return points, normals, samples[:, 6].copy()
