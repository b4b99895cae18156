"""What a page is shown: the live bench, or a recording that is replayed. Both give the same, in the same words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from app.service.bench import Bench
from app.service.instructor import NOT_HERE, InstructorLine
from app.service.link import LinkLine, bench_line
from app.service.motion.line import MotionLine, motion_line
from app.service.stage import Stage
from app.service.views import EventLine, event_of_journal

LIVE: Final = "live"


@dataclass(frozen=True, slots=True)
class VisitLine:
    """The open visit."""

    id: str
    person: str
    started_ns: int


@dataclass(frozen=True, slots=True)
class LoopLine:
    """What is played over and over, in t_ns."""

    from_ns: int
    to_ns: int


@dataclass(frozen=True, slots=True)
class CursorLine:
    """The cursor of a replay. Times in t_ns.

    ``speed`` is what was asked for, ``attained`` what the last second really made; both 1 is as it happened. None: it
    stands still, or has not played for long enough to tell.
    ``from_ns`` and ``to_ns`` bound the recording. ``seeking``: the state at the cursor is being made.
    """

    t_ns: int
    playing: bool
    speed: float
    attained: float | None
    from_ns: int
    to_ns: int
    loop: LoopLine | None
    seeking: bool


class Shown(Protocol):
    """One context of the socket and the API."""

    @property
    def ctx(self) -> str:
        """``live``, or ``replay/`` and the name of the recording."""

    @property
    def epoch(self) -> int:
        """Raised whenever what was told before is void: another connection, or another place in the recording."""

    @property
    def stage(self) -> Stage | None:
        """Devices and what is known of them; None where nothing is connected."""

    def now_ns(self) -> int:
        """The time that is shown."""

    def link(self) -> LinkLine:
        """The state of the link."""

    def visit(self) -> VisitLine | None:
        """The open visit."""

    def instructor(self) -> InstructorLine:
        """Faults in our own twins."""

    def motion(self) -> MotionLine:
        """Who may move the axes, and what is under way."""

    def noted(self) -> list[EventLine]:
        """What people did and what became of the link, the latest, oldest first."""

    def listen(self, hear: Callable[[EventLine], None]) -> Callable[[], None]:
        """Call ``hear`` with each that follows, from any thread; the answer ends it."""

    def cursor(self) -> CursorLine | None:
        """Where a replay stands; None for the live bench."""


class LiveShown:
    """The bench as it is now."""

    ctx = LIVE

    def __init__(self, bench: Bench) -> None:
        self._bench = bench

    @property
    def epoch(self) -> int:
        """Raised with every connection that is made or ended."""
        return self._bench.epoch

    @property
    def stage(self) -> Stage | None:
        """The connection while there is one."""
        return self._bench.connection

    def now_ns(self) -> int:
        """Time of the bench."""
        return self._bench.stamper()

    def link(self) -> LinkLine:
        """The state of the link now."""
        return bench_line(self._bench)

    def visit(self) -> VisitLine | None:
        """The open visit."""
        visit = self._bench.office.visits.current
        return None if visit is None else VisitLine(visit.id, visit.person, visit.started_ns)

    def instructor(self) -> InstructorLine:
        """Faults in the twins that were started with this server."""
        desk = self._bench.instructor
        return NOT_HERE if desk is None else desk.line

    def motion(self) -> MotionLine:
        """The desk from which axes are moved."""
        return motion_line(self._bench.motion)

    def noted(self) -> list[EventLine]:
        """The latest entries of the journal."""
        return [event_of_journal(entry) for entry in self._bench.journal.latest()]

    def listen(self, hear: Callable[[EventLine], None]) -> Callable[[], None]:
        """Every entry of the journal that follows."""
        return self._bench.journal.listen(lambda entry: hear(event_of_journal(entry)))

    def cursor(self) -> None:
        """The bench has none: it is now."""
        return None
