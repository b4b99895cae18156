"""Battery management of the PMM: charger, charge counters, battery test (manual, 4.3 and 4.1.1.6)."""

from __future__ import annotations

from enum import Enum
from typing import Final

from app.twins.object_store import ObjectStore
from app.twins.plant_power import PowerPlant

_TEST_S: Final = 10.0
"""How long the test loads the battery; not printed, that of the manual booster start is taken."""
_TEST_LEAST_V_PER_BLOC: Final = 30.0
"""Below it the test has failed; not printed (5/6 of the nominal bloc voltage)."""
_TEST_LEAST_CHARGE: Final = 0.9
"""From here on the batteries count as charged; not printed."""
_CHARGE_STEP_MA: Final = 2.5
_DISCHARGE_STEP_MA: Final = 400.0
"""Resolutions of 3070h (4.3.2.11)."""
_ADAPTER_EFFICIENCY: Final = 0.85
"""Of the 24 V mains adapter (estimate)."""


class ChargeStage(Enum):
    """What the charger does."""

    OFF = "off"
    CURRENT = "constant current"
    VOLTAGE = "constant voltage"


class TestState(Enum):
    """Where the battery test stands."""

    __test__ = False

    NONE = "none"
    ARMED = "armed"
    ACTIVE = "active"
    PASSED = "passed"
    FAILED = "failed"
    IMPOSSIBLE = "impossible"


_TEST_BITS: Final = {
    TestState.NONE: 0,
    TestState.ARMED: 1 << 2,
    TestState.ACTIVE: 1 << 3,
    TestState.PASSED: 1 << 0 | 1 << 1,
    TestState.FAILED: 1 << 1 | 1 << 4,
    TestState.IMPOSSIBLE: 1 << 5,
}


class Charger:
    """Charges in two stages and counts what flows."""

    def __init__(self, store: ObjectStore, power: PowerPlant) -> None:
        self._store = store
        self._power = power
        self.stage = ChargeStage.OFF
        self.off_load_v = power.open_circuit_v
        self._charged_mas = self._discharged_mas = 0.0

    def clear(self) -> None:
        """Begin anew, as at power-on."""
        self.stage = ChargeStage.OFF
        self._power.commands.charge_a = 0.0
        self._charged_mas = self._discharged_mas = 0.0

    def start(self) -> None:
        """Begin a charging cycle; the counters of the last one begin at 0."""
        if self.stage is ChargeStage.OFF and self._can_charge():
            self.stage = ChargeStage.CURRENT
            self._store.cell(0x3051).raw = 0
            self._store.cell(0x3052).raw = 0

    def step(self, dt_s: float) -> None:
        """Decide on the charge current and count the charge."""
        power = self._power
        if self.stage is ChargeStage.OFF and power.open_circuit_v < self._store.number(0x30F1, 5):
            self.start()
        if self.stage is not ChargeStage.OFF and not self._can_charge():
            self.stage = ChargeStage.OFF
        power.commands.charge_a = self._current_a()
        if power.battery_a == 0.0 and power.commands.charge_a == 0.0:
            self.off_load_v = power.open_circuit_v
        self._count(dt_s)

    @property
    def status(self) -> int:
        """3001h (table 12)."""
        active = self.stage is not ChargeStage.OFF
        stages = (self.stage is ChargeStage.CURRENT) << 2 | (self.stage is ChargeStage.VOLTAGE) << 3
        return 1 | active << 1 | stages

    @property
    def output_v(self) -> float:
        """3064h: a volt above the battery while charging, else ten below its off-load voltage."""
        if self.stage is ChargeStage.OFF:
            return self.off_load_v - 10
        return self._power.battery_v + 1

    @property
    def output_ma(self) -> float:
        """3074h: charge current and input current of the 24 V adapter."""
        power = self._power
        adapter_a = power.supply_v * power.supply_a / max(self.output_v, 1.0) / _ADAPTER_EFFICIENCY
        return (power.commands.charge_a + adapter_a) * 1000

    @property
    def battery_ma(self) -> int:
        """3070h: positive discharges; coarse then, fine while charging."""
        current_ma = self._power.battery_a * 1000
        step = _DISCHARGE_STEP_MA if current_ma > 0 else _CHARGE_STEP_MA
        return round(round(current_ma / step) * step)

    def _can_charge(self) -> bool:
        """Mains, DC link and battery voltage are there, the booster rests (4.1.1.2)."""
        power = self._power
        return (
            power.mains_present
            and power.commands.booster_target_v is None
            and power.dc_link_v >= self._store.number(0x30FA, 3)
            and power.open_circuit_v > 0
        )

    def _current_a(self) -> float:
        if self.stage is ChargeStage.OFF:
            return 0.0
        power = self._power
        resistance = power.battery_ohm + power.constants.lead_ohm
        by_voltage_a = (self._store.number(0x30F1, 4) - power.open_circuit_v) / resistance
        highest_a = self._store.number(0x3020, 3) / 1000
        if by_voltage_a >= highest_a:
            self.stage = ChargeStage.CURRENT
            return highest_a
        self.stage = ChargeStage.VOLTAGE
        if by_voltage_a * 1000 < self._store.number(0x30F1, 6):
            self.stage = ChargeStage.OFF
            return 0.0
        return by_voltage_a

    def _count(self, dt_s: float) -> None:
        """3050h to 3052h in mAh; fractions are kept until they make one."""
        current_ma = self._power.battery_a * 1000
        if current_ma < 0:
            self._charged_mas -= current_ma * dt_s
        else:
            self._discharged_mas += current_ma * dt_s
        charged, self._charged_mas = divmod(self._charged_mas, 3600)
        discharged, self._discharged_mas = divmod(self._discharged_mas, 3600)
        for index, change in ((0x3050, charged), (0x3052, charged), (0x3051, discharged)):
            if change:
                cell = self._store.cell(index)
                span = cell.entry.type.range
                limit = span[1] if span is not None else 0
                cell.raw = min(cell.number + int(change), limit)


