"""Operations as data: what was done to a texture, so that it can be done again, byte for byte.

An operation is a kind and parameters: JSON values and arrays of numbers. `perform` carries one
out. All are deterministic: the same operations on the same octree give the same texels.
"""

import inspect
import json
import math
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import TextureError
from ..progress import Progress, silent
from . import operation_kinds, source_kinds
from .volume_texture import VolumeTexture

ARRAY = "$array"
PLAIN, ZLIB = 0, 1
DTYPES = ("<f8", "<f4", "<i8", "<i4", "<u4", "<u2", "|u1")
LARGE = 256  # shorter parameters are not worth compressing

KINDS: dict[str, Callable[..., None]] = {
    "add-layer": operation_kinds.add_layer,
    "bake": operation_kinds.bake,
    "coarsen": operation_kinds.coarsen_layer,
    "drop-layer": operation_kinds.drop_layer,
    "fill-color": operation_kinds.fill_color,
    "layer": operation_kinds.change_layer,
    "mesh-colors": source_kinds.mesh_colors,
    "paint-ball": operation_kinds.paint_ball,
    "project": source_kinds.project_image,
    "stroke": operation_kinds.stroke,
}
"""What `perform` carries out: ``function(texture, **parameters)``."""

TURNS = ("undo", "redo")
"""Kinds that are about other operations; a `Project` carries them out."""


@dataclass(frozen=True, eq=False)
class Operation:
    """One thing to do to a texture.

    Attributes
    ----------
    kind : str
        One of `KINDS` or `TURNS`.
    params : dict
        By name: None, booleans, numbers, text, lists and dicts of them, and arrays.
    """

    kind: str
    params: dict[str, Any] = field(default_factory=dict)

    @property
    def layer(self) -> int | None:
        """Number of the layer it is about, if it is about one."""
        layer = self.params.get("layer")
        return layer if isinstance(layer, int) else None

    def encoded(self) -> bytes:
        """The parameters as bytes, the same for the same values.

        Raises
        ------
        TextureError
            A parameter is of a type that cannot be kept, or a number is not finite.
        """
        arrays: list[bytes] = []
        plain = _plain(self.params, self.kind, arrays)
        text = json.dumps(plain, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
        head = text.encode()
        whole = struct.pack("<I", len(head)) + head + b"".join(arrays)
        if len(whole) < LARGE:
            return bytes([PLAIN]) + whole
        return bytes([ZLIB]) + zlib.compress(whole, 1)

    @classmethod
    def decoded(cls, kind: str, data: bytes) -> "Operation":
        """The operation whose parameters `encoded` made these bytes of."""
        whole = zlib.decompress(data[1:]) if data[0] == ZLIB else data[1:]
        (n_head,) = struct.unpack_from("<I", whole)
        plain = json.loads(whole[4 : 4 + n_head].decode())
        return cls(kind, _restored(plain, memoryview(whole)[4 + n_head :]))


def perform(texture: VolumeTexture, operation: Operation, *, progress: Progress = silent) -> None:
    """Carry an operation out; kinds that fill a layer tell how far they are.

    Raises
    ------
    TextureError
        There is no such kind, it has other parameters, or it cannot be done.
    """
    function = KINDS.get(operation.kind)
    if function is None:
        what = f"there is no operation {operation.kind!r}"
        raise TextureError(what, "perform(texture, operation)", f"use one of {', '.join(KINDS)}")
    known = inspect.signature(function).parameters
    told = {"progress": progress} if "progress" in known else {}
    try:
        inspect.signature(function).bind(texture, **told, **operation.params)
    except TypeError as error:
        names = [name for name in known if name not in ("texture", "progress")]
        what = f"operation {operation.kind!r}: {error}"
        fix = f"its parameters are {', '.join(names)}"
        raise TextureError(what, "Operation(params=...)", fix) from None
    function(texture, **told, **operation.params)


def _plain(value: Any, kind: str, arrays: list[bytes]) -> Any:
    """The value for JSON; arrays are put aside."""
    where = f"Operation({kind!r}, params)"
    if isinstance(value, np.ndarray):
        dtype = value.dtype.newbyteorder("<").str
        if dtype not in DTYPES or not np.isfinite(value).all():
            what = f"an array of {value.dtype} {value.shape} is none of finite numbers"
            raise TextureError(what, where, f"use one of {', '.join(DTYPES)}")
        start = sum(map(len, arrays))
        arrays.append(value.astype(dtype).tobytes())
        return {ARRAY: [start, dtype, list(value.shape)]}
    if isinstance(value, dict):
        if not all(isinstance(key, str) and key != ARRAY for key in value):
            raise TextureError(f"{list(value)} are no names of parameters", where, "use text")
        return {key: _plain(value[key], kind, arrays) for key in sorted(value)}
    if isinstance(value, list | tuple):
        return [_plain(one, kind, arrays) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        raise TextureError(f"a parameter is {value}", where, "use finite numbers")
    if value is None or isinstance(value, bool | int | float | str):
        return value
    what = f"a parameter is a {type(value).__name__}"
    raise TextureError(what, where, "use JSON values and arrays")


def _restored(plain: Any, arrays: memoryview) -> Any:
    if isinstance(plain, list):
        return [_restored(one, arrays) for one in plain]
    if not isinstance(plain, dict):
        return plain
    if ARRAY not in plain:
        return {key: _restored(value, arrays) for key, value in plain.items()}
    start, dtype, shape = plain[ARRAY]
    found = np.frombuffer(arrays, dtype, math.prod(shape), start)
    return found.reshape(shape).astype(np.dtype(dtype).newbyteorder("="))
