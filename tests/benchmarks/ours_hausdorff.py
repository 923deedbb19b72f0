"""Run as a process of its own: two large meshes to an interval, with time and peak memory.

Usage: ours_hausdorff.py PAIR.npz SHARE; the interval is to be no wider than the share of the
diagonal. Prints one JSON object. The time covers both directions, trees included, after a first
small run that loads the kernels.
"""

import json
import sys
import time

import numpy as np
from peak import peak_bytes

from meshsdf import Mesh
from meshsdf.report.hausdorff import hausdorff


def main(path, share):
    with np.load(path) as data:
        a, b = (Mesh(data[f"v{name}"], data[f"f{name}"].astype(np.int32)) for name in "ab")
    hausdorff(Mesh(a.vertices, a.faces[:2000]), Mesh(b.vertices, b.faces[:2000]), means=False)
    size = a.box.diagonal
    begin = time.perf_counter()
    found = hausdorff(a, b, tolerance=float(share) * size, means=False)
    seconds = time.perf_counter() - begin
    sides = (found.forward, found.backward)
    told = {
        "seconds": seconds,
        "peak": peak_bytes(),
        "lower": found.distance.lower / size,
        "upper": found.distance.upper / size,
        "n_evaluations": [side.n_evaluations for side in sides],
        "within": all(side.is_within_tolerance for side in sides),
    }
    print(json.dumps(told))


main(*sys.argv[1:])
