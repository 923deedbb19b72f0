"""What a mesh is as its faces name vertices, and what tools see that merge equal positions.

Both are facts, and they may differ: two vertices of a closed surface may lie at one place. All
that tells of a mesh's topology says it in these words.
"""

from dataclasses import dataclass

import numpy as np

from .components import component_labels
from .edge_table import edge_table
from .measures import euler_number, is_watertight, welded
from .mesh import Mesh

SPECK_FACES = 8
"""A part of at most so many faces is a speck: the least that marching cubes makes of one node."""


@dataclass(frozen=True)
class Topology:
    """Counts by index, and the same by position.

    Attributes
    ----------
    is_watertight, euler_number : bool, int
        By index: as faces name vertices.
    n_parts, n_specks : int
        Pieces that hang together by edges, and those of at most 8 faces; by index.
    n_repeated_places : int
        Vertices at the place of another one before them.
    is_watertight_by_position, euler_number_by_position : bool, int
        With equal positions made one vertex.
    """

    is_watertight: bool
    euler_number: int
    n_parts: int
    n_specks: int
    n_repeated_places: int
    is_watertight_by_position: bool
    euler_number_by_position: int

    @property
    def differs(self) -> bool:
        """Whether merging equal positions changes what is told."""
        by_position = self.is_watertight_by_position, self.euler_number_by_position
        return (self.is_watertight, self.euler_number) != by_position

    def describe(self, open_words: str = "not closed") -> str:
        """Return it in words, such as ``closed, Euler number 2, 1 part``."""
        parts = _count(self.n_parts, "part")
        if self.n_specks > 0:
            who = "specks" if self.n_specks > 1 else "a speck"
            parts += f", {_count(self.n_specks)} of them {who} of at most {SPECK_FACES} faces"
        closed = _closed(self.is_watertight, open_words)
        words = f"{closed}, Euler number {_count(self.euler_number)}, {parts}"
        if not self.differs:
            return words
        sharing = "1 vertex shares its place"
        if self.n_repeated_places > 1:
            sharing = f"{_count(self.n_repeated_places)} vertices share places"
        return (
            f"{words} by index; {sharing}: tools that merge them see "
            f"Euler number {_count(self.euler_number_by_position)}, "
            f"{_closed(self.is_watertight_by_position)}"
        )


def topology(mesh: Mesh) -> Topology:
    """Count both ways.

    Examples
    --------
    >>> from meshsdf.mesh.primitives import box_mesh
    >>> topology(box_mesh()).describe()
    'closed, Euler number 2, 1 part'
    >>> box = box_mesh()  # and the same with corners of its own for every face, as in an STL
    >>> loose = Mesh(box.triangles.reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(-1, 3))
    >>> print(topology(loose).describe().split("; ")[1])
    28 vertices share places: tools that merge them see Euler number 2, closed
    """
    labels, n_parts = component_labels(edge_table(mesh.faces, mesh.n_vertices))
    sizes = np.bincount(labels[labels >= 0], minlength=n_parts)
    joined = welded(mesh)
    return Topology(
        is_watertight=is_watertight(mesh),
        euler_number=euler_number(mesh),
        n_parts=n_parts,
        n_specks=int((sizes <= SPECK_FACES).sum()),
        n_repeated_places=mesh.n_vertices - len(mesh.welded.points),
        is_watertight_by_position=is_watertight(joined),
        euler_number_by_position=euler_number(joined),
    )


def _closed(is_watertight: bool, open_words: str = "not closed") -> str:
    return "closed" if is_watertight else open_words


def _count(n: int, one: str = "") -> str:
    """``1 part``, ``3 parts``; thousands parted by spaces."""
    number = f"{n:,}".replace(",", " ")
    return f"{number} {one if n == 1 else one + 's'}" if one else number
