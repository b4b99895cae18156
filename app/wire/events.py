"""Events: what a person wants to be told of the traffic, typed, with a text key and details to fill it."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from enum import Enum
from typing import Any, Final, NamedTuple

from app.model.description import Description
from app.wire.emcy import NO_ERROR, emcy_text_key
from app.wire.modbus.functions import exception_text_key
from app.wire.profibus.diagnosis import Status
from app.wire.profibus.pkw import error_text_key
from app.wire.records import (
    DiagnosisSeen,
    EmcySeen,
    FaultSeen,
    Outcome,
    Protocol,
    SdoAccess,
    SdoSeen,
    SlaveSeen,
    SlaveState,
    TransactionSeen,
)
from app.wire.sdo import Abort, abort_text_key


class EventKind(Enum):
    """What happened."""

    BOOT_UP = "boot_up"
    STATE_CHANGED = "state_changed"
    NMT_COMMAND = "nmt_command"
    EMCY = "emcy"
    EMCY_RESET = "emcy_reset"
    DEVICE_FAULT = "device_fault"
    """A device that sends no emergency messages shows an error, by its statusword or its error code."""
    DEVICE_FAULT_OVER = "device_fault_over"
    SDO_ABORTED = "sdo_aborted"
    SDO_LOST = "sdo_lost"
    SDO_BROKEN = "sdo_broken"
    ORPHAN = "orphan"
    MALFORMED = "malformed"
    SAVED = "saved"
    SAVE_FAILED = "save_failed"
    LOADED = "loaded"
    LOAD_FAILED = "load_failed"
    REQUEST_REFUSED = "request_refused"
    """A Modbus request that is no access to one object was refused."""
    SLAVE_STATE = "slave_state"
    """A PROFIBUS slave came, went, or went into another state."""
    DIAGNOSIS = "diagnosis"
    """A PROFIBUS slave tells another diagnosis than before."""
    STORED_DIFFERS = "stored_differs"
    """What a device holds after a restart is not what it acknowledged to save."""
    GAP = "gap"
    HEARTBEAT_LOST = "heartbeat_lost"
    HEARTBEAT_BACK = "heartbeat_back"

    @property
    def text_key(self) -> str:
        """Text key of the event."""
        return f"event.{self.value}"


class Severity(Enum):
    """How much it matters."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class Event(NamedTuple):
    """One event; ``version`` is that of the live state when it came in or was last repeated.

    ``details`` are JSON-able and fill the placeholders of the text. One named ``x_key`` is itself a text key: its text
    fills the placeholder ``x``. ``repeats`` counts like events in a row that were folded into this one.
    """

    version: int
    t_ns: int
    bus: str
    node: int
    kind: EventKind
    severity: Severity
    text_key: str
    details: Mapping[str, Any]
    repeats: int = 0


_FOLDED: Final = (EventKind.ORPHAN, EventKind.MALFORMED, EventKind.SDO_LOST, EventKind.SDO_BROKEN)
FOLD_NS: Final = 1_000_000_000


class EventLog:
    """The last ``limit`` events. Orphans and malformed frames in a row are folded: noise cannot flush the rest."""

    def __init__(self, limit: int) -> None:
        self._events: deque[Event] = deque(maxlen=limit)

    def add(self, event: Event) -> None:
        """Append, or fold into the last one."""
        last = self._events[-1] if self._events else None
        if last is not None and event.kind in _FOLDED and _same(last, event):
            self._events[-1] = event._replace(repeats=last.repeats + 1)
        else:
            self._events.append(event)

    def since(self, version: int) -> tuple[Event, ...]:
        """Events later than ``version``, oldest first."""
        found = []
        for event in reversed(self._events):
            if event.version <= version:
                break
            found.append(event)
        return tuple(reversed(found))

    def snapshot(self, limit: int) -> list[dict[str, Any]]:
        """The last ``limit`` events, JSON-able."""
        events = list(self._events)[-limit:]
        return [
            {**e._asdict(), "kind": e.kind.value, "severity": e.severity.value, "details": dict(e.details)}
            for e in events
        ]

    def restore(self, events: list[dict[str, Any]], version: int) -> None:
        """Replace all by those of ``snapshot()``, with ``version`` as theirs."""
        self._events.clear()
        for e in events:
            kinds = {"kind": EventKind(e["kind"]), "severity": Severity(e["severity"]), "version": version}
            self._events.append(Event(**{**e, **kinds}))


def _same(last: Event, event: Event) -> bool:
    near = event.t_ns - last.t_ns <= FOLD_NS
    return near and last.kind is event.kind and (last.bus, last.node) == (event.bus, event.node)


class Told(NamedTuple):
    """The part of an event that depends on the record alone."""

    kind: EventKind
    severity: Severity
    text_key: str
    details: Mapping[str, Any]


