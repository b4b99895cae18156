"""A replay: one cursor, moved by anybody who looks, seen by all. It runs in a thread of its own.

The thread makes the state at the cursor: forwards by the frames that follow, elsewhere from the last keyframe before.
It reads a file and nothing else; no driver is within its reach.
"""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from threading import Condition, Thread
from typing import Final

from app.errors import HubsideError, RecordingError, ReplayEndedError
from app.service.instructor import NOT_HERE, InstructorLine
from app.service.link import LinkLine, replay_line
from app.service.motion.line import NO_MOTION, MotionLine
from app.service.replay.noted import event_line
from app.service.replay.orders import (
    Order,
    Pause,
    Play,
    Seek,
    SetLoop,
    SetSpeed,
    StepEvent,
    StepFrame,
    StepTime,
)
from app.service.replay.source import Source
from app.service.replay.stage import ReplayStage, stage_near
from app.service.replay.steps import EventSteps, frame_after, frame_before
from app.service.replay.transport import Attained, Transport
from app.service.shown import CursorLine, LoopLine, VisitLine
from app.service.stage import Stage
from app.service.views import EventLine

log = logging.getLogger(__name__)

PERIOD_S: Final = 0.005
"""How often a cursor that plays is moved."""
BREATH_S: Final = 0.001
"""So long others have the interpreter between two slices."""
SLICE_NS: Final = 15_000_000
"""So long frames are decoded before the cursor is shown again; the interpreter is for others, too."""
LATE_NS: Final = 2_000_000_000
"""Of the clock: what is later than this is not caught up. A stall of a busy machine is, or the cursor would drift."""
WARM_NS: Final = 1_100_000_000
"""A state is made from a keyframe so much before it, for what looks back a second: bus load, rates."""
ON_FOOT_NS: Final = 2_000_000_000
"""So far ahead the frames between are decoded; farther away a keyframe is nearer."""
RECENT: Final = 300
"""Events that are told to who begins to look."""


@dataclass(slots=True)
class _Asked:
    order: Order
    answer: Future[CursorLine]


class _OvertakenError(Exception):
    """A later seek came while the state of an earlier one was made."""


