"""Does any frame raise anything but our own error, over a million of them?

python -m tests.benchmarks.frames [--n N] [--requests N] [--seed N]

Frames are random bytes, random payloads behind good headers, and good frames with bytes altered;
each is decoded. Then well-formed brushes and operations whose values were replaced by others are
carried out on a project, as a page's would be; after them the project still paints.
"""

import argparse
import asyncio
import copy
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from meshsdf.errors import MeshsdfError
from meshsdf.mesh import icosphere
from meshsdf.server.messages import Message, OperationAsked, StrokeBegin, Type, decode
from meshsdf.server.requests import Requests
from meshsdf.server.samples import Samples
from meshsdf.server.studio import Studio
from meshsdf.texture import Brush, Operation, Project
from meshsdf.texture.live import LiveStrokes
from tests.server.test_messages import fuzzed

from .alternate import machine

CLIENT = "0123456789abcdef" * 2
VALUES = [
    None, True, -1, 0, 3, 7, 2**53, 1e300, -0.5, 1e-300, "", "checker", "paint", "x" * 300, [],
    [[]],
    [0.5, 0.5, 0.5], [1, 2, 3, 4, 5], ["a"], [None], {}, {"shape": [2, -1], "float32": "AAAA"},
    {"shape": [1], "float32": "!"}, {"axes": "x"}, [[1, 0, 0], [0, 1]], [[0.0, 1.0], [1.0, 0.0]],
]  # fmt: skip
OPERATIONS = [
    ("add-layer", {"name": "a", "color": [0.1, 0.2, 0.3]}),
    ("drop-layer", {"layer": 1}),
    ("layer", {"layer": 0, "name": "b", "opacity": 0.5, "mode": "normal", "place": 0}),
    ("layer", {"layer": 0, "visible": True}),
    ("fill-color", {"layer": 0, "color": [0.5, 0.5, 0.5, 1]}),
    ("bake", {"layer": 0, "texture_kind": "checker", "level": 2, "side": 0.5}),
    ("bake", {"layer": 0, "texture_kind": "wood", "level": 2, "scale": 1.0, "seed": 3}),
    ("coarsen", {"layer": 0, "tolerance": 0.1}),
    ("project", {"layer": 0, "image": "1", "projection": "planar", "level": 2, "matrix": None}),
]  # fmt: skip


class Images:
    """One small picture."""

    def get(self, name: str) -> np.ndarray:
        """It, whatever its name."""
        return np.full((4, 5, 3), 128, np.uint8)


def main() -> None:
    """Print what was counted; an exception that is not ours ends the run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=1_000_000)
    parser.add_argument("--requests", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    begin, n_read = time.perf_counter(), 0
    for number, data in enumerate(fuzzed(rng, asked.n)):
        try:
            decode(data)
            n_read += 1
        except MeshsdfError:
            pass
        if number % 100_000 == 0:
            print(number, "frames", file=sys.stderr, flush=True)
    seconds = time.perf_counter() - begin
    print(machine())
    print(f"{asked.n} frames in {seconds:.0f} s: {n_read} were messages, the others refused")
    with tempfile.TemporaryDirectory() as folder:
        n_done = asyncio.run(carry_out(Path(folder), rng, asked.requests))
    print(f"{asked.requests} requests: {n_done} were done, the others refused; it still paints")


async def carry_out(folder: Path, rng: np.random.Generator, n: int) -> int:
    """Have mangled requests carried out; how many could be."""
    project = Project.create(folder / "a.mtex", icosphere(subdivisions=2), resolution=32)
    project.apply(Operation("add-layer", {"color": [0.5, 0.5, 0.5]}))
    studio = Studio(LiveStrokes(project))
    requests = Requests(studio, Images())
    n_done = 0
    for cseq in range(1, n + 1):
        body = mangled(rng)
        kind = Type.STROKE_BEGIN if isinstance(body, StrokeBegin) else Type.OPERATION
        if cseq % 3 == 0:
            normals = rng.normal(size=(2, 3))
            kind, body = Type.DABS, Samples(normals, normals, np.ones(2))
        try:
            await studio.do(requests.carry_out, CLIENT, Message(kind, cseq, body))
            n_done += 1
        except MeshsdfError:
            pass
    for cseq, (kind, body) in enumerate(good_stroke(studio), n + 1):
        await studio.do(requests.carry_out, CLIENT, Message(kind, cseq, body))
    wanted = await studio.do(project.digest)
    await studio.close()
    with Project.open(folder / "a.mtex") as again:
        assert again.digest() == wanted, "the file does not lead to what was shown"
    return n_done


def good_stroke(studio: Studio) -> list:
    """A stroke that can be painted, on a layer that is there."""
    up = np.array([[0.0, 0.0, 1.0]])
    add = OperationAsked("add-layer", {"name": "last"})
    number = studio.texture._next_number
    return [
        (Type.OPERATION, add),
        (Type.STROKE_BEGIN, StrokeBegin(number, Brush(0.3).to_dict())),
        (Type.DABS, Samples(up, up, np.ones(1))),
        (Type.STROKE_END, None),
    ]


def mangled(rng: np.random.Generator) -> StrokeBegin | OperationAsked:
    """A good request with values replaced."""
    if rng.random() < 0.5:
        brush = Brush(0.3, stamp=np.ones((2, 2), np.float32)).to_dict()
        replace_some(rng, brush)
        return StrokeBegin(0, brush)
    kind, params = OPERATIONS[int(rng.integers(len(OPERATIONS)))]
    params = copy.deepcopy(params)
    replace_some(rng, params)
    return OperationAsked(kind, params, bool(rng.integers(2)))


def replace_some(rng: np.random.Generator, values: dict) -> None:
    """Put other values in the place of up to two, and sometimes add one."""
    names = list(values)
    for _ in range(int(rng.integers(3))):
        name = names[int(rng.integers(len(names)))]
        inner = values[name]
        value = copy.deepcopy(VALUES[int(rng.integers(len(VALUES)))])
        if isinstance(inner, dict) and inner and rng.random() < 0.7:
            inner[list(inner)[int(rng.integers(len(inner)))]] = value
        else:
            values[name] = value
    if rng.random() < 0.1:
        values["more"] = 1


if __name__ == "__main__":
    main()
