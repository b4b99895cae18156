"""What is wrong with a setup of PDOs, or worth a thought, each with its place and its reason.

An error keeps the setup from being applied: the device would refuse it, frames would collide, or STOP would lose its
short path. Looked at is what changes and what is enabled: a PDO that is off and stays as it is harms nobody.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from app.model.address import Address
from app.model.datatypes import DataType
from app.model.description import Access, Description, Entry, PdoWay
from app.model.pdo.identifiers import Taken, Use, is_restricted, taken_by_pdos
from app.model.pdo.objects import MAX_DUMMY_INDEX
from app.model.pdo.setup import (
    EVENT_TYPES,
    LAST_SYNC_TYPE,
    MAX_BITS,
    REMOTE_TYPES,
    SUB_EVENT,
    SUB_INHIBIT,
    SUB_SYNC_START,
    Direction,
    Mapped,
    PdoId,
    PdoPlace,
    PdoSetup,
    PdoSetups,
)
from app.model.pdo.writes import changed_pdos

CONTROLWORD: Final = Address(0x6040)
STATUSWORD: Final = Address(0x6041)
_WORD_BITS: Final = 16
_ALL_BITS: Final = 0x1FFFFFFF
_LAST_BASE_ID: Final = 0x7FF
_DUMMIES: Final = {kind.value: kind for kind in DataType if kind.value <= DataType.UNSIGNED32.value}
"""Data types that an RPDO may map to fill bits (7.4.7.2)."""


class Severity(Enum):
    """An error is refused; a warning is to be known; a note explains."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


class Part(Enum):
    """The part of a PDO that a finding is about."""

    COB_ID = "cob_id"
    TYPE = "type"
    INHIBIT = "inhibit"
    EVENT = "event"
    SYNC_START = "sync_start"
    MAPPING = "mapping"


_SUB_OF: Final = {Part.INHIBIT: SUB_INHIBIT, Part.EVENT: SUB_EVENT, Part.SYNC_START: SUB_SYNC_START}


class Code(Enum):
    """What was found; the value is the end of its text key ``page.pdo.finding.…``."""

    NOT_MAPPABLE = "not_mappable"
    NOT_WRITABLE = "not_writable"
    NOT_READABLE = "not_readable"
    UNKNOWN_OBJECT = "unknown_object"
    DUMMY_IN_TPDO = "dummy_in_tpdo"
    WRONG_LENGTH = "wrong_length"
    EMPTY_ENTRY = "empty_entry"
    TOO_MANY_BITS = "too_many_bits"
    TOO_MANY_OBJECTS = "too_many_objects"
    NO_OBJECT = "no_object"
    TWICE = "twice"
    NOT_BYTES = "not_bytes"
    RESTRICTED = "restricted"
    COB_ID_RANGE = "cob_id_range"
    COB_ID_TAKEN = "cob_id_taken"
    COB_ID_LINKED = "cob_id_linked"
    COB_ID_SEEN = "cob_id_seen"
    COMMANDS_OTHER = "commands_other"
    EXTENDED = "extended"
    TYPE_RESERVED = "type_reserved"
    REMOTE_ONLY = "remote_only"
    REMOTE_FORBIDDEN = "remote_forbidden"
    INHIBIT_OVER_EVENT = "inhibit_over_event"
    NOTHING_TRIGGERS = "nothing_triggers"
    NO_EVENT_TIMER = "no_event_timer"
    TIMER_UNUSED = "timer_unused"
    SYNC_START_RANGE = "sync_start_range"
    NO_PARAMETER = "no_parameter"
    STOP_PATH = "stop_path"
    STOP_PATH_MISSING = "stop_path_missing"
    STATUS_PATH = "status_path"


_ERRORS: Final = frozenset(
    {
        *(Code.NOT_MAPPABLE, Code.NOT_WRITABLE, Code.NOT_READABLE, Code.UNKNOWN_OBJECT, Code.DUMMY_IN_TPDO),
        *(Code.WRONG_LENGTH, Code.EMPTY_ENTRY, Code.TOO_MANY_BITS, Code.TOO_MANY_OBJECTS, Code.NO_OBJECT),
        *(Code.RESTRICTED, Code.COB_ID_RANGE, Code.COB_ID_TAKEN, Code.TYPE_RESERVED, Code.REMOTE_FORBIDDEN),
        *(Code.SYNC_START_RANGE, Code.NO_PARAMETER, Code.STOP_PATH, Code.STATUS_PATH, Code.COMMANDS_OTHER),
    }
)
_NOTES: Final = frozenset({Code.NO_EVENT_TIMER, Code.TIMER_UNUSED})
PATHS: Final = frozenset({Code.STOP_PATH, Code.STATUS_PATH})
"""What STOP and motion rest on: refused also where an earlier setup is put back."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding. ``entry``: the mapped object that it is about, counted from 1; None where it is about all."""

    code: Code
    pdo: PdoId
    part: Part
    entry: int | None = None
    details: Mapping[str, str | int] = field(default_factory=dict)

    @property
    def severity(self) -> Severity:
        """How bad it is."""
        if self.code in _ERRORS:
            return Severity.ERROR
        return Severity.NOTE if self.code in _NOTES else Severity.WARNING


