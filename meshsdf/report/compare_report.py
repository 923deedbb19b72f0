"""Two meshes compared as one plain dict: the JSON of that report, from which every page is written.

Lengths stand as `comparison_data` writes them. What could not be measured is null.
"""

from dataclasses import dataclass

from ..arrays import Number
from ..mesh import Mesh
from ..mesh.two_set import TwoSetReport
from ..progress import Progress, silent
from .compare import Comparison
from .comparison_data import comparison_data, mesh_data, plain, two_set_data, versions
from .pair_words import PairWords
from .pointers import UNITS
from .sharp_edges import SharpEdges, sharp_edges
from .verdict import comparison_verdict

SCHEMA = "meshsdf.compare_report/1"
EDGE_VOXELS = 1e-2  # sharp edges are followed until known to this part of a voxel, or
EDGE_DIAGONALS = 1e-5  # of the diagonal where no voxel is known
STEPS = 256  # pieces of sharp edges are then as long as if the diagonal had so many voxels


@dataclass(frozen=True, eq=False)
class ComparisonAsked:
    """What the user asked for, as far as the report repeats it.

    Attributes
    ----------
    a, b : str
        Names of the files.
    command : str
        That gives these numbers.
    tolerance, max_error : str or None
        The limits, as written.
    missed : tuple of str
        A sentence for each limit that is not certainly kept.
    warnings : tuple of str
        What was said while reading.
    """

    a: str
    b: str
    command: str = ""
    tolerance: str | None = None
    max_error: str | None = None
    missed: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class ComparedPair:
    """Two meshes and what was found of them.

    Attributes
    ----------
    meshes : pair of Mesh
        A and B.
    comparison : Comparison
        Of A against B.
    checks : pair of TwoSetReport
        Whether each has an inside.
    edges : SharpEdges or None
        Of A, against B; None if it has none. Without a voxel size, what is kept has no meaning.
    """

    meshes: tuple[Mesh, Mesh]
    comparison: Comparison
    checks: tuple[TwoSetReport, TwoSetReport]
    edges: SharpEdges | None


def edges_between(
    a: Mesh, b: Mesh, voxel_size: Number | None, *, progress: Progress = silent
) -> SharpEdges | None:
    """Measure how far the sharp edges of A are from B, to a part of a voxel or of A's diagonal."""
    diagonal = a.box.diagonal
    if voxel_size is None and diagonal == 0:
        return None
    step = diagonal / STEPS if voxel_size is None else voxel_size
    width = EDGE_DIAGONALS * diagonal if voxel_size is None else EDGE_VOXELS * voxel_size
    return sharp_edges(a, b, voxel_size=step, tolerance=width, progress=progress)


def compare_data(pair: ComparedPair, asked: ComparisonAsked) -> dict:
    """Gather everything a report tells, as bool, int, float, str, list, dict and None."""
    found, (a, b) = pair.comparison, pair.meshes
    spread = found.forward_statistics, found.backward_statistics
    told = plain(comparison_data(found, b, spread, pair.edges))
    says = PairWords.of_files(asked.a, asked.b)
    data = {
        "schema": SCHEMA,
        "a": mesh_data(a, asked.a),
        "b": mesh_data(b, asked.b),
        "command": asked.command,
        "limits": {
            "tolerance": asked.tolerance,
            "max_error": asked.max_error,
            "missed": list(asked.missed),
            "passed": not asked.missed,
        },
        "warnings": list(asked.warnings),
        "voxel_size": found.voxel_size,
        "verdict": comparison_verdict(told, says),
        "comparison": told,
        "two_set": {
            name: two_set_data(check) for name, check in zip("ab", pair.checks, strict=True)
        },
        "versions": versions(),
    }
    return plain(data)


def words_of(data: dict) -> PairWords:
    """What the report calls both meshes."""
    return PairWords.of_files(data["a"]["name"], data["b"]["name"])


def units_of(data: dict) -> tuple[tuple[str, str], ...]:
    """The units of the report: voxels only where their size is known."""
    largest = data["comparison"]["largest"]
    return tuple((unit, words) for unit, words in UNITS if largest[unit] is not None)


def main_unit(data: dict) -> tuple[str, str]:
    """The unit that sentences use."""
    return ("world", "world units") if data["voxel_size"] is None else ("voxels", "voxels")
