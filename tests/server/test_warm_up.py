"""meshsdf.server.warm_up: the first stroke of a server waits for no compiler."""

import json
import subprocess
import sys

CODE = """
import gc, json, sys
from pathlib import Path
from numba.core.dispatcher import Dispatcher
from meshsdf.mesh.primitives import icosphere
from meshsdf.server.warm_up import PLAIN, RARER, warm_up
from meshsdf.texture.journal import Project
from meshsdf.texture.live import LiveStrokes
from meshsdf.texture.operations import Operation
from meshsdf.server.wire_bricks import WireBricks

def begin(path):
    with Project.create(path, icosphere(subdivisions=3), resolution=64) as project:
        project.apply(Operation("add-layer", {"color": [0.5, 0.5, 0.5, 1.0]}))
        project.apply(Operation("add-layer", {}))
    live = LiveStrokes.open(path)
    return live, WireBricks(live.project.texture)

def ready():
    kernels = [one for one in gc.get_objects() if isinstance(one, Dispatcher)]
    return {f"{k.py_func.__name__} {s}" for k in kernels for s in k.signatures}

warm_up(Path(sys.argv[1]).parent)
live, bricks = begin(sys.argv[1])
places = icosphere(subdivisions=2).vertices
before = ready()
for turn, brush in enumerate(2 * (PLAIN + RARER)):
    # Beside what was painted, across its rim, and on it
    points = places[7 * turn : 7 * turn + 12]
    live.begin("a", 10 * turn + 1, 1, brush)
    live.add("a", 10 * turn + 2, points, points)
    bricks.update()
    live.end("a", 10 * turn + 3)
    bricks.update()
print(json.dumps([len(before), sorted(ready() - before)]))
live.close()
"""


def test_after_it_nothing_is_compiled_or_loaded_for_a_stroke(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", CODE, str(tmp_path / "a.mtex")], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    n_before, later = json.loads(done.stdout)
    assert n_before > 20
    assert later == []
