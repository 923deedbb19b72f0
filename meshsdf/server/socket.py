"""One page's WebSocket: frames in, to the studio; acknowledgements, state and bricks out.

What waits to go out is bounded: a message is read only while few are unanswered, of states the
latest counts, and of bricks a `Feed` sends no more than the page shows.
"""

import asyncio
from collections import deque
from functools import partial
from typing import Any

from ..errors import MeshsdfError, ServerError
from .feed import Feed
from .messages import (
    DURABLE,
    MOST_BYTES,
    VERSION,
    Hello,
    Message,
    Type,
    View,
    decode,
    encode_ack,
    encode_error,
    encode_json,
)
from .requests import Requests
from .studio import Studio

MALFORMED, TOO_LARGE, REPLACED = 1008, 1009, 4001
MOST_UNANSWERED = 64  # durable messages of one page that are being done
ALIVE_SECONDS = 5.0  # a page hears something at least so often while its messages are being done
HELLO_SECONDS = 10.0


async def serve_socket(websocket: Any, studio: Studio, images: Any = None) -> None:
    """Serve one page until it goes or sends what is no message.

    Parameters
    ----------
    websocket : starlette.websockets.WebSocket
        Not yet accepted; whoever is there may paint.
    studio : Studio
    images : object, optional
        ``images.get(name)`` gives a picture for projections.
    """
    await websocket.accept()
    page = Page(websocket, studio, images)
    try:
        await page.serve()
    except ServerError as error:
        await page.refuse(error)


class TooLarge(ServerError):
    """A frame that is longer than any may be."""


class Page:
    """A page that is connected."""

    def __init__(self, websocket: Any, studio: Studio, images: Any) -> None:
        self.websocket, self.studio = websocket, studio
        self.requests = Requests(studio, images)
        self.client = ""
        self.feed: Feed
        self._loop = asyncio.get_running_loop()
        self._out: deque[bytes] = deque()
        self._state: dict[str, Any] | None = None
        self._wake = asyncio.Event()
        self._room = asyncio.Semaphore(MOST_UNANSWERED)
        self._last: asyncio.Future | None = None
        self._last_was_samples = False
        self._is_replaced = False

    async def serve(self) -> None:
        """Greet, then read and write until one of the two ends."""
        hello = await self._hello()
        if hello is None:
            return
        self.client = hello.client
        await self._welcome()
        self.studio.arrive(self.client, self)
        reader = asyncio.create_task(self._read(hello))
        writer = asyncio.create_task(self._write())
        alive = asyncio.create_task(self._keep_alive())
        tasks = (reader, writer, alive)
        try:
            done, _ = await asyncio.wait({reader, writer}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self.studio.unsubscribe(self)
            self.studio.depart(self.client, self)
        for task in () if self._is_replaced else done:
            task.result()  # or what ended it

    def replace(self) -> None:
        """Another connection of the same client is there: end this one."""
        self._is_replaced = True
        self._wake.set()

    def refill(self) -> None:
        """On the studio's thread: send bricks, if there are any to send."""
        self.feed.refill()

    def told_state(self, state: dict[str, Any]) -> None:
        """On the studio's thread: the latest state is to be sent."""
        self._loop.call_soon_threadsafe(self._set_state, state)

    async def refuse(self, error: ServerError) -> None:
        """Say what is wrong and close."""
        code = TOO_LARGE if isinstance(error, TooLarge) else MALFORMED
        await self.websocket.send_bytes(encode_error(0, error))
        await self.websocket.close(code)

    async def _hello(self) -> Hello | None:
        async with asyncio.timeout(HELLO_SECONDS):
            message = await self._next()
        if message is None:
            return None
        if not isinstance(message.body, Hello):
            what = f"the first message is {message.type.name}"
            raise ServerError(what, "a message of the painting page", "send HELLO first")
        return message.body

    async def _welcome(self) -> None:
        studio = self.studio
        greeting = {
            "version": VERSION,
            "run": studio.run,
            "cseq": studio.live.last_cseq(self.client),
            "state": studio.state,
        }
        await self.websocket.send_bytes(encode_json(Type.WELCOME, greeting))

    async def _next(self) -> Message | None:
        """The next message; None once the page has gone."""
        event = await self.websocket.receive()
        if event["type"] == "websocket.disconnect":
            return None
        data = event.get("bytes")
        if data is None:
            what = "a frame of text"
            raise ServerError(what, "a message of the painting page", "send binary frames")
        if len(data) > MOST_BYTES:
            what = f"a frame of {len(data)} bytes"
            raise TooLarge(what, "a message of the painting page", f"send at most {MOST_BYTES}")
        return decode(data)

    async def _read(self, hello: Hello) -> None:
        known = {"run_is_known": hello.run == self.studio.run, "since": hello.since}
        bricks = self.studio.bricks
        self.feed = await self.studio.do(partial(Feed, bricks, self._send_soon, **known))
        self.studio.subscribe(self)
        while (message := await self._next()) is not None:
            if message.type in DURABLE:
                await self._room.acquire()
                asked = await self._asked(message)
                asked.add_done_callback(partial(self._answer, message.seq))
            elif message.type is Type.SHOWN:
                await self.studio.ask(self.feed.shown, message.seq)
            elif isinstance(message.body, View):
                await self._look(message.body)
            else:
                what = f"{message.type.name} came again"
                raise ServerError(what, "a message of the painting page", "send it once, first")

    async def _asked(self, message: Message) -> asyncio.Future:
        """Have a durable message done, after those before it; samples have their own thread."""
        is_samples = message.type is Type.DABS
        if self._last is not None and is_samples is not self._last_was_samples:
            await asyncio.wait([self._last])
        ask = self.studio.ask_intake if is_samples else self.studio.ask
        self._last = await ask(self.requests.carry_out, self.client, message)
        self._last_was_samples = is_samples
        return self._last

    async def _look(self, view: View) -> None:
        origin = self.studio.origin
        cursor = None if view.cursor is None else view.cursor + origin
        await self.studio.ask(self.feed.look, view.eye + origin, cursor)

    def _answer(self, cseq: int, done: asyncio.Future) -> None:
        """Say that a message is on the disk, or why not; then there is room for the next."""
        if done.cancelled():
            return
        error = done.exception()
        if error is None:
            self._send(encode_ack(cseq, done.result()))
        elif isinstance(error, MeshsdfError):
            self._send(encode_error(cseq, error))
        else:
            words = f"{type(error).__name__}: {error}"[:200]
            fault = ServerError(f"the server failed: {words}", "the server", "report it")
            self._send(encode_error(cseq, fault))

    def _send_soon(self, frame: bytes) -> None:
        """On the studio's thread: send a frame."""
        self._loop.call_soon_threadsafe(self._send, frame)

    def _send(self, frame: bytes) -> None:
        self._out.append(frame)
        self._wake.set()

    def _set_state(self, state: dict[str, Any]) -> None:
        self._state = state
        self._wake.set()

    async def _write(self) -> None:
        while True:
            await self._wake.wait()
            self._wake.clear()
            if self._is_replaced:
                await self.websocket.close(REPLACED)
                return
            while self._out or self._state is not None:
                if self._out:
                    frame = self._out.popleft()
                    await self.websocket.send_bytes(frame)
                    if frame[0] != Type.BRICKS:
                        self._room.release()
                else:
                    state, self._state = self._state, None
                    await self.websocket.send_bytes(encode_json(Type.STATE, state))

    async def _keep_alive(self) -> None:
        while True:
            await asyncio.sleep(ALIVE_SECONDS)
            if self.studio.is_busy:
                self._set_state(self.studio.state)
