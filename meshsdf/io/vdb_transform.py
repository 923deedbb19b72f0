"""From index to world: the maps of a ``.vdb`` file as 4 x 4 matrices.

A map is its name (text) and doubles. The scale maps repeat themselves so that readers need not
divide: the scale, the voxel size (its absolute value), 1 / scale, 1 / scale**2 and 1 / (2 scale),
each as three doubles, with the translation before them if there is one. Affine maps are written
for row vectors, the translation in the last row. An integer index (i, j, k) is a voxel's centre,
which is a node of ours.
"""

import numpy as np

from ..arrays import Matrix4
from .vdb_stream import UnsuitedError, VdbReader, VdbWriter, printable

_SCALES = ("UniformScaleMap", "ScaleMap")
_SCALES_TRANSLATED = ("UniformScaleTranslateMap", "ScaleTranslateMap")
_AFFINE = ("AffineMap", "UnitaryMap")


def read_transform(reader: VdbReader) -> Matrix4:
    """Return the matrix that takes (i, j, k, 1) to world space.

    Raises
    ------
    ValueError
        The bytes are no map, or one that is not invertible; `UnsuitedError` if it is not affine.
    """
    kind = reader.text()
    matrix = np.eye(4)
    if kind in _SCALES_TRANSLATED or kind == "TranslationMap":
        matrix[:3, 3] = reader.numbers("3d")
    if kind in _SCALES or kind in _SCALES_TRANSLATED:
        matrix[[0, 1, 2], [0, 1, 2]] = reader.numbers("15d")[:3]
    elif kind in _AFFINE:
        matrix = np.array(reader.numbers("16d")).reshape(4, 4).T
    elif kind != "TranslationMap":
        raise UnsuitedError(
            f"its transform is a {printable(kind)!r}, not an affine one", "resample it"
        )
    if not np.isfinite(matrix).all() or matrix[3].tolist() != [0, 0, 0, 1]:
        raise ValueError(f"its {kind} holds numbers that make no transform")
    largest, _, smallest = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if not smallest > 1e-12 * largest:
        raise ValueError(f"its {kind} flattens space: voxels of {largest:g} by {smallest:g}")
    return np.ascontiguousarray(matrix)


def write_transform(writer: VdbWriter, matrix: Matrix4) -> None:
    """Write an affine matrix as the plainest map that says the same, bit by bit."""
    scale, translation = np.diag(matrix)[:3], matrix[:3, 3]
    if np.count_nonzero(matrix[:3, :3]) > 3 or not scale.all():
        writer.text("AffineMap")
        writer.numbers("16d", *matrix.T.ravel())
        return
    uniform = "Uniform" if (scale == scale[0]).all() else ""
    moved = bool(translation.any() or np.signbit(translation).any())
    writer.text(f"{uniform}Scale{'Translate' if moved else ''}Map")
    if moved:
        writer.numbers("3d", *translation)
    with np.errstate(all="ignore"):  # of a voxel of 1e-200 the inverse square is infinite
        derived = [np.abs(scale), 1 / scale, 1 / scale**2, 0.5 / scale]
    writer.numbers("15d", *scale, *np.concatenate(derived))


def uniform_scale(matrix: Matrix4) -> float | None:
    """The voxel size, if the matrix does no more than scale evenly and move."""
    size = matrix[0, 0]
    return float(size) if size > 0 and (matrix[:3, :3] == size * np.eye(3)).all() else None
