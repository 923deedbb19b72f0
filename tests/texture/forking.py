"""Processes that fork others on demand, so that these can be killed without a slow start each.

For every line on its input such a process forks one that does what the line says, and prints its
process number; for the next line, whatever it says, it waits for the other's death and prints
``dead``. Until then nobody else can have the number.
"""

import os
import sys


def fork_on_demand(work):
    """Say ``ready``; then call ``work(*words)`` in a process of its own for every line."""
    print("ready", flush=True)
    while line := sys.stdin.readline():
        pid = os.fork()
        if pid == 0:
            try:
                work(*line.split())
            finally:
                os._exit(1)
        print(pid, flush=True)
        sys.stdin.readline()
        os.waitpid(pid, 0)
        print("dead", flush=True)
