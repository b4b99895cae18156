"""How the PDOs of a node are set up: read from raw values, and told apart (CiA 301, 7.2.2 and 7.5.2.35 to 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.pdo.objects import (
    COB_INVALID,
    PDO_COUNT,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
    PdoParameters,
    parse_mapping_entry,
)

SUB_COB_ID: Final = 1
SUB_TYPE: Final = 2
SUB_INHIBIT: Final = 3
SUB_EVENT: Final = 5
SUB_SYNC_START: Final = 6
_PARAMETERS: Final = (SUB_COB_ID, SUB_TYPE, SUB_INHIBIT, SUB_EVENT, SUB_SYNC_START)
MAX_MAPPED: Final = 64
"""More in sub-index 0 of a mapping means a multiplex PDO (FEh, FFh), whose data name their own address."""
MAX_BITS: Final = 64
"""A frame carries eight octets."""
LAST_SYNC_TYPE: Final = 240
EVENT_TYPES: Final = (254, 255)
REMOTE_TYPES: Final = (252, 253)


class Direction(Enum):
    """Seen by the device: it receives an RPDO and transmits a TPDO."""

    RECEIVE = "rpdo"
    TRANSMIT = "tpdo"

    @property
    def communication(self) -> int:
        """Index of the communication parameters of the first one."""
        return TPDO_COMMUNICATION if self is Direction.TRANSMIT else RPDO_COMMUNICATION

    @property
    def mapping(self) -> int:
        """Index of the mapping parameters of the first one."""
        return TPDO_MAPPING if self is Direction.TRANSMIT else RPDO_MAPPING


class PdoId(NamedTuple):
    """One PDO of a node; ``number`` counts from 1."""

    direction: Direction
    number: int

    def __str__(self) -> str:
        return f"{self.direction.value.upper()}{self.number}"

    def parameter(self, sub: int) -> Address:
        """A communication parameter."""
        return Address(self.direction.communication + self.number - 1, sub)

    def mapped(self, sub: int) -> Address:
        """Sub-index 0: how many objects are mapped; from 1 on which."""
        return Address(self.direction.mapping + self.number - 1, sub)


class Mapped(NamedTuple):
    """One mapped object, as it stands in the mapping: index, sub-index and width in one UNSIGNED32."""

    raw: int

    @property
    def address(self) -> Address:
        """What is mapped; up to 001Fh a data type that only fills bits."""
        return parse_mapping_entry(self.raw)[0]

    @property
    def bits(self) -> int:
        """Its width."""
        return parse_mapping_entry(self.raw)[1]


@dataclass(frozen=True, slots=True)
class PdoPlace:
    """What a device has for one PDO: which communication parameters, and room for how many objects."""

    id: PdoId
    subs: frozenset[int]
    room: int


@dataclass(frozen=True, slots=True)
class PdoSetup:
    """One PDO as it is set up. Parameters that the device does not have are 0."""

    id: PdoId
    parameters: PdoParameters
    mapped: tuple[Mapped, ...]

    @property
    def enabled(self) -> bool:
        """True where the PDO exists: bit 31 of its COB-ID is 0."""
        return self.parameters.valid

    @property
    def bits(self) -> int:
        """Width of all that is mapped."""
        return sum(one.bits for one in self.mapped)

    @property
    def size(self) -> int:
        """Data bytes of its frame."""
        return (self.bits + 7) // 8

    @property
    def on_event(self) -> bool:
        """True where no SYNC and no remote frame is waited for."""
        return self.parameters.transmission_type in EVENT_TYPES

    def carries(self, address: Address) -> bool:
        """True where the object is mapped, whatever else is."""
        return any(one.address == address for one in self.mapped)

    def same_frame(self, other: PdoSetup) -> bool:
        """True where both, enabled or not, mean the same frame at the same times."""
        return _without_switch(self) == _without_switch(other)


def _without_switch(setup: PdoSetup) -> tuple[PdoParameters, tuple[Mapped, ...]]:
    return setup.parameters._replace(cob_id=setup.parameters.cob_id & ~COB_INVALID), setup.mapped


PdoSetups = Mapping[PdoId, PdoSetup]
"""All PDOs of a node."""


def places_of(description: Description) -> tuple[PdoPlace, ...]:
    """The PDOs that a device has, receive PDOs first."""
    return tuple(_places(description))


def _places(description: Description) -> Iterator[PdoPlace]:
    entries = description.entries
    indices = {address.major for address in entries}
    for direction in Direction:
        for number in range(1, PDO_COUNT + 1):
            pdo = PdoId(direction, number)
            if pdo.parameter(0).major not in indices or pdo.mapped(0) not in entries:
                continue
            subs = frozenset(sub for sub in _PARAMETERS if pdo.parameter(sub) in entries)
            room = next(sub for sub in range(MAX_MAPPED + 1) if pdo.mapped(sub + 1) not in entries)
            if SUB_COB_ID in subs:
                yield PdoPlace(pdo, subs, room)


def objects_of(place: PdoPlace) -> list[Address]:
    """Every object that sets the PDO up, in the order of reading."""
    subs = (place.id.parameter(sub) for sub in sorted(place.subs))
    return [*subs, *(place.id.mapped(sub) for sub in range(place.room + 1))]


def parse_setup(place: PdoPlace, lookup: Callable[[Address], Raw | None]) -> PdoSetup | None:
    """The PDO from the raw values of its objects; None while one of those that count is not known.

    Sub-index 0 may claim more objects than the device has room for: those count as empty entries.
    """
    pdo = place.id
    values = {sub: lookup(pdo.parameter(sub)) for sub in place.subs}
    count = lookup(pdo.mapped(0))
    if not isinstance(count, int) or count > MAX_MAPPED:
        return None
    entries = [lookup(pdo.mapped(sub)) if sub <= place.room else 0 for sub in range(1, count + 1)]
    if not all(isinstance(raw, int) for raw in (*values.values(), *entries)):
        return None

    def number(sub: int) -> int:
        raw = values.get(sub, 0)
        return raw if isinstance(raw, int) else 0

    parameters = PdoParameters(*(number(sub) for sub in _PARAMETERS))
    return PdoSetup(pdo, parameters, tuple(Mapped(raw) for raw in entries if isinstance(raw, int)))
