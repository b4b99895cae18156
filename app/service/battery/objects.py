"""The objects of the PMM that battery test and battery change rest on (OAT manual, chapter 4)."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntFlag
from typing import Any, Final

from app.errors import HubsideError, UsageError
from app.model.address import Address
from app.service.devices import Target, decode

CONTROLWORD: Final = Address(0x3040)
STATUS: Final = Address(0x3000)
CHARGER_STATUS: Final = Address(0x3001)
BOOSTER_STATUS: Final = Address(0x3002)
TEST_STATUS: Final = Address(0x3005)
BLOCS: Final = Address(0x3020, 4)
CHARGED_TOTAL: Final = Address(0x3050)
BATTERY_V: Final = Address(0x3060)
MAINS_V: Final = Address(0x3062)
CHARGER_V: Final = Address(0x3064)
OFF_LOAD_V: Final = Address(0x3067)
LOWEST_V: Final = Address(0x3068)
CURRENT_MA: Final = Address(0x3070)
BOOSTER_A: Final = Address(0x3073)
CHARGE_PERCENT: Final = Address(0x3080)
HEALTH_PERCENT: Final = Address(0x3081)
RESISTANCE_MOHM: Final = Address(0x30B4)
_BLOC_V: Final = 0x3061
MOST_BLOCS: Final = 8


class Command(IntFlag):
    """Bits of the controlword 3040h (table 17). Bits 3 to 6 and 8 to 15 are unused and always written 0."""

    CHARGE = 1 << 0
    TEST = 1 << 1
    BOOST = 1 << 2
    FAULT_RESET = 1 << 7


USED: Final = Command.CHARGE | Command.TEST | Command.BOOST | Command.FAULT_RESET


class TestStatus(IntFlag):
    """Bits of the test status 3005h (table 16)."""

    __test__ = False

    OK = 1 << 0
    FINISHED = 1 << 1
    STARTED = 1 << 2
    """Armed: it begins when the bit of the controlword falls."""
    ACTIVE = 1 << 3
    ERROR = 1 << 4
    IMPOSSIBLE = 1 << 5


def has_battery(target: Target) -> bool:
    """True for a device that tests a battery."""
    return CONTROLWORD in target.description.entries and TEST_STATUS in target.description.entries


def require_battery(target: Target) -> None:
    """Raises UsageError for a device that has no battery."""
    if not has_battery(target):
        raise UsageError(reason=f"{target.slug} has no battery")


def bloc_voltages(count: int) -> tuple[Address, ...]:
    """3061h of the first ``count`` blocs."""
    return tuple(Address(_BLOC_V, number) for number in range(1, min(count, MOST_BLOCS) + 1))


async def read_number(driver: Any, target: Target, address: Address) -> int:
    """One number of the device. Raises NoAnswerError, DeviceError, UsageError (what came is no number)."""
    raw = decode(target.entry(address), await driver.read(target.node, address))
    if not isinstance(raw, int):
        raise UsageError(reason=f"{target.slug} {address.short} is no number")
    return raw


async def read_numbers(driver: Any, target: Target, addresses: Iterable[Address]) -> dict[Address, int | None]:
    """Many numbers; None for each that did not come. Never raises for the sake of the wire."""
    wanted = tuple(addresses)
    try:
        answers = await driver.read_many(target.node, wanted)
    except HubsideError:
        return dict.fromkeys(wanted)
    found: dict[Address, int | None] = {}
    for address in wanted:
        answer = answers.get(address)
        raw = decode(target.entry(address), answer) if isinstance(answer, bytes) else None
        found[address] = raw if isinstance(raw, int) else None
    return found
