"""What went wrong, where, and how to fix it: one error class per package.

Every error a user can cause is a `MeshsdfError` with three lines: what is wrong, with the numbers
seen; where, in the caller's words; how to fix it. It is raised before any work is done wherever
that can be known.
"""


class MeshsdfError(Exception):
    """Base of every error meshsdf raises on purpose.

    Parameters
    ----------
    what : str
        What is wrong, with the numbers seen.
    where : str
        The call, option or file it was found in, in the caller's words.
    fix : str
        How to go on.
    """

    def __init__(self, what: str, where: str, fix: str) -> None:
        super().__init__(what, where, fix)
        self.what = what
        self.where = where
        self.fix = fix

    def __str__(self) -> str:
        return f"{self.what}\n  where: {self.where}\n  fix:   {self.fix}"


class MeshError(MeshsdfError):
    """The vertices or faces of a mesh cannot be what they are."""


class GridError(MeshsdfError):
    """Values on nodes, their spacing or their place make no sense."""


class SpatialError(MeshsdfError):
    """A query on a mesh cannot be answered."""


class ImplicitError(MeshsdfError):
    """An implicit function cannot be made, or does not give what it should."""


class SdfError(MeshsdfError):
    """A mesh cannot be turned into distances as asked."""


class SurfaceError(MeshsdfError):
    """A field cannot be turned into a surface as asked."""


class RayError(MeshsdfError):
    """A picture cannot be made as asked."""


class TextureError(MeshsdfError):
    """A texture, in space or in an image, cannot be made, changed, kept or looked up as asked."""


class ReportError(MeshsdfError):
    """Two things cannot be compared as asked."""


class IoError(MeshsdfError):
    """A file cannot be read or written."""


class OutputError(IoError):
    """A file cannot be written there: its name, its folder or what is there forbids it."""


class ServerError(MeshsdfError):
    """The painting page's server is asked for what it cannot or may not do."""


class MemoryLimitError(MeshsdfError):
    """The work would not fit in memory; said before it starts."""
