"""From rows of the trace to lines for the page: names of objects, values with units, keys of texts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from app.model.address import Address
from app.model.description import Description, Entry, Kind
from app.model.values import quantity_of, show
from app.service.devices import Target, decode
from app.service.trace.fdl_text import fdl_notes
from app.wire.emcy import NO_ERROR, emcy_text_key
from app.wire.events import tell_fault
from app.wire.frame import Adu, Can, Fdl, Frame
from app.wire.modbus.functions import exception_text_key
from app.wire.modbus.transactions import ARROW
from app.wire.profibus.pkw import error_text_key
from app.wire.profibus.telegrams import Signal
from app.wire.records import (
    BootUpSeen,
    EmcySeen,
    EnvironmentSeen,
    FaultSeen,
    GapSeen,
    MalformedAduSeen,
    MalformedSeen,
    NmtCommandSeen,
    OrphanSeen,
    Outcome,
    Protocol,
    RestartSeen,
    SdoSeen,
    SlaveSeen,
    Source,
    StateSeen,
    SyncSeen,
    TransactionSeen,
    ValueSeen,
)
from app.wire.sdo import abort_text_key
from app.wire.trace.fdl_told import FdlTold
from app.wire.trace.service import Service
from app.wire.trace.tracer import Step, TraceRow, direction_of

ToneName = Literal["plain", "warning", "error"]
DirectionName = Literal["rx", "tx"]
_PDO: Final = (Service.TPDO, Service.RPDO)
_CARRYING: Final = (*_PDO, Service.MODBUS_RESPONSE)
"""Services of which one frame carries many objects."""
_MAX_BYTES: Final = 64
"""Of a value that is shown as bytes."""


@dataclass(frozen=True, slots=True)
class TraceItem:
    """One object with the value that a frame brought; ``text`` is None where it names the object only.

    ``name`` is that of the object, ``sub`` that of its sub-index; None where nothing is known.
    ``key`` is the text key of an enumeration's value; ``bits`` are those of the bits that are set.
    """

    address: str
    name: str | None
    sub: str | None
    text: str | None
    unit: str
    key: str | None
    bits: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TraceNote:
    """A text key with what fills its placeholders; a detail named ``x_key`` is itself a text key."""

    key: str
    details: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class TraceLine:
    """One frame, or a gap in the traffic. ``start_t_ns``: the first request of the transfer that this frame ended.

    Of Modbus TCP ``transaction`` is set, ``peer`` is the client's end of the connection, ``number`` the function
    code and ``dlc`` the bytes of the ADU; ``can_id`` is 0. Of PROFIBUS ``fdl`` is set, and ``dlc`` is the bytes of the
    telegram.
    """

    t_ns: int
    bus: str
    direction: DirectionName
    can_id: int
    extended: bool
    remote: bool
    dlc: int
    data: str
    t_adapter_ns: int | None
    service: str
    number: int
    node: int
    device: str | None
    step: str | None
    items: tuple[TraceItem, ...]
    notes: tuple[TraceNote, ...]
    tone: ToneName
    start_t_ns: int | None
    transaction: int | None
    peer: str | None
    fdl: TraceFdl | None


@dataclass(frozen=True, slots=True)
class TraceFdl:
    """Of a PROFIBUS telegram: who speaks to whom, and the access points; None where it does not say.

    ``pkw``: its data begin with PKW, the process data follow. ``sound``: it is a whole telegram without an error.
    """

    source: int | None
    destination: int | None
    dsap: int | None
    ssap: int | None
    pkw: bool
    sound: bool


class Namer:
    """Knows the objects of the connected devices. ``targets`` of one connection."""

    def __init__(self, targets: Iterable[Target]) -> None:
        self._targets = {(target.device.bus, target.node): target for target in targets}

    def target(self, bus: str, node: int) -> Target | None:
        """The device at a place, where one is known."""
        return self._targets.get((bus, node))

    def slug(self, bus: str, node: int) -> str | None:
        """Its slug."""
        target = self._targets.get((bus, node))
        return None if target is None else target.slug

    def description(self, bus: str, node: int) -> Description | None:
        """Its description."""
        target = self._targets.get((bus, node))
        return None if target is None else target.description

    def item(self, bus: str, node: int, address: Address, data: bytes | None) -> TraceItem:
        """An object with its value. A unit that depends on other objects is that of their present values."""
        target = self._targets.get((bus, node))
        entry = None if target is None else target.description.entries.get(address)
        if target is None or entry is None:
            return TraceItem(address.short, None, None, None if data is None else plain(data), "", None, ())
        name, sub = (entry.name, None) if entry.kind is Kind.VAR else (entry.object_name, entry.name)
        raw = None if data is None else decode(entry, data)
        if raw is None or isinstance(raw, bytes):
            return TraceItem(address.short, name, sub, None if raw is None else plain(raw), "", None, ())
        unit = quantity_of(entry, target.lookup).unit
        key, bits = _named(target.description, entry, raw)
        return TraceItem(address.short, name, sub, show(entry, raw, target.lookup), unit, key, bits)


def plain(data: bytes) -> str:
    """Bytes of which nothing is known: up to 8 as they came, more of them counted."""
    if len(data) <= _MAX_BYTES:
        return data.hex(" ").upper()
    return f"{data[:_MAX_BYTES].hex(' ').upper()} … ({len(data)})"


def _named(description: Description, entry: Entry, raw: int | float | str) -> tuple[str | None, tuple[str, ...]]:
    if not isinstance(raw, int):
        return None, ()
    if entry.enumeration is not None:
        named = description.enumerations[entry.enumeration].by_value(raw)
        return (None if named is None else named.text_key), ()
    if entry.bits is None:
        return None, ()
    return None, tuple(bit.text_key for bit in description.bit_tables[entry.bits].bits if raw & bit.mask)


def line(row: TraceRow, namer: Namer) -> TraceLine:
    """A row for the page."""
    item, speaker = row.item, row.speaker
    payload = item.payload if isinstance(item, Frame) else None
    can = payload if isinstance(payload, Can) else Can(0)
    adu = payload if isinstance(payload, Adu) else None
    telegram = payload if isinstance(payload, Adu | Fdl) else None
    took_ns = row.took_ns
    return TraceLine(
        t_ns=item.t_ns,
        bus=item.bus,
        direction=direction_of(item).value,
        can_id=can.can_id,
        extended=can.extended,
        remote=can.remote,
        dlc=can.length if telegram is None else len(telegram.data),
        data=(can if telegram is None else telegram).data.hex(),
        t_adapter_ns=item.t_adapter_ns if isinstance(item, Frame) else None,
        service=speaker.service.value,
        number=speaker.number,
        node=speaker.node,
        device=namer.slug(item.bus, speaker.node),
        step=None if row.step is None else row.step.value,
        items=tuple(items_of(row, namer)),
        notes=tuple(notes_of(row, namer)),
        tone=row.tone.value,
        start_t_ns=None if took_ns is None else item.t_ns - took_ns,
        transaction=None if adu is None else int.from_bytes(adu.data[:2], "big"),
        peer=None if adu is None else _peer(adu, speaker.service),
        fdl=_fdl(row.fdl) if isinstance(payload, Fdl) else None,
    )


def _fdl(told: FdlTold | None) -> TraceFdl:
    if told is None:
        return TraceFdl(None, None, None, None, pkw=False, sound=False)
    return TraceFdl(told.source, told.destination, told.dsap, told.ssap, told.has_pkw, sound=True)


def _peer(adu: Adu, service: Service) -> str:
    """The client's end of the connection, empty where the link does not name it."""
    sender, arrow, receiver = adu.link.partition(ARROW)
    if not arrow:
        return ""
    return receiver if service is Service.MODBUS_RESPONSE else sender


