"""A process that forks painting servers, to be killed; see `kills.py`.

A line is a project; a server is what `meshsdf paint` runs, and prints its address once it answers.
"""

from meshsdf.server.paint import paint
from meshsdf.texture import checkpoints, housekeeping
from meshsdf.texture.live import LiveStrokes
from tests.texture.forking import fork_on_demand
from tests.texture.kill_worker import OPERATIONS_PER_CHECKPOINT, warm_up


def serve(project):
    """Open the project and serve it until killed."""
    live = LiveStrokes.open(project, warn=lambda words: print("!", words, flush=True))
    paint(live, name="killed", ready=lambda address: print(address, flush=True))


def main():
    """Warm up, then fork on demand."""
    checkpoints.OPERATIONS_PER_CHECKPOINT = OPERATIONS_PER_CHECKPOINT
    housekeeping.COPY_SECONDS = 0.02
    warm_up()
    fork_on_demand(serve)


if __name__ == "__main__":
    main()
