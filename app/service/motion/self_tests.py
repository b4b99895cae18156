"""What the power unit of an axis tests just now: its battery (3005h), or the wires of its safety inputs (30FDh).

A battery test loads the DC link that the motor lives on, and a motor that moves breaks it off (manual 4.1.1.6). A test
of the inputs is made by the turbine's controller: a pulse of up to 40 ms at X13.10, X13.8 or X13.7, too short for an
emergency drive, which a bit of its own shows for some seconds (4.7.1.3).

OPEN whether such a bit shows a pulse by 1 or by 0. So no level counts: the bits of inputs that are at 24 V are alike as
long as none of them is tested. A controller that pulls all of them at once is not seen: an open chain looks the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.model.address import Address
from app.model.station import station_slug
from app.service.battery.objects import TEST_STATUS, TestStatus, has_battery, read_numbers
from app.service.connection import Connection
from app.service.devices import Target

INPUTS: Final = Address(0x30FD)
_CLAMPS: Final[Mapping[int, str]] = {0: "X13.10", 2: "X13.8", 3: "X13.7"}
"""Bits of the inputs that may be pulsed (table 34)."""
_FEEDBACK_SHIFT: Final = 16


class Testing(Enum):
    """Whether it is tested; the value is the end of its text key ``interlock.testing.…``."""

    __test__ = False

    NO = "no"
    ARMED = "armed"
    """It begins as soon as anybody writes the controlword without its bit."""
    YES = "yes"
    UNKNOWN = "unknown"

    @property
    def text_key(self) -> str:
        """Text key of it."""
        return f"interlock.testing.{self.value}"


@dataclass(frozen=True, slots=True)
class Tests:
    """What the units of a station test. ``clamps``: the inputs that are tested, or a dash."""

    __test__ = False

    battery: Testing = Testing.NO
    inputs: Testing = Testing.NO
    clamps: str = "–"


async def look_at_tests(connection: Connection, target: Target) -> Tests:
    """What the units of the station of ``target`` test, asked now. What does not answer is not known."""
    station = station_slug(target.slug)
    units = [one for one in connection.targets if station_slug(one.slug) == station and has_battery(one)]
    found = Tests()
    for unit in units:
        words = await read_numbers(connection.driver(unit), unit, (TEST_STATUS, INPUTS))
        clamps = pulsed(words[INPUTS])
        inputs = Testing.UNKNOWN if clamps is None else Testing.YES if clamps else Testing.NO
        found = Tests(
            _first((battery(words[TEST_STATUS]), found.battery)),
            _first((inputs, found.inputs)),
            ", ".join(clamps or ()) or found.clamps,
        )
    return found


def battery(status: int | None) -> Testing:
    """What 3005h says of a test of the battery."""
    if status is None:
        return Testing.UNKNOWN
    if status & TestStatus.ACTIVE:
        return Testing.YES
    return Testing.ARMED if status & TestStatus.STARTED else Testing.NO


def pulsed(word: int | None) -> tuple[str, ...] | None:
    """The clamps of which 30FDh shows a test pulse, or may: of two that differ nobody knows which. None: not known."""
    if word is None:
        return None
    shown = {bit: word >> bit + _FEEDBACK_SHIFT & 1 for bit in _CLAMPS if word >> bit & 1}
    if len(set(shown.values())) < 2:
        return ()
    ones = [bit for bit in shown if shown[bit]]
    odd = ones if 2 * len(ones) <= len(shown) else [bit for bit in shown if not shown[bit]]
    return tuple(_CLAMPS[bit] for bit in (shown if 2 * len(odd) == len(shown) else odd))


def _first(found: Iterable[Testing]) -> Testing:
    """What holds back most."""
    return max(found, key=(Testing.NO, Testing.UNKNOWN, Testing.ARMED, Testing.YES).index)
