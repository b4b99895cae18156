"""What the page is told of the live state: nodes, axes, values, events, link. Pure: live state in, small views out.

Only what was seen on the wire is in it; what is not known is None, what is old says so.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from app.errors import ValueTypeError
from app.model.address import Address
from app.model.axis_state import AxisState
from app.model.datatypes import DataType, Raw
from app.model.description import Bus, Entry
from app.model.site import Station, Turbine
from app.model.values import to_scaled
from app.service.devices import Target, decode
from app.service.journal import Entry as JournalEntry
from app.wire.events import Event, EventKind
from app.wire.live import LiveState, NodeView, ValueView
from app.wire.nmt import NmtState
from app.wire.records import SdoAccess, Source
from app.wire.sdo import Abort

STALE_NS: Final = 1_000_000_000
"""A position older than this is no longer the present one."""
STATUSWORD: Final = Address(0x6041)
ERROR_CODE: Final = Address(0x603F)
_POSITION: Final = (Address(0x6064), Address(0x5064))
_DEMAND: Final = (Address(0x607A), Address(0x507A))
_MODE: Final = Address(0x6061)
_POSITION_MODES: Final = (1, 8)
"""Profile position and cyclic synchronous position (CiA 402, modes of operation)."""
_VELOCITY: Final = (Address(0x606C), Address(0x506C))
_FOLLOWING_ERROR: Final = (Address(0x60F4), Address(0x50F4))
_CURRENT: Final = (Address(0x6078),)
_DC_LINK: Final = (Address(0x6079), Address(0x5079), Address(0x3063))
_SOC: Final = (Address(0x3080),)
_BATTERY: Final = (Address(0x3060),)
_LARGEST_EXACT: Final = 2**53 - 1
"""Of the integers that JSON readers in browsers keep exactly."""

RawJson = int | float | str
"""A raw value as JSON: octets as hexadecimal digits, integers beyond 2^53 as decimal digits."""
NmtName = Literal["operational", "pre-operational", "stopped", "booting", "unknown"]
SourceName = Literal["sdo-read", "sdo-write", "pdo", "emcy"]
SeverityName = Literal["info", "warning", "error"]
LookName = Literal["unknown", "stale", "idle", "enabled", "warning", "fault"]

_NMT: Final[Mapping[NmtState, NmtName]] = {
    NmtState.OPERATIONAL: "operational",
    NmtState.PRE_OPERATIONAL: "pre-operational",
    NmtState.STOPPED: "stopped",
    NmtState.BOOT_UP: "booting",
}
SOURCE_NAMES: Final[Mapping[Source, SourceName]] = {
    Source.SDO_READ: "sdo-read",
    Source.SDO_WRITE: "sdo-write",
    Source.PDO_TX: "pdo",
    Source.PDO_RX: "pdo",
    Source.EMCY: "emcy",
}
ENABLED: Final = "axis_state.operation_enabled"
_STOPPED: Final = "axis_state.quick_stop_active"
_FAULT: Final = ("axis_state.fault", "axis_state.fault_reaction_active")
_COMPLAINTS: Final = ((STATUSWORD, 1 << 7, 1 << 3), (Address(0x3000), 1 << 1, 1 << 2))
"""Status objects with their bits of warning and of fault (CiA 402, statusword; OAT manual, table 11)."""


@dataclass(frozen=True, slots=True)
class NodeLine:
    """One device as network management sees it. ``silent``: its heartbeat is overdue, so its state is unknown.

    Not ``managed``: its bus has neither states nor heartbeats; then ``answered_t_ns``, the latest answer that it gave
    to anybody, tells that it is there.
    """

    device: str
    node: int
    nmt: NmtName
    silent: bool
    heartbeat_t_ns: int | None
    heartbeat_period_ms: float | None
    boots: int
    managed: bool
    answered_t_ns: int | None


@dataclass(frozen=True, slots=True)
class FaultLine:
    """What a device complains of. ``text_key`` None: its description does not know the code."""

    device: str
    code: int
    text_key: str | None
    severity: Literal["warning", "error"]


@dataclass(frozen=True, slots=True)
class AxisLine:
    """One blade. ``state`` and ``fault_text_key`` are text keys; ``fault_code`` 0 is no fault, None not known.

    ``fault_code`` is that of the worst of ``faults``. ``demand_deg`` is None while the axis does not follow a target
    position. ``current_pct`` is in per cent of the rated current.
    ``stale``: the position is not known, older than a second, or its node is silent.
    ``look`` sums up what a picture of the blade shows, the worst first: what is not the present, then complaints.
    """

    station: str
    blade: int
    position_deg: float | None
    position_t_ns: int | None
    demand_deg: float | None
    velocity_dps: float | None
    following_error_deg: float | None
    current_pct: float | None
    state: str | None
    fault_code: int | None
    fault_text_key: str | None
    faults: tuple[FaultLine, ...]
    battery_soc_pct: float | None
    battery_v: float | None
    dc_link_v: float | None
    stale: bool
    look: LookName


@dataclass(frozen=True, slots=True)
class StoredCell:
    """What stands in non-volatile memory: proven by a restart, or saved and not yet proven."""

    raw: RawJson
    state: Literal["proven", "saved"]


@dataclass(frozen=True, slots=True)
class ValueCell:
    """One object. Not ``known``: RAM was never seen, or not since the last boot-up; then raw, hex, t_ns are None.

    ``stale``: frames were lost since, or the object's mirror was written.
    """

    raw: RawJson | None
    hex: str | None
    t_ns: int | None
    source: SourceName | None
    stored: StoredCell | None
    known: bool
    stale: bool


@dataclass(frozen=True, slots=True)
class EventLine:
    """One event; ``details`` fill the placeholders of the text, those that end in ``_key`` are text keys.

    ``person`` is who did it, None where nobody here did.
    """

    t_ns: int
    severity: SeverityName
    device: str | None
    text_key: str
    details: Mapping[str, Any]
    person: str | None


# -- nodes -------------------------------------------------------------------------


def node_lines(targets: Iterable[Target], live: LiveState) -> tuple[NodeLine, ...]:
    """All devices in the order of ``targets``, also those that never said anything."""
    return tuple(_node_line(target, live.node(target.device.bus, target.node)) for target in targets)


def is_managed(target: Target) -> bool:
    """True where its bus has network management: states, heartbeats, boot-up messages."""
    return target.description.bus is Bus.CANOPEN


def _node_line(target: Target, view: NodeView | None) -> NodeLine:
    managed = is_managed(target)
    if view is None:
        return NodeLine(target.slug, target.node, "unknown", False, None, None, 0, managed, None)
    nmt: NmtName = "unknown" if view.state is None or view.silent else _NMT[view.state]
    period_ms = None if view.period_ns is None else round(view.period_ns / 1e6, 1)
    return NodeLine(
        device=target.slug,
        node=target.node,
        nmt=nmt,
        silent=view.silent,
        heartbeat_t_ns=view.heartbeat_ns,
        heartbeat_period_ms=period_ms,
        boots=view.boots,
        managed=managed,
        answered_t_ns=None if managed else view.answered_ns,
    )


def nodes_urgent(lines: Iterable[NodeLine]) -> tuple[Any, ...]:
    """The part of the lines whose change must be told at once; heartbeat times are not in it."""
    return tuple((line.device, line.nmt, line.silent, line.boots) for line in lines)


def device_state(target: Target) -> str | None:
    """Text key of the state that a device is in: of its axis where it has one, else of network management."""
    status = target.lookup(STATUSWORD)
    if isinstance(status, int):
        return axis_state(status)
    view = target.live.node(target.device.bus, target.node)
    return None if view is None or view.state is None else view.state.text_key


# -- axes --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Seen:
    number: float
    t_ns: int
    stale: bool


def axis_lines(turbine: Turbine, targets: Mapping[str, Target], now_ns: int) -> tuple[AxisLine, ...]:
    """One line a blade, in the order of the site file. ``targets`` by slug."""
    lines = []
    for station in turbine.stations:
        if station.blade is not None:
            devices = [targets[device.slug] for device in station.devices if device.slug in targets]
            lines.append(_axis_line(station, station.blade, devices, now_ns))
    return tuple(lines)


def _axis_line(station: Station, blade: int, devices: list[Target], now_ns: int) -> AxisLine:
    position = _latest(devices, _POSITION)
    state = next((axis_state(raw) for raw in _lookups(devices, STATUSWORD) if isinstance(raw, int)), None)
    faults, code = fault_lines(devices)
    stale = position is None or position.stale or now_ns - position.t_ns > STALE_NS
    return AxisLine(
        station=station.slug,
        blade=blade,
        position_deg=_number(position),
        position_t_ns=None if position is None else position.t_ns,
        demand_deg=_demand(devices, state),
        velocity_dps=_number(_latest(devices, _VELOCITY)),
        following_error_deg=_number(_latest(devices, _FOLLOWING_ERROR)),
        current_pct=_number(_latest(devices, _CURRENT)),
        state=state,
        fault_code=code,
        fault_text_key=faults[0].text_key if faults else None,
        faults=faults,
        battery_soc_pct=_number(_latest(devices, _SOC)),
        battery_v=_number(_latest(devices, _BATTERY)),
        dc_link_v=_number(_latest(devices, _DC_LINK)),
        stale=stale,
        look="unknown" if position is None else "stale" if stale else look_of(state, faults),
    )


def look_of(state: str | None, faults: Iterable[FaultLine]) -> LookName:
    """What a picture of an axis shows that is known and not old, the worst first."""
    severities = {fault.severity for fault in faults}
    if state in _FAULT or "error" in severities:
        return "fault"
    if state == _STOPPED or "warning" in severities:
        return "warning"
    return "enabled" if state == ENABLED else "idle"


def _demand(devices: list[Target], state: str | None) -> float | None:
    """The target position, while the axis follows it: an old target is no demand on an axis that is off."""
    mode = next((raw for raw in _lookups(devices, _MODE) if raw is not None), None)
    if state != ENABLED or (mode is not None and mode not in _POSITION_MODES):
        return None
    return _number(_latest(devices, _DEMAND))


def axis_state(status: int) -> str | None:
    """Text key of the state in a statusword; None for bits that no state has."""
    state = AxisState.of(status)
    return None if state is None else state.text_key


def _lookups(devices: Iterable[Target], address: Address) -> Iterable[Raw | None]:
    return (device.lookup(address) for device in devices)


def _latest(devices: Iterable[Target], addresses: Iterable[Address]) -> _Seen | None:
    """The newest reading of one quantity, whichever device and mirror object gave it."""
    found = [seen for device in devices for address in addresses if (seen := _seen(device, address)) is not None]
    return max(found, key=lambda seen: seen.t_ns, default=None)


def _seen(device: Target, address: Address) -> _Seen | None:
    entry = device.description.entries.get(address)
    if entry is None:
        return None
    view = device.live.value(device.device.bus, device.node, address)
    if view is None or view.reading is None:
        return None
    scaled = to_scaled(entry, decode(entry, view.reading.data), device.lookup)
    if scaled is None:
        return None
    number = float(scaled.number) / (1000 if scaled.unit.startswith("m") and len(scaled.unit) > 1 else 1)
    node = device.live.node(device.device.bus, device.node)
    return _Seen(round(number, 4), view.reading.t_ns, view.stale or (node is not None and node.silent))


def _number(seen: _Seen | None) -> float | None:
    return None if seen is None else seen.number


def fault_lines(devices: Iterable[Target]) -> tuple[tuple[FaultLine, ...], int | None]:
    """What the devices complain of, errors first, and the code of the worst; 0: nothing, None: not known."""
    known: int | None = None
    found = []
    for device in devices:
        code = _error_code(device)
        known = known if code is None else 0
        if code:
            error = device.description.errors.get(code)
            text_key = None if error is None else error.text_key
            found.append(FaultLine(device.slug, code, text_key, "warning" if _only_warns(device) else "error"))
    found.sort(key=lambda line: line.severity)
    return tuple(found), found[0].code if found else known


def _only_warns(device: Target) -> bool:
    """True where the device's status shows a warning and no fault; what is not known is taken for a fault."""
    for address, warning, fault in _COMPLAINTS:
        status = device.lookup(address)
        if isinstance(status, int):
            return bool(status & warning) and not status & fault
    return False


