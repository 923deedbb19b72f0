"""A process that forks writers of projects, to be killed; see `kills.py`.

For a line ``PROJECT ACKNOWLEDGED SEED`` the writer opens the project and sends random operations,
beginning with the first that was not acknowledged, as a client does that has lost its server; it
appends ``cseq seq`` to the file ACKNOWLEDGED after each.
"""

import os

from meshsdf.texture import checkpoints
from meshsdf.texture.journal import Project

from .forking import fork_on_demand
from .random_operations import RESOLUTION, next_of, small_mesh

OPERATIONS_PER_CHECKPOINT = 7
MOST_OPERATIONS = 30
CLIENT = "worker"


def write(project_path: str, acknowledged_path: str, seed: str) -> None:
    """Send operations until killed, or until there were enough; then close."""
    with open(acknowledged_path) as file:
        n_acknowledged = len(file.readlines())
    file = os.open(acknowledged_path, os.O_WRONLY | os.O_APPEND)
    project = Project.open(project_path, warn=lambda words: os.write(file, f"! {words}\n".encode()))
    for cseq in range(n_acknowledged + 1, n_acknowledged + 1 + MOST_OPERATIONS):
        if (CLIENT, cseq) in project.seqs:
            seq = project.seqs[CLIENT, cseq]  # what it is does not matter: it was done
        else:
            operation = next_of(int(seed), cseq, project.texture, project.history)
            seq = project.apply(operation, client=CLIENT, cseq=cseq)
        os.write(file, f"{cseq} {seq}\n".encode())
    project.close()


def main() -> None:
    """Warm up, then fork on demand."""
    checkpoints.OPERATIONS_PER_CHECKPOINT = OPERATIONS_PER_CHECKPOINT
    warm_up()
    fork_on_demand(write)


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
