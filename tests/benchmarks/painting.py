"""The painting server under load: `meshsdf paint` as a process, painters over real sockets.

python -m tests.benchmarks.painting latency MESH [--seconds 20]
python -m tests.benchmarks.painting soak MESH [--seconds 600]
python -m tests.benchmarks.painting storm MESH [--seconds 300]
python -m tests.benchmarks.painting two MESH [--seconds 20]
python -m tests.benchmarks.painting slow MESH [--seconds 60]

latency  from a dab (60 per second, radius 25 texels) to its acknowledgement, after the commit.
soak     the same for ten minutes: growth of the server's memory, the first minute, the last, and
         all between. Beside it what the disk takes for a page in another file, as often.
storm    a painter whose connection is cut every 200 ms, beside the same strokes without cuts.
two      two painters at once: what each was sent, and the server's own, by their SHA-256.
slow     a page that reads a megabit per second while another paints: the server's memory.
"""

import argparse
import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from meshsdf import read_mesh
from meshsdf.mesh.measures import area
from meshsdf.server.client import Painter
from meshsdf.server.messages import Hello, Type, decode, encode, encode_hello, encode_json
from meshsdf.server.samples import Samples
from meshsdf.spatial import ClosestPoint
from meshsdf.texture.brush import Brush

from .alternate import machine
from .disk import Disk

RATE = 60.0  # dabs per second
RADIUS = 25  # texels
STROKE = 60  # dabs
PAUSE = 0.2  # seconds between strokes
RESOLUTION = 512
CUT = 0.2  # seconds
MEGABIT = 1e6 / 8  # bytes


class Server:
    """`meshsdf paint` on a new project of a mesh."""

    def __init__(self, mesh, folder, resolution=RESOLUTION):
        command = [
            sys.executable, "-m", "meshsdf", "paint", str(mesh),
            "--project", str(Path(folder) / "painted.mtex"), "--resolution", str(resolution),
        ]  # fmt: skip
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.address = re.search(r"http://\S+", self.process.stdout.readline())[0]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(60) == 0
        self.process.stdout.close()

    @property
    def resident(self):
        """Bytes of memory the server holds now."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return 1024 * int(re.search(r"VmRSS:\s+(\d+)", status)[1])


@contextlib.contextmanager
def served(mesh_path):
    """A server on a new project in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder, Server(mesh_path, folder) as server:
        yield server


class Walk:
    """A pointer that wanders over the surface in steps of about half a brush's radius."""

    def __init__(self, mesh, texel, seed):
        self.rng, self.closest = np.random.default_rng(seed), ClosestPoint(mesh)
        self.step = 0.5 * RADIUS * texel
        self.face = mesh.triangles
        self.normals = np.cross(*(self.face[:, [1, 2]] - self.face[:, :1]).swapaxes(0, 1))
        self.jump()

    def jump(self):
        """Go to another place."""
        at = self.rng.integers(len(self.face))
        self.point, self.way = self.face[at].mean(axis=0), self.rng.normal(size=3)

    def next(self):
        """The next point and its normal, each (1, 3)."""
        self.way += 0.3 * self.rng.normal(size=3)
        self.way /= np.linalg.norm(self.way)
        found = self.closest((self.point + self.step * self.way)[None])
        self.point = found.point[0]
        return found.point, self.normals[found.face_index]


def brush_of(painter, color):
    """A round brush of the radius asked for, in the texture's units."""
    return Brush(RADIUS * painter.facts["texel"], color=color, hardness=0.5)


class Broken(Exception):
    """The server's connection is gone, and with it what was to be measured."""


