"""Which service a frame belongs to and whose it is: what a person reads first of it.

The identifiers are those of the predefined connection set (CiA 301, 7.3.5); a decoder knows which were moved.
"""

from __future__ import annotations

from enum import Enum
from functools import lru_cache
from typing import Final, NamedTuple

from app.wire.emcy import EMCY_BASE
from app.wire.nmt import HEARTBEAT_BASE, MAX_NODE, NMT_COB_ID
from app.wire.sdo import REQUEST_BASE, RESPONSE_BASE
from app.wire.sync import SYNC_COB_ID, TIME_COB_ID

LSS_MASTER: Final = 0x7E5
LSS_SLAVE: Final = 0x7E4
"""Layer setting services (CiA 305, 3.7)."""


class Service(Enum):
    """A communication service. HEARTBEAT is boot-up and node guarding too; GAP stands where frames are missing."""

    NMT = "nmt"
    SYNC = "sync"
    TIME = "time"
    EMCY = "emcy"
    TPDO = "tpdo"
    RPDO = "rpdo"
    SDO_REQUEST = "sdo-request"
    SDO_RESPONSE = "sdo-response"
    HEARTBEAT = "heartbeat"
    LSS = "lss"
    MODBUS_REQUEST = "modbus-request"
    MODBUS_RESPONSE = "modbus-response"
    FDL_REQUEST = "fdl-request"
    FDL_RESPONSE = "fdl-response"
    FDL_SAME = "fdl-same"
    """A Data_Exchange of PROFIBUS, either way, with the very data of the one before."""
    FDL_TOKEN = "fdl-token"
    ERROR = "error"
    TWIN = "twin"
    """Rotor and wind, as a twin tells them (``app.wire.twin_environment``)."""
    GAP = "gap"
    UNKNOWN = "unknown"

    # Enum's own is written in Python, and services are looked up with every frame.
    __hash__ = object.__hash__


class Speaker(NamedTuple):
    """The service of a frame and the node that it belongs to (0: all, or none).

    ``number`` counts PDOs from 1; of Modbus it is the function code.
    """

    service: Service
    node: int = 0
    number: int = 0


UNKNOWN: Final = Speaker(Service.UNKNOWN)
_FIXED: Final = {
    NMT_COB_ID: Speaker(Service.NMT),
    SYNC_COB_ID: Speaker(Service.SYNC),
    TIME_COB_ID: Speaker(Service.TIME),
    LSS_MASTER: Speaker(Service.LSS),
    LSS_SLAVE: Speaker(Service.LSS),
}
_BY_NODE: Final = {
    EMCY_BASE: (Service.EMCY, 0),
    0x180: (Service.TPDO, 1),
    0x200: (Service.RPDO, 1),
    0x280: (Service.TPDO, 2),
    0x300: (Service.RPDO, 2),
    0x380: (Service.TPDO, 3),
    0x400: (Service.RPDO, 3),
    0x480: (Service.TPDO, 4),
    0x500: (Service.RPDO, 4),
    RESPONSE_BASE: (Service.SDO_RESPONSE, 0),
    REQUEST_BASE: (Service.SDO_REQUEST, 0),
    HEARTBEAT_BASE: (Service.HEARTBEAT, 0),
}


@lru_cache(maxsize=2048)
def predefined(can_id: int) -> Speaker:
    """Who speaks with this 11-bit identifier where nothing else is known."""
    fixed = _FIXED.get(can_id)
    if fixed is not None:
        return fixed
    node = can_id & MAX_NODE
    found = _BY_NODE.get(can_id - node)
    return UNKNOWN if found is None or node == 0 else Speaker(found[0], node, found[1])
