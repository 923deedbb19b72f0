"""What durable messages do to the project; on the studio's thread, or on its intake."""

import threading
from typing import Any

import numpy as np

from ..errors import MeshsdfError, ServerError
from ..texture.brush import Brush
from ..texture.operations import Operation
from .asked import check_asked, check_brush_kinds
from .limits import check_brush
from .messages import Message, OperationAsked, StrokeBegin, Type
from .samples import Samples

MOST_REFUSED = 1024  # messages whose refusal is remembered, should they come again
_REFUSING = threading.Lock()
BAD_VALUES = (TypeError, ValueError, LookupError, ArithmeticError, AttributeError, MemoryError)


class Requests:
    """Carries out durable messages.

    Parameters
    ----------
    studio : Studio
    images : object
        ``images.get(name)`` gives a picture for projections.
    """

    def __init__(self, studio: Any, images: Any) -> None:
        self.studio, self.images = studio, images

    def carry_out(self, client: str, message: Message) -> int:
        """Do it and keep it; the number of the operation that it is, 0 for a part of a stroke.

        Raises
        ------
        MeshsdfError
            It cannot be done; nothing has changed.
        """
        refused = self.studio.refused
        if (client, message.seq) in refused:
            raise refused[client, message.seq]
        try:
            return self._carry_out(client, message)
        except MeshsdfError as error:
            told = error
        except BAD_VALUES as error:
            words = " ".join(str(error).split())[:200]
            what = f"this makes no sense: {words or type(error).__name__}"
            fix = "see what brushes and operations take"
            told = ServerError(what, message.type.name, fix)
        with _REFUSING:
            refused[client, message.seq] = told
            while len(refused) > MOST_REFUSED:
                del refused[next(iter(refused))]
        raise told

    def _carry_out(self, client: str, message: Message) -> int:
        live, cseq, body = self.studio.live, message.seq, message.body
        if cseq <= live.last_cseq(client):
            return self.studio.project.seqs.get((client, cseq), 0)
        if isinstance(body, StrokeBegin):
            check_brush_kinds(body.brush)
            # A page shows one of the sheets that texels are divided among
            brush = Brush.from_dict({"through": True, **body.brush})
            check_brush(brush, self.studio.texture)
            live.begin(client, cseq, body.layer, brush)
        elif isinstance(body, Samples):
            points = body.points + self.studio.origin
            live.keep(client, cseq, np.column_stack([points, body.normals, body.pressures]))
        elif isinstance(body, OperationAsked):
            return self._apply(client, cseq, self._operation(body), replaces=body.replaces)
        elif message.type is Type.STROKE_END:
            return live.end(client, cseq)
        elif message.type is Type.STROKE_CANCEL:
            live.cancel(client, cseq)
        else:
            kind = "undo" if message.type is Type.UNDO else "redo"
            return live.apply(Operation(kind), client=client, cseq=cseq)
        return 0

    def _operation(self, asked: OperationAsked) -> Operation:
        check_asked(asked.kind, asked.params)
        params = dict(asked.params)
        if asked.kind == "project":
            params["image"] = self._image(params.get("image"), f"operation {asked.kind!r}")
            if params.get("matrix") is not None:
                params["matrix"] = np.array(params["matrix"], np.float64)
        return Operation(asked.kind, params)

    def _image(self, name: Any, where: str) -> np.ndarray:
        if self.images is None or not isinstance(name, str):
            what = "a picture is named by the text that POST /api/images answered"
            raise ServerError(what, where, "send the picture first")
        return self.images.get(name)

    def _apply(self, client: str, cseq: int, operation: Operation, *, replaces: bool) -> int:
        """Do an operation, in the place of the client's last one if that is asked for."""
        studio, live = self.studio, self.studio.live
        replaces = replaces and studio.is_newest(client, operation)
        if replaces:
            live.apply(Operation("undo"))
        try:
            seq = live.apply(operation, client=client, cseq=cseq)
        except BaseException:
            if replaces:
                live.apply(Operation("redo"))
            raise
        studio.note(seq, client, operation)
        return seq