class Session:
    """The replay of ``source``, which it closes at its end. ``monotonic_ns`` is the clock by which it plays.

    It stands at ``at_ns`` first, in t_ns; at the beginning without.

    As the context of a page (``service.shown.Shown``) it may be read from any thread.
    """

    def __init__(self, source: Source, monotonic_ns: Callable[[], int], at_ns: int | None = None) -> None:
        self.source = source
        self.epoch = 0
        self.stage: Stage | None = None
        self._clock = monotonic_ns
        self._transport = Transport(source.from_ns, source.to_ns)
        self._attained = Attained()
        self._event_steps = EventSteps(source)
        self._first_ns = self._transport.seek(source.from_ns if at_ns is None else at_ns, monotonic_ns())
        self._shown_ns = source.from_ns
        self._seeking = True
        self._played_ns = 0
        self._now: ReplayStage | None = None
        self.opened: Future[None] = Future()
        """Done when the first state is there; has what went wrong where it never came."""
        self._asked: deque[_Asked] = deque()
        self._wake = Condition()
        self._closing = False
        self._failure: HubsideError | None = None
        self._listeners: list[Callable[[EventLine], None]] = []
        self._thread = Thread(target=self._run, name=f"replay {source.name}", daemon=True)
        self._thread.start()

    # -- as a context ---------------------------------------------------------------

    @property
    def ctx(self) -> str:
        """``replay/`` and the name of the recording."""
        return f"replay/{self.source.name}"

    def now_ns(self) -> int:
        """Time of the cursor."""
        return self._shown_ns

    def link(self) -> LinkLine:
        """Bus and load as they were."""
        return replay_line({} if self._now is None else self._now.buses, self._shown_ns)

    def visit(self) -> VisitLine | None:
        """None: nobody is at work in a recording."""
        return None

    def instructor(self) -> InstructorLine:
        """None: what acts in a recording cannot be changed."""
        return NOT_HERE

    def motion(self) -> MotionLine:
        """None: nothing is moved in a recording."""
        return NO_MOTION

    def noted(self) -> list[EventLine]:
        """What the recorder had noted until the cursor."""
        return [event_line(event) for event in self.source.events if event.t_ns <= self._shown_ns][-RECENT:]

    def listen(self, hear: Callable[[EventLine], None]) -> Callable[[], None]:
        """Call ``hear`` with what was noted, as the cursor passes it."""
        self._listeners.append(hear)
        return lambda: self._listeners.remove(hear)

    def cursor(self) -> CursorLine:
        """Where it stands."""
        transport = self._transport
        loop, attained = transport.loop, self._attained.speed
        return CursorLine(
            t_ns=self._shown_ns,
            playing=transport.playing,
            speed=transport.speed,
            attained=round(attained, 3) if transport.playing and attained is not None else None,
            from_ns=transport.from_ns,
            to_ns=transport.to_ns,
            loop=None if loop is None else LoopLine(loop.from_ns, loop.to_ns),
            seeking=self._seeking,
        )

    # -- orders ---------------------------------------------------------------------

    def order(self, order: Order) -> Future[CursorLine]:
        """Have an order carried out; the answer is where the cursor stands then.

        Of seeks that wait only the latest is carried out: who drags the cursor wants to see where it is now.
        """
        asked = _Asked(order, Future())
        with self._wake:
            if self._closing:
                asked.answer.set_exception(self._failure or ReplayEndedError(recording=self.source.name))
            else:
                self._asked.append(asked)
                self._wake.notify()
        return asked.answer

    @property
    def failure(self) -> HubsideError | None:
        """Why the replay has ended of itself."""
        return self._failure

    def close(self, timeout_s: float = 5.0) -> None:
        """End the thread and close the file. May be called twice."""
        with self._wake:
            self._closing = True
            self._wake.notify()
        self._thread.join(timeout_s)

    # -- its thread -----------------------------------------------------------------

    def _run(self) -> None:
        failure: HubsideError | None = None
        try:
            with suppress(_OvertakenError):  # somebody wants to be elsewhere already
                self._move(self._first_ns)
            self.opened.set_result(None)
            while self._wait():
                self._carry_out_all()
                if self._transport.playing:
                    self._play()
        except HubsideError as error:
            failure = error
        except Exception as error:
            log.exception("the replay of %s has ended by a defect of its own", self.source.name)
            failure = RecordingError(file=self.source.path.name, offset=0, reason=repr(error))
        finally:
            self._end(failure)

    def _end(self, failure: HubsideError | None) -> None:
        with self._wake:
            self._failure, self._closing = failure, True
            asked = list(self._asked)
            self._asked.clear()
        ended = failure or ReplayEndedError(recording=self.source.name)
        if not self.opened.done():
            self.opened.set_exception(ended)
        for one in asked:
            if one.answer.set_running_or_notify_cancel():
                one.answer.set_exception(ended)
        self.source.close()

    def _wait(self) -> bool:
        """Until there is something to do; False at the end."""
        with self._wake:
            if not self._asked and not self._closing:
                self._wake.wait(PERIOD_S if self._transport.playing else None)
            return not self._closing

    def _take_order(self) -> tuple[Order, list[Future[CursorLine]]] | None:
        with self._wake:
            if not self._asked:
                return None
            first = self._asked.popleft()
            order, answers = first.order, [first.answer]
            while isinstance(order, Seek) and self._asked and isinstance(self._asked[0].order, Seek):
                later = self._asked.popleft()
                order = later.order
                answers.append(later.answer)
            return order, answers

    def _carry_out_all(self) -> None:
        """What is refused or cannot be read is told to who asked; the cursor stays where it was."""
        passed_over: list[Future[CursorLine]] = []
        while (taken := self._take_order()) is not None:
            order, asked = taken
            answers = [*passed_over, *(one for one in asked if one.set_running_or_notify_cancel())]
            passed_over = []
            try:
                self._carry_out(order)
            except _OvertakenError:
                passed_over = answers
            except HubsideError as error:
                self._transport.seek(self._shown_ns, self._clock())
                self._refuse(answers, error)
            except BaseException as error:
                self._refuse(answers, error)
                raise
            else:
                for answer in answers:
                    answer.set_result(self.cursor())
        self._refuse(passed_over, ReplayEndedError(recording=self.source.name))

    def _refuse(self, answers: Iterable[Future[CursorLine]], error: BaseException) -> None:
        self._seeking = False
        for answer in answers:
            answer.set_exception(error)

    def _carry_out(self, order: Order) -> None:
        """Raises UsageError where it makes no sense."""
        transport, now_ns = self._transport, self._clock()
        self._hold(now_ns)
        match order:
            case Play(speed):
                if speed is not None:
                    transport.set_speed(speed, now_ns)
                self._attained.restart()
                transport.play(now_ns)
                self._go_to(transport.t_ns(now_ns))
            case Pause():
                transport.pause(now_ns)
                self._go_to(transport.t_ns(now_ns))
            case SetSpeed(speed):
                transport.set_speed(speed, now_ns)
                self._attained.restart()
            case SetLoop(loop):
                transport.set_loop(loop, now_ns)
            case Seek(t_ns):
                self._go_to(t_ns)
            case StepTime() | StepFrame() | StepEvent():
                transport.pause(now_ns)
                self._go_to(transport.t_ns(now_ns))
                self._go_to(self._stepped(order, self._shown_ns))

    def _hold(self, now_ns: int) -> None:
        """Go on from what is shown: what a busy machine has not come to yet is not jumped over."""
        if self._transport.playing and self._now is not None:
            self._transport.seek(self._shown_ns, now_ns)

    def _stepped(self, step: StepTime | StepFrame | StepEvent, t_ns: int) -> int:
        """Where a step leads; where it stands, if there is nothing in that direction."""
        if isinstance(step, StepTime):
            return t_ns + step.dt_ns
        if isinstance(step, StepEvent):
            found = self._event_steps.beside(t_ns, step.forward)
        else:
            found = frame_after(self.source, t_ns) if step.forward else frame_before(self.source, t_ns)
        return t_ns if found is None else found

    def _go_to(self, t_ns: int) -> None:
        """Set the cursor, and have the state there."""
        to_ns = self._transport.seek(t_ns, self._clock())
        if to_ns != self._shown_ns or self._now is None:
            self._move(to_ns)
            if self._transport.playing:  # the time that it took to get there was not played
                self._transport.seek(to_ns, self._clock())

    def _move(self, t_ns: int) -> None:
        """Make the state at ``t_ns``: on foot where it is near, else from a keyframe."""
        now = self._now
        if now is not None and now.t_ns <= t_ns <= now.t_ns + ON_FOOT_NS:
            self._advance(now, t_ns)
            return
        self._seeking = True
        stage = stage_near(self.source, t_ns - WARM_NS, t_ns, self.now_ns)
        while stage.advance(t_ns, self._pause()) < t_ns:
            if self._overtaken():
                raise _OvertakenError
            time.sleep(BREATH_S)
        self._shown_ns = t_ns
        self._now = self.stage = stage
        self.epoch += 1
        self._seeking = False

    def _pause(self) -> Callable[[], bool]:
        """True after a slice: on the way to a far place others want to have the interpreter as well."""
        until_ns = self._clock() + SLICE_NS
        return lambda: self._clock() >= until_ns

    def _overtaken(self) -> bool:
        """Somebody wants to be elsewhere by now, or nobody anywhere."""
        with self._wake:
            return self._closing or any(isinstance(one.order, Seek) for one in self._asked)

    def _advance(self, stage: ReplayStage, t_ns: int, until_ns: int | None = None) -> None:
        """On foot, and not beyond the time ``until_ns`` of the clock; tells what was noted on the way."""
        before_ns = self._shown_ns
        reached_ns = stage.advance(t_ns, lambda: until_ns is not None and self._clock() >= until_ns)
        self._shown_ns = reached_ns
        for event in self.source.events_from(before_ns + 1):
            if event.t_ns > reached_ns:
                break
            for hear in tuple(self._listeners):
                hear(event_line(event))

    def _play(self) -> None:
        transport, now_ns = self._transport, self._clock()
        wanted_ns, before_ns = transport.t_ns(now_ns), self._shown_ns
        if self._now is not None:
            self._advance(self._now, wanted_ns, now_ns + SLICE_NS)
        if wanted_ns - self._shown_ns > LATE_NS * transport.speed:
            self._hold(self._clock())  # too much to decode at this speed: as fast as it goes
        self._played_ns += self._shown_ns - before_ns
        self._attained.take(now_ns, self._played_ns)
        if self._shown_ns >= transport.end_ns:
            begin_ns = transport.wrapped(now_ns)
            if begin_ns is not None:
                self._go_to(begin_ns)
