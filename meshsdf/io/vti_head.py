"""The XML of a ``.vti`` file, up to its appended data, which need not be XML.

Read by expat with handlers of our own: no tree is built, no entity is expanded (a document type is
refused), and what is longer than any head of a file is refused while it is read.
"""

from dataclasses import dataclass, field
from typing import BinaryIO
from xml.parsers import expat

from .dense_header import counts_of, numbers_of
from .vdb_stream import UnsuitedError, printable

_CHUNK = 1 << 16
_LONGEST_TOKEN = 1 << 20  # bytes without any element; no tag of a sound file comes near
_MOST_ELEMENTS = 10_000
_SECTIONS = ("FieldData", "PointData", "CellData")
_ITEM = {"Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4"}
ITEM_TYPES = _ITEM | {"Int64": "i8", "UInt64": "u8", "Float32": "f4", "Float64": "f8"}
"""Types of values by the names that VTK gives them."""


@dataclass(eq=False)
class VtiArray:
    """One array of a file: its section, its attributes, and its text if it stands inline."""

    section: str
    attributes: dict[str, str]
    texts: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """As the file calls it."""
        return self.attributes.get("Name", "")

    @property
    def format(self) -> str:
        """ "ascii", "binary" (base64 inline) or "appended"."""
        return self.attributes.get("format", "ascii")

    @property
    def n_components(self) -> int:
        """Numbers a node."""
        (n,) = counts_of(self.attributes.get("NumberOfComponents", "1"), 1, "NumberOfComponents")
        return n


@dataclass(eq=False)
class VtiHead:
    """What the elements of a file say.

    Attributes
    ----------
    file, image, piece : dict of str
        Attributes of the elements VTKFile, ImageData and Piece.
    active : dict of str
        Of each section the array that its attribute Scalars names.
    arrays : list of VtiArray
        In the order of the file.
    appended_at : int
        Byte behind the underscore where appended data begin; -1 if there are none.
    appended_as : str
        "raw" or "base64".
    """

    file: dict[str, str] = field(default_factory=dict)
    image: dict[str, str] = field(default_factory=dict)
    piece: dict[str, str] = field(default_factory=dict)
    active: dict[str, str] = field(default_factory=dict)
    arrays: list[VtiArray] = field(default_factory=list)
    appended_at: int = -1
    appended_as: str = ""

    @property
    def byte_order(self) -> str:
        """ "<" or ">", as NumPy writes it."""
        return {"LittleEndian": "<", "BigEndian": ">"}[self.file["byte_order"]]

    def place(self) -> tuple[list[float], list[float], list[int]]:
        """Spacings, the position of the first node, and steps between nodes along the axes.

        Raises
        ------
        UnsuitedError
            The axes are turned.
        ValueError
            A number is missing or makes no sense.
        """
        missing = {"WholeExtent", "Origin", "Spacing"} - self.image.keys()
        if missing:
            raise ValueError(f"its ImageData lacks {', '.join(sorted(missing))}")
        extent = counts_of(self.image["WholeExtent"], 6, "WholeExtent")
        piece = counts_of(self.piece.get("Extent", self.image["WholeExtent"]), 6, "Extent")
        if piece != extent:
            fix = "write it as one piece"
            raise UnsuitedError(f"it holds only the piece {piece} of {extent}", fix)
        spacings = numbers_of(self.image["Spacing"], 3, "Spacing")
        origin = numbers_of(self.image["Origin"], 3, "Origin")
        turn = numbers_of(self.image.get("Direction", "1 0 0 0 1 0 0 0 1"), 9, "Direction")
        if turn != [1, 0, 0, 0, 1, 0, 0, 0, 1]:
            words = printable(self.image["Direction"])
            fix = "resample it to cubes along the axes where it was made"
            raise UnsuitedError(f"its axes are turned or flipped: {words}", fix)
        starts = zip(origin, spacings, extent[::2], strict=True)
        first = [start + step * n for start, step, n in starts]
        return spacings, first, [b - a for a, b in zip(extent[::2], extent[1::2], strict=True)]