class Timed:
    """A page that paints at a steady pace and notes when acknowledgements come.

    Nothing else happens in this process while it paints: the way is laid out before.
    """

    def __init__(self, painter, mesh, seconds, seed=0):
        self.frames = list(self._laid_out(painter, mesh, seconds, seed))
        self.told = np.zeros(len(self.frames))
        self.sent = np.zeros(len(self.frames))
        self.kinds = np.array([kind for kind, _, _ in self.frames])
        self.headers = {"Authorization": f"Bearer {painter._token}"}
        self.url = "ws" + painter.base.removeprefix("http") + "/api/socket"

    @staticmethod
    def _laid_out(painter, mesh, seconds, seed):
        """(kind, when to send it, frame); strokes of a second, and a pause of a fifth."""
        walk, layer = (
            Walk(mesh, painter.facts["texel"], seed),
            painter.state["layers"][-1]["number"],
        )
        when, seq = 0.0, 0
        while when < seconds:
            walk.jump()
            brush = brush_of(painter, (*walk.rng.random(3).tolist(), 1.0)).to_dict()
            seq += 1
            body = {"layer": layer, "brush": brush}
            yield "begin", when, encode_json(Type.STROKE_BEGIN, body, seq)
            for _ in range(STROKE):
                point, normal = walk.next()
                seq += 1
                data = Samples(point - painter.origin, normal, np.ones(1)).packed()
                yield "dab", when, encode(Type.DABS, seq, data)
                when += 1 / RATE
            seq += 1
            yield "end", when, encode(Type.STROKE_END, seq)
            when += PAUSE

    def paint(self):
        """Send everything at its time, until the last is acknowledged; `Broken` if one is not."""
        opened = connect(
            self.url, additional_headers=self.headers, compression=None, max_size=2**26, proxy=None
        )
        with opened as socket:
            socket.send(encode_hello(Hello(os.urandom(16).hex())))
            with ThreadPoolExecutor(1) as pool:
                listening = pool.submit(self._listen, socket)
                time.sleep(1)
                begin = time.perf_counter()
                for n, (_, when, frame) in enumerate(self.frames):
                    time.sleep(max(0.0, begin + when - time.perf_counter()))
                    self.sent[n] = time.perf_counter()
                    try:
                        socket.send(frame)
                    except ConnectionClosed:
                        break
                listening.result()

    def _listen(self, socket):
        """Note when acknowledgements come."""
        n_told = 0
        try:
            while n_told < len(self.frames):
                n_told += self._take(socket, socket.recv())
        except ConnectionClosed as error:
            words = f"the connection broke after {n_told} of {len(self.frames)} answers"
            raise Broken(f"{words}: {error}") from None

    def _take(self, socket, data):
        """Whether it is an acknowledgement."""
        if data[0] == Type.ACK:
            self.told[int.from_bytes(data[4:8], "little") - 1] = time.perf_counter()
        elif data[0] == Type.BRICKS:
            socket.send(encode(Type.SHOWN, int.from_bytes(data[4:8], "little")))
        elif data[0] == Type.ERROR:
            raise Broken(decode(data, downward=True).body)
        return data[0] == Type.ACK

    def waits(self, kind, first=0.0, last=np.inf):
        """Milliseconds from sending to acknowledgement, of those sent in a time of the run."""
        at = self.sent - self.sent[0]
        rows = (self.kinds == kind) & (at >= first) & (at < last)
        return 1e3 * (self.told - self.sent)[rows]


def highs(parts):
    """The 99th percentile of every part."""
    return " ".join(f"{np.percentile(one, 99):.1f}" for one in parts if len(one))


def in_words(waits):
    """Median, 99 % and longest."""
    middle, high = np.percentile(waits, [50, 99])
    return f"median {middle:.1f} ms, 99 % {high:.1f} ms, longest {waits.max():.1f} ms"


def latency(mesh_path, mesh, seconds):
    """Time from a dab to its acknowledgement."""
    with served(mesh_path) as server:
        with Painter(server.address) as painter:
            warm, timed = Timed(painter, mesh, 5, seed=1), Timed(painter, mesh, seconds)
        warm.paint()  # kernels are compiled or loaded
        timed.paint()
        for kind in ("dab", "begin", "end"):
            waits = timed.waits(kind)
            print(f"{kind}: {len(waits)}, {in_words(waits)}")
        print(f"all: {in_words(1e3 * (timed.told - timed.sent))}")


