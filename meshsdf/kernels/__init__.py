"""The compiled loops: contiguous arrays in, the caller's arrays filled, no checks.

numba is imported in this package and nowhere else. Kernels are compiled at their first call and
cached on disk; every one releases the interpreter lock, and `parallel` runs pieces of work on all
cores. A piece writes only what is its own, so results do not depend on the number of threads.
"""

from .compiling import load_cached_at_once

load_cached_at_once()
