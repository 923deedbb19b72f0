"""The painting server's answers to HTTP, and the door to its WebSocket; `PROTOCOL.md` lists all.

Starlette is imported here alone. Nothing here touches the project: the studio's thread does.
"""

import asyncio
import hashlib
import mimetypes
from collections.abc import AsyncIterator, Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import (
    FileResponse,
    HTMLResponse,
    JSONResponse,
    Response,
    StreamingResponse,
)
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from ..errors import MeshsdfError
from ..kernels.wire_codes import PICTURES
from ..mesh import Mesh
from ..texture.snapshot import snapshot
from .apart import Turnstile, apart
from .bundle import STATIC
from .exports import MIME, PROJECT, Exports, Written, checked_name
from .facts import mesh_bytes, project_facts
from .images import Images
from .limits import (
    MOST_BRICKS,
    MOST_EXPORTS,
    MOST_IMAGE,
    MOST_JSON,
    MOST_SOCKETS,
    MOST_UPLOADS,
    RateLimit,
    Refused,
    whole_body,
)
from .octree_wire import octree_bytes
from .plain_json import json_object
from .security import App, Gate, Guard, Receive, Scope, Send
from .socket import serve_socket
from .static_page import MISSING_PAGE, has_page
from .studio import Studio

CHUNK = 1 << 18  # bytes handed over at once of a long answer
NO_ROOM, SILENT = 1013, 1008  # close a WebSocket: "try again later", "policy violation" (IANA)
UNCHANGING = {"cache-control": "private, no-cache"}  # ask again, and be told if it is the same


class Service:
    """What the paths of the API do.

    Parameters
    ----------
    studio : Studio
        Whose thread owns the project.
    gate : Gate
    images : Images
    exports : Exports
    name : str
        Of what is painted, for people.
    mesh : Mesh
        What exports are written on: the painted mesh, with its own texture coordinates if known.
    """

    def __init__(
        self, studio: Studio, gate: Gate, *, images: Images, exports: Exports, name: str, mesh: Mesh
    ) -> None:
        self.studio, self.gate = studio, gate
        self.images, self.exports = images, exports
        self.name, self.mesh = name, mesh
        self._sockets = Turnstile(MOST_SOCKETS, "connections")
        self._uploads = Turnstile(MOST_UPLOADS, "pictures on their way")
        self._exporting = Turnstile(MOST_EXPORTS, "exports under way")
        self._wrong_tokens = RateLimit(2, 20, "wrong tokens")
        self._kept: dict[str, tuple[bytes, str]] = {}  # answers that never change, and their tags

    async def session(self, request: Request) -> Response:
        """The cookie's key for the token."""
        token = json_object(await _body(request, MOST_JSON)).get("token")
        if not (isinstance(token, str) and self.gate.is_token(token)):
            self._wrong_tokens.take()
            fix = "open the address that the server printed when it was started"
            raise Refused(403, "this is not the token of this run", "POST /api/session", fix)
        return Response(status_code=204, headers={"set-cookie": self.gate.set_cookie()})

    async def project(self, request: Request) -> Response:
        """The project's facts."""
        studio = self.studio
        facts = await studio.do(project_facts, studio.project, self.name, studio.origin)
        return JSONResponse(facts)

    async def mesh_file(self, request: Request) -> Response:
        """The mesh that a page draws."""
        texture = self.studio.texture
        return await self._unchanging(request, mesh_bytes, texture.surface, self.studio.origin)

    async def octree(self, request: Request) -> Response:
        """Where bricks are."""
        return await self._unchanging(request, octree_bytes, self.studio.texture)

    async def bricks(self, request: Request) -> Response:
        """Bricks of a range of entries."""
        first, last = (_whole(request, name) for name in ("first", "last"))
        if not 0 <= last - first <= MOST_BRICKS:
            what = f"entries {first} to {last} are no range of up to {MOST_BRICKS}"
            raise Refused(400, what, "GET /api/bricks", "ask for fewer at a time")
        picture = request.query_params.get("picture", PICTURES[0])
        if picture not in PICTURES:
            what = f"there is no picture {picture[:40]!r}"
            raise Refused(400, what, "GET /api/bricks", f"use one of {', '.join(PICTURES)}")
        payload = await self.studio.do(_payload, self.studio, first, last, picture)
        return _tagged(request, payload, _tag(payload))

    async def digest(self, request: Request) -> Response:
        """Checksums of the project and of what is shown."""
        return JSONResponse(await self.studio.do(self.studio.digests))

    async def add_image(self, request: Request) -> Response:
        """Keep a picture for a projection."""
        with self._uploads.passed():
            kept = await apart(self.images.add, await _body(request, MOST_IMAGE))
        return JSONResponse(asdict(kept), 201)

    async def export(self, request: Request) -> Response:
        """Write files beside the project."""
        name = checked_name(json_object(await _body(request, MOST_JSON)).get("name"))
        with self._exporting.passed():
            if Path(name).suffix.lower() == PROJECT:
                written = await self._save_as(name)
            else:
                shown = await self.studio.do(snapshot, self.studio.texture)
                written = await apart(self.exports.write, name, shown, self.mesh)
        files = [{"name": one, "url": f"/api/exports/{quote(one)}"} for one in written.names]
        facts = files[0] | {"bytes": written.n_bytes, "notes": list(written.notes)}
        return JSONResponse(facts | {"files": files}, 201)

    async def exported(self, request: Request) -> Response:
        """A file that was exported in this run."""
        path = self.exports.find(request.path_params["name"])
        kind = MIME.get(path.suffix.lower(), "application/octet-stream")
        return FileResponse(path, media_type=kind, filename=path.name)

    async def socket(self, websocket: WebSocket) -> None:
        """Painting itself."""
        try:
            with self._sockets.passed():
                await serve_socket(websocket, self.studio, self.images)
        except Refused as refused:
            await websocket.close(NO_ROOM, refused.what)
        except TimeoutError:
            await websocket.close(SILENT, "no word came")
        except (WebSocketDisconnect, OSError, RuntimeError):
            if _is_open(websocket):
                raise
            # else it went in the middle of a word

    async def _save_as(self, name: str) -> Written:
        loop = asyncio.get_running_loop()

        def save(path: Path) -> None:
            done = self.studio.do(self.studio.project.save_as, path)
            asyncio.run_coroutine_threadsafe(done, loop).result()

        return await apart(self.exports.save_project, name, save)

    async def _unchanging(self, request: Request, make: Callable[..., bytes], *arguments: Any):
        """What a function makes of arguments that never change."""
        name = make.__name__
        if name not in self._kept:
            data = await self.studio.do(make, *arguments)
            self._kept[name] = data, _tag(data)
        return _tagged(request, *self._kept[name])


