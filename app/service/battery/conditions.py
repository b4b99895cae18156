"""What a battery test needs, each with its reason, to be seen before it is begun (manual 4.1.1.6).

The drive itself decides whether a test can be run, and says so by bit 5 of 3005h; what is looked at here spares the
attempt. From which charge on it counts its battery as charged is not printed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from app.errors import HubsideError
from app.model.address import Address
from app.model.station import station_slug
from app.model.values import to_scaled
from app.service.battery.objects import (
    BOOSTER_STATUS,
    CHARGE_PERCENT,
    MAINS_V,
    STATUS,
    TEST_STATUS,
    TestStatus,
    read_numbers,
)
from app.service.connection import Connection
from app.service.devices import Target
from app.service.motion.desk import MotionDesk
from app.service.stop import is_axis

LEAST_CHARGE_PERCENT: Final = 80
"""Below this no drive will call its battery charged; above it the drive decides."""
STANDS_DPS: Final = 0.1
VELOCITY: Final = Address(0x606C)
_MAINS_WRONG: Final = 1 << 4 | 1 << 5 | 1 << 6 | 1 << 7
"""Bits of 3000h (table 11): switch-off counter, under voltage, over voltage, phase failure."""
_BOOSTER_ACTIVE: Final = 1 << 1
_LOOKED_AT: Final = (STATUS, BOOSTER_STATUS, TEST_STATUS, MAINS_V, CHARGE_PERCENT)
UNKNOWN: Final = "–"


class Condition(Enum):
    """The value is the end of its text keys ``page.setup.battery.need.…``."""

    ANSWERS = "answers"
    NO_TEST = "no_test"
    CHARGED = "charged"
    MAINS = "mains"
    STANDS = "stands"
    NOBODY_MOVES = "nobody_moves"
    NO_RESTORE = "no_restore"


@dataclass(frozen=True, slots=True)
class Need:
    """How one condition stands; ``details`` fill its text."""

    condition: Condition
    holds_back: bool
    details: Mapping[str, Any]

    @property
    def reason(self) -> dict[str, Any]:
        """The details of an error for which it is the reason."""
        name = self.condition.value
        return {"condition": name, "reason_key": f"page.setup.battery.need.{name}.bites", **self.details}


async def look(connection: Connection, motion: MotionDesk | None, target: Target) -> list[Need]:
    """How every condition of a device's battery test stands now. What is not known holds back."""
    found = await read_numbers(connection.driver(target), target, _LOOKED_AT)
    return [
        Need(Condition.ANSWERS, any(found[one] is None for one in _LOOKED_AT), {}),
        Need(Condition.NO_TEST, bool((found[TEST_STATUS] or 0) & TestStatus.ACTIVE), {}),
        _charged(found[CHARGE_PERCENT]),
        _mains(found),
        await _stands(connection, target),
        _nobody_moves(motion),
        await _no_restore(connection, target),
    ]


def _charged(percent: int | None) -> Need:
    details = {"percent": UNKNOWN if percent is None else percent, "least": LEAST_CHARGE_PERCENT}
    return Need(Condition.CHARGED, percent is None or percent < LEAST_CHARGE_PERCENT, details)


def _mains(found: Mapping[Address, int | None]) -> Need:
    status, booster, volts = found[STATUS], found[BOOSTER_STATUS], found[MAINS_V]
    wrong = status is None or booster is None or bool(status & _MAINS_WRONG) or bool(booster & _BOOSTER_ACTIVE)
    return Need(Condition.MAINS, wrong, {"volts": UNKNOWN if volts is None else volts})


async def _stands(connection: Connection, target: Target) -> Need:
    """The motor of the same blade. Where the site names no axis there, the drive alone knows."""
    station = station_slug(target.slug)
    fastest: float | None = 0.0
    for axis in connection.targets:
        if station_slug(axis.slug) != station or not is_axis(axis) or VELOCITY not in axis.description.entries:
            continue
        raw = (await read_numbers(connection.driver(axis), axis, (VELOCITY,)))[VELOCITY]
        scaled = None if raw is None else to_scaled(axis.entry(VELOCITY), raw, axis.lookup)
        if scaled is None:
            fastest = None
            break
        fastest = max(fastest or 0.0, abs(float(scaled.number)))
    speed = UNKNOWN if fastest is None else round(fastest, 2)
    return Need(Condition.STANDS, fastest is None or fastest > STANDS_DPS, {"speed": speed})


def _nobody_moves(motion: MotionDesk | None) -> Need:
    running = None if motion is None else motion.running
    return Need(Condition.NOBODY_MOVES, running is not None, {"axis": UNKNOWN if running is None else running.slug})


async def _no_restore(connection: Connection, target: Target) -> Need:
    try:
        await target.require_no_restore(connection.driver(target))
        target.gate.claims.require_unclaimed(target.slug)
    except HubsideError:
        return Need(Condition.NO_RESTORE, True, {})
    return Need(Condition.NO_RESTORE, False, {})
