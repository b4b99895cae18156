"""The scope itself. Pure: values, events and the time are passed in; what it has caught comes out.

All values since it was armed lie in one memory per signal, in the order in which they came. A trigger only marks a
stretch of time; what lies in it is taken out once its end has passed. So nothing can be lost or doubled between what
came before a trigger and after it, and the stretches of two captures may share values.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.service.scope.samples import Samples, Stretch
from app.service.scope.trigger import Happened, Node, Trigger, What, bit_of, forget_states, state_changed
from app.wire.nmt import NmtState

SETTLE_NS: Final = 150_000_000
"""A stretch is taken out so long after its end: what came in time from another bus may be handed over later."""
MAX_SAMPLES: Final = 1_000_000
"""Of all signals together: 16 octets each."""
MAX_MARKS: Final = 2000
_PRUNE_EVERY: Final = 4096
_SHARE: Final = 8
"""While nothing was caught yet, a full memory lets go of this part of what is oldest."""


class Mode(Enum):
    """What follows a capture."""

    SINGLE = "single"
    """Nothing."""
    NORMAL = "normal"
    """The next one."""
    AUTO = "auto"
    """The next one, and where no trigger comes for a while, one without."""


class Phase(Enum):
    """What the scope does."""

    WAITING = "waiting"
    CAPTURING = "capturing"
    DONE = "done"


class Cause(Enum):
    """Why a capture began."""

    TRIGGER = "trigger"
    MANUAL = "manual"
    AUTO = "auto"


class Ended(Enum):
    """How a capture ended."""

    COMPLETE = "complete"
    STOPPED = "stopped"
    MEMORY = "memory"
    LINK = "link"
    """The connection ended."""


@dataclass(frozen=True, slots=True)
class Timing:
    """A capture spans ``total_ns``, of which ``pre_ns`` lie before the trigger.

    For ``hold_off_ns`` after its end no trigger counts. ``auto_ns``: in AUTO, how long a trigger is waited for.
    """

    total_ns: int
    pre_ns: int
    mode: Mode
    hold_off_ns: int
    auto_ns: int


@dataclass(frozen=True, slots=True)
class Channel:
    """A signal: its source's number, the bit of it, and the code of the array that holds it."""

    source: int
    bit: int | None
    code: str


@dataclass(frozen=True, slots=True)
class Mark:
    """Something to be seen in a capture. ``what``: ``emcy``, ``boot_up``, ``nmt`` or ``gap``; ``node`` 0: the bus.

    ``detail``: the code of an emergency message as 4 hexadecimal digits, or the text key of a state or of the reason of
    a gap.
    """

    t_ns: int
    what: str
    bus: str
    node: int
    detail: str


@dataclass(slots=True)
class Window:
    """A stretch that was triggered at ``trigger_ns``; both ends belong to it."""

    number: int
    cause: Cause
    trigger_ns: int
    start_ns: int
    end_ns: int
    known_ns: int
    ended: Ended = Ended.COMPLETE


@dataclass(frozen=True, slots=True)
class Caught:
    """A finished capture: what each channel brought, and what happened meanwhile.

    ``window.known_ns``: from here on everything was seen; later than its start where the pre-trigger is shorter than
    wanted.
    """

    window: Window
    stretches: tuple[Stretch, ...]
    marks: tuple[Mark, ...]