class BatteryTest:
    """Loads the battery through booster and chopper and looks at its lowest voltage."""

    def __init__(self, store: ObjectStore, power: PowerPlant) -> None:
        self._store = store
        self._power = power
        self._left_s = 0.0
        self._since_s = 0.0
        self.state = TestState.NONE

    @property
    def status(self) -> int:
        """3005h (table 16)."""
        return _TEST_BITS[self.state]

    @property
    def loads(self) -> bool:
        """Booster and chopper have to load the battery."""
        return self.state is TestState.ACTIVE

    def clear(self) -> None:
        """Begin anew, as at power-on."""
        self.state = TestState.NONE
        self._since_s = 0.0

    def arm(self) -> None:
        """Controlword bit 1 rose."""
        if self.state is not TestState.ACTIVE:
            self.state = TestState.ARMED

    def release(self, axis_moves: bool) -> None:
        """Controlword bit 1 fell: an armed test begins."""
        if self.state is TestState.ARMED:
            self.begin(axis_moves)

    def begin(self, axis_moves: bool) -> None:
        """Begin a test if it is possible: batteries charged, mains there, motor at rest."""
        if axis_moves or self._power.charge < _TEST_LEAST_CHARGE or not self._power.mains_present:
            self.state = TestState.IMPOSSIBLE
            return
        self.state = TestState.ACTIVE
        self._left_s = _TEST_S
        self._since_s = 0.0
        self._store.cell(0x3068).raw = round(self._power.battery_v)

    def step(self, dt_s: float, axis_moves: bool) -> None:
        """Go on with a test, or begin one by the cycle of 30E3h (minutes; 0: never)."""
        self._since_s += dt_s
        cycle_min = self._store.number(0x30E3)
        if self.state is not TestState.ACTIVE:
            if cycle_min and self._since_s >= cycle_min * 60:
                self._since_s = 0.0
                self.begin(axis_moves)
            return
        lowest = self._store.cell(0x3068)
        lowest.raw = min(lowest.number, round(self._power.battery_v))
        self._left_s -= dt_s
        if not self._power.mains_present or axis_moves:
            self.state = TestState.IMPOSSIBLE
        elif self._left_s <= 0:
            least_v = _TEST_LEAST_V_PER_BLOC * self._store.number(0x3020, 4)
            self.state = TestState.PASSED if lowest.number >= least_v else TestState.FAILED
