"""A process that forks painting servers, to be killed; see `kills.py`.

For every line on its input, a project, it forks what `meshsdf paint` runs and prints its process
number, then the address once the server answers; for the next line, whatever it says, it waits for
the server's death and prints ``dead``.
"""

import os
import sys

from meshsdf.server.paint import paint
from meshsdf.texture import journal
from meshsdf.texture.live import LiveStrokes
from tests.texture.kill_worker import OPERATIONS_PER_CHECKPOINT, warm_up


def serve(project):
    """Open the project and serve it until killed."""
    live = LiveStrokes.open(project, warn=lambda words: print("!", words, flush=True))
    paint(live, name="killed", ready=lambda address: print(address, flush=True))


def main():
    """Warm up, then fork on demand."""
    journal.OPERATIONS_PER_CHECKPOINT = OPERATIONS_PER_CHECKPOINT
    warm_up()
    print("ready", flush=True)
    while line := sys.stdin.readline():
        pid = os.fork()
        if pid == 0:
            try:
                serve(line.strip())
            finally:
                os._exit(1)
        print(pid, flush=True)
        sys.stdin.readline()
        os.waitpid(pid, 0)
        print("dead", flush=True)


if __name__ == "__main__":
    main()