def read_head(file: BinaryIO) -> VtiHead:
    """Read all elements before the appended data; ValueError says what is wrong with them."""
    parser = _Parser()
    at = parser.run(file)
    head = parser.head
    if head.file.get("type") != "ImageData":
        kind = printable(head.file.get("type", "nothing"))
        raise UnsuitedError(f"it holds {kind}, not ImageData", "resample it to ImageData")
    if head.file.setdefault("byte_order", "LittleEndian") not in ("LittleEndian", "BigEndian"):
        raise ValueError(f"its byte order is '{printable(head.file['byte_order'])}'")
    if parser.n_pieces != 1:
        fix = "write it as one piece"
        raise UnsuitedError(f"it is cut into {parser.n_pieces} pieces", fix)
    if at >= 0:
        if head.appended_as not in ("raw", "base64"):
            raise ValueError(f"its appended data are '{printable(head.appended_as)}'")
        head.appended_at = _behind_underscore(file, at)
    return head


def _behind_underscore(file: BinaryIO, at: int) -> int:
    """Where data begin, given the byte at which the tag AppendedData does."""
    file.seek(at)
    start = file.read(_CHUNK)
    tag_end = start.find(b">")
    mark = start.find(b"_", tag_end)
    if tag_end < 0 or mark < 0 or start[tag_end + 1 : mark].strip():
        raise ValueError("its appended data do not begin with an underscore")
    return at + mark + 1


class _HeadEndsError(Exception):
    """Not an error: what follows is data."""


class _Parser:
    """Handlers that fill a head."""

    def __init__(self) -> None:
        self.head = VtiHead()
        self.n_pieces = 0
        self._n_elements = 0
        self._section = ""
        self._array: VtiArray | None = None
        self._has_moved = False
        self._end_at = -1
        self._parser = expat.ParserCreate()
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text
        self._parser.StartDoctypeDeclHandler = self._refuse

    def run(self, file: BinaryIO) -> int:
        """Parse; return the byte at which the tag AppendedData begins, -1 if there is none."""
        n_still = 0
        try:
            while chunk := file.read(_CHUNK):
                self._has_moved = False
                self._parser.Parse(chunk, False)
                n_still = 0 if self._has_moved else n_still + len(chunk)
                if n_still > _LONGEST_TOKEN:
                    raise ValueError(f"a tag is longer than {_LONGEST_TOKEN} bytes")
            self._parser.Parse(b"", True)
        except _HeadEndsError:
            return self._end_at
        except (expat.ExpatError, LookupError) as error:  # the latter of unknown encodings
            raise ValueError(f"its XML is damaged: {printable(str(error))}") from None
        return -1

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._has_moved = True
        self._n_elements += 1
        if self._n_elements > _MOST_ELEMENTS:
            raise ValueError(f"it has more than {_MOST_ELEMENTS} elements")
        head = self.head
        if self._n_elements == 1:
            if name != "VTKFile":
                raise ValueError(f"it is the XML of '{printable(name)}', not of VTKFile")
            head.file = attributes
        elif name == "ImageData":
            head.image = attributes
        elif name == "Piece":
            head.piece = attributes
            self.n_pieces += 1
        elif name in _SECTIONS:
            self._section = name
            head.active[name] = attributes.get("Scalars", "")
        elif name in ("DataArray", "Array") and self._section:
            self._array = VtiArray(self._section, attributes)
            head.arrays.append(self._array)
        elif name == "AppendedData":
            head.appended_as = attributes.get("encoding", "raw")
            self._end_at = self._parser.CurrentByteIndex
            raise _HeadEndsError

    def _end(self, name: str) -> None:
        self._has_moved = True
        if name in _SECTIONS:
            self._section = ""
        elif name in ("DataArray", "Array"):
            self._array = None

    def _text(self, text: str) -> None:
        self._has_moved = True
        if self._array is not None:
            self._array.texts.append(text)

    def _refuse(self, *_: object) -> None:
        raise ValueError("it declares a document type, which no .vti file needs")
