"""What PDOs cost of the bus: frames a second, bits a frame, share of the bit rate; each estimate names its grounds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.model.pdo.setup import EVENT_TYPES, LAST_SYNC_TYPE, Direction, PdoSetup

ASSUMED_HZ: Final = 100.0
"""Taken for an event-driven PDO that neither inhibit time nor event timer nor a measurement tells anything of."""
_FIXED: Final = {False: 47, True: 67}
"""Bits of a frame without data, from start of frame to the end of the intermission (CAN 2.0 A, B)."""
_STUFFED: Final = {False: 34, True: 54}
"""Those of them that stuffing applies to: start of frame to CRC."""
_UNITS_OF_INHIBIT: Final = 10_000
_MS: Final = 1_000


class Basis(Enum):
    """What a rate rests on; the value is the end of its text key ``page.pdo.basis.…``."""

    OFF = "off"
    EMPTY = "empty"
    MEASURED = "measured"
    SYNC = "sync"
    SYNC_AT_MOST = "sync_at_most"
    NO_SYNC = "no_sync"
    INHIBIT = "inhibit"
    ASSUMED = "assumed"
    REMOTE = "remote"
    SENDER = "sender"

    @property
    def certain(self) -> bool:
        """False where the rate is a bound or a guess."""
        return self in (Basis.OFF, Basis.EMPTY, Basis.MEASURED, Basis.SYNC)


@dataclass(frozen=True, slots=True)
class PdoLoad:
    """The cost of one PDO: frames a second, bits of the longest frame, share of the bit rate (0..1)."""

    per_second: float
    bits: int
    share: float
    basis: Basis


def worst_bits(size: int, extended: bool = False) -> int:
    """Bits of a data frame of ``size`` bytes with as many stuff bits as there can be, intermission included."""
    data = 8 * size
    return _FIXED[extended] + data + (_STUFFED[extended] + data - 1) // 4


def estimate(setup: PdoSetup, bitrate: int, sync_hz: float | None, measured_hz: float | None) -> PdoLoad:
    """What the PDO costs while its node is operational.

    ``sync_hz``: SYNC messages a second, None where none was seen. ``measured_hz``: how often its frame was seen in the
    last second, while it was set up as it is here; None where it was not.
    """
    per_second, basis = _rate(setup, sync_hz, measured_hz)
    bits = worst_bits(setup.size, setup.parameters.extended)
    return PdoLoad(per_second, bits, per_second * bits / bitrate, basis)


def _rate(setup: PdoSetup, sync_hz: float | None, measured_hz: float | None) -> tuple[float, Basis]:
    if not setup.enabled:
        return 0.0, Basis.OFF
    if not setup.mapped:
        return 0.0, Basis.EMPTY
    if measured_hz is not None:
        return measured_hz, Basis.MEASURED
    if setup.id.direction is Direction.RECEIVE:
        return 0.0, Basis.SENDER
    kind = setup.parameters.transmission_type
    if kind <= LAST_SYNC_TYPE:
        if sync_hz is None:
            return 0.0, Basis.NO_SYNC
        return (sync_hz, Basis.SYNC_AT_MOST) if kind == 0 else (sync_hz / kind, Basis.SYNC)
    if kind not in EVENT_TYPES:
        return 0.0, Basis.REMOTE
    return _event_rate(setup.parameters.inhibit_100us, setup.parameters.event_ms)


def _event_rate(inhibit_100us: int, event_ms: int) -> tuple[float, Basis]:
    """The most that the inhibit time lets through; else at least what the timer brings, and changes come on top."""
    if inhibit_100us:
        return _UNITS_OF_INHIBIT / inhibit_100us, Basis.INHIBIT
    if event_ms:
        return max(ASSUMED_HZ, _MS / event_ms), Basis.ASSUMED
    return ASSUMED_HZ, Basis.ASSUMED


def total(loads: Iterable[PdoLoad]) -> float:
    """Share of the bit rate of all of them, 0..1."""
    return sum(load.share for load in loads)
