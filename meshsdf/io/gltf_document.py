"""The container of glTF 2.0: its JSON, its buffers, and the arrays that accessors describe.

Every size a file claims is held against the bytes it has before anything is allocated.
Source: Khronos glTF 2.0 specification, sections 3.6 (binary data) and 4 (GLB).
"""

import base64
import json
import struct
import urllib.parse
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

_MAGIC = b"glTF"
_JSON_CHUNK = 0x4E4F534A
_BINARY_CHUNK = 0x004E4942
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass(frozen=True, eq=False)
class Document:
    """The JSON of a glTF file and access to its binary data.

    Attributes
    ----------
    json : dict
        The parsed text.
    folder : Path
        Where buffers and images outside the file are looked for.
    binary : bytes or None
        The binary chunk of a GLB file.
    """

    json: dict
    folder: Path
    binary: bytes | None
    _buffers: dict[int, bytes] = field(default_factory=dict)

    def items(self, name: str) -> list:
        """Return a top-level list of the JSON, such as "nodes"; empty if it is absent."""
        entries = self.json.get(name, [])
        if not isinstance(entries, list):
            raise ValueError(f"its {name} are not a list")
        return entries

    def item(self, name: str, index: object) -> dict:
        """Return one entry of a top-level list; ValueError if there is no such entry."""
        entries = self.items(name)
        if not (isinstance(index, int) and 0 <= index < len(entries)):
            raise ValueError(f"it refers to {name}[{index!r}], but there are {len(entries)}")
        if not isinstance(entries[index], dict):
            raise ValueError(f"its {name}[{index}] is not an object")
        return entries[index]

    def view(self, index: object) -> bytes | memoryview:
        """Return the bytes of a buffer view."""
        view = self.item("bufferViews", index)
        data = memoryview(self._buffer(view["buffer"]))
        return _part(data, view.get("byteOffset", 0), view["byteLength"], f"buffer view {index}")

    def array(self, index: object) -> np.ndarray:
        """Return what an accessor describes, (count, width); normalized integers as float64."""
        accessor = self.item("accessors", index)
        width = _WIDTHS[accessor["type"]]
        dtype = np.dtype(_COMPONENTS[accessor["componentType"]])
        count = _size(accessor["count"], "count of an accessor")
        if "bufferView" in accessor:
            view = self.item("bufferViews", accessor["bufferView"])
            stride = _size(view.get("byteStride", 0), "stride") or dtype.itemsize * width
            place = (accessor["bufferView"], accessor.get("byteOffset", 0), stride)
            values = self._strided(place, count, width, dtype)
        else:
            if count > self._total_bytes():
                raise ValueError(f"an accessor claims {count} elements that no bytes stand for")
            values = np.zeros((count, width), dtype)
        if "sparse" in accessor:
            values = self._with_sparse(values, accessor["sparse"])
        if accessor.get("normalized", False) and dtype.kind in "iu":
            return np.maximum(values / np.iinfo(dtype).max, -1.0)
        return values

    def file(self, uri: object) -> bytes | Path:
        """Return the bytes of a data URI, or the path of a file beside the document."""
        if not isinstance(uri, str):
            raise ValueError(f"it refers to the file {uri!r}")
        if uri.startswith("data:"):
            head, _, body = uri.partition(",")
            if not head.endswith(";base64"):
                return urllib.parse.unquote_to_bytes(body)
            return base64.b64decode(body)
        for name in (urllib.parse.unquote(uri), uri):
            path = self.folder / name
            if "\0" not in name and path.is_file():
                return path
        raise ValueError(f"the file {uri[:80]!r} that it needs is missing")

    def _buffer(self, index: object) -> bytes:
        buffer = self.item("buffers", index)
        if index not in self._buffers:
            if "uri" in buffer:
                found = self.file(buffer["uri"])
                data = found.read_bytes() if isinstance(found, Path) else found
            elif index == 0 and self.binary is not None:
                data = self.binary
            else:
                raise ValueError(f"buffer {index} has no data")
            if len(data) < _size(buffer["byteLength"], "length of a buffer"):
                claim = f"buffer {index} promises {buffer['byteLength']} bytes"
                raise ValueError(f"{claim}, but has {len(data)}")
            self._buffers[index] = data
        return self._buffers[index]

    def _total_bytes(self) -> int:
        return sum(len(self._buffer(index)) for index in range(len(self.items("buffers"))))

    def _strided(self, place: tuple, count: int, width: int, dtype: np.dtype) -> np.ndarray:
        view, offset, stride = place
        length = max(count - 1, 0) * stride + dtype.itemsize * width * (count > 0)
        data = _part(
            memoryview(self.view(view)), offset, length, f"{count} elements of an accessor"
        )
        strides = (stride, dtype.itemsize)
        return np.ndarray((count, width), dtype, buffer=data, strides=strides)

    def _with_sparse(self, values: np.ndarray, sparse: dict) -> np.ndarray:
        """The values with some of them replaced."""
        count = _size(sparse["count"], "count of a sparse accessor")
        spots, news = sparse["indices"], sparse["values"]
        kind = np.dtype(_COMPONENTS[spots["componentType"]])
        place = (spots["bufferView"], spots.get("byteOffset", 0), kind.itemsize)
        index = self._strided(place, count, 1, kind)[:, 0].astype(np.int64)
        width, dtype = values.shape[1], values.dtype
        place = (news["bufferView"], news.get("byteOffset", 0), width * dtype.itemsize)
        if count and (index.min() < 0 or index.max() >= len(values)):
            raise ValueError("a sparse accessor names an element that does not exist")
        changed = values.copy()
        changed[index] = self._strided(place, count, width, dtype)
        return changed


def open_document(path: Path) -> Document:
    """Read a ``.glb`` or ``.gltf`` file; ValueError says what is wrong with it."""
    data, binary = path.read_bytes(), None
    if data[:4] == _MAGIC:
        text, binary = _chunks(data)
    else:
        text = data
    parsed = json.loads(text.decode("utf-8-sig"))
    if not (isinstance(parsed, dict) and isinstance(parsed.get("asset"), dict)):
        raise ValueError("it is not a glTF document")
    version = str(parsed["asset"].get("version", ""))
    if not version.startswith("2"):
        raise ValueError(f"it is glTF version {version or 'unknown'}; only 2 is read")
    return Document(parsed, path.parent, binary)


def _chunks(data: bytes) -> tuple[bytes, bytes | None]:
    if len(data) < 20:
        raise ValueError(f"it is cut off after {len(data)} bytes")
    version, length = struct.unpack_from("<2I", data, 4)
    if version != 2:
        raise ValueError(f"it is GLB version {version}; only 2 is read")
    if length > len(data):
        raise ValueError(f"it is cut off: it promises {length} bytes, but has {len(data)}")
    found, at = {}, 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<2I", data, at)
        found.setdefault(kind, bytes(_part(memoryview(data), at + 8, size, "a chunk")))
        at += 8 + size
    if _JSON_CHUNK not in found:
        raise ValueError("it has no JSON chunk")
    return found[_JSON_CHUNK], found.get(_BINARY_CHUNK)


def _size(value: object, what: str) -> int:
    if not isinstance(value, int) or value < 0:
        raise ValueError(f"{what} is {value!r}")
    return value


def _part(data: memoryview, offset: object, length: object, what: str) -> memoryview:
    """A slice that must lie within the data."""
    end = _size(offset, f"offset of {what}") + _size(length, f"length of {what}")
    if end > len(data):
        raise ValueError(f"{what} should end at byte {end}, but there are {len(data)}")
    return data[offset:end]
