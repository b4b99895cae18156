"""The objects that configure PDOs, as CiA 301 lays them out (7.5.2.35 to 7.5.2.38): indices, bits, mapping entries."""

from __future__ import annotations

from typing import Final, NamedTuple

from app.model.address import Address

RPDO_COMMUNICATION: Final = 0x1400
RPDO_MAPPING: Final = 0x1600
TPDO_COMMUNICATION: Final = 0x1800
TPDO_MAPPING: Final = 0x1A00
PDO_COUNT: Final = 512

COB_INVALID: Final = 0x80000000
COB_NO_RTR: Final = 0x40000000
COB_EXTENDED: Final = 0x20000000
MAX_DUMMY_INDEX: Final = 0x001F
"""Up to here an index in a mapping is a data type: bits that nobody reads (7.4.7)."""


class PdoParameters(NamedTuple):
    """Communication parameters (14xxh, 18xxh). ``cob_id`` is the raw UNSIGNED32 of sub-index 1.

    ``inhibit_100us`` is sub-index 3, ``event_ms`` sub-index 5, ``sync_start`` sub-index 6.
    """

    cob_id: int
    transmission_type: int = 255
    inhibit_100us: int = 0
    event_ms: int = 0
    sync_start: int = 0

    @property
    def valid(self) -> bool:
        """True where the PDO exists: bit 31 of the COB-ID is 0."""
        return not self.cob_id & COB_INVALID

    @property
    def rtr_allowed(self) -> bool:
        """True where a TPDO may be asked for by a remote frame: bit 30 is 0."""
        return not self.cob_id & COB_NO_RTR

    @property
    def extended(self) -> bool:
        """True where it has a 29-bit identifier."""
        return bool(self.cob_id & COB_EXTENDED)

    @property
    def can_id(self) -> int:
        """The CAN identifier."""
        return self.cob_id & (0x1FFFFFFF if self.extended else 0x7FF)


def mapping_entry(address: Address, bits: int) -> int:
    """The UNSIGNED32 of 16xxh and 1Axxh: index, sub-index, width. Raises ValueError where the width is not 1..64."""
    if not 1 <= bits <= 64:
        raise ValueError(f"{bits} bits cannot be mapped")
    return address.major << 16 | address.minor << 8 | bits


def parse_mapping_entry(raw: int) -> tuple[Address, int]:
    """Read an UNSIGNED32 of 16xxh or 1Axxh: the address and its width in bits."""
    return Address(raw >> 16 & 0xFFFF, raw >> 8 & 0xFF), raw & 0xFF
