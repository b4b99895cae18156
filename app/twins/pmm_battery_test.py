"""The PMM's battery test: booster and chopper load the battery (manual, 4.1.1.6 and 4.3.2.15)."""

from __future__ import annotations

from enum import Enum
from typing import Final

from app.twins.object_store import ObjectStore
from app.twins.plant_power import PowerPlant
from app.twins.pmm_battery import Gauge, connected

_TEST_S: Final = 10.0
"""OPEN how long the test loads the battery; so long as the booster started by hand runs (table 17)."""
_LEAST_SHARE: Final = 0.94
"""OPEN: the least voltage of the test is not printed. Of the nominal voltage, for battery and each bloc: 33.8 V,
what a bloc shows without load at a tenth of its charge. A sound one, charged, stays 4 V above it under this load."""
_LEAST_CHARGE: Final = 0.9
"""OPEN from where on batteries count as charged: a charged one has 90 % yet when it is recharged (30F1h/5)."""


class TestState(Enum):
    """Where the battery test stands."""

    __test__ = False

    NONE = "none"
    ARMED = "armed"
    ACTIVE = "active"
    PASSED = "passed"
    FAILED = "failed"
    IMPOSSIBLE = "impossible"


_BITS: Final = {
    TestState.NONE: 0,
    TestState.ARMED: 1 << 2,
    TestState.ACTIVE: 1 << 3,
    TestState.PASSED: 1 << 0 | 1 << 1,
    TestState.FAILED: 1 << 1 | 1 << 4,
    TestState.IMPOSSIBLE: 1 << 5,
}


class BatteryTest:
    """Loads the battery and looks at its lowest voltage, and at that of each bloc."""

    def __init__(self, store: ObjectStore, power: PowerPlant, gauge: Gauge) -> None:
        self._store = store
        self._power = power
        self._gauge = gauge
        self._left_s = self._since_s = 0.0
        self._due = False
        self.state = TestState.NONE

    @property
    def status(self) -> int:
        """3005h (table 16)."""
        return _BITS[self.state]

    @property
    def loads(self) -> bool:
        """Booster and chopper have to load the battery."""
        return self.state is TestState.ACTIVE

    def clear(self) -> None:
        """Begin anew, as at power-on. The time of 30E3h runs from here: with 0, the default, no test comes."""
        self.state = TestState.NONE
        self._since_s = 0.0
        self._due = False

    def arm(self) -> None:
        """Controlword bit 1 rose."""
        if self.state is not TestState.ACTIVE:
            self.state = TestState.ARMED

    def release(self, axis_moves: bool) -> None:
        """Controlword bit 1 fell: an armed test begins, or is impossible, and then is not made up for."""
        if self.state is TestState.ARMED:
            self._begin(axis_moves)

    def step(self, dt_s: float, axis_moves: bool) -> None:
        """Go on with a test, or begin one by the cycle of 30E3h (minutes; 0: never).

        OPEN whether 1 to 59 minutes are refused or raised to 60; they are refused, by the limits of the object, so that
        nobody is mistaken about what was set.

        One that is due and not possible waits, with bit 5, until the battery is charged and the motor rests.
        """
        self._since_s += dt_s
        cycle_min = self._store.number(0x30E3)
        if self.state is TestState.ACTIVE:
            self._go_on(dt_s, axis_moves)
        elif cycle_min and (self._due or self._since_s >= cycle_min * 60):
            self._since_s = 0.0 if not self._due else self._since_s
            self._due = True
            self._begin(axis_moves)
        else:
            self._due = False

    def _possible(self, axis_moves: bool) -> bool:
        """Charged, at rest; with a sound mains, for nothing may be taken from a battery that is needed."""
        power = self._power
        charged = self._gauge.charge >= _LEAST_CHARGE
        return charged and not axis_moves and not power.commands.mains_failed and power.mains_present

    def _begin(self, axis_moves: bool) -> None:
        if not self._possible(axis_moves):
            self.state = TestState.IMPOSSIBLE
            return
        self.state = TestState.ACTIVE
        self._due = False
        self._left_s = _TEST_S
        self._since_s = 0.0
        self._power.reset_lowest()
        self._store.cell(0x3068).raw = round(self._power.battery_v)

    def _go_on(self, dt_s: float, axis_moves: bool) -> None:
        """OPEN what a mains failure or a move does to a running test; it is broken off, the battery is needed."""
        power = self._power
        self._store.cell(0x3068).raw = round(power.lowest_battery_v)
        self._left_s -= dt_s
        if power.commands.mains_failed or axis_moves:
            self.state = TestState.IMPOSSIBLE
        elif self._too_low():
            self.state = TestState.FAILED
        elif self._left_s <= 0:
            self.state = TestState.PASSED

    def _too_low(self) -> bool:
        power = self._power
        bloc_v = _LEAST_SHARE * self._store.number(0x3020, 5) / 1000
        blocs = connected(self._store, power)
        if power.lowest_battery_v < bloc_v * self._store.number(0x3020, 4):
            return True
        return any(power.bloc_v(number) < bloc_v for number in range(blocs))
