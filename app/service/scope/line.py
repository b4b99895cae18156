"""The scope as every page sees it: what it does, how fast its signals come, what it has caught."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from app.service.scope.capture import Values
from app.service.scope.desk import SHOWN_NS, Run, ScopeDesk
from app.service.scope.engine import Mark
from app.service.scope.order import ScopeOrder
from app.service.scope.samples import Stretch
from app.service.scope.series import ScopeSeries, series_of
from app.service.scope.signals import Signal

RATE_NS: Final = 2_000_000_000
"""Rates are measured over so much."""

PhaseName = Literal["idle", "waiting", "capturing", "done"]
WayName = Literal["pdo", "polled", "silent"]


@dataclass(frozen=True, slots=True)
class SignalRate:
    """How one signal comes: by PDO, every value; polled; or not at all just now. ``rate_hz`` is measured."""

    name: str
    title: str
    device: str
    bit: int | None
    bit_key: str | None
    unit: str
    scale: str
    way: WayName
    rate_hz: float


@dataclass(frozen=True, slots=True)
class ScopeLine:
    """The scope. ``available``: a turbine is connected. Times are t_ns.

    ``captures``: those of this arming, oldest first. ``reason_key``: why it ended by itself. ``filled``: share of its
    memory, 0..1. ``unreadable``: values whose length is not their type's. ``late``: values that came too late for the
    capture to which they belong.
    """

    available: bool
    phase: PhaseName
    order: ScopeOrder | None
    person: str
    armed_ns: int | None
    trigger_ns: int | None
    end_ns: int | None
    now_ns: int
    signals: tuple[SignalRate, ...]
    captures: tuple[str, ...]
    reason_key: str | None
    filled: float
    unreadable: int
    late: int


@dataclass(frozen=True, slots=True)
class ScopeView:
    """What came last, s before ``now_ns``. None where nothing is armed."""

    now_ns: int
    span_s: float
    series: list[ScopeSeries]


def scope_line(desk: ScopeDesk, connected: bool) -> ScopeLine:
    """The scope now."""
    run, now_ns = desk.run, desk.now_ns()
    if run is None:
        return ScopeLine(connected, "idle", None, "", None, None, None, now_ns, (), (), None, 0.0, 0, 0)
    window = None if run.over else run.engine.window
    phase: PhaseName = "done" if run.over else _phase(run)
    return ScopeLine(
        available=connected,
        phase=phase,
        order=run.order,
        person=run.person,
        armed_ns=run.armed_ns,
        trigger_ns=None if window is None else window.trigger_ns,
        end_ns=None if window is None else window.end_ns,
        now_ns=now_ns,
        signals=_rates(run, now_ns),
        captures=tuple(run.made),
        reason_key=run.reason_key,
        filled=round(run.engine.filled, 3),
        unreadable=run.unreadable,
        late=run.engine.late,
    )


def _phase(run: Run) -> PhaseName:
    phase: PhaseName = run.engine.phase.value
    return phase


def _rates(run: Run, now_ns: int) -> tuple[SignalRate, ...]:
    since_ns = max(run.armed_ns, now_ns - RATE_NS)
    span_s = max(1e-3, (now_ns - since_ns) / 1e9)
    rates = []
    for one, stretch in zip(run.plan.signals, run.engine.latest(since_ns, now_ns), strict=True):
        count = 0 if run.over else len(stretch.t_ns)
        way: WayName = "silent" if count == 0 else "pdo" if stretch.by_pdo else "polled"
        named = one.name, one.title, one.device, one.bit, one.bit_key, one.unit, str(one.scale)
        rates.append(SignalRate(*named, way=way, rate_hz=round(count / span_s, 1)))
    return tuple(rates)


@dataclass(frozen=True, slots=True)
class Latest:
    """What came last, as it was at ``now_ns``."""

    now_ns: int
    signals: tuple[Signal, ...]
    stretches: list[Stretch]
    marks: tuple[Mark, ...]


def latest_of(desk: ScopeDesk) -> Latest:
    """A copy of the last seconds of every signal: in the event loop, and quick."""
    run, now_ns = desk.run, desk.now_ns()
    if run is None or run.over:
        return Latest(now_ns, (), [], ())
    since_ns = now_ns - SHOWN_NS
    return Latest(now_ns, run.plan.signals, run.engine.latest(since_ns, now_ns), run.engine.marks(since_ns, now_ns))


def scope_view(latest: Latest, points: int) -> ScopeView:
    """The live view of it, in any thread."""
    now_ns, marks = latest.now_ns, latest.marks
    span_s = SHOWN_NS / 1e9
    series = []
    for signal, stretch in zip(latest.signals, latest.stretches, strict=True):
        values = Values(stretch.t_ns, stretch.raw)
        breaks = sorted((one.t_ns - now_ns) / 1e9 for one in marks if _breaks(one, signal.place.bus, signal.place.node))
        scaled = values.scaled(str(signal.scale))
        series.append(series_of(signal.name, values.t_s(now_ns), scaled, breaks, -span_s, 0.0, points))
    return ScopeView(now_ns, span_s, series)


def _breaks(mark: Mark, bus: str, node: int) -> bool:
    return (mark.what == "gap" and mark.bus == bus) or (mark.what == "boot_up" and (mark.bus, mark.node) == (bus, node))
