"""The whole painting server in this process, on a free port of 127.0.0.1."""

import contextlib
import socket
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
from websockets.sync.client import connect

from meshsdf.mesh import Mesh
from meshsdf.mesh.primitives import icosphere
from meshsdf.server.app import Service, make_app
from meshsdf.server.exports import Exports
from meshsdf.server.images import Images
from meshsdf.server.security import Gate
from meshsdf.server.serve import PaintServer, listen, serve, server_of
from meshsdf.server.studio import Studio
from meshsdf.texture.journal import Project
from meshsdf.texture.live import LiveStrokes
from meshsdf.texture.operations import Operation

MIB = 1 << 20
RED = [1.0, 0.0, 0.0, 1.0]


@dataclass(frozen=True)
class Running:
    """A server, and clients for it."""

    gate: Gate
    studio: Studio
    service: Service
    folder: Path
    server: PaintServer

    @property
    def base(self) -> str:
        """Its address, as pages write it."""
        return f"http://127.0.0.1:{self.gate.port}"

    @property
    def address(self) -> str:
        """What `meshsdf paint` prints."""
        return f"{self.base}/#t={self.gate.token}"

    @property
    def bearer(self) -> dict[str, str]:
        """What a script sends to be let in."""
        return {"authorization": f"Bearer {self.gate.token}"}

    def client(self, **headers: str) -> httpx.Client:
        """A client that knows the token."""
        return httpx.Client(base_url=self.base, headers=self.bearer | headers, timeout=30)

    @contextlib.contextmanager
    def page(self) -> Iterator[httpx.Client]:
        """A client that does what the page does: it has a cookie, and says where it is from."""
        own = {"origin": self.base}
        with httpx.Client(base_url=self.base, headers=own, timeout=30) as client:
            assert client.post("/api/session", json={"token": self.gate.token}).status_code == 204
            yield client


def painted_ball(path: Path, mesh: Mesh | None = None, resolution: int = 32) -> None:
    """A project around a ball, with a red layer."""
    mesh = icosphere(subdivisions=3) if mesh is None else mesh
    with Project.create(path, mesh, resolution=resolution) as project:
        project.apply(Operation("add-layer", {"name": "base", "color": RED}))


@contextlib.contextmanager
def running(folder: Path, static: Path | None = None) -> Iterator[Running]:
    """A server of a project in a folder, which is made if it is not there."""
    file = folder / "ball.mtex"
    if not file.exists():
        painted_ball(file)
    studio = Studio(LiveStrokes.open(file))
    listening = listen("127.0.0.1", 0)
    gate = Gate(listening.getsockname()[1])
    parts = {"images": Images(), "exports": Exports(file, 64), "name": "ball"}
    service = Service(studio, gate, mesh=studio.texture.surface, **parts)
    server = server_of(make_app(service, static or folder / "static"))
    ready = threading.Event()
    thread = threading.Thread(
        target=serve, args=(server, listening), kwargs={"ready": ready.set, "close": studio.close}
    )
    thread.start()
    try:
        assert ready.wait(30)
        yield Running(gate, studio, service, folder, server)
    finally:
        server.should_exit = True
        thread.join(30)
    assert not thread.is_alive()


def is_alive(server: Running) -> bool:
    """Whether it still answers who may ask."""
    with server.client() as client:
        return client.get("/api/project").json()["name"] == "ball"


def raw(server: Running, *parts: bytes, seconds: float = 10.0) -> bytes:
    """What the server says to bytes, until it closes or is silent."""
    answer = b""
    address = ("127.0.0.1", server.gate.port)
    with (
        socket.create_connection(address, timeout=seconds) as client,
        contextlib.suppress(TimeoutError, ConnectionError),
    ):
        for part in parts:
            client.sendall(part)
        while got := client.recv(1 << 16):
            answer += got
    return answer


def head(server: Running, line: str, *headers: str) -> bytes:
    """A request's line and headers, for this server."""
    own = [f"Host: 127.0.0.1:{server.gate.port}", *headers]
    return "\r\n".join([f"{line} HTTP/1.1", *own, "", ""]).encode()


def status_of(answer: bytes) -> int:
    """The number of an answer; 0 if there is none."""
    return int(answer.split(b" ", 2)[1]) if answer.startswith(b"HTTP/1.1 ") else 0


def knock(server: Running, **headers: str):
    """The WebSocket that these headers open."""
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    address = f"ws://127.0.0.1:{server.gate.port}/api/socket"
    origin = given.pop("origin", None)
    return connect(address, additional_headers=given, origin=origin, proxy=None, open_timeout=10)


def cookie_of(server: Running) -> str:
    """What the page's browser sends along."""
    return server.gate.set_cookie().split(";")[0]
