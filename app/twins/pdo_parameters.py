"""Writes to the PDO parameters of a twin: what may be written, and when (CiA 301, 7.5.2.33 to 7.5.2.38).

The order that the standard demands: disable the PDO (bit 31 of its COB-ID), set sub-index 0 of the mapping to 0, write
the entries, set sub-index 0 to their number, enable the PDO.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from app.model.address import Address
from app.model.datatypes import DataType, Raw
from app.model.pdo.identifiers import is_restricted
from app.twins.object_store import Cell, ObjectStore, RefusedAccessError
from app.wire import pdo
from app.wire.sdo import Abort

_DUMMY_TYPES: Final = {kind.value: kind for kind in DataType if kind.value <= 7}
_MAX_BITS: Final = 64


@dataclass(frozen=True, slots=True)
class PdoObjects:
    """The objects of one PDO, communication and mapping; ``transmit`` tells its direction, seen by the device."""

    transmit: bool
    cob_id: Cell
    kind: Cell | None
    inhibit: Cell | None
    event: Cell | None
    count: Cell
    entries: tuple[Cell, ...]

    @property
    def parameters(self) -> pdo.PdoParameters:
        """The communication parameters in force."""
        return pdo.PdoParameters(
            self.cob_id.number,
            255 if self.kind is None else self.kind.number,
            0 if self.inhibit is None else self.inhibit.number,
            0 if self.event is None else self.event.number,
        )


def pdo_objects(store: ObjectStore) -> list[PdoObjects]:
    """All PDOs that the description has."""
    found = []
    for communication, mapping, transmit in (
        (pdo.RPDO_COMMUNICATION, pdo.RPDO_MAPPING, False),
        (pdo.TPDO_COMMUNICATION, pdo.TPDO_MAPPING, True),
    ):
        for number in range(pdo.PDO_COUNT):
            cob_id, count = store.find(communication + number, 1), store.find(mapping + number)
            if cob_id is None or count is None:
                continue
            entries = (store.find(mapping + number, sub) for sub in range(1, _MAX_BITS + 1))
            found.append(
                PdoObjects(
                    transmit,
                    cob_id,
                    store.find(communication + number, 2),
                    store.find(communication + number, 3),
                    store.find(communication + number, 5),
                    count,
                    tuple(cell for cell in entries if cell is not None),
                )
            )
    return found


def guard_parameters(store: ObjectStore, objects: PdoObjects, changed: Callable[[], None]) -> None:
    """Install the checks on one PDO's objects; ``changed`` runs after each write that alters it."""

    def announce(_raw: Raw) -> None:
        changed()

    objects.cob_id.guard = _cob_guard(objects)
    if objects.kind is not None:
        objects.kind.guard = _kind_guard
    if objects.inhibit is not None:
        objects.inhibit.guard = _while_disabled(objects)
    objects.count.guard = _count_guard(store, objects)
    for cell in objects.entries:
        cell.guard = _entry_guard(store, objects)
    for changing in (objects.cob_id, objects.kind, objects.inhibit, objects.event, objects.count, *objects.entries):
        if changing is not None:
            changing.effect = announce


def check_entry(store: ObjectStore, raw: int, transmit: bool) -> int:
    """Bits of a mapping entry. Raises RefusedAccessError where it cannot be mapped."""
    address, bits = pdo.parse_mapping_entry(raw)
    if not transmit and address.major in _DUMMY_TYPES and address.minor == 0:
        expected = _DUMMY_TYPES[address.major].bits
    else:
        entry = store.at(address).entry
        allowed = entry.access.readable if transmit else entry.access.writable
        if not (entry.pdo and allowed):
            raise RefusedAccessError(Abort.NOT_MAPPABLE)
        expected = entry.type.bits
    if bits != expected:
        raise RefusedAccessError(Abort.PDO_LENGTH)
    return bits


def mapping_of(objects: PdoObjects) -> tuple[tuple[Address, int], ...]:
    """The mapped entries in force."""
    return tuple(pdo.parse_mapping_entry(cell.number) for cell in objects.entries[: objects.count.number])


def _cob_guard(objects: PdoObjects) -> Callable[[Raw], None]:
    def check(raw: Raw) -> None:
        old = objects.cob_id.number
        if not isinstance(raw, int) or raw & pdo.COB_EXTENDED:
            raise RefusedAccessError(Abort.VALUE_RANGE)
        identifier = raw & 0x7FF
        if not raw & pdo.COB_INVALID:
            if not old & pdo.COB_INVALID and raw != old:
                raise RefusedAccessError(Abort.VALUE_RANGE)
            if is_restricted(identifier):
                raise RefusedAccessError(Abort.VALUE_RANGE)

    return check


def _kind_guard(raw: Raw) -> None:
    if isinstance(raw, int) and 241 <= raw <= 251:
        raise RefusedAccessError(Abort.VALUE_RANGE)


def _while_disabled(objects: PdoObjects) -> Callable[[Raw], None]:
    def check(_raw: Raw) -> None:
        if objects.parameters.valid:
            raise RefusedAccessError(Abort.VALUE_RANGE)

    return check


def _count_guard(store: ObjectStore, objects: PdoObjects) -> Callable[[Raw], None]:
    def check(raw: Raw) -> None:
        if not isinstance(raw, int) or objects.parameters.valid:
            raise RefusedAccessError(Abort.UNSUPPORTED_ACCESS)
        if raw > len(objects.entries):
            raise RefusedAccessError(Abort.VALUE_TOO_HIGH)
        bits = sum(check_entry(store, cell.number, objects.transmit) for cell in objects.entries[:raw])
        if bits > _MAX_BITS:
            raise RefusedAccessError(Abort.PDO_LENGTH)

    return check


def _entry_guard(store: ObjectStore, objects: PdoObjects) -> Callable[[Raw], None]:
    def check(raw: Raw) -> None:
        if not isinstance(raw, int) or objects.parameters.valid or objects.count.number:
            raise RefusedAccessError(Abort.UNSUPPORTED_ACCESS)
        if raw:
            check_entry(store, raw, objects.transmit)

    return check
