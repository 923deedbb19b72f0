"""A process that forks painters, to be killed; `kills.Worker` speaks to it.

A painter opens a project, goes on with the strokes that are open, and sends what two clients say,
beginning shortly before the first message that was not acknowledged, as clients do that have lost
their server. It appends the number of each to the file ACKNOWLEDGED when it is done.
"""

import os
import tempfile

import numpy as np

from meshsdf.texture import checkpoints, housekeeping
from meshsdf.texture.brush import Brush
from meshsdf.texture.journal import Project
from meshsdf.texture.live import LiveStrokes
from meshsdf.texture.operations import Operation
from tests.texture.forking import fork_on_demand
from tests.texture.live_twin import CLIENTS, walk
from tests.texture.random_operations import RESOLUTION, small_mesh

OPERATIONS_PER_CHECKPOINT = 5
MOST_MESSAGES = 400
TO_A_STROKE = 6  # messages of a client
BRUSHES = (
    Brush(0.2, color=(1.0, 0.0, 0.0, 1.0)),
    Brush(0.2, color=(0.0, 0.3, 1.0, 0.5), build_up=True, flow=0.5),
    Brush(0.3, kind="smudge"),
)


def message_of(seed, number):
    """(client, kind, samples): what is said as the number-th message, counted from 1."""
    client = CLIENTS[number % 2]
    turn, place = divmod(number // 2, TO_A_STROKE)
    kind = ["begin", "add", "add", "add", "add", "end"][place]
    if kind == "end" and (turn + number) % 4 == 3:
        kind = "cancel"
    return client, kind, walk(np.random.default_rng([seed, number]), 3)


def send(live, seed, number):
    """Say it; the client's own number is that of the message."""
    client, kind, samples = message_of(seed, number)
    if kind == "begin":
        turn = number // 2 // TO_A_STROKE
        live.begin(client, number, (turn * (1 + number % 2)) % 2, BRUSHES[(turn + number) % 3])
    elif kind == "add" and client in live.open_clients():
        live.add(client, number, *samples)
    elif kind == "end" and client in live.open_clients():
        live.end(client, number)
    elif kind == "cancel":
        live.cancel(client, number)


def create(path):
    """A project with two layers."""
    with Project.create(path, small_mesh(), resolution=RESOLUTION) as project:
        for color in ([0.1, 0.2, 0.3, 1.0], [0.0, 0.0, 0.0, 0.0]):
            project.apply(Operation("add-layer", {"color": color}))


def write(project_path, acknowledged_path, seed):
    """Send messages until killed, or until there were enough; then close."""
    with open(acknowledged_path) as file:
        n_acknowledged = len(file.readlines())
    file = os.open(acknowledged_path, os.O_WRONLY | os.O_APPEND)
    live = LiveStrokes.open(
        project_path, warn=lambda words: os.write(file, f"! {words}\n".encode())
    )
    if n_acknowledged % 2:
        live.project.keep_house_apart()
    for number in range(max(1, n_acknowledged - 3), n_acknowledged + MOST_MESSAGES):
        send(live, int(seed), number)
        if number > n_acknowledged:
            os.write(file, f"{number}\n".encode())
    live.close()


def main():
    """Warm up, then fork on demand."""
    checkpoints.OPERATIONS_PER_CHECKPOINT = OPERATIONS_PER_CHECKPOINT
    housekeeping.COPY_SECONDS = 0.0
    with tempfile.TemporaryDirectory() as folder:
        create(f"{folder}/warm.mtex")
        live = LiveStrokes.open(f"{folder}/warm.mtex")
        for number in range(1, 60):
            send(live, 0, number)
        live.close()
    fork_on_demand(write)


if __name__ == "__main__":
    main()