def _error_code(device: Target) -> int | None:
    bus, node = device.device.bus, device.node
    view, value = device.live.node(bus, node), device.live.value(bus, node, ERROR_CODE)
    read_ns = -1 if value is None or value.reading is None else value.reading.t_ns
    if view is not None and view.emcy_code is not None and (view.emcy_ns or 0) > read_ns:
        return view.emcy_code
    raw = device.lookup(ERROR_CODE)
    return raw if isinstance(raw, int) else None


# -- values ------------------------------------------------------------------------


def value_cells(target: Target, views: Iterable[ValueView]) -> dict[str, ValueCell]:
    """The views that belong to ``target``, by address."""
    place = (target.device.bus, target.node)
    entries = target.description.entries
    return {
        view.address.short: value_cell(entries.get(view.address), view)
        for view in views
        if (view.bus, view.node) == place
    }


def value_cell(entry: Entry | None, view: ValueView) -> ValueCell:
    """One object; without an entry its bytes are told as they are."""
    stored = None
    if view.stored is not None:
        state: Literal["proven", "saved"] = "proven" if view.stored.state.value == "proven" else "saved"
        stored = StoredCell(_raw(entry, view.stored.data), state)
    reading = view.reading
    if reading is None:
        return ValueCell(None, None, None, None, stored, False, view.stale)
    raw = _raw(entry, reading.data)
    return ValueCell(raw, reading.data.hex(), reading.t_ns, SOURCE_NAMES[reading.source], stored, True, view.stale)


