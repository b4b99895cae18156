"""What keeps an axis from moving, each with its reason, to be seen before it bites."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from app.drivers.contract import TWIN_NAME, LinkState
from app.errors import HubsideError
from app.model.address import Address
from app.model.rules.rule import Severity
from app.model.station import station_slug
from app.recording.writer import RecorderState
from app.service.bus_link import BusLink
from app.service.connection import Connection
from app.service.devices import Target
from app.service.link import DEVICE_NAME
from app.service.motion.heartbeat import Heartbeat
from app.service.motion.self_tests import Testing, Tests, look_at_tests
from app.service.restore.precheck import MASTER_QUIET_NS
from app.service.rule_check import check_live
from app.service.stop import has_feather, is_axis
from app.service.views import STALE_NS, AxisLine, axis_lines

POSITION: Final = Address(0x6064)
ASK_TIMEOUT_S: Final = 0.5
FEATHER_DEG: Final = 75.0
BEYOND_DEG: Final = 105.0
"""No blade is in feather there: its position is wrong, after a lost homing say."""
"""A blade at this angle or beyond is in feather: the rotor does not take up wind by it."""


class Interlock(Enum):
    """The value is the end of its text keys ``interlock.…``."""

    CONNECTED = "connected"
    ROTOR_LOCKED = "rotor_locked"
    PEOPLE_OUT = "people_out"
    OTHERS_FEATHERED = "others_feathered"
    RULES = "rules"
    NO_RESTORE = "no_restore"
    NO_MASTER = "no_master"
    RECORDING = "recording"
    HEARTBEAT_NODE = "heartbeat_node"
    SELF_STOP = "self_stop"
    """Something stops it by itself when the connection is lost, or may it do without."""
    ZONE_CLEAR = "zone_clear"
    ORDER = "pzd_order"
    """It is proven in which order the bytes of its process data come, the controlword among them."""
    BATTERY_TEST = "battery_test"
    INPUT_TEST = "input_test"


@dataclass(frozen=True, slots=True)
class Standing:
    """How one interlock stands; ``details`` fill its text."""

    interlock: Interlock
    holds_back: bool
    details: Mapping[str, Any]

    @property
    def reason(self) -> dict[str, Any]:
        """The details of an error for which it is the reason."""
        name = self.interlock.value
        return {"interlock": name, "reason_key": f"interlock.{name}.bites", **self.details}


@dataclass(frozen=True, slots=True)
class Confirmed:
    """What a person has looked at and says. ``external_stops``: devices whose stop by hand an expert answers for."""

    rotor_locked: bool = False
    people_out: bool = False
    external_stops: frozenset[str] = frozenset()

    def takes_back(self, later: Confirmed) -> bool:
        """Whether something that was confirmed here is not any more ``later``."""
        return (
            (self.rotor_locked and not later.rotor_locked)
            or (self.people_out and not later.people_out)
            or bool(self.external_stops - later.external_stops)
        )


async def look(
    connection: Connection,
    target: Target,
    heartbeat: Heartbeat,
    confirmed: Confirmed,
    tested_here: Collection[str] = (),
) -> list[Standing]:
    """How every interlock of an axis stands now. ``tested_here``: stations whose battery is tested by this bench.

    Those of a blade are asked of an axis that turns one. Of blades that nobody has looked at lately the angle is asked,
    and the units of the axis what they test.
    """
    link = connection.buses[target.device.bus]
    blade = turns_blade(connection, target)
    tests = Tests()
    if blade:
        tests, _ = await asyncio.gather(look_at_tests(connection, target), _ask_others(connection, target))
    state = None if connection.recording is None else connection.recording.status().state
    return [
        Standing(Interlock.CONNECTED, link.status.state is not LinkState.CONNECTED, {"bus": link.name}),
        *(_of_blade(connection, target, confirmed) if blade else _of_bench(confirmed)),
        _rules(connection.targets, target),
        await _restore(connection, target),
        *((_masters(link, connection.stamper()),) if heartbeat.watched else ()),
        Standing(Interlock.RECORDING, state is not RecorderState.RECORDING, {}),
        Standing(Interlock.HEARTBEAT_NODE, heartbeat.seen, {"node": heartbeat.node})
        if heartbeat.watched
        else await _without_watch(connection, target, confirmed),
        *(await _order(link, target)),
        *(_tested(tests, station_slug(target.slug) in tested_here) if blade else ()),
    ]


async def _order(link: BusLink, target: Target) -> list[Standing]:
    """Where the order of process data has to be proven before a bit of the controlword may be sent."""
    check = await link.order_check(target.node)
    if check is None:
        return []
    return [Standing(Interlock.ORDER, not check.proven, {"why_key": check.reason_key})]


def turns_blade(connection: Connection, target: Target) -> bool:
    """The axis has an emergency feather drive, or stands at a blade."""
    station = next(one for one in connection.turbine.stations if target.device in one.devices)
    return station.blade is not None or has_feather(target)


def _of_blade(connection: Connection, target: Target, confirmed: Confirmed) -> list[Standing]:
    return [
        Standing(Interlock.ROTOR_LOCKED, not confirmed.rotor_locked, {}),
        Standing(Interlock.PEOPLE_OUT, not confirmed.people_out, {}),
        _others(connection, target),
    ]


def _of_bench(confirmed: Confirmed) -> list[Standing]:
    return [Standing(Interlock.ZONE_CLEAR, not confirmed.people_out, {})]


def _tested(tests: Tests, here: bool) -> list[Standing]:
    return [
        _battery(tests.battery, here),
        Standing(Interlock.INPUT_TEST, tests.inputs is not Testing.NO, {"clamps": tests.clamps}),
    ]


async def _without_watch(connection: Connection, target: Target, confirmed: Confirmed) -> Standing:
    """By its bus it cannot stop by itself: it says now that it is a twin, or somebody answers for its stop by hand."""
    stop = target.device.external_stop
    if await _is_twin(connection, target):
        state = "twin"
    elif not stop:
        state = "none"
    else:
        state = "confirmed" if target.slug in confirmed.external_stops else "not_confirmed"
    details = {"state_key": f"interlock.external_stop.{state}", "stop": stop or "–"}
    return Standing(Interlock.SELF_STOP, state in ("none", "not_confirmed"), details)


async def _is_twin(connection: Connection, target: Target) -> bool:
    """What it answers now counts: another device may stand behind the address since it was asked last."""
    by_bus = connection.buses[target.device.bus].says_twin(target.node)
    if by_bus is not None or DEVICE_NAME not in target.description.entries:
        return by_bus is True
    try:
        name = await connection.driver(target).read(target.node, DEVICE_NAME, ASK_TIMEOUT_S)
    except HubsideError:
        return False
    return bool(name.startswith(TWIN_NAME.encode()))


def _battery(seen: Testing, here: bool) -> Standing:
    found = Testing.YES if here else seen
    return Standing(Interlock.BATTERY_TEST, found is not Testing.NO, {"state_key": found.text_key})


def others_at_work(connection: Connection, target: Target) -> bool:
    """Another master was heard on the bus of ``target`` in the last seconds."""
    return bool(_heard(connection.buses[target.device.bus], connection.stamper()))


def _heard(link: BusLink, now_ns: int) -> list[str]:
    return [one.sign.text_key for one in link.status.masters if now_ns - one.t_ns < MASTER_QUIET_NS]


def _masters(link: BusLink, now_ns: int) -> Standing:
    seen = _heard(link, now_ns)
    keys = list(dict.fromkeys(seen))
    return Standing(Interlock.NO_MASTER, bool(seen) or link.needs_consent, {"seen_keys": keys} if keys else {})


async def _ask_others(connection: Connection, target: Target) -> None:
    """A blade that does not answer stays not known: that holds back too.

    Asked are also those whose angle would grow old while the units are asked what they test.
    """
    soon_ns = connection.stamper() + STALE_NS // 2
    lines = axis_lines(connection.turbine, {one.slug: one for one in connection.targets}, soon_ns)
    stale = {line.station for line in lines if line.stale} - {station_slug(target.slug)}
    asked = [one for one in connection.targets if station_slug(one.slug) in stale and is_axis(one)]
    await asyncio.gather(
        *(connection.driver(one).read(one.node, POSITION, ASK_TIMEOUT_S) for one in asked), return_exceptions=True
    )


def _others(connection: Connection, target: Target) -> Standing:
    """All other blades are known to be in feather."""
    by_slug = {one.slug: one for one in connection.targets}
    own = station_slug(target.slug)
    lines = [
        line
        for line in axis_lines(connection.turbine, by_slug, connection.stamper())
        if line.station != own and _has_axis(connection, line)
    ]
    out = [
        line
        for line in lines
        if line.stale or line.position_deg is None or not FEATHER_DEG <= line.position_deg <= BEYOND_DEG
    ]
    blades = ", ".join(str(line.blade) for line in out) or "–"
    return Standing(Interlock.OTHERS_FEATHERED, bool(out), {"blades": blades, "angle": FEATHER_DEG, "most": BEYOND_DEG})


def _has_axis(connection: Connection, line: AxisLine) -> bool:
    return any(station_slug(one.slug) == line.station and is_axis(one) for one in connection.targets)


def _rules(targets: Iterable[Target], target: Target) -> Standing:
    judged = check_live(targets, {}, station_slug(target.slug))
    errors = sum(one.broken(Severity.ERROR) for one in judged)
    return Standing(Interlock.RULES, errors > 0, {"count": errors})


async def _restore(connection: Connection, target: Target) -> Standing:
    try:
        await target.require_no_restore(connection.driver(target))
        target.gate.claims.require_unclaimed(target.slug)
    except HubsideError:
        return Standing(Interlock.NO_RESTORE, True, {})
    return Standing(Interlock.NO_RESTORE, False, {})
