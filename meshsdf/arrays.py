"""The named array types that signatures use, checked at every call in the tests.

``n`` points, ``m`` faces. Points and what is computed on them are float64, stored volumes float32.
"""

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32, Int64, UInt64

Number = float | int | np.floating | np.integer
"""A scalar that a caller may give as any kind of number."""

Points = Float64[np.ndarray, "n 3"]
Values = Float64[np.ndarray, " n"]
Vector3 = Float64[np.ndarray, "3"]
Points2 = Float64[np.ndarray, "n 2"]
Vector2 = Float64[np.ndarray, "2"]
Matrix4 = Float64[np.ndarray, "4 4"]

Faces = Int32[np.ndarray, "m 3"]
FaceValues = Float64[np.ndarray, " m"]
FaceLabels = Int32[np.ndarray, " m"]
FaceMask = Bool[np.ndarray, " m"]
Indices = Int32[np.ndarray, " n"]
Barycentrics = Float64[np.ndarray, "n 3"]

Ijk = Int64[np.ndarray, "n 3"]
Ijk1 = Int64[np.ndarray, "3"]
NodeValues = Float32[np.ndarray, "i j k"]

BrickValues = Float32[np.ndarray, "b 8 8 8"]
BrickMasks = UInt64[np.ndarray, "b 8"]
BrickFaces = Int32[np.ndarray, "b 8 8 8"]
BrickBarycentrics = Float32[np.ndarray, "b 8 8 8 2"]
BrickCoordinates = Int64[np.ndarray, "b 3"]
BrickRuns = Int64[np.ndarray, "r 4"]
RootTable = Int32[np.ndarray, "px py pz"]
PageTable = Int32[np.ndarray, "p 16 16 16"]


def writable_alias(array: np.ndarray) -> np.ndarray:
    """The same memory without its write protection, or a copy if its owner is protected too.

    Kernels are compiled anew for read-only arrays. They write to nothing but their outputs, so
    they may have an input by this name.
    """
    alias = array.view()
    try:
        alias.flags.writeable = True
    except ValueError:
        return array.copy()
    return alias
