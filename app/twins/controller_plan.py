"""What a turbine controller sets in PMM and PMC before it works with them, and what it asks for while it works. Data.

PDOs are set in the order of CiA 301, 7.5.2.36: switched off, mapping emptied, filled, counted, switched on. Nothing of
it is saved: a device that restarts is set anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from app.model.address import Address
from app.wire import pdo

SYNC_NS: Final = 20_000_000
"""Cycle of the controller, and of the set-points: 20 ms (usual 10 to 100)."""
HEARTBEAT_MS: Final = 500
"""Of the devices and of the controller."""
CONSUMER_MS: Final = 2000
"""After this long without the controller's heartbeat a device reports a lost connection."""
AXIS_VELOCITY: Final = 1000
"""Fastest motion of an axis, 0.01 degrees/s; more than is ever asked for, so that an axis can catch up."""
ON_EVENT: Final = 255
AT_SYNC: Final = 1

Mapped = tuple[tuple[str, int], ...]


@dataclass(frozen=True, slots=True)
class Pdo:
    """A PDO of a device: its number from 1, what it carries (address, bits), when it is sent (CiA 301, 7.5.2.35)."""

    number: int
    mapped: Mapped
    kind: int
    inhibit_ms: int = 0
    event_ms: int = 0


@dataclass(frozen=True, slots=True)
class Poll:
    """An object that is read again and again."""

    address: Address
    period_ns: int


PMC_TPDOS: Final = (
    Pdo(1, (("6041", 16), ("603F", 16), ("60FD", 32)), ON_EVENT, inhibit_ms=5, event_ms=500),
    Pdo(2, (("6064", 32), ("606C", 32)), AT_SYNC),
    Pdo(3, (("60F4", 32), ("6079", 32)), 2),
    Pdo(4, (("6864", 32), ("6077", 16), ("6078", 16)), 5),
)
PMC_RPDOS: Final = (Pdo(2, (("6040", 16), ("607A", 32)), AT_SYNC),)
PMM_TPDOS: Final = (
    Pdo(1, (("3000", 8), ("603F", 16), ("3002", 8), ("3005", 8)), ON_EVENT, inhibit_ms=10, event_ms=1000),
    Pdo(2, (("3060", 16), ("3070", 32), ("3080", 8)), 10),
    Pdo(3, (("3062", 16), ("3063", 16), ("3073", 16), ("30B0", 8)), 5),
    Pdo(4, (("30FD", 32), ("30FE:03", 32)), ON_EVENT, inhibit_ms=20),
)
PMM_RPDOS: Final = (Pdo(1, (("3040", 16),), ON_EVENT),)
_S: Final = 1_000_000_000


def _polls(*pairs: tuple[str, int]) -> tuple[Poll, ...]:
    return tuple(Poll(_address(where), period_ns) for where, period_ns in pairs)


def _address(where: str) -> Address:
    index, _, sub = where.partition(":")
    return Address(int(index, 16), int(sub or "0", 16))


PMC_POLLS: Final = _polls(
    ("68F4", _S // 2), ("6061", _S), ("60FE:03", _S), ("6410:09", 2 * _S), ("6510:03", 2 * _S), ("6510:08", 2 * _S)
)
PMM_POLLS: Final = _polls(
    ("30B2", _S // 5), ("30B3", _S // 2), ("3001", _S), ("3003", _S), ("30B1", _S), ("3004", 2 * _S),
    ("3068", 2 * _S), ("3067", 2 * _S), ("3010", 2 * _S), ("3011", 2 * _S), ("30B4", 5 * _S),
    ("3061:01", 5 * _S), ("3061:02", 5 * _S), ("3061:03", 5 * _S),
    ("3061:04", 5 * _S), ("3061:05", 5 * _S), ("3061:06", 5 * _S),
)  # fmt: skip
"""What no PDO carries: timers of the mains failure, temperatures, batteries."""


def settings(node: int, axis: bool, controller: int) -> Iterator[tuple[Address, bytes]]:
    """What is written to a device before its start: heartbeats, PDOs and, in an axis, the cycle of its set-points."""
    yield Address(0x1017), HEARTBEAT_MS.to_bytes(2, "little")
    yield Address(0x1016, 1), (controller << 16 | CONSUMER_MS).to_bytes(4, "little")
    if axis:  # 60C2h: 20 x 10^-3 s; 6081h limits the cyclic modes too, and is 0 after power-on
        yield Address(0x6081), AXIS_VELOCITY.to_bytes(4, "little")
        yield Address(0x60C2, 1), bytes((SYNC_NS // 1_000_000,))
        yield Address(0x60C2, 2), (-3).to_bytes(1, "little", signed=True)
    for transmit, pdos in ((True, PMC_TPDOS if axis else PMM_TPDOS), (False, PMC_RPDOS if axis else PMM_RPDOS)):
        for one in pdos:
            yield from _pdo(one, node, transmit)


def pdo_id(number: int, node: int, transmit: bool) -> int:
    """Identifier of the predefined connection set (CiA 301, 7.3.5)."""
    return (0x80 if transmit else 0x100) + 0x100 * number + node


def _pdo(one: Pdo, node: int, transmit: bool) -> Iterator[tuple[Address, bytes]]:
    place = one.number - 1
    communication = (pdo.TPDO_COMMUNICATION if transmit else pdo.RPDO_COMMUNICATION) + place
    mapping = (pdo.TPDO_MAPPING if transmit else pdo.RPDO_MAPPING) + place
    cob_id = pdo_id(one.number, node, transmit) | (pdo.COB_NO_RTR if transmit else 0)
    yield Address(communication, 1), (cob_id | pdo.COB_INVALID).to_bytes(4, "little")
    yield Address(mapping), b"\0"
    for sub, (where, bits) in enumerate(one.mapped, 1):
        yield Address(mapping, sub), pdo.mapping_entry(_address(where), bits).to_bytes(4, "little")
    yield Address(mapping), bytes((len(one.mapped),))
    yield Address(communication, 2), bytes((one.kind,))
    if transmit:
        yield Address(communication, 3), (one.inhibit_ms * 10).to_bytes(2, "little")
        yield Address(communication, 5), one.event_ms.to_bytes(2, "little")
    yield Address(communication, 1), cob_id.to_bytes(4, "little")


def carried(pdos: Sequence[Pdo], number: int) -> Mapped:
    """What the PDO of that number carries."""
    return next(one.mapped for one in pdos if one.number == number)