def tell_sdo(seen: SdoSeen) -> Told | None:
    """What an SDO transfer is worth: nothing where it went well, or where a read was given up."""
    details: dict[str, Any] = {"address": seen.address.short, "access": seen.access.value}
    writing = seen.access is SdoAccess.WRITE
    severity = Severity.WARNING if writing else Severity.INFO
    if seen.protocol is Protocol.PKW and seen.outcome is Outcome.ABORTED and seen.abort_code is not None:
        details |= {"code": seen.abort_code, "reason_key": error_text_key(seen.abort_code)}
        return Told(EventKind.SDO_ABORTED, severity, "event.pkw_refused", details)
    if seen.outcome is Outcome.ABORTED and seen.abort_code is not None and seen.aborted_by is not None:
        details |= {
            "abort_code": seen.abort_code,
            "abort_code_hex": f"{seen.abort_code:08X}h",
            "reason_key": abort_text_key(seen.abort_code),
            "aborted_by": seen.aborted_by.value,
        }
        return Told(EventKind.SDO_ABORTED, severity, EventKind.SDO_ABORTED.text_key, details)
    if seen.outcome is Outcome.LOST and writing:
        return Told(EventKind.SDO_LOST, severity, EventKind.SDO_LOST.text_key, details)
    if seen.outcome is Outcome.BROKEN:
        return Told(EventKind.SDO_BROKEN, severity, EventKind.SDO_BROKEN.text_key, details)
    return None


def tell_transaction(seen: TransactionSeen) -> Told | None:
    """What a Modbus transaction is worth: nothing but its refusal. That FC 101 has no more data is no refusal."""
    if seen.outcome is not Outcome.ABORTED or seen.abort_code == Abort.NO_DATA:
        return None
    code = seen.exception if seen.abort_code is None else seen.abort_code
    if code is None:
        return None
    reason_key = exception_text_key(code) if seen.abort_code is None else abort_text_key(code)
    kind = EventKind.REQUEST_REFUSED
    details = {"function": seen.function, "code": code, "reason_key": reason_key}
    return Told(kind, Severity.WARNING, kind.text_key, details)


def tell_slave(seen: SlaveSeen) -> Told:
    """A slave that is gone is a warning: who runs it tells more of it."""
    severity = Severity.WARNING if seen.state is SlaveState.ABSENT else Severity.INFO
    return Told(EventKind.SLAVE_STATE, severity, EventKind.SLAVE_STATE.text_key, {"state_key": seen.state.text_key})


def tell_diagnosis(seen: DiagnosisSeen) -> Told:
    """The first of what is wrong stands for the rest; waiting for parameters is how every slave begins."""
    status = Status(seen.status)
    keys = status.faults.text_keys or status.text_keys or ["profibus.status.none"]
    begins = Status.NOT_READY | Status.PARAMETERS_REQUIRED
    severity = Severity.WARNING if status.faults & ~begins else Severity.INFO
    details = {"status_hex": f"{seen.status:06X}h", "ident_hex": f"{seen.ident:04X}h", "reason_key": keys[0]}
    return Told(EventKind.DIAGNOSIS, severity, EventKind.DIAGNOSIS.text_key, details)


def tell_emcy(seen: EmcySeen, description: Description | None) -> Told:
    """An emergency in the words of the device where it is described, else of the standard's error classes."""
    known = None if description is None else description.errors.get(seen.code)
    reason_key = emcy_text_key(seen.code) if known is None else known.text_key
    details = {
        "code": seen.code,
        "code_hex": f"{seen.code:04X}h",
        "register": seen.register,
        "data": seen.data.hex(),
        "reason_key": reason_key,
    }
    if seen.code == NO_ERROR:
        return Told(EventKind.EMCY_RESET, Severity.INFO, EventKind.EMCY_RESET.text_key, details)
    return Told(EventKind.EMCY, Severity.ERROR, EventKind.EMCY.text_key, details)


def tell_fault(seen: FaultSeen, description: Description | None) -> Told:
    """A fault of a device without emergency messages; the code of an error without the state Fault is a warning."""
    if seen.over:
        return Told(EventKind.DEVICE_FAULT_OVER, Severity.INFO, EventKind.DEVICE_FAULT_OVER.text_key, {})
    kind = EventKind.DEVICE_FAULT
    if not seen.code:
        return Told(kind, Severity.ERROR, f"{kind.text_key}_unknown", {})
    known = None if description is None else description.errors.get(seen.code)
    details = {
        "code": seen.code,
        "code_hex": f"{seen.code:04X}h",
        "reason_key": emcy_text_key(seen.code) if known is None else known.text_key,
    }
    return Told(kind, Severity.WARNING if seen.fault is False else Severity.ERROR, kind.text_key, details)
