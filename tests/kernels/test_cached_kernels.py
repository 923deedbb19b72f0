"""Kernels from the cache and kernels compiled anew live side by side in one process."""

import subprocess
import sys

import pytest

MIXED = """
import numpy as np
from meshsdf.kernels.texel_codes import decode_texels, encode_texels
from numba import njit

values = np.random.default_rng(1).random((64, 4)).astype(np.float32)
texels, back = np.empty(64, np.uint32), np.empty((64, 4), np.float32)
encode_texels(0, values, texels)           # from the cache

@njit
def anew(x):                                # compiled here, with linear algebra and text
    y = np.linalg.solve(x @ x.T + np.eye(4), np.ones(4))
    words = {"a": 1.0, "b": y.sum()}
    return words["b"] + len(str(len(x))) + np.sort(y)[0]

print(repr(anew(values[:4].astype(np.float64))))
decode_texels(0, texels, back)              # from the cache again
print(texels.sum(), repr(float(back.sum())))
"""


def run(script: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_cached_and_new_kernels_work_in_one_process():
    pytest.importorskip("scipy")
    plain = MIXED.replace("import numpy as np\n", "import numpy as np\nimport meshsdf.kernels\n", 1)
    first = run(MIXED)  # compiles what is not cached yet
    as_numba_does = run(
        "import numba.core.caching as c\noriginal = c.Cache.load_overload\n"
        "import meshsdf.kernels\nc.Cache.load_overload = original\n" + plain
    )
    assert run(MIXED) == first == as_numba_does