def make_app(service: Service, static: Path = STATIC) -> App:
    """The whole server behind its gate, as an ASGI application."""
    mimetypes.add_type("text/javascript", ".js")  # whatever this machine's registry says
    mimetypes.add_type("font/woff2", ".woff2")

    async def page(request: Request) -> Response:
        if not has_page(static / "index.html"):
            return HTMLResponse(MISSING_PAGE)
        return FileResponse(static / "index.html", media_type="text/html", headers=UNCHANGING)

    files = StaticFiles(directory=static, check_dir=False)

    async def bundled(scope: Scope, receive: Receive, send: Send) -> None:
        if not static.is_dir() or "\0" in scope["path"]:  # which no file's name has
            raise HTTPException(404)
        await files(scope, receive, send)

    async def nothing(request: Request) -> Response:
        return Response(status_code=204)

    routes = [
        Route("/", page),
        Route("/favicon.ico", nothing),
        Mount("/static", bundled),
        Route("/api/session", service.session, methods=["POST"]),
        Route("/api/project", service.project),
        Route("/api/mesh", service.mesh_file),
        Route("/api/octree", service.octree),
        Route("/api/bricks", service.bricks),
        Route("/api/digest", service.digest),
        Route("/api/images", service.add_image, methods=["POST"]),
        Route("/api/exports", service.export, methods=["POST"]),
        Route("/api/exports/{name}", service.exported),
        WebSocketRoute("/api/socket", service.socket),
    ]
    handlers = {MeshsdfError: _refused, HTTPException: _refused, Exception: _failed}
    return Guard(Starlette(routes=routes, exception_handlers=handlers), service.gate)


def _payload(studio: Studio, first: int, last: int, picture: str) -> bytes:
    studio.look()
    return studio.bricks.range_payload(first, last, picture)


def _is_open(websocket: WebSocket) -> bool:
    states = websocket.client_state, websocket.application_state
    return WebSocketState.DISCONNECTED not in states


async def _body(request: Request, most: int) -> bytes:
    try:
        return await whole_body(request.stream(), most, request.headers.get("content-length"))
    except ClientDisconnect:
        raise Refused(400, "the request ended early", "the request's body", "send it") from None


async def _refused(request: Request, error: Exception) -> Response:
    """Why a request is not done as asked."""
    headers: dict[str, str] = {}
    if isinstance(error, HTTPException):
        status, headers = error.status_code, dict(error.headers or {})
        words = error.detail, f"{request.method} {request.url.path}", "see PROTOCOL.md"
    else:
        status = error.status if isinstance(error, Refused) else 400
        words = error.what, error.where, error.fix
    return JSONResponse(dict(zip(("what", "where", "fix"), words, strict=True)), status, headers)


async def _failed(request: Request, error: Exception) -> Response:
    """A fault of ours; it is logged by the server, and what is painted is safe."""
    facts = {"what": f"{type(error).__name__} in the server", "where": request.url.path}
    return JSONResponse(facts | {"fix": "report this with the server's last words"}, 500)


def _tag(data: bytes) -> str:
    return f'"{hashlib.sha256(data).hexdigest()[:32]}"'


def _tagged(request: Request, data: bytes, tag: str) -> Response:
    """The data in pieces, or the word that they are what the page has already."""
    headers = UNCHANGING | {"etag": tag}
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    headers["content-length"] = str(len(data))
    return StreamingResponse(_pieces(data), 200, headers, "application/octet-stream")


async def _pieces(data: bytes) -> AsyncIterator[memoryview]:
    """Slow readers make the server wait, and cost it no memory beyond a piece."""
    whole = memoryview(data)
    for start in range(0, len(whole), CHUNK):
        yield whole[start : start + CHUNK]


def _whole(request: Request, name: str) -> int:
    """A whole number of the address."""
    text = request.query_params.get(name, "")
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        what = f"{name}={text[:40]!r} is no whole number"
        raise Refused(400, what, "GET /api/bricks", "write /api/bricks?first=0&last=100")
    return int(text)
