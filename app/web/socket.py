"""The socket ``/api/ws``: a page says what it wants to hear of which context, and is told until it goes away.

The context ``live`` is always there; the others are recordings that are replayed. What is told of each is the work of
its feed (``app.web.feed``).
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterator
from typing import Any, Final, Protocol

from fastapi import WebSocket, WebSocketDisconnect
from pydantic import TypeAdapter, ValidationError

from app.service.shown import LIVE, Shown
from app.web.feed import Feed
from app.web.models import Beat, ClientMessage, GoneMessage, ServerMessage, Subscribe, Urgent, UrgentMessage, UrgentTold
from app.web.urgent import Commanding, Commands

log = logging.getLogger(__name__)

TICK_S: Final = 0.01
"""Window in which changes are collected: the most that a change waits here."""
SEND_TIMEOUT_S: Final = 15.0
"""A client that takes nothing for so long is dropped; it comes back by itself."""
MAX_REQUEST: Final = 65_536
MAX_OTHERS: Final = 4
"""Replays that one page hears of at a time; each is worth the work of a feed."""
_adapter: Final[TypeAdapter[Any]] = TypeAdapter(ServerMessage)
_from_client: Final[TypeAdapter[Subscribe | Beat | Urgent]] = TypeAdapter(ClientMessage)


class Contexts(Protocol):
    """What can be shown."""

    def shown(self, ctx: str) -> Shown | None:
        """The context of that name; None where there is none, or no longer."""

    def watch(self, ctx: str) -> Callable[[], None]:
        """Somebody looks at it from now on; the answer ends it."""


class DeadManDesk(Protocol):
    """Where the beats of pages go that hold an axis."""

    def beat(self, page: str, fence: int, number: int, holding: bool, order: int, sent_s: float | None) -> None:
        """A beat has come."""

    def page_gone(self, page: str) -> None:
        """The socket of a page that has beaten is closed."""


class Client:
    """One page: a feed for each context that it asked for. For one thread.

    ``desk`` says where its beats go now; None: nothing is connected that could move. ``commands`` does its STOP.
    """

    def __init__(
        self,
        live: Shown,
        contexts: Contexts,
        desk: Callable[[], DeadManDesk | None] = lambda: None,
        commands: Commands = lambda _wanted: None,
    ) -> None:
        self._contexts = contexts
        self._desk = desk
        self._commands = commands
        self._commanding: set[asyncio.Task[None]] = set()
        self._told: list[UrgentTold] = []
        self._page: str | None = None
        self._live = Feed(live)
        self._others: dict[str, tuple[Feed, Callable[[], None], Shown]] = {}
        self._gone: list[str] = []

    def close(self) -> None:
        """Forget the page. What it held it holds no more."""
        desk = self._desk()
        if self._page is not None and desk is not None:
            desk.page_gone(self._page)
        self._live.close()
        for ctx in list(self._others):
            self._end(ctx)

    def take(self, request: Subscribe | Beat | Urgent) -> None:
        """A STOP, a beat, or what the page wants to hear of a context from now on; nothing of a replay ends it."""
        if isinstance(request, Urgent):
            self._command(request)
            return
        if isinstance(request, Beat):
            self._page = request.page
            if (desk := self._desk()) is not None:
                sent_s = request.sent_ms / 1000
                desk.beat(request.page, request.fence, request.number, request.holding, request.order, sent_s)
            return
        feed = self._live if request.ctx == LIVE else self._other(request.ctx, bool(request.topics))
        if feed is not None:
            feed.subscribe(request.topics, None if request.trace is None else request.trace.query())

    def _command(self, request: Urgent) -> None:
        """Begin it before anything else; it goes on where the page goes away."""
        work = self._commands(request)
        if work is not None:
            task = asyncio.create_task(self._tell_end(request.number, work))
            self._commanding.add(task)
            task.add_done_callback(self._commanding.discard)
        self._told.append(UrgentTold(number=request.number, taken=work is not None, done=None))

    async def _tell_end(self, number: int, work: Commanding) -> None:
        try:
            done = await work()
        except Exception:  # a defect of ours: the page asks anew, by a request
            log.exception("a command over the socket failed")
            done = None
        self._told.append(UrgentTold(number=number, taken=done is not None, done=done))

    def hello(self) -> ServerMessage:
        """The first message."""
        return self._live.hello()

    def due(self, now_s: float) -> Iterator[ServerMessage]:
        """The messages of this moment, of all contexts."""
        while self._told:
            yield UrgentMessage(ctx=LIVE, seq=0, t_ns=0, data=self._told.pop(0))
        yield from self._live.due(now_s)
        for ctx, (feed, _, shown) in list(self._others.items()):
            if self._contexts.shown(ctx) is not shown:  # closed, or opened again since
                self._end(ctx)
                self._gone.append(ctx)
            else:
                yield from feed.due(now_s)
        while self._gone:
            yield GoneMessage(ctx=self._gone.pop(), seq=0, t_ns=0)

    def _other(self, ctx: str, wanted: bool) -> Feed | None:
        """The feed of a replay; None where it is not wanted, or not there."""
        if not wanted:
            if ctx in self._others:
                self._end(ctx)
            return None
        if ctx not in self._others:
            shown = self._contexts.shown(ctx)
            if shown is None or len(self._others) >= MAX_OTHERS:
                self._gone.append(ctx)
                return None
            self._others[ctx] = Feed(shown), self._contexts.watch(ctx), shown
        return self._others[ctx][0]

    def _end(self, ctx: str) -> None:
        feed, unwatch, _ = self._others.pop(ctx)
        feed.close()
        unwatch()


async def serve_client(
    socket: WebSocket,
    live: Shown,
    contexts: Contexts,
    now_s: Callable[[], float],
    desk: Callable[[], DeadManDesk | None] = lambda: None,
    commands: Commands = lambda _wanted: None,
) -> None:
    """Serve one page until it goes away. The guard has let it in."""
    await socket.accept()
    client = Client(live, contexts, desk, commands)
    tasks = [asyncio.create_task(_tell(socket, client, now_s)), asyncio.create_task(_listen(socket, client))]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    except WebSocketDisconnect:
        log.debug("a page went away")
    except TimeoutError:
        log.warning("a page took nothing for %s s and was dropped", SEND_TIMEOUT_S)
    finally:
        client.close()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _tell(socket: WebSocket, client: Client, now_s: Callable[[], float]) -> None:
    await _send(socket, client.hello())
    while True:
        started_s = now_s()
        for message in client.due(started_s):
            await _send(socket, message)
        await asyncio.sleep(max(0.0, TICK_S - (now_s() - started_s)))


async def _send(socket: WebSocket, message: ServerMessage) -> None:
    """Waits while the client's buffers are full: that is what holds back its feeds. Raises TimeoutError."""
    text = _adapter.dump_json(message).decode()
    async with asyncio.timeout(SEND_TIMEOUT_S):
        await socket.send_text(text)


async def _listen(socket: WebSocket, client: Client) -> None:
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(message.get("code", 1005))
        text = message.get("text")
        if text is None:
            log.warning("a page sent bytes, where only text is understood")
            await socket.close(1003, "text only")
            return
        if len(text) > MAX_REQUEST:
            await socket.close(1009)
            return
        try:
            request = _from_client.validate_json(text)
        except ValidationError as error:
            log.warning("a page sent what is no message: %s", error.errors()[0]["msg"])
            await socket.close(1008, "no such message")
            return
        client.take(request)
