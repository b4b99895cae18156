"""CAN identifiers: which ones no PDO may have, and who has the others (CiA 301, 7.3.3 and 7.3.5)."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from typing import Final, NamedTuple

from app.model.pdo.setup import Direction, PdoId, PdoSetup

RESTRICTED: Final = (
    range(0x000, 0x001),  # NMT
    range(0x001, 0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),  # answers of the default SDO
    range(0x601, 0x680),  # requests of the default SDO
    range(0x6E0, 0x700),
    range(0x701, 0x780),  # NMT error control: boot-up, heartbeat
    range(0x780, 0x800),
)
"""Identifiers that no configurable object may have (table of restricted CAN-IDs, 7.3.3)."""
SYNC: Final = 0x080
TIME: Final = 0x100
EMCY: Final = 0x080


class Use(Enum):
    """What an identifier is for.

    ``COMMANDS``: an RPDO that carries the controlword of an axis: who shared it would obey or command that axis.
    ``SEEN``: frames of it are on the bus now, and nobody here knows whose.
    """

    SYNC = "sync"
    TIME = "time"
    EMCY = "emcy"
    RPDO = "rpdo"
    TPDO = "tpdo"
    SDO = "sdo"
    COMMANDS = "commands"
    SEEN = "seen"


class Taken(NamedTuple):
    """Who uses an identifier: a PDO of ``device`` (None: the bus as a whole), ``number`` counts PDOs from 1."""

    can_id: int
    extended: bool
    use: Use
    device: str | None
    number: int = 0


def is_restricted(can_id: int) -> bool:
    """True for an 11-bit identifier that no PDO may have."""
    return any(can_id in ids for ids in RESTRICTED)


def bus_wide(sync_ids: Iterable[int]) -> list[Taken]:
    """SYNC, as the nodes have it set, and TIME."""
    return [*(Taken(one, False, Use.SYNC, None) for one in sorted(set(sync_ids))), Taken(TIME, False, Use.TIME, None)]


def taken_by_pdos(device: str, setups: Iterable[PdoSetup]) -> list[Taken]:
    """Identifiers of the PDOs of a device that are enabled."""
    return [
        Taken(setup.parameters.can_id, setup.parameters.extended, _use(setup.id), device, setup.id.number)
        for setup in setups
        if setup.enabled
    ]


def _use(pdo: PdoId) -> Use:
    return Use.TPDO if pdo.direction is Direction.TRANSMIT else Use.RPDO