def is_stop_path(setup: PdoSetup) -> bool:
    """True for a receive PDO by which STOP goes: the controlword alone, used as soon as it comes, however often."""
    return (
        setup.id.direction is Direction.RECEIVE
        and setup.enabled
        and setup.on_event
        and not setup.parameters.inhibit_100us
        and [(one.address, one.bits) for one in setup.mapped] == [(CONTROLWORD, _WORD_BITS)]
    )


def is_status_path(setup: PdoSetup) -> bool:
    """True for a transmit PDO that tells a change of the statusword at once."""
    return setup.id.direction is Direction.TRANSMIT and setup.enabled and setup.on_event and setup.carries(STATUSWORD)


def find(
    description: Description,
    places: Sequence[PdoPlace],
    before: PdoSetups,
    after: PdoSetups,
    others: Sequence[Taken],
) -> list[Finding]:
    """All findings on ``after``. ``others``: identifiers that others on the bus use, PDOs of this node left out."""
    changed = set(changed_pdos(before, after))
    found: list[Finding] = []
    for place in places:
        setup = after.get(place.id)
        if setup is None or not (setup.enabled or place.id in changed):
            continue
        found += _mapping(description, place, setup)
        own = taken_by_pdos("", [other for other in after.values() if other.id != setup.id])
        standing = place.id not in changed  # how a turbine shares its commands is not for an edit of another PDO to say
        found += (one for one in _cob_id(setup, others, own) if not (standing and one.code is Code.COMMANDS_OTHER))
        found += _timing(place, setup)
        if setup.enabled and setup.id.direction is Direction.TRANSMIT:
            found += _triggers(description, setup)
    return [*found, *_paths(description, before, after)]


# -- what is mapped -------------------------------------------------------------


def _mapping(description: Description, place: PdoPlace, setup: PdoSetup) -> Iterator[Finding]:
    pdo = setup.id
    if len(setup.mapped) > place.room:
        yield Finding(Code.TOO_MANY_OBJECTS, pdo, Part.MAPPING, None, {"count": len(setup.mapped), "room": place.room})
    if setup.bits > MAX_BITS:
        yield Finding(Code.TOO_MANY_BITS, pdo, Part.MAPPING, None, {"bits": setup.bits})
    if setup.enabled and not setup.mapped:
        yield Finding(Code.NO_OBJECT, pdo, Part.MAPPING)
    position, seen = 0, set()
    for number, one in enumerate(setup.mapped, start=1):
        yield from _entry(description, pdo, number, one)
        name = {"object": one.address.short}
        if one.address in seen and one.address.major > MAX_DUMMY_INDEX:
            yield Finding(Code.TWICE, pdo, Part.MAPPING, number, name)
        if position % 8 or one.bits % 8:
            yield Finding(Code.NOT_BYTES, pdo, Part.MAPPING, number, {**name, "bits": one.bits})
        seen.add(one.address)
        position += one.bits


def _entry(description: Description, pdo: PdoId, number: int, one: Mapped) -> Iterator[Finding]:
    address, receives = one.address, pdo.direction is Direction.RECEIVE

    def finding(code: Code, **more: str | int) -> Finding:
        return Finding(code, pdo, Part.MAPPING, number, {"object": address.short, **more})

    if not one.raw:
        yield finding(Code.EMPTY_ENTRY)
        return
    if address.major in _DUMMIES and address.minor == 0:
        expected = _DUMMIES[address.major].bits
        if not receives:
            yield finding(Code.DUMMY_IN_TPDO)
    else:
        entry = description.entries.get(address)
        if entry is None:
            yield finding(Code.UNKNOWN_OBJECT)
            return
        expected = entry.type.bits
        if not entry.pdo:
            yield finding(Code.NOT_MAPPABLE)
        elif receives and not entry.receivable:
            yield finding(Code.NOT_WRITABLE, access=_access_text(entry))
        elif not receives and not entry.sendable:
            yield finding(Code.NOT_READABLE, access=_access_text(entry))
    if one.bits != expected:
        yield finding(Code.WRONG_LENGTH, bits=one.bits, expected=expected or 0)


def _access_text(entry: Entry) -> str:
    return entry.access.value if entry.pdo_way is PdoWay.BOTH else entry.pdo_way.value


# -- its identifier -------------------------------------------------------------


