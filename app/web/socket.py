"""The socket ``/api/ws``: what the page subscribed to, a snapshot first, then what changed, coalesced.

Every client has a feed of its own, which remembers how far it has told the live state. While a slow client's buffers
are full its feed just waits: the live state keeps the latest value of everything, so the next message carries all that
changed meanwhile, nobody else waits, and memory stays bounded.
"""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from fastapi import WebSocket, WebSocketDisconnect
from pydantic import TypeAdapter, ValidationError

from app import __version__
from app.service.bench import Bench
from app.service.connection import Connection
from app.service.devices import Target
from app.service.instructor import NOT_HERE, InstructorLine
from app.service.journal import Entry
from app.service.link import LinkLine, bench_line, link_urgent
from app.service.rotor_view import NOBODY, rotor_line
from app.service.trace.query import TraceQuery
from app.service.trace.tail import PERIOD_S as TRACE_S
from app.service.trace.tail import TraceTail
from app.service.views import (
    AxisLine,
    EventLine,
    axis_lines,
    event_of_journal,
    event_of_wire,
    is_told,
    node_lines,
    nodes_urgent,
    value_cells,
)
from app.web.models import (
    AxesMessage,
    BenchData,
    BenchMessage,
    ClientMessage,
    EventMessage,
    HeartbeatMessage,
    Hello,
    HelloMessage,
    InstructorMessage,
    LinkMessage,
    NodesMessage,
    RotorMessage,
    ServerMessage,
    TraceMessage,
    ValuesData,
    ValuesMessage,
    VisitRef,
)
from app.wire.live import Changes

log = logging.getLogger(__name__)

TICK_S: Final = 0.01
"""Window in which changes are collected: the most that a change waits here."""
HEARTBEAT_S: Final = 0.25
ROTOR_S: Final = 0.5
AXES_S: Final = 0.02
AXES_LOOK_AGAIN_S: Final = 0.2
AXES_AT_LEAST_S: Final = 1.0
NODES_S: Final = 0.25
LINK_S: Final = 1.0
LINK_LOOK_S: Final = 0.1
RECENT_EVENTS: Final = 300
SEND_TIMEOUT_S: Final = 15.0
"""A client that takes nothing for so long is dropped; it comes back by itself."""
MAX_REQUEST: Final = 65_536
_VALUES: Final = "values:"
_adapter: Final[TypeAdapter[Any]] = TypeAdapter(ServerMessage)


