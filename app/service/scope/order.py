"""What a person asks of the scope, checked, and made into what the engine needs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Final, Literal

from app.errors import ScopeSettingsError
from app.model.datatypes import DataType
from app.service.devices import Target
from app.service.scope import trigger as triggers
from app.service.scope.engine import Channel, Mode, Timing
from app.service.scope.signals import Place, Signal, resolve, resolve_one
from app.service.scope.trigger import Node, Side, Slope, Trigger, What
from app.service.stop import is_axis
from app.service.views import STATUSWORD

TOTAL_S: Final = (0.1, 120.0)
HOLD_OFF_S: Final = (0.0, 600.0)
AUTO_S: Final = (0.1, 600.0)
_NS: Final = 1e9

KindName = Literal["manual", "edge", "level", "event", "fault"]
EventName = Literal["emcy", "boot_up", "nmt", "axis_state", "bit"]
SlopeName = Literal["rising", "falling", "either"]
SideName = Literal["above", "below"]
ModeName = Literal["single", "normal", "auto"]


@dataclass(frozen=True, slots=True)
class TriggerOrder:
    """What is waited for; what a kind does not need is None.

    ``signal`` with ``level`` in its unit: edge and level; a bit as ``signal``: event ``bit``. ``device`` None: any.
    ``code``: of an emergency message; None any but 0.
    """

    kind: KindName
    signal: str | None
    level: float | None
    slope: SlopeName | None
    side: SideName | None
    event: EventName | None
    device: str | None
    code: int | None


@dataclass(frozen=True, slots=True)
class ScopeOrder:
    """The setting of a scope, as a person made it. Times in s; ``pre_s`` of ``total_s`` lie before the trigger."""

    signals: tuple[str, ...]
    trigger: TriggerOrder
    total_s: float
    pre_s: float
    mode: ModeName
    hold_off_s: float
    auto_s: float


@dataclass(frozen=True, slots=True)
class Plan:
    """What the engine and the tap need. ``sources``: objects by number, with the type of each."""

    signals: tuple[Signal, ...]
    channels: tuple[Channel, ...]
    sources: dict[Place, int]
    types: tuple[DataType, ...]
    trigger: Trigger
    timing: Timing


def plan(order: ScopeOrder, find: Callable[[str], Target], targets: Iterable[Target]) -> Plan:
    """Check ``order`` and make it ready. ``find`` as in ``resolve``. Raises ScopeSettingsError."""
    signals = resolve(order.signals, find)
    timing = _timing(order)
    sources = _Sources()
    channels = tuple(Channel(sources.number(one.place, one.type), one.bit, one.code) for one in signals)
    trigger = _trigger(order.trigger, find, list(targets), sources)
    return Plan(signals, channels, sources.numbers, tuple(sources.types), trigger, timing)


class _Sources:
    def __init__(self) -> None:
        self.numbers: dict[Place, int] = {}
        self.types: list[DataType] = []

    def number(self, place: Place, data_type: DataType) -> int:
        """The number of an object, a new one where it has none."""
        if place not in self.numbers:
            self.numbers[place] = len(self.types)
            self.types.append(data_type)
        return self.numbers[place]

    def of(self, signal: Signal) -> int:
        """The number of a signal's object."""
        return self.number(signal.place, signal.type)


def _timing(order: ScopeOrder) -> Timing:
    total_s = _within("total_s", order.total_s, TOTAL_S)
    pre_s = _within("pre_s", order.pre_s, (0.0, total_s))
    hold_off_s = _within("hold_off_s", order.hold_off_s, HOLD_OFF_S)
    auto_s = _within("auto_s", order.auto_s, AUTO_S)
    return Timing(
        total_ns=round(total_s * _NS),
        pre_ns=round(pre_s * _NS),
        mode=Mode(order.mode),
        hold_off_ns=round(hold_off_s * _NS),
        auto_ns=round(auto_s * _NS),
    )


def _within(field: str, number: float, limits: tuple[float, float]) -> float:
    if not math.isfinite(number) or not limits[0] <= number <= limits[1]:
        raise ScopeSettingsError(
            field=field, reason_key="scope.flaw.range", minimum=f"{limits[0]:g}", maximum=f"{limits[1]:g}"
        )
    return number


def _trigger(
    order: TriggerOrder, find: Callable[[str], Target], targets: Sequence[Target], sources: _Sources
) -> Trigger:
    if order.kind == "manual":
        return triggers.Manual()
    if order.kind == "edge":
        signal = _signal(order, find)
        slope = Slope(order.slope or "rising")
        return triggers.Edge(sources.of(signal), signal.bit, _level(order, signal), slope)
    if order.kind == "level":
        signal = _signal(order, find)
        side = Side(order.side or "above")
        return triggers.Level(sources.of(signal), signal.bit, _level(order, signal), side)
    concerned = _concerned(order, find, targets)
    nodes = None if order.device is None else frozenset(_node(one) for one in concerned)
    if order.kind == "fault":
        return triggers.Fault(_statuswords(concerned, sources), nodes, order.code)
    return _event(order, find, concerned, nodes, sources)


def _event(
    order: TriggerOrder,
    find: Callable[[str], Target],
    concerned: Sequence[Target],
    nodes: frozenset[Node] | None,
    sources: _Sources,
) -> Trigger:
    if order.event is None:
        raise ScopeSettingsError(field="event", reason_key="scope.flaw.event")
    if order.event == "bit":
        signal = _signal(order, find)
        if signal.bit is None:
            raise ScopeSettingsError(field="signal", reason_key="scope.flaw.bit")
        return triggers.Change(sources.of(signal), signal.bit)
    if order.event == "axis_state":
        found = _statuswords(concerned, sources)
        if not found:
            raise ScopeSettingsError(field="device", reason_key="scope.flaw.axis")
        return triggers.StateChange(found)
    return triggers.Event(What(order.event), nodes)


def _signal(order: TriggerOrder, find: Callable[[str], Target]) -> Signal:
    if order.signal is None:
        raise ScopeSettingsError(field="signal", reason_key="scope.flaw.signal")
    return resolve_one(order.signal, find)


def _level(order: TriggerOrder, signal: Signal) -> float:
    """The level in raw steps; a bit is crossed between 0 and 1."""
    if signal.bit is not None:
        return 0.5
    if order.level is None or not math.isfinite(order.level):
        raise ScopeSettingsError(field="level", reason_key="scope.flaw.level")
    return float(Decimal(str(order.level)) / signal.scale)


def _concerned(order: TriggerOrder, find: Callable[[str], Target], targets: Sequence[Target]) -> list[Target]:
    if order.device is None:
        return list(targets)
    found = [one for one in targets if one.slug == order.device]
    if not found:
        raise ScopeSettingsError(field="device", reason_key="scope.flaw.device")
    return found


def _statuswords(targets: Iterable[Target], sources: _Sources) -> frozenset[int]:
    return frozenset(
        sources.number(Place(one.device.bus, one.node, STATUSWORD), one.entry(STATUSWORD).type)
        for one in targets
        if is_axis(one)
    )


def _node(target: Target) -> Node:
    return target.device.bus, target.node