def _raw(entry: Entry | None, data: bytes) -> RawJson:
    return raw_to_json(data if entry is None else decode(entry, data))


def raw_to_json(raw: Raw) -> RawJson:
    """A raw value for JSON."""
    if isinstance(raw, bytes):
        return raw.hex()
    return str(raw) if isinstance(raw, int) and abs(raw) > _LARGEST_EXACT else raw


def raw_from_json(entry: Entry, raw: RawJson) -> Raw:
    """A raw value as JSON brought it. Raises ValueTypeError where a text is none of the entry's type."""
    if not isinstance(raw, str) or entry.type in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return raw
    try:
        return int(raw) if entry.type.is_integer else bytes.fromhex(raw)
    except ValueError as error:
        reason = "no integer" if entry.type.is_integer else "no hexadecimal bytes"
        raise ValueTypeError(
            address=entry.address.short, name=entry.title, type=entry.type.name, value=raw, reason=reason
        ) from error


# -- events ------------------------------------------------------------------------


def is_told(event: Event) -> bool:
    """False for a read of what is empty (an error history without errors): a complete read has dozens of them."""
    access, code = event.details.get("access"), event.details.get("abort_code")
    return not (event.kind is EventKind.SDO_ABORTED and access == SdoAccess.READ.value and code == Abort.NO_DATA)


def event_of_wire(event: Event, slugs: Mapping[tuple[str, int], str]) -> EventLine:
    """An event that the decoder saw; ``slugs`` by bus and node.

    A late answer is no more than information: a slow machine gives many, and none of them was taken for another.
    """
    details = dict(event.details) | ({"repeats": event.repeats} if event.repeats else {})
    device = slugs.get((event.bus, event.node))
    if device is None and event.node:
        details["node"] = event.node
    severity: SeverityName = "info" if event.kind is EventKind.ORPHAN else event.severity.value
    return EventLine(event.t_ns, severity, device, event.text_key, details, None)


def event_of_journal(entry: JournalEntry) -> EventLine:
    """An event of the journal: what a person did, or what became of the link."""
    details = {
        name: detail if isinstance(detail, int | float) else str(detail) for name, detail in entry.details.items()
    }
    person = entry.person if entry.kind.has_doer else None
    return EventLine(entry.t_ns, entry.kind.severity.value, entry.device, entry.text_key, details, person)