def items_of(row: TraceRow, namer: Namer) -> Iterable[TraceItem]:
    """The objects that a row names."""
    bus, node = row.item.bus, row.speaker.node
    if row.address is not None:
        yield namer.item(bus, node, row.address, row.value)
    if row.fdl is not None:
        yield from (_signal(bus, node, signal, value, namer) for signal, value in row.fdl.signals)
    elif row.address is None and row.speaker.service in _CARRYING:
        values = [record for record in row.records if isinstance(record, ValueSeen) and record.node == node]
        # Of an exchange both ways what the device gave comes first: what was written is known from before.
        for record in sorted(values, key=lambda one: one.source is Source.PDO_RX):
            yield namer.item(bus, node, record.address, record.data)


def _signal(bus: str, node: int, signal: Signal, value: int, namer: Namer) -> TraceItem:
    """A signal of process data as its parameter; one that no parameter has is told by its number."""
    description = namer.description(bus, node)
    entry = None if description is None or signal.address is None else description.entries.get(signal.address)
    if entry is not None and entry.type.size is not None:
        data = value.to_bytes(entry.type.size, "little", signed=signal.signed)
        return namer.item(bus, node, entry.address, data)
    return TraceItem(f"PZD {signal.number}", signal.name, None, str(value), "", None, ())


def notes_of(row: TraceRow, namer: Namer) -> Iterable[TraceNote]:
    """What a row says beside its objects."""
    service = row.speaker.service
    if row.abort_code is not None:
        yield TraceNote("trace.note.abort", abort_details(row.abort_code))
    if row.exception is not None:
        details = {"code": row.exception, "reason_key": exception_text_key(row.exception)}
        yield TraceNote("trace.note.exception", details)
    for key, span in (("read", row.read), ("written", row.written)):
        if span is not None:
            yield TraceNote(f"trace.note.registers_{key}", {"first": span[0], "last": sum(span) - 1})
    if row.fdl is not None:
        yield from (TraceNote(note.key, note.details) for note in fdl_notes(row.fdl, service is Service.FDL_SAME))
    for record in row.records:
        note = _NOTES.get(type(record))
        if note is not None:
            yield from note(record, row, namer)
    if service in _PDO and not row.records:
        yield TraceNote("trace.note.unmapped", {})
    if service is Service.ERROR:
        yield TraceNote("trace.note.error_frame", {})


