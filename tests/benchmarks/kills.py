"""Is any acknowledged operation lost when the process is killed, over a thousand kills?

python -m tests.benchmarks.kills [--n N] [--seed N] [--server]

Writers apply random operations to small projects and are killed (SIGKILL) at random instants: while
a project is opened, while operations run, while checkpoints are written. After every kill a copy of
what is left is opened: all acknowledged operations are there, once, the texels have the SHA-256 of
the same operations done in memory alone, and SQLite finds no fault in the file. With ``--server``
it is the painting server that is killed while a client paints on it over a socket; the client
comes back to the next server, and in the end every stroke it was told of is there, once, with all
its samples.
"""

import argparse
import sys
import tempfile
import time

from tests.server.kills import kill as kill_servers
from tests.texture.kills import kill as kill_writers

from .alternate import machine


def main() -> None:
    """Print what was counted; a loss ends the run with its words."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--server", action="store_true")
    asked = parser.parse_args()
    kill = kill_servers if asked.server else kill_writers
    begin = time.perf_counter()

    def told(done: int, n_operations: int) -> None:
        if done % 50 == 0:
            print(f"{done} kills, {n_operations} operations", file=sys.stderr, flush=True)

    with tempfile.TemporaryDirectory() as folder:
        n_operations = kill(folder, asked.n, seed=asked.seed, told=told)
    seconds = time.perf_counter() - begin
    print(machine())
    print(f"{asked.n} kills, {n_operations} operations in {seconds:.0f} s: 0 lost, 0 doubled")


if __name__ == "__main__":
    main()
