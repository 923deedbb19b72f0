"""A server in this process on a free port, with nothing in front of the socket."""

import asyncio
import contextlib
import threading

import uvicorn
from starlette.applications import Starlette
from starlette.responses import JSONResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocketDisconnect

from meshsdf.server.socket import serve_socket
from meshsdf.server.studio import Studio


@contextlib.contextmanager
def serving(live, images=None, **options):
    """The address and the studio of a server of these strokes; it is closed in the end."""
    studio = Studio(live, **options)

    async def project(request):
        return JSONResponse({"origin": studio.origin.tolist()})

    async def digest(request):
        return JSONResponse(await studio.do(studio.digests))

    async def socket(websocket):
        with contextlib.suppress(
            WebSocketDisconnect, OSError, RuntimeError
        ):  # it went in the middle of a word
            await serve_socket(websocket, studio, images)

    routes = [
        Route("/api/project", project),
        Route("/api/digest", digest),
        WebSocketRoute("/api/socket", socket),
    ]
    config = uvicorn.Config(
        Starlette(routes=routes), host="127.0.0.1", port=0, log_level="error", lifespan="off",
        ws="websockets-sansio", ws_max_size=2**20, ws_per_message_deflate=False,
        timeout_graceful_shutdown=1,
    )  # fmt: skip
    server = uvicorn.Server(config)

    async def run():
        await server.serve()
        await studio.close()

    thread = threading.Thread(target=asyncio.run, args=(run(),))
    thread.start()
    try:
        while not server.started:
            thread.join(0.01)
        port = server.servers[0].sockets[0].getsockname()[1]
        yield f"http://127.0.0.1:{port}/#t=none", studio
    finally:
        server.should_exit = True
        thread.join()