def abort_details(code: int, protocol: Protocol = Protocol.EXPEDITED) -> dict[str, Any]:
    """An abort code in hexadecimal and in words; of PKW an error code, as its manual counts them."""
    if protocol is Protocol.PKW:
        return {"code_hex": str(code), "reason_key": error_text_key(code)}
    return {"code_hex": f"{code:08X}h", "reason_key": abort_text_key(code)}


def emcy_details(seen: EmcySeen, description: Description | None) -> dict[str, Any]:
    """An emergency in the words of the device where it is described, else of the standard."""
    known = None if description is None else description.errors.get(seen.code)
    return {
        "code_hex": f"{seen.code:04X}h",
        "register_hex": f"{seen.register:02X}h",
        "data": seen.data.hex(" ").upper(),
        "reason_key": emcy_text_key(seen.code) if known is None else known.text_key,
    }


_Notes = Iterable[TraceNote]


def _emcy(seen: EmcySeen, _row: TraceRow, namer: Namer) -> _Notes:
    key = "trace.note.emcy_reset" if seen.code == NO_ERROR else "trace.note.emcy"
    yield TraceNote(key, emcy_details(seen, namer.description(seen.bus, seen.node)))


def _nmt(seen: NmtCommandSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    key = "trace.note.nmt_all" if seen.node == 0 else "trace.note.nmt"
    yield TraceNote(key, {"command_key": seen.command.text_key, "node": seen.node})


def _sync(seen: SyncSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    if seen.counter is not None:
        yield TraceNote("trace.note.sync", {"counter": seen.counter})


def _state(seen: StateSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    yield TraceNote(seen.state.text_key, {})


def _boot_up(_seen: BootUpSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    yield TraceNote("trace.note.boot_up", {})


def _environment(seen: EnvironmentSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    azimuth_deg, rotor_rpm, wind_mps, wind_deg = seen.environment
    details = {
        "azimuth": f"{azimuth_deg:.1f}",
        "rpm": f"{rotor_rpm:.2f}",
        "wind": f"{wind_mps:.1f}",
        "from": f"{wind_deg:.1f}",
    }
    yield TraceNote("trace.note.environment", details)


def _gap(seen: GapSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    yield TraceNote("trace.note.gap", {"reason_key": seen.reason})


def _malformed(seen: MalformedSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    yield TraceNote(seen.fault.text_key, {})


def _orphan(seen: OrphanSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    yield TraceNote("trace.note.orphan", {})


def _sdo(seen: SdoSeen, row: TraceRow, _namer: Namer) -> _Notes:
    if seen.outcome is Outcome.LOST:
        yield TraceNote("trace.note.lost", {"address": seen.address.short})
    elif seen.outcome is Outcome.BROKEN:
        yield TraceNote("trace.note.broken", {"address": seen.address.short})
    elif seen.outcome is Outcome.DONE and row.step is not Step.WRITE:
        yield TraceNote("trace.note.took", {"ms": f"{seen.dt_ns / 1e6:.1f}"})


def _slave(seen: SlaveSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    yield TraceNote("trace.fdl.slave", {"node": seen.node, "state_key": seen.state.text_key})


def _transaction(seen: TransactionSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    if seen.outcome is Outcome.DONE:
        yield TraceNote("trace.note.took", {"ms": f"{seen.dt_ns / 1e6:.1f}"})
    elif seen.outcome is not Outcome.ABORTED:
        yield TraceNote("trace.note.request_lost", {"function": seen.function})


def _malformed_adu(seen: MalformedAduSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    yield TraceNote("trace.note.malformed_adu", {"reason_key": seen.fault.text_key, "offset": seen.offset})


def _restart(_seen: RestartSeen, _row: TraceRow, _namer: Namer) -> _Notes:
    yield TraceNote("trace.note.restart", {})


def _fault(seen: FaultSeen, _row: TraceRow, namer: Namer) -> _Notes:
    told = tell_fault(seen, namer.description(seen.bus, seen.node))
    yield TraceNote(told.text_key, told.details)


_NOTES: Final[Mapping[type, Callable[[Any, TraceRow, Namer], _Notes]]] = {
    EmcySeen: _emcy,
    EnvironmentSeen: _environment,
    NmtCommandSeen: _nmt,
    SyncSeen: _sync,
    StateSeen: _state,
    BootUpSeen: _boot_up,
    GapSeen: _gap,
    MalformedSeen: _malformed,
    MalformedAduSeen: _malformed_adu,
    OrphanSeen: _orphan,
    RestartSeen: _restart,
    FaultSeen: _fault,
    SdoSeen: _sdo,
    SlaveSeen: _slave,
    TransactionSeen: _transaction,
}


def details_text(record_details: Mapping[str, Any], text: Callable[[str], str]) -> str:
    """All of a note's details as words, for a search."""
    return " ".join(
        text(str(detail)) if name.endswith("_key") else str(detail) for name, detail in record_details.items()
    )