class Engine:
    """Armed from its making on. Values must come in the order of time within a source; so must ``advance``."""

    def __init__(
        self,
        channels: Sequence[Channel],
        trigger: Trigger,
        timing: Timing,
        armed_ns: int,
        buses: Sequence[str],
        shown_ns: int = 0,
        max_samples: int = MAX_SAMPLES,
    ) -> None:
        """``buses``: on which each source is, by its number.

        ``shown_ns``: so much is remembered even where the pre-trigger is shorter, for who looks on.
        """
        self.timing = timing
        self.triggered = 0
        self.late = 0
        """Values that came after the capture to which they belong was taken out: it does not have them."""
        self._taken_ns = 0
        self._on_bus: dict[str, list[int]] = {}
        for source, bus in enumerate(buses):
            self._on_bus.setdefault(bus, []).append(source)
        self._trigger = trigger
        self._memory = [Samples(one.code) for one in channels]
        self._of_source: dict[int, list[tuple[Samples, int | None]]] = {}
        for one, samples in zip(channels, self._memory, strict=True):
            self._of_source.setdefault(one.source, []).append((samples, one.bit))
        self._marks: deque[Mark] = deque(maxlen=MAX_MARKS)
        self._states: dict[Node, NmtState | None] = {}
        self._back_ns = max(timing.pre_ns, shown_ns) + SETTLE_NS
        self._max = max_samples
        self._held = self._since_prune = 0
        self._known_ns = armed_ns
        self._ready_ns = armed_ns
        """From here on a trigger counts; an automatic one comes ``auto_ns`` later."""
        self._waits = True
        self._open: list[Window] = []
        self._now_ns = armed_ns

    # -- what comes ------------------------------------------------------------------

    def value(self, source: int, t_ns: int, raw: int | float, by_pdo: bool) -> None:
        """A value crossed the wire."""
        memories = self._of_source.get(source, ())
        if t_ns <= self._taken_ns:
            self.late += 1
        for samples, bit in memories:
            samples.add(t_ns, bit_of(raw, bit), by_pdo)
        self._held += len(memories)
        if self._trigger.value(source, raw) and self._takes(t_ns):
            self._begin(t_ns, Cause.TRIGGER)
        self._since_prune += 1
        if self._since_prune >= _PRUNE_EVERY or self._held > self._max:
            self._prune(t_ns)

    def happened(self, event: Happened) -> None:
        """A device told something. A boot-up makes what it held unknown."""
        changed = state_changed(self._states, event)
        if event.what is not What.NMT or changed:
            self._marks.append(_mark(event))
        if self._trigger.happened(event) and self._takes(event.t_ns):
            self._begin(event.t_ns, Cause.TRIGGER)

    def gap(self, t_ns: int, bus: str, reason_key: str) -> None:
        """Something of ``bus`` is missing at ``t_ns``: its lines are broken there, those of other buses go on."""
        self._marks.append(Mark(t_ns, "gap", bus, 0, reason_key))
        self._trigger.forget(bus, self._on_bus.get(bus, ()))
        forget_states(self._states, bus)

    def advance(self, now_ns: int) -> list[Caught]:
        """Time has gone on, and what crossed the wire until then was told; what is complete by now."""
        self._now_ns = max(now_ns, self._now_ns)
        done = [one for one in self._open if one.end_ns + SETTLE_NS <= now_ns]
        caught = [self._take(one) for one in done]
        if self.timing.mode is Mode.AUTO and self._waits and not self._open:
            due_ns = self._ready_ns + self.timing.auto_ns
            if due_ns + SETTLE_NS <= now_ns:
                self._begin(due_ns, Cause.AUTO)
        return caught

    # -- what a person does ------------------------------------------------------------

    def trigger_now(self, now_ns: int) -> bool:
        """Begin a capture by hand; False where one is under way, or none is waited for."""
        if self.phase is not Phase.WAITING:
            return False
        self._begin(now_ns, Cause.MANUAL)
        return True

    def stop(self, now_ns: int, why: Ended = Ended.STOPPED) -> list[Caught]:
        """End it; what is under way is cut off here."""
        self._waits = False
        for one in self._open:
            if one.end_ns > now_ns:
                one.end_ns, one.ended = now_ns, why
        return [self._take(one) for one in list(self._open)]

    # -- what is seen --------------------------------------------------------------------

    @property
    def phase(self) -> Phase:
        """What it does now."""
        if any(one.end_ns >= self._now_ns for one in self._open):
            return Phase.CAPTURING
        if self._waits:
            return Phase.WAITING
        return Phase.CAPTURING if self._open else Phase.DONE

    @property
    def window(self) -> Window | None:
        """The capture under way that began last."""
        return self._open[-1] if self._open else None

    @property
    def filled(self) -> float:
        """Share of the memory that is used, 0..1."""
        return min(1.0, self._held / self._max)

    def latest(self, from_ns: int, to_ns: int) -> list[Stretch]:
        """What came last, channel by channel, as far as it is remembered."""
        return [samples.between(from_ns, to_ns) for samples in self._memory]

    def marks(self, from_ns: int, to_ns: int) -> tuple[Mark, ...]:
        """What happened in a stretch."""
        return tuple(one for one in self._marks if from_ns <= one.t_ns <= to_ns)

    # ------------------------------------------------------------------------------------

    def _takes(self, t_ns: int) -> bool:
        return self._waits and t_ns >= self._ready_ns

    def _begin(self, t_ns: int, cause: Cause) -> None:
        timing = self.timing
        start_ns = t_ns - timing.pre_ns
        window = Window(
            self.triggered, cause, t_ns, start_ns, start_ns + timing.total_ns, max(start_ns, self._known_ns)
        )
        self.triggered += 1
        self._open.append(window)
        self._ready_ns = window.end_ns + timing.hold_off_ns + 1
        self._waits = timing.mode is not Mode.SINGLE

    def _take(self, window: Window) -> Caught:
        self._open.remove(window)
        self._taken_ns = max(self._taken_ns, window.end_ns)
        span = window.start_ns, window.end_ns
        return Caught(window, tuple(one.between(*span) for one in self._memory), self.marks(*span))

    def _prune(self, now_ns: int) -> None:
        self._since_prune = 0
        starts = (one.start_ns for one in self._open)
        self._forget_before(min(starts, default=now_ns - self._back_ns))
        if self._held <= self._max:
            return
        if self._open:
            for one in self._open:
                if one.end_ns > now_ns:
                    one.end_ns, one.ended = now_ns, Ended.MEMORY
                    self._ready_ns = now_ns + self.timing.hold_off_ns + 1
            if self._held <= 2 * self._max:
                return
            for one in self._open:  # nobody takes them: what is oldest goes, and they say so
                one.known_ns = max(one.known_ns, self._cut(now_ns))
            return
        self._known_ns = self._cut(now_ns)

    def _cut(self, now_ns: int) -> int:
        """Let go of what is oldest; from when on everything is known."""
        oldest_ns = min((one.first_ns for one in self._memory if len(one)), default=now_ns)
        from_ns = oldest_ns + (now_ns - oldest_ns) // _SHARE + 1
        self._forget_before(from_ns)
        return from_ns

    def _forget_before(self, t_ns: int) -> None:
        for one in self._memory:
            self._held -= one.forget_before(t_ns)


def _mark(event: Happened) -> Mark:
    detail = ""
    if event.code is not None:
        detail = f"{event.code:04X}"
    elif event.state is not None:
        detail = event.state.text_key
    return Mark(event.t_ns, event.what.value, event.bus, event.node, detail)
