"""A process that forks writers of projects, to be killed; see `kills.py`.

For every line ``PROJECT ACKNOWLEDGED SEED`` on its input it forks a writer and prints its process
number; for the next line, whatever it says, it waits for the writer's death and prints ``dead``.
Until then nobody else can have the number. The writer opens the project and sends random
operations, beginning with the first that was not acknowledged, as a client does that has lost its
server; it appends ``cseq seq`` to the file ACKNOWLEDGED after each.
"""

import os
import sys

from meshsdf.texture import journal
from meshsdf.texture.journal import Project

from .random_operations import RESOLUTION, next_of, small_mesh

OPERATIONS_PER_CHECKPOINT = 7
MOST_OPERATIONS = 30
CLIENT = "worker"


def write(project_path: str, acknowledged_path: str, seed: int) -> None:
    """Send operations until killed, or until there were enough; then close."""
    with open(acknowledged_path) as file:
        n_acknowledged = len(file.readlines())
    file = os.open(acknowledged_path, os.O_WRONLY | os.O_APPEND)
    project = Project.open(project_path, warn=lambda words: os.write(file, f"! {words}\n".encode()))
    for cseq in range(n_acknowledged + 1, n_acknowledged + 1 + MOST_OPERATIONS):
        if (CLIENT, cseq) in project.seqs:
            seq = project.seqs[CLIENT, cseq]  # what it is does not matter: it was done
        else:
            operation = next_of(seed, cseq, project.texture, project.history)
            seq = project.apply(operation, client=CLIENT, cseq=cseq)
        os.write(file, f"{cseq} {seq}\n".encode())
    project.close()


def main() -> None:
    """Warm up, then fork on demand."""
    journal.OPERATIONS_PER_CHECKPOINT = OPERATIONS_PER_CHECKPOINT
    warm_up()
    print("ready", flush=True)
    while line := sys.stdin.readline():
        project, acknowledged, seed = line.split()
        pid = os.fork()
        if pid == 0:
            try:
                write(project, acknowledged, int(seed))
            finally:
                os._exit(0)
        print(pid, flush=True)
        sys.stdin.readline()
        os.waitpid(pid, 0)
        print("dead", flush=True)


def warm_up() -> None:
    """Load every kernel, so that writers do not have to."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/warm.mtex"
        with Project.create(path, small_mesh(), resolution=RESOLUTION) as project:
            for number in range(60):
                project.apply(next_of(1, number, project.texture, project.history))
        Project.open(path).close()


if __name__ == "__main__":
    main()