class Feed:
    """What one client is to be told. ``due`` gives the messages of this moment; for one thread."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._epoch = -1
        self._connection: Connection | None = None
        self._targets: Mapping[str, Target] = {}
        self._slugs: Mapping[tuple[str, int], str] = {}
        self._topics: frozenset[str] = frozenset()
        self._devices: frozenset[str] = frozenset()
        self._fresh: set[str] = set()
        self._wanted: tuple[frozenset[str], TraceQuery] | None = None
        self._cursor = 0
        self._since = 0
        self._seq = 0
        self._journal: deque[Entry] = deque(maxlen=RECENT_EVENTS)
        self._stop_listening = bench.journal.listen(self._journal.append)
        self._link: LinkLine | None = None
        self._axes: tuple[AxisLine, ...] = ()
        self._axes_cursor = -1
        self._rotor = NOBODY
        self._instructor: InstructorLine | None = None
        self._nodes_urgent: tuple[Any, ...] = ()
        self._nodes_changed = False
        self._told_events = False
        self._next: dict[str, float] = {}
        self._trace_query = TraceQuery()
        self._trace: TraceTail | None = None

    def close(self) -> None:
        """Forget the client."""
        self._stop_listening()

    def subscribe(self, topics: list[str], trace: TraceQuery | None = None) -> None:
        """Replace the topics. Each topic's snapshot comes again, past events only where they are a new topic.

        Topics that do not exist are passed over. It holds from the next ``due`` on: a client may ask for others while
        the messages of this moment are on their way to it.
        """
        self._wanted = (frozenset(topics), trace or TraceQuery())

    def _take_wanted(self) -> None:
        if self._wanted is None:
            return
        (self._topics, query), self._wanted = self._wanted, None
        if "trace" not in self._topics or query != self._trace_query:
            self._trace, self._trace_query = None, query
        self._told_events = self._told_events and "events" in self._topics
        self._start_over(frozenset({"events"} if self._told_events else ()))

    def _start_over(self, known: frozenset[str] = frozenset()) -> None:
        """Have the snapshots of all topics told again, but for those in ``known``."""
        wanted = frozenset(t.removeprefix(_VALUES) for t in self._topics if t.startswith(_VALUES))
        self._devices = wanted & set(self._targets)
        self._fresh = {*self._devices, *(self._topics - known)}
        self._next = {}

    def hello(self) -> HelloMessage:
        """The first message."""
        now_ns = self._bench.stamper()
        return HelloMessage(seq=self._count(), t_ns=now_ns, data=Hello(version=__version__, server_t_ns=now_ns))

    def due(self, now_s: float) -> Iterator[ServerMessage]:
        """The messages of this moment. ``now_s`` is a monotonic time in s."""
        self._take_wanted()
        if self._bench.epoch != self._epoch:
            yield self._turn()
        changes = self._changes()
        if "link" in self._topics:
            yield from self._link_due(now_s)
        if changes is not None:
            yield from self._values_due(changes)
            self._nodes_changed = self._nodes_changed or bool(changes.nodes) or changes.full
        if "nodes" in self._topics:
            yield from self._nodes_due(now_s)
        if "axes" in self._topics:
            yield from self._axes_due(now_s)
        if "rotor" in self._topics:
            yield from self._rotor_due(now_s)
        if "instructor" in self._topics:
            yield from self._instructor_due()
        yield from self._events_due(changes)
        if "trace" in self._topics:
            yield from self._trace_due(now_s)
        self._fresh.clear()
        if self._passed("heartbeat", now_s, HEARTBEAT_S):
            yield HeartbeatMessage(seq=self._count(), t_ns=self._bench.stamper())

    def _turn(self) -> BenchMessage:
        """Another connection was made, or the one that was there ended."""
        self._epoch, self._connection = self._bench.epoch, self._bench.connection
        targets = () if self._connection is None else self._connection.targets
        self._targets = {target.slug: target for target in targets}
        self._slugs = {(target.device.bus, target.node): slug for slug, target in self._targets.items()}
        self._cursor = self._since = 0
        self._link, self._axes, self._nodes_urgent = None, (), ()
        self._trace = None
        self._start_over(frozenset({"events"} if self._told_events else ()))
        turbine = None if self._connection is None else self._connection.turbine.slug
        visit = self._bench.office.visits.current
        ref = None if visit is None else VisitRef(id=visit.id, person=visit.person, started_ns=visit.started_ns)
        data = BenchData(epoch=self._epoch, turbine=turbine, visit=ref)
        return BenchMessage(seq=self._count(), t_ns=self._bench.stamper(), data=data)

    def _changes(self) -> Changes | None:
        if self._connection is None:
            return None
        live = self._connection.live
        if self._fresh:
            changes = live.changes_since(0)
        elif live.version == self._cursor:
            return None
        else:
            changes = live.changes_since(self._cursor)
        self._since, self._cursor = self._cursor, changes.version
        return changes

    def _values_due(self, changes: Changes) -> Iterator[ServerMessage]:
        for slug in sorted(self._devices):
            # A snapshot was fetched for the sake of one topic: the others get only what is new to them.
            full = slug in self._fresh or (changes.full and not self._fresh)
            views = changes.values if full else [v for v in changes.values if v.version > self._since]
            cells = value_cells(self._targets[slug], views)
            if cells or full:
                data = ValuesData(device=slug, full=full, values=cells)
                yield ValuesMessage(seq=self._count(), t_ns=changes.t_ns, data=data)

    def _nodes_due(self, now_s: float) -> Iterator[ServerMessage]:
        if not self._nodes_changed and "nodes" not in self._fresh:
            return
        lines = () if self._connection is None else node_lines(self._targets.values(), self._connection.live)
        urgent = nodes_urgent(lines)
        if urgent != self._nodes_urgent or self._passed("nodes", now_s, NODES_S):
            self._nodes_urgent, self._nodes_changed = urgent, False
            yield NodesMessage(seq=self._count(), t_ns=self._bench.stamper(), data=lines)

    def _axes_due(self, now_s: float) -> Iterator[ServerMessage]:
        changed = self._cursor != self._axes_cursor or "axes" in self._fresh
        # Where nothing changed nothing is computed anew, but for looking now and then: values also grow old.
        what, period_s = ("axes", AXES_S) if changed else ("old axes", AXES_LOOK_AGAIN_S)
        if not self._passed(what, now_s, period_s):
            return
        self._axes_cursor = self._cursor
        now_ns = self._bench.stamper()
        turbine = None if self._connection is None else self._connection.turbine
        lines = () if turbine is None else axis_lines(turbine, self._targets, now_ns)
        if lines != self._axes or "axes" in self._fresh or self._passed("axes at least", now_s, AXES_AT_LEAST_S):
            self._axes = lines
            self._next["axes at least"] = now_s + AXES_AT_LEAST_S
            yield AxesMessage(seq=self._count(), t_ns=now_ns, data=lines)

    def _rotor_due(self, now_s: float) -> Iterator[ServerMessage]:
        if not self._passed("rotor", now_s, ROTOR_S):
            return
        now_ns = self._bench.stamper()
        line = NOBODY if self._connection is None else rotor_line(self._connection.live, now_ns)
        if line != self._rotor or "rotor" in self._fresh:
            self._rotor = line
            yield RotorMessage(seq=self._count(), t_ns=now_ns, data=line)

    def _instructor_due(self) -> Iterator[ServerMessage]:
        desk = self._bench.instructor
        line = NOT_HERE if desk is None else desk.line
        if line is not self._instructor or "instructor" in self._fresh:
            self._instructor = line
            yield InstructorMessage(seq=self._count(), t_ns=self._bench.stamper(), data=line)

    def _link_due(self, now_s: float) -> Iterator[ServerMessage]:
        if not self._passed("look at link", now_s, LINK_LOOK_S):
            return
        now_ns = self._bench.stamper()
        line = bench_line(self._bench)
        changed = self._link is None or link_urgent(line) != link_urgent(self._link)
        if changed or self._passed("link", now_s, LINK_S):
            self._link = line
            self._next["link"] = now_s + LINK_S
            yield LinkMessage(seq=self._count(), t_ns=now_ns, data=line)

    def _events_due(self, changes: Changes | None) -> Iterator[ServerMessage]:
        if "events" not in self._topics:
            self._journal.clear()
            return
        lines: list[EventLine] = []
        self._told_events = True
        if "events" in self._fresh:
            self._journal.clear()
            lines += [event_of_journal(entry) for entry in self._bench.journal.latest()]
        while self._journal:
            lines.append(event_of_journal(self._journal.popleft()))
        if changes is not None:
            new = changes.events if "events" in self._fresh else [e for e in changes.events if e.version > self._since]
            lines += [event_of_wire(event, self._slugs) for event in new if is_told(event)]
        for line in sorted(lines, key=lambda line: line.t_ns)[-RECENT_EVENTS:]:
            yield EventMessage(seq=self._count(), t_ns=self._bench.stamper(), data=line)

    def _trace_due(self, now_s: float) -> Iterator[ServerMessage]:
        if self._connection is None or not self._passed("trace", now_s, TRACE_S):
            return
        if self._trace is None:
            self._trace = TraceTail(self._connection, self._trace_query)
        yield TraceMessage(seq=self._count(), t_ns=self._bench.stamper(), data=self._trace.batch())

    def _passed(self, what: str, now_s: float, period_s: float) -> bool:
        """True at most once a period."""
        if now_s < self._next.get(what, now_s):
            return False
        self._next[what] = now_s + period_s
        return True

    def _count(self) -> int:
        self._seq += 1
        return self._seq


async def serve_client(socket: WebSocket, bench: Bench, now_s: Callable[[], float]) -> None:
    """Serve one page until it goes away. The guard has let it in."""
    await socket.accept()
    feed = Feed(bench)
    tasks = [asyncio.create_task(_tell(socket, feed, now_s)), asyncio.create_task(_listen(socket, feed))]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    except WebSocketDisconnect:
        log.debug("a page went away")
    except TimeoutError:
        log.warning("a page took nothing for %s s and was dropped", SEND_TIMEOUT_S)
    finally:
        feed.close()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _tell(socket: WebSocket, feed: Feed, now_s: Callable[[], float]) -> None:
    await _send(socket, feed.hello())
    while True:
        started_s = now_s()
        for message in feed.due(started_s):
            await _send(socket, message)
        await asyncio.sleep(max(0.0, TICK_S - (now_s() - started_s)))


async def _send(socket: WebSocket, message: ServerMessage) -> None:
    """Waits while the client's buffers are full: that is what holds back its feed. Raises TimeoutError."""
    text = _adapter.dump_json(message).decode()
    async with asyncio.timeout(SEND_TIMEOUT_S):
        await socket.send_text(text)


async def _listen(socket: WebSocket, feed: Feed) -> None:
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
            request = ClientMessage.model_validate_json(text)
        except ValidationError as error:
            log.warning("a page sent what is no message: %s", error.errors()[0]["msg"])
            await socket.close(1008, "no such message")
            return
        feed.subscribe(request.topics, None if request.trace is None else request.trace.query())
