"""Which step follows from which: the rules of the devices, each with its reason.

A rule says that a sign of one kind is explained by an earlier one of another kind, at the same node, at the same
station or anywhere, within a time. Sections are those of the manual of the pitch system.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.service.analysis.places import Places, stations_of
from app.service.analysis.steps import Step
from app.wire.signs import SignKind

_K = SignKind
MS: Final = 1_000_000
SECOND: Final = 1000 * MS
REPORT_LAG_NS: Final = 60 * MS
"""A consequence may be reported so much before its cause: two messages of one moment, two cycles of 20 ms."""


class Reason(Enum):
    """Why one follows from the other."""

    SAME_EVENT = "same_event"
    """Two reports of one thing."""
    MAINS = "mains"
    HOLD_UP = "hold_up"
    BATTERY_LOAD = "battery_load"
    NO_VOLTAGE = "no_voltage"
    WINDOW_TIME = "window_time"
    FAULT_OPENS = "fault_opens"
    CHAIN = "chain"
    RESTART_OPENS = "restart_opens"
    UNIT_MISSED = "unit_missed"
    PARTNER_SILENT = "partner_silent"
    COMMAND = "command"
    EFC_RULES = "efc_rules"
    DRIVES_TO_FEATHER = "drives_to_feather"
    FAULT_PENDING = "fault_pending"
    POWER_DOWN = "power_down"
    OFF_THE_BUS = "off_the_bus"

    @property
    def text_key(self) -> str:
        """Text key of the reason."""
        return f"analysis.reason.{self.value}"


class Where(Enum):
    """How near the cause must be."""

    NODE = "node"
    STATION = "station"
    ANYWHERE = "anywhere"


Matches = Callable[[Step], bool]


@dataclass(frozen=True, slots=True)
class Rule:
    """``effect`` follows from ``cause`` not later than ``within_ns``; ``lag``: it may be told a moment earlier."""

    effect: Matches
    cause: Matches
    where: Where
    within_ns: int
    reason: Reason
    lag: bool = True


def _kind(*kinds: SignKind) -> Matches:
    return lambda step: step.kind in kinds


def _code(first: int, last: int | None = None, *kinds: SignKind) -> Matches:
    """An emergency message (or other kinds) with an error code in this range."""
    wanted = kinds or (_K.EMCY,)
    return lambda step: step.kind in wanted and first <= int(step.sign.details.get("code", -1)) <= (last or first)


def _of(kind: SignKind, *subjects: str) -> Matches:
    return lambda step: step.kind is kind and step.sign.subject.startswith(subjects)


def _any(*tests: Matches) -> Matches:
    return lambda step: any(test(step) for test in tests)


def _restart(step: Step) -> bool:
    command = str(step.sign.details.get("subject", ""))
    return step.kind is _K.BOOT_UP or (step.kind is _K.NMT_COMMAND and command.startswith("reset"))


def _taken_out(step: Step) -> bool:
    return step.kind is _K.NMT_COMMAND and not _restart(step)


MAINS: Final = _kind(_K.MAINS_LOW, _K.ON_BATTERY, _K.MAINS_PHASE)
BATTERY: Final = _any(_code(0x3280, 0x3288), _kind(_K.BATTERY_FAULT))
DC_LOW: Final = _any(_code(0x3220, None, _K.EMCY, _K.ERROR_CODE), _of(_K.LIMIT, "3063>30FA:03", "6079>6510:04"))
FOLLOWING: Final = _any(_kind(_K.FOLLOWING_ERROR), _of(_K.LIMIT, "60F4"))
NO_CONTACT: Final = _code(0x8100, 0x81FF, _K.EMCY, _K.ERROR_CODE)
SAID: Final = _kind(_K.EMCY)
REPORTS: Final = _kind(
    _K.PMM_FAULT, _K.PMM_WARNING, _K.BATTERY_FAULT, _K.AXIS_FAULT, _K.AXIS_WARNING, _K.ERROR_CODE, _K.DEVICE_STATUS
)

RULES: Final[tuple[Rule, ...]] = (
    # Mains, DC link, battery (4.2.1, 4.4; tables 6 and 11)
    Rule(_kind(_K.ON_BATTERY), _kind(_K.MAINS_LOW), Where.STATION, SECOND, Reason.SAME_EVENT),
    Rule(_code(0x3110, 0x3130, _K.ERROR_CODE), MAINS, Where.STATION, SECOND, Reason.SAME_EVENT),
    Rule(_kind(_K.PMM_WARNING), MAINS, Where.NODE, SECOND, Reason.SAME_EVENT),
    Rule(_kind(_K.BOOSTER), MAINS, Where.NODE, 120 * SECOND, Reason.MAINS),
    Rule(_kind(_K.HOLD_UP_OVER), MAINS, Where.NODE, 66 * SECOND, Reason.HOLD_UP),
    Rule(_code(0x3281, 0x3288), _code(0x3280, 0x3288), Where.NODE, SECOND, Reason.SAME_EVENT, lag=False),
    Rule(_kind(_K.BATTERY_FAULT), _code(0x3280, 0x3288), Where.NODE, SECOND, Reason.SAME_EVENT),
    Rule(BATTERY, MAINS, Where.NODE, 300 * SECOND, Reason.BATTERY_LOAD),
    Rule(_of(_K.LIMIT, "3063", "6079"), _code(0x3210, 0x3220), Where.NODE, 2 * SECOND, Reason.SAME_EVENT),
    Rule(DC_LOW, BATTERY, Where.STATION, 60 * SECOND, Reason.NO_VOLTAGE),
    Rule(DC_LOW, MAINS, Where.STATION, 300 * SECOND, Reason.MAINS),
    # The axis (5.7, 5.8; tables 48 and 49)
    Rule(_code(0x8611), FOLLOWING, Where.NODE, 5 * SECOND, Reason.WINDOW_TIME),
    Rule(_code(0x8620), _of(_K.LIMIT, "68F4"), Where.NODE, 60 * SECOND, Reason.WINDOW_TIME),
    Rule(FOLLOWING, _code(0x8611), Where.NODE, 5 * SECOND, Reason.SAME_EVENT, lag=False),
    Rule(FOLLOWING, FOLLOWING, Where.NODE, 5 * SECOND, Reason.SAME_EVENT, lag=False),
    Rule(FOLLOWING, DC_LOW, Where.STATION, 30 * SECOND, Reason.NO_VOLTAGE),
    Rule(_code(0x4210, 0x4310), _of(_K.LIMIT, "6510:03", "6410:09"), Where.NODE, 40 * SECOND, Reason.WINDOW_TIME),
    Rule(REPORTS, SAID, Where.NODE, 3 * SECOND, Reason.SAME_EVENT),
    Rule(_kind(_K.PMM_FAULT), BATTERY, Where.NODE, SECOND, Reason.SAME_EVENT),
    Rule(_kind(_K.AXIS_FAULT), SAID, Where.NODE, 300 * SECOND, Reason.FAULT_PENDING),
    Rule(_kind(_K.WATCHDOG_OPEN), _any(SAID, _kind(_K.AXIS_FAULT)), Where.NODE, 3 * SECOND, Reason.FAULT_OPENS),
    Rule(_kind(_K.WATCHDOG_OPEN), _kind(_K.SILENT), Where.NODE, SECOND, Reason.OFF_THE_BUS),
    # Units that are missed (4.1.1, 5.6)
    Rule(_code(0x3221), _kind(_K.SILENT), Where.STATION, 10 * SECOND, Reason.PARTNER_SILENT),
    Rule(NO_CONTACT, _kind(_K.SILENT), Where.NODE, 3600 * SECOND, Reason.OFF_THE_BUS),
    Rule(_kind(_K.AXIS_WARNING), _kind(_K.SILENT), Where.NODE, 3600 * SECOND, Reason.OFF_THE_BUS),
    Rule(_kind(_K.SILENT, _K.BOOT_UP), _restart, Where.NODE, 5 * SECOND, Reason.COMMAND),
    Rule(_kind(_K.BOOT_UP), _kind(_K.SILENT), Where.NODE, 3600 * SECOND, Reason.OFF_THE_BUS),
    Rule(_kind(_K.NOT_OPERATIONAL), _any(_taken_out, _restart), Where.NODE, 5 * SECOND, Reason.COMMAND),
    Rule(_kind(_K.SILENT), MAINS, Where.STATION, 600 * SECOND, Reason.POWER_DOWN),
    # The safety chain (4.2.1.2, 4.7.1.3, 5.8.2; 60FEh/3 and 30FEh/3 bit 16)
    Rule(_kind(_K.RELAY_OPEN), _any(SAID, _kind(_K.PMM_FAULT)), Where.NODE, SECOND, Reason.FAULT_OPENS),
    Rule(_kind(_K.RELAY_OPEN), _restart, Where.NODE, 2 * SECOND, Reason.RESTART_OPENS),
    Rule(_kind(_K.RELAY_OPEN), MAINS, Where.NODE, 66 * SECOND, Reason.HOLD_UP),
    Rule(_kind(_K.CHAIN_OPEN), _kind(_K.RELAY_OPEN), Where.ANYWHERE, 200 * MS, Reason.FAULT_OPENS),
    Rule(
        _kind(_K.CHAIN_OPEN), _any(SAID, _kind(_K.AXIS_FAULT, _K.PMM_FAULT)), Where.ANYWHERE, 300 * MS,
        Reason.FAULT_OPENS,
    ),
    Rule(_kind(_K.CHAIN_OPEN), _restart, Where.ANYWHERE, 2 * SECOND, Reason.RESTART_OPENS),
    Rule(
        _kind(_K.CHAIN_OPEN), _any(_taken_out, _kind(_K.SILENT, _K.NOT_OPERATIONAL)), Where.ANYWHERE, 5 * SECOND,
        Reason.UNIT_MISSED,
    ),
    # The feather command (5.15)
    Rule(_kind(_K.EFC_INPUT), _kind(_K.CHAIN_OPEN), Where.ANYWHERE, 300 * MS, Reason.CHAIN),
    Rule(
        _kind(_K.EFC_INPUT), _any(SAID, _kind(_K.RELAY_OPEN, _K.AXIS_FAULT)), Where.ANYWHERE, 500 * MS,
        Reason.FAULT_OPENS,
    ),
    Rule(_kind(_K.EFC_INPUT), _restart, Where.ANYWHERE, 2 * SECOND, Reason.RESTART_OPENS),
    Rule(
        _kind(_K.EFC_INPUT), _any(_taken_out, _kind(_K.SILENT, _K.NOT_OPERATIONAL)), Where.ANYWHERE, 5 * SECOND,
        Reason.UNIT_MISSED,
    ),
    Rule(_kind(_K.REMOTE_LOST), _kind(_K.EFC_INPUT), Where.NODE, 300 * MS, Reason.EFC_RULES),
    Rule(
        _kind(_K.FEATHER_SWITCH), _kind(_K.EFC_INPUT, _K.EFC_COMMAND), Where.NODE, 600 * SECOND,
        Reason.DRIVES_TO_FEATHER,
    ),
)  # fmt: skip
"""In the order in which they are tried: the first that finds a cause is taken."""


@dataclass(frozen=True, slots=True)
class Because:
    """The step (by its place in the list) that explains another, and why."""

    cause: int
    reason: Reason


def explain(steps: Sequence[Step], places: Places) -> list[Because | None]:
    """For each step what explains it; None where nothing does. Never in a circle."""
    found: list[Because | None] = [None] * len(steps)
    for number, step in enumerate(steps):
        for rule in RULES:
            if not rule.effect(step):
                continue
            cause = _cause(steps, number, rule, places, found)
            if cause is not None:
                found[number] = Because(cause, rule.reason)
                break
    return found


def _cause(
    steps: Sequence[Step], number: int, rule: Rule, places: Places, found: Sequence[Because | None]
) -> int | None:
    """The latest step that the rule allows, else the earliest of those reported a moment later."""
    step = steps[number]

    def explains(at: int) -> bool:
        return _fits(step, steps[at], rule, places) and not _leads_to(found, at, number)

    earliest = min(one.since_ns for one in step.signs) - rule.within_ns
    for at in range(number - 1, -1, -1):
        if steps[at].t_ns < earliest:
            break
        if explains(at):
            return _first_report(at, found, explains)
    for at in range(number + 1, len(steps) if rule.lag else 0):
        if steps[at].t_ns > max(step.t_ns + REPORT_LAG_NS, step.sign.t_ns):
            break
        if explains(at):
            return at
    return None


def _first_report(at: int, found: Sequence[Because | None], explains: Callable[[int], bool]) -> int:
    """Of several reports of one thing the first that explains as well."""
    while (because := found[at]) is not None and because.reason is Reason.SAME_EVENT and explains(because.cause):
        at = because.cause
    return at


def _fits(effect: Step, cause: Step, rule: Rule, places: Places) -> bool:
    if not rule.cause(cause):
        return False
    if rule.where is Where.ANYWHERE:
        return True
    if any(node == 0 for _, node in cause.nodes) or set(effect.nodes) & set(cause.nodes):
        return True
    if rule.where is Where.NODE:
        return False
    return bool(stations_of(effect.nodes, places) & stations_of(cause.nodes, places))


def _leads_to(found: Sequence[Because | None], start: int, end: int) -> bool:
    """Whether ``start`` is already explained by ``end``."""
    at: int | None = start
    for _ in found:
        if at is None or at == end:
            break
        because = found[at]
        at = None if because is None else because.cause
    return at == end