def _cob_id(setup: PdoSetup, others: Sequence[Taken], own: Sequence[Taken]) -> Iterator[Finding]:
    """An identifier counts where the PDO is enabled; one that could never be is told in any case."""
    pdo, parameters = setup.id, setup.parameters
    shown = {"id": f"{parameters.can_id:X}h"}
    if parameters.extended:
        yield Finding(Code.EXTENDED, pdo, Part.COB_ID, None, shown)
    elif parameters.cob_id & _ALL_BITS > _LAST_BASE_ID:
        yield Finding(Code.COB_ID_RANGE, pdo, Part.COB_ID, None, {"id": f"{parameters.cob_id & _ALL_BITS:X}h"})
    elif is_restricted(parameters.can_id):
        yield Finding(Code.RESTRICTED, pdo, Part.COB_ID, None, shown)
    if not setup.enabled:
        return
    for taken in (*own, *others):
        if (taken.can_id, taken.extended) != (parameters.can_id, parameters.extended):
            continue
        if taken.use is Use.SEEN and pdo.direction is Direction.RECEIVE:
            continue  # it takes what somebody sends
        linked = taken not in own and _is_link(pdo.direction, taken.use)
        code = _CODE_OF.get(taken.use, Code.COB_ID_LINKED if linked else Code.COB_ID_TAKEN)
        use = taken.use.value.upper() + (str(taken.number) if taken.number else "")
        yield Finding(code, pdo, Part.COB_ID, None, {**shown, "use": use, "by": taken.device or ""})


_CODE_OF: Final = {Use.SEEN: Code.COB_ID_SEEN, Use.COMMANDS: Code.COMMANDS_OTHER}


def _is_link(direction: Direction, use: Use) -> bool:
    """One sends and others take: that is how two nodes are linked. Two that send the same frame collide."""
    if direction is Direction.TRANSMIT:
        return use is Use.RPDO
    return use in (Use.RPDO, Use.TPDO)


# -- when it goes ---------------------------------------------------------------


def _timing(place: PdoPlace, setup: PdoSetup) -> Iterator[Finding]:
    pdo, parameters = setup.id, setup.parameters
    kind, transmits = parameters.transmission_type, pdo.direction is Direction.TRANSMIT
    remote = kind in REMOTE_TYPES
    if LAST_SYNC_TYPE < kind < EVENT_TYPES[0] and not (remote and transmits):
        yield Finding(Code.TYPE_RESERVED, pdo, Part.TYPE, None, {"type": kind})
    elif remote and not parameters.rtr_allowed:
        yield Finding(Code.REMOTE_FORBIDDEN, pdo, Part.TYPE, None, {"type": kind})
    elif remote:
        yield Finding(Code.REMOTE_ONLY, pdo, Part.TYPE, None, {"type": kind})
    if parameters.sync_start > LAST_SYNC_TYPE:
        yield Finding(Code.SYNC_START_RANGE, pdo, Part.SYNC_START, None, {"start": parameters.sync_start})
    for number, where in (
        (parameters.inhibit_100us, Part.INHIBIT),
        (parameters.event_ms, Part.EVENT),
        (parameters.sync_start, Part.SYNC_START),
    ):
        if number and _SUB_OF[where] not in place.subs:
            yield Finding(Code.NO_PARAMETER, pdo, where, None, {"sub": _SUB_OF[where]})
    if 0 < 10 * parameters.event_ms < parameters.inhibit_100us:
        yield Finding(Code.INHIBIT_OVER_EVENT, pdo, Part.INHIBIT, None, {"event_ms": parameters.event_ms})
    if transmits and not setup.on_event and (parameters.inhibit_100us or parameters.event_ms):
        where = Part.INHIBIT if parameters.inhibit_100us else Part.EVENT
        yield Finding(Code.TIMER_UNUSED, pdo, where, None, {"type": kind})


def _triggers(description: Description, setup: PdoSetup) -> Iterator[Finding]:
    if not setup.on_event or setup.parameters.event_ms or not setup.mapped:
        return
    entries = [description.entries.get(one.address) for one in setup.mapped]
    constant = all(entry is not None and entry.access is Access.CONST for entry in entries)
    code = Code.NOTHING_TRIGGERS if constant else Code.NO_EVENT_TIMER
    yield Finding(code, setup.id, Part.EVENT, None, {"type": setup.parameters.transmission_type})


# -- what STOP and motion rest on -------------------------------------------------


def _paths(description: Description, before: PdoSetups, after: PdoSetups) -> Iterator[Finding]:
    """At the first PDO that carried it; where none did, at the first one of its direction."""
    if CONTROLWORD not in description.entries or STATUSWORD not in description.entries:
        return
    for judge, code, missing in (
        (is_stop_path, Code.STOP_PATH, Code.STOP_PATH_MISSING),
        (is_status_path, Code.STATUS_PATH, None),
    ):
        if any(judge(setup) for setup in after.values()):
            continue
        carried = [pdo for pdo, setup in before.items() if judge(setup)]
        if carried:
            yield Finding(code, carried[0], Part.MAPPING)
        elif missing is not None and PdoId(Direction.RECEIVE, 1) in after:
            yield Finding(missing, PdoId(Direction.RECEIVE, 1), Part.MAPPING)
