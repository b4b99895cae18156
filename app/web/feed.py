"""What one client of the socket is to be told of one context: a snapshot first, then what changed, coalesced.

Every client has a feed of its own for each context, which remembers how far it has told the live state. While a slow
client's buffers are full its feed just waits: the live state keeps the latest value of everything, so the next message
carries all that changed meanwhile, nobody else waits, and memory stays bounded.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any, Final

from app import __version__
from app.service.cylinder_view import CylindersLine, cylinder_lines
from app.service.devices import Target
from app.service.instructor import InstructorLine
from app.service.link import LinkLine, link_urgent
from app.service.motion.line import MotionLine
from app.service.rotor_view import NOBODY, rotor_line
from app.service.shown import LIVE, CursorLine, Shown
from app.service.stage import Stage
from app.service.trace.query import TraceQuery
from app.service.trace.tail import PERIOD_S as TRACE_S
from app.service.trace.tail import TraceTail
from app.service.views import (
    AxisLine,
    EventLine,
    axis_lines,
    event_of_wire,
    is_managed,
    is_told,
    node_lines,
    nodes_urgent,
    value_cells,
)
from app.web.models import (
    AxesMessage,
    BenchData,
    BenchMessage,
    CursorMessage,
    CylindersMessage,
    EventMessage,
    HeartbeatMessage,
    Hello,
    HelloMessage,
    InstructorMessage,
    LinkMessage,
    MotionMessage,
    NodesMessage,
    RotorMessage,
    ServerMessage,
    TraceMessage,
    ValuesData,
    ValuesMessage,
    VisitRef,
)
from app.wire.live import Changes

HEARTBEAT_S: Final = 0.25
ROTOR_S: Final = 0.5
CYLINDERS_S: Final = 0.05
AXES_S: Final = 0.02
AXES_LOOK_AGAIN_S: Final = 0.2
AXES_AT_LEAST_S: Final = 1.0
NODES_S: Final = 0.25
ANSWERS_S: Final = 0.5
LINK_S: Final = 1.0
LINK_LOOK_S: Final = 0.1
CURSOR_S: Final = 0.02
MOTION_S: Final = 0.05
RECENT_EVENTS: Final = 300
_VALUES: Final = "values:"


class Feed:
    """What one client is to be told of ``shown``. ``due`` gives the messages of this moment; for one thread."""

    def __init__(self, shown: Shown) -> None:
        self._shown = shown
        self._epoch = -1
        self._stage: Stage | None = None
        self._targets: Mapping[str, Target] = {}
        self._all_managed = True
        self._slugs: Mapping[tuple[str, int], str] = {}
        self._topics: frozenset[str] = frozenset()
        self._devices: frozenset[str] = frozenset()
        self._fresh: set[str] = set()
        self._wanted: tuple[frozenset[str], TraceQuery] | None = None
        self._cursor = 0
        self._since = 0
        self._seq = 0
        self._journal: deque[EventLine] = deque(maxlen=RECENT_EVENTS)
        self._stop_listening = shown.listen(self._journal.append)
        self._link: LinkLine | None = None
        self._axes: tuple[AxisLine, ...] = ()
        self._axes_cursor = -1
        self._rotor = NOBODY
        self._cylinders: tuple[CylindersLine, ...] = ()
        self._instructor: InstructorLine | None = None
        self._motion: MotionLine | None = None
        self._cursor_line: CursorLine | None = None
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
        now_ns = self._shown.now_ns()
        return HelloMessage(
            ctx=self._shown.ctx, seq=self._count(), t_ns=now_ns, data=Hello(version=__version__, server_t_ns=now_ns)
        )

    def due(self, now_s: float) -> Iterator[ServerMessage]:
        """The messages of this moment. ``now_s`` is a monotonic time in s."""
        self._take_wanted()
        if self._shown.epoch != self._epoch:
            yield self._turn()
        changes = self._changes()
        if "link" in self._topics:
            yield from self._link_due(now_s)
        if changes is not None:
            yield from self._values_due(changes)
            self._nodes_changed = self._nodes_changed or bool(changes.nodes) or changes.full
        if "cursor" in self._topics:
            yield from self._cursor_due(now_s)
        if "nodes" in self._topics:
            yield from self._nodes_due(now_s)
        if "axes" in self._topics:
            yield from self._axes_due(now_s)
        if "rotor" in self._topics:
            yield from self._rotor_due(now_s)
        if "cylinders" in self._topics:
            yield from self._cylinders_due(now_s)
        if "instructor" in self._topics:
            yield from self._instructor_due()
        if "motion" in self._topics:
            yield from self._motion_due(now_s)
        yield from self._events_due(changes)
        if "trace" in self._topics:
            yield from self._trace_due(now_s)
        self._fresh.clear()
        if self._shown.ctx == LIVE and self._passed("heartbeat", now_s, HEARTBEAT_S):
            yield HeartbeatMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=self._shown.now_ns())

    def _turn(self) -> BenchMessage:
        """Another connection was made, or the one that was there ended."""
        self._epoch, self._stage = self._shown.epoch, self._shown.stage
        targets = () if self._stage is None else self._stage.targets
        self._targets = {target.slug: target for target in targets}
        self._all_managed = all(is_managed(target) for target in targets)
        self._slugs = {(target.device.bus, target.node): slug for slug, target in self._targets.items()}
        self._cursor = self._since = 0
        self._link, self._axes, self._nodes_urgent = None, (), ()
        self._trace = None
        # Of a recording past events are told anew: what comes after the cursor has not happened yet.
        self._start_over(frozenset({"events"} if self._told_events and self._shown.ctx == LIVE else ()))
        turbine = None if self._stage is None else self._stage.turbine.slug
        visit = self._shown.visit()
        ref = None if visit is None else VisitRef(id=visit.id, person=visit.person, started_ns=visit.started_ns)
        data = BenchData(epoch=self._epoch, turbine=turbine, visit=ref)
        return BenchMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=self._shown.now_ns(), data=data)

    def _changes(self) -> Changes | None:
        if self._stage is None:
            return None
        live = self._stage.live
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
                yield ValuesMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=changes.t_ns, data=data)

    def _cursor_due(self, now_s: float) -> Iterator[ServerMessage]:
        line = self._shown.cursor()
        if line is None or (line == self._cursor_line and "cursor" not in self._fresh):
            return
        if self._passed("cursor", now_s, CURSOR_S):
            self._cursor_line = line
            yield CursorMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=line.t_ns, data=line)

    def _nodes_due(self, now_s: float) -> Iterator[ServerMessage]:
        # What a bus without heartbeats has instead comes with every answer, and is told now and then only.
        answers = not self._all_managed and self._passed("answers", now_s, ANSWERS_S)
        if not (self._nodes_changed or answers or "nodes" in self._fresh):
            return
        lines = () if self._stage is None else node_lines(self._targets.values(), self._stage.live)
        urgent = nodes_urgent(lines)
        if urgent != self._nodes_urgent or self._passed("nodes", now_s, NODES_S):
            self._nodes_urgent, self._nodes_changed = urgent, False
            yield NodesMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=self._shown.now_ns(), data=lines)

    def _axes_due(self, now_s: float) -> Iterator[ServerMessage]:
        changed = self._cursor != self._axes_cursor or "axes" in self._fresh
        # Where nothing changed nothing is computed anew, but for looking now and then: values also grow old.
        what, period_s = ("axes", AXES_S) if changed else ("old axes", AXES_LOOK_AGAIN_S)
        if not self._passed(what, now_s, period_s):
            return
        self._axes_cursor = self._cursor
        now_ns = self._shown.now_ns()
        turbine = None if self._stage is None else self._stage.turbine
        lines = () if turbine is None else axis_lines(turbine, self._targets, now_ns)
        if lines != self._axes or "axes" in self._fresh or self._passed("axes at least", now_s, AXES_AT_LEAST_S):
            self._axes = lines
            self._next["axes at least"] = now_s + AXES_AT_LEAST_S
            yield AxesMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=now_ns, data=lines)

    def _rotor_due(self, now_s: float) -> Iterator[ServerMessage]:
        if not self._passed("rotor", now_s, ROTOR_S):
            return
        now_ns = self._shown.now_ns()
        line = NOBODY if self._stage is None else rotor_line(self._stage.live, now_ns)
        if line != self._rotor or "rotor" in self._fresh:
            self._rotor = line
            yield RotorMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=now_ns, data=line)

    def _cylinders_due(self, now_s: float) -> Iterator[ServerMessage]:
        if not self._passed("cylinders", now_s, CYLINDERS_S):
            return
        now_ns = self._shown.now_ns()
        lines = () if self._stage is None else cylinder_lines(self._stage.turbine, self._targets, now_ns)
        if lines != self._cylinders or "cylinders" in self._fresh:
            self._cylinders = lines
            yield CylindersMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=now_ns, data=lines)

    def _instructor_due(self) -> Iterator[ServerMessage]:
        line = self._shown.instructor()
        if line is not self._instructor or "instructor" in self._fresh:
            self._instructor = line
            yield InstructorMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=self._shown.now_ns(), data=line)

    def _motion_due(self, now_s: float) -> Iterator[ServerMessage]:
        if not self._passed("motion", now_s, MOTION_S):
            return
        line = self._shown.motion()
        if line != self._motion or "motion" in self._fresh:
            self._motion = line
            yield MotionMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=self._shown.now_ns(), data=line)

    def _link_due(self, now_s: float) -> Iterator[ServerMessage]:
        if not self._passed("look at link", now_s, LINK_LOOK_S):
            return
        now_ns = self._shown.now_ns()
        line = self._shown.link()
        changed = self._link is None or link_urgent(line) != link_urgent(self._link)
        if changed or self._passed("link", now_s, LINK_S):
            self._link = line
            self._next["link"] = now_s + LINK_S
            yield LinkMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=now_ns, data=line)

    def _events_due(self, changes: Changes | None) -> Iterator[ServerMessage]:
        if "events" not in self._topics:
            self._journal.clear()
            return
        lines: list[EventLine] = []
        self._told_events = True
        if "events" in self._fresh:
            self._journal.clear()
            lines += self._shown.noted()
        while self._journal:
            lines.append(self._journal.popleft())
        if changes is not None:
            new = changes.events if "events" in self._fresh else [e for e in changes.events if e.version > self._since]
            lines += [event_of_wire(event, self._slugs) for event in new if is_told(event)]
        for line in sorted(lines, key=lambda line: line.t_ns)[-RECENT_EVENTS:]:
            yield EventMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=self._shown.now_ns(), data=line)

    def _trace_due(self, now_s: float) -> Iterator[ServerMessage]:
        if self._stage is None or not self._passed("trace", now_s, TRACE_S):
            return
        if self._trace is None:
            self._trace = TraceTail(self._stage, self._trace_query)
        yield TraceMessage(ctx=self._shown.ctx, seq=self._count(), t_ns=self._shown.now_ns(), data=self._trace.batch())

    def _passed(self, what: str, now_s: float, period_s: float) -> bool:
        """True at most once a period."""
        if now_s < self._next.get(what, now_s):
            return False
        self._next[what] = now_s + period_s
        return True

    def _count(self) -> int:
        self._seq += 1
        return self._seq
