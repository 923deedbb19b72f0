"""What live strokes are held against: the operations of a project's file, done one after another.

`replayed` uses nothing of live painting: rows are read from the file, and every one is carried out
on a new texture.
"""

import contextlib
import shutil
import sqlite3
from pathlib import Path

import numpy as np

from meshsdf.texture.brush import Brush
from meshsdf.texture.content import digest
from meshsdf.texture.history import History
from meshsdf.texture.journal import Project
from meshsdf.texture.live import LiveStrokes
from meshsdf.texture.operations import TURNS, Operation, perform
from meshsdf.texture.symmetry import Symmetry
from meshsdf.texture.volume_texture import VolumeTexture
from tests.texture.random_operations import RESOLUTION, small_mesh

CLIENTS = tuple(f"{n:032x}" for n in range(1, 4))
ANNE, BERT, CARL = CLIENTS
RED = (1.0, 0.0, 0.0, 1.0)
BLUE = (0.0, 0.0, 1.0, 0.7)
BRUSHES = {
    "band": Brush(0.2, color=RED, hardness=0.2),
    "dabs": Brush(0.15, color=BLUE, build_up=True, flow=0.4, pressure_radius=((0, 0.3), (1, 1))),
    "mirrored": Brush(0.2, color=RED, build_up=True, symmetry=Symmetry(mirror="xz")),
    "stamp": Brush(0.3, color=BLUE, stamp=np.linspace(0, 1, 16, dtype=np.float32).reshape(4, 4)),
    "geodesic": Brush(0.3, color=RED, geodesic=True, opacity=0.6),
    "height": Brush(0.3, channel="height", value=2.0),
    "erase": Brush(0.3, kind="erase"),
    "blur": Brush(0.3, kind="blur"),
    "smudge": Brush(0.3, kind="smudge", flow=0.7),
    "clone": Brush(0.3, kind="clone", offset=(0.4, 0.2, 0.0)),
    "fill": Brush(0.3, kind="fill", color=RED, tolerance=0.2),
    "gradient": Brush(0.3, kind="gradient", color=RED, end_color=BLUE),
}


def operations_of(path):
    """(client, cseq, operation) of all that is in a project's file."""
    with contextlib.closing(sqlite3.connect(path)) as connection:
        rows = connection.execute("SELECT client, cseq, kind, params FROM op ORDER BY seq")
        return [(c, n, Operation.decoded(kind, params)) for c, n, kind, params in rows]


def pending_of(path):
    """(client, cseq, kind) of all batches that are no operations yet."""
    with contextlib.closing(sqlite3.connect(path)) as connection:
        return connection.execute("SELECT client, cseq, kind FROM pending ORDER BY id").fetchall()


def replayed(path):
    """Digest of a new texture after all operations of a file."""
    texture = VolumeTexture.around(small_mesh(), resolution=RESOLUTION)
    history = History(texture)
    for _, _, operation in operations_of(path):
        if operation.kind in TURNS:
            getattr(history, operation.kind)()
        else:
            with history.record(operation.kind):
                perform(texture, operation)
    return digest(texture)


def samples_of(operation):
    """(n, 7) points, normals and pressures of a stroke."""
    params = operation.params
    return np.column_stack([params["points"], params["normals"], params["pressures"]])


def walk(rng, n):
    """n samples of a walk over the unit sphere, some of them very close to one another."""
    points = np.cumsum(
        rng.normal(scale=rng.choice([0.001, 0.05, 0.3], (n, 1)), size=(n, 3)), axis=0
    )
    points += rng.normal(size=3)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points, points.copy(), rng.uniform(0.2, 1.0, n)


def ball(layer=0, x=0.5, color=(0.2, 0.7, 0.1, 1.0)):
    params = {"layer": layer, "center": [np.cos(x), np.sin(x), 0.0], "radius": 0.6, "color": color}
    return Operation("paint-ball", params)


def fresh(folder, name="a.mtex", n_layers=2, **options):
    """Live strokes of a new project with layers that have something on them."""
    path = folder / name
    live = LiveStrokes(Project.create(path, small_mesh(), resolution=RESOLUTION, **options))
    for n in range(n_layers):
        live.apply(Operation("add-layer", {"color": [0.1 * n, 0.2, 0.3, 1.0]}))
        live.apply(ball(n, 0.4 + n))
    return live


def paint(live, client, cseq, layer, brush, batches):
    """A whole stroke in batches; the number of its operation."""
    live.begin(client, cseq, layer, brush)
    for n, batch in enumerate(batches, cseq + 1):
        live.add(client, n, *batch)
    return live.end(client, cseq + 1 + len(batches))


def copied(path, folder):
    """A copy of all files of a project; its path."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for end in ("", "-wal", "-lock"):
        if Path(f"{path}{end}").exists():
            shutil.copyfile(f"{path}{end}", f"{folder}/a.mtex{end}")
    return folder / "a.mtex"


def crashed(live, folder):
    """A copy of the files of a project whose owner does nothing more; its path."""
    return copied(live.project.path, folder)