def soak(mesh_path, mesh, seconds):
    """Memory and latency over a long time."""
    with served(mesh_path) as server:
        with Painter(server.address) as painter:
            warm, timed = Timed(painter, mesh, 10, seed=1), Timed(painter, mesh, seconds)
        warm.paint()
        sizes, begin = [], time.perf_counter()
        with ThreadPoolExecutor(1) as pool, Disk() as disk:
            painting = pool.submit(timed.paint)
            while not painting.done():
                sizes.append((time.perf_counter() - begin, server.resident))
                wait([painting], 5)
            painting.result()
        for at, size in sizes[:: max(1, len(sizes) // 12)]:
            print(f"{at:6.0f} s  {size / 2**20:7.1f} MiB")
        part = min(60.0, seconds / 4)
        print(f"dabs in the first {part:.0f} s: {in_words(timed.waits('dab', 0, part))}")
        print(f"dabs in the last: {in_words(timed.waits('dab', seconds - part))}")
        begins = np.arange(0, seconds, part)
        parts = [timed.waits("dab", at, at + part) for at in begins]
        print(f"99 %, every {part:.0f} s: {highs(parts)} ms")
        print(f"of the disk alone: {highs(disk.parts(begins[1:]))} ms")
        middle = next(size for at, size in sizes if at >= seconds / 4)
        print(f"memory from a quarter on: {100 * (sizes[-1][1] / middle - 1):+.1f} %")


def strokes(painter, mesh, seconds, seed, *, cut=lambda: None):
    """The same strokes for the same seed, about as fast as a hand."""
    walk, layer = Walk(mesh, painter.facts["texel"], seed), painter.state["layers"][-1]["number"]
    for n in range(int(seconds * RATE)):
        if n % STROKE == 0:
            if n:
                painter.end()
            walk.jump()
            painter.begin(layer, brush_of(painter, (*walk.rng.random(3).tolist(), 1.0)))
        painter.dabs(*walk.next())
        cut()
        time.sleep(1 / RATE)
    painter.end()


def storm(mesh_path, mesh, seconds):
    """Cut the connection again and again; nothing may differ."""
    digests = []
    for breaks in (True, False):
        with served(mesh_path) as server, Painter(server.address) as painter:
            last = [time.perf_counter()]

            def cut(painter=painter, last=last, breaks=breaks):
                if breaks and time.perf_counter() - last[0] > CUT:
                    last[0] = time.perf_counter()
                    socket = painter._socket
                    if socket is not None:
                        socket.socket.close()

            strokes(painter, mesh, seconds, 7, cut=cut)
            painter.catch_up()
            digests.append(painter.get_json("/api/digest")["project"])
            print(f"{painter.n_connections} connections, project {digests[-1][:16]}")
    print("equal" if digests[0] == digests[1] else "DIFFERENT")


def two(mesh_path, mesh, seconds):
    """Two painters at once, on one layer and with undo in between."""
    with (
        served(mesh_path) as server,
        Painter(server.address) as first,
        Painter(server.address) as second,
    ):
        painters = first, second
        threads = [
            threading.Thread(target=strokes, args=(painter, mesh, seconds, seed))
            for seed, painter in enumerate(painters)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        first.undo()
        found = [painter.catch_up() for painter in painters]
        wanted = first.get_json("/api/digest")["shown"]
        print(*found, wanted, "equal" if {*found} == {wanted} else "DIFFERENT")


def slow(mesh_path, mesh, seconds):
    """A page that hardly reads, and what it costs the server."""
    with served(mesh_path) as server, Painter(server.address) as painter:
        strokes(painter, mesh, 5, 1)
        painter.catch_up()
        sizes = []
        for with_slow in (False, True):
            stop = threading.Event()
            page = Slow(painter, stop) if with_slow else None
            before = server.resident
            strokes(painter, mesh, seconds, 2 + with_slow)
            painter.wait()
            sizes.append(server.resident - before)
            stop.set()
            if page is not None:
                page.thread.join()
                print(f"the slow page got {page.n_bytes / 2**20:.1f} MiB")
        for words, size in zip(("without it", "with it"), sizes, strict=True):
            print(f"memory grew by {size / 2**20:.1f} MiB {words}")
        print("it catches up:", page.catches_up())


class Slow:
    """A page on a line of one megabit per second."""

    def __init__(self, painter, stop):
        self.painter, self.stop, self.n_bytes = painter, stop, 0
        self.bricks, self.newest = {}, 0
        headers = {"Authorization": f"Bearer {painter._token}"}
        url = "ws" + painter.base.removeprefix("http") + "/api/socket"
        self.opened = connect(
            url, additional_headers=headers, compression=None, max_size=2**26, max_queue=1,
            proxy=None,
        )  # fmt: skip
        self.socket = self.opened.__enter__()
        self.socket.send(encode_hello(Hello(os.urandom(16).hex())))
        self.thread = threading.Thread(target=self._read)
        self.thread.start()

    def _read(self):
        while not self.stop.is_set():
            with contextlib.suppress(TimeoutError):
                self._take(self.socket.recv(timeout=0.2), MEGABIT)

    def _take(self, data, rate):
        from meshsdf.server.wire_records import brick_records

        self.n_bytes += len(data)
        if rate:
            time.sleep(len(data) / rate)
        message = decode(data, downward=True)
        if message.type is Type.BRICKS:
            self.bricks |= {entry: brick for entry, _, brick in brick_records(message.body)}
            self.socket.send(encode(Type.SHOWN, message.seq))

    def catches_up(self):
        """Whether it has what the server shows, once it may read on."""
        from meshsdf.server.wire_records import bricks_digest

        wanted = self.painter.get_json("/api/digest")["shown"]
        with contextlib.suppress(TimeoutError):
            while bricks_digest(sorted(self.bricks.items())) != wanted:
                self._take(self.socket.recv(timeout=10), 0)
            return True
        return False


def main():
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    work = {"latency": (latency, 20), "soak": (soak, 600), "storm": (storm, 300),
            "two": (two, 20), "slow": (slow, 60)}  # fmt: skip
    parser.add_argument("what", choices=work)
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--seconds", type=float)
    asked = parser.parse_args()
    function, usual = work[asked.what]
    mesh = read_mesh(asked.mesh)
    print(machine())
    print(f"{asked.what}: {asked.mesh.name}, {mesh.n_faces} faces, area {area(mesh):.4g}")
    try:
        function(asked.mesh, mesh, asked.seconds or usual)
    except Broken as error:
        sys.exit(f"nothing was measured: {error}")


if __name__ == "__main__":
    main()
