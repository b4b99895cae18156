"""Battery management of the PMM: what it measures and counts, its charger, its alarms (manual, 4.3)."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Final

from app.model.datatypes import Raw
from app.twins import supply_kernel
from app.twins.object_store import ObjectStore
from app.twins.plant_battery import charge_of
from app.twins.plant_power import PowerPlant, Stage
from app.twins.pmm_errors import PmmErrors

BATTERY_LOW = 0x3280
"""And one more for each bloc, 3281h to 3288h (table 6)."""
CHARGER_SHORT, BATTERY_SILENT = 0x2250, 0x7520
LEAST_SHARE: Final = 0.78
"""OPEN: 3280h and 328nh have no printed threshold. Of the nominal voltage, 28 V of a bloc's 36 V: a little above where
the booster begins to spare the battery, far below what a sound one shows under load."""
_LOW_S: Final = 0.5
"""For so long a voltage must be low; starting currents do not count (estimate)."""
_CHARGE_STEP_MA: Final = 2.5
_DISCHARGE_STEP_MA: Final = 400.0
"""Resolutions of 3070h (4.3.2.11)."""
_REST_S: Final = 60.0
"""OPEN when the battery has rested for its voltage to tell the charge: three of its time constants (estimate)."""
_OHM_WINDOW_S: Final = 1.0
_OHM_LEAST_MA: Final = 5000
"""OPEN how the internal resistance is found: in the first second of a discharge, before the slow part of the voltage
drop builds up, and from a current on that is large beside its resolution."""
_CUT_OFF_S: Final = 5.0
"""OPEN for how long the current must be small until charging ends; longer than the filter of 30F1h/3 rings."""
_ADAPTER_STEP_V: Final = 10.0
_CHARGER_STEP_V: Final = 1.0
"""Of 3064h against the battery (4.3.3.3)."""
_BLOC_OBJECTS: Final = 8
"""Elements of 301Fh and 3061h."""
NO_SENSOR: Final = 32767
"""OPEN what 301Fh shows for a bloc that is not connected, or tells nothing: a sensor that is not there (4.6.2.4)."""


class ChargeStage(Enum):
    """What the charger does."""

    OFF = "off"
    CURRENT = "constant current"
    VOLTAGE = "constant voltage"


class Gauge:
    """Measures current, off-load voltage, charge and internal resistance of the battery; counts what flows."""

    def __init__(self, store: ObjectStore, power: PowerPlant) -> None:
        self._store = store
        self._power = power
        self._charged_as = self._discharged_as = 0.0
        self._seen_as = (0.0, 0.0)
        self._rest_s = self._flowing_s = 0.0
        self.off_load_v = self.charge = 0.0
        self.internal_mohm = 0.0
        self.clear()

    def clear(self) -> None:
        """Begin anew, as at power-on. OPEN the resistance before the first discharge; that of a new battery."""
        power = self._power
        self._seen_as = (power.s[supply_kernel.CHARGED_AS], power.s[supply_kernel.DISCHARGED_AS])
        self._charged_as = self._discharged_as = 0.0
        self._rest_s = self._flowing_s = 0.0
        self.off_load_v = power.battery_v
        self.charge = self._charge_at_rest()
        self.internal_mohm = float(self._store.number(0x3020, 8))

    def step(self, dt_s: float) -> None:
        """Count, and look at the voltages: at rest for the charge, under load for the resistance."""
        charged_as, discharged_as = self._flowed()
        self._count(charged_as, discharged_as)
        self.charge += (charged_as - discharged_as) / (max(self._store.number(0x3020, 2), 1) * 3.6)
        self.charge = min(max(self.charge, 0.0), 1.0)
        if self.battery_ma == 0:
            self._rest_s += dt_s
            self._flowing_s = 0.0
            self.off_load_v = self._power.battery_v
            if self._rest_s >= _REST_S:
                self.charge = self._charge_at_rest()
        else:
            self._rest_s = 0.0
            if self.battery_ma >= _OHM_LEAST_MA:
                self._flowing_s += dt_s
                self._measure_resistance()

    @property
    def battery_ma(self) -> int:
        """3070h: positive discharges; coarse then, fine while charging."""
        current_ma = self._power.battery_a * 1000
        step = _DISCHARGE_STEP_MA if current_ma > 0 else _CHARGE_STEP_MA
        return round(round(current_ma / step) * step)

    @property
    def capacity_mah(self) -> int:
        """3053h."""
        return round(self.charge * self._store.number(0x3020, 2))

    @property
    def health_percent(self) -> int:
        """3081h: a new battery's resistance against the measured one."""
        return min(100, round(100 * self._store.number(0x3020, 8) / max(self.internal_mohm, 1.0)))

    def _charge_at_rest(self) -> float:
        return charge_of(self.off_load_v / max(self._store.number(0x3020, 4), 1))

    def _measure_resistance(self) -> None:
        if self._flowing_s <= _OHM_WINDOW_S:
            drop_v = self.off_load_v - self._power.battery_v
            all_mohm = drop_v / self.battery_ma * 1e6
            self.internal_mohm = max(all_mohm - self._store.number(0x3020, 7), 0.0)

    def _flowed(self) -> tuple[float, float]:
        s = self._power.s
        before, self._seen_as = self._seen_as, (s[supply_kernel.CHARGED_AS], s[supply_kernel.DISCHARGED_AS])
        return self._seen_as[0] - before[0], self._seen_as[1] - before[1]

    def _count(self, charged_as: float, discharged_as: float) -> None:
        """3050h to 3052h in mAh; fractions are kept until they make one."""
        charged, self._charged_as = divmod(self._charged_as + charged_as, 3.6)
        discharged, self._discharged_as = divmod(self._discharged_as + discharged_as, 3.6)
        for index, change in ((0x3050, charged), (0x3052, charged), (0x3051, discharged)):
            if change:
                cell = self._store.cell(index)
                span = cell.entry.type.range
                limit = span[1] if span is not None else 0
                cell.raw = min(cell.number + int(change), limit)


class Charger:
    """Charges in two stages: constant current, then constant voltage until the current is small."""

    def __init__(self, store: ObjectStore, power: PowerPlant, errors: PmmErrors, gauge: Gauge) -> None:
        self._store = store
        self._power = power
        self._errors = errors
        self._gauge = gauge
        self._small_s = 0.0
        self.stage = ChargeStage.OFF

    def clear(self) -> None:
        """Begin anew, as at power-on."""
        self._stop()

    def start(self) -> None:
        """Begin a charging cycle; the counters of the last one begin at 0."""
        if self.stage is ChargeStage.OFF and self._can_charge():
            self.stage = ChargeStage.CURRENT
            self._small_s = 0.0
            self._store.cell(0x3051).raw = 0
            self._store.cell(0x3052).raw = 0

    def step(self, dt_s: float) -> None:
        """Begin by itself where the off-load voltage is low, control the current, end."""
        self._errors.error(CHARGER_SHORT, Stage.CHARGER in self._power.shorted)
        resting = self._gauge.battery_ma == 0
        if self.stage is ChargeStage.OFF and resting and self._gauge.off_load_v < self._store.number(0x30F1, 5):
            self.start()
        if self.stage is not ChargeStage.OFF and not self._can_charge():
            self._stop()
        if self.stage is not ChargeStage.OFF:
            self._control(dt_s)

    @property
    def status(self) -> int:
        """3001h (table 12)."""
        pending = self._errors.pending
        short, silent = CHARGER_SHORT in pending, BATTERY_SILENT in pending
        active = self.stage is not ChargeStage.OFF
        stages = (self.stage is ChargeStage.CURRENT) << 2 | (self.stage is ChargeStage.VOLTAGE) << 3
        return (not short and not silent) | active << 1 | stages | short << 4 | silent << 7

    @property
    def output_v(self) -> float:
        """3064h: a volt above the battery while charging, else ten below its off-load voltage."""
        if self.stage is ChargeStage.OFF:
            return self._gauge.off_load_v - _ADAPTER_STEP_V
        return self._power.battery_v + _CHARGER_STEP_V

    @property
    def output_ma(self) -> float:
        """3074h: charge current and input current of the 24 V adapter."""
        power = self._power
        return (power.commands.charge_a + power.adapter_w / max(self.output_v, 1.0)) * 1000

    def _can_charge(self) -> bool:
        """Mains, DC link and battery voltage are there, the booster rests, nothing is wrong (4.1.1.2)."""
        power, number = self._power, self._store.number
        battery_least_v = number(0x3020, 5) / 1000 * number(0x3020, 4) / 2
        return (
            not power.commands.mains_failed
            and power.mains_present
            and not power.booster_on
            and not power.commands.booster_on
            and power.dc_link_v >= number(0x30FA, 3)
            and power.battery_v >= battery_least_v
            and Stage.CHARGER not in power.shorted
            and not power.blocs_silent
        )

    def _control(self, dt_s: float) -> None:
        """The current that brings the clamps to the charging voltage, as far as 3020h/3 allows.

        OPEN the gains of 30F1h/1 and /2 have no unit; the step is that of a controller that knows the resistances.
        """
        power, number = self._power, self._store.number
        ohm = max(number(0x3020, 7) + number(0x3020, 8), 1) / 1000
        wanted_a = -min(power.battery_a, 0.0) + (number(0x30F1, 4) - power.battery_v) / ohm
        highest_a = number(0x3020, 3) / 1000
        self.stage = ChargeStage.CURRENT if wanted_a >= highest_a else ChargeStage.VOLTAGE
        power.commands.charge_a = min(max(wanted_a, 0.0), highest_a)
        small = power.commands.charge_a * 1000 < number(0x30F1, 6)
        self._small_s = self._small_s + dt_s if small else 0.0
        if self._small_s >= _CUT_OFF_S:
            self._stop()

    def _stop(self) -> None:
        self.stage = ChargeStage.OFF
        self._power.commands.charge_a = 0.0


class BatteryAlarms:
    """3280h, 328nh and 7520h. OPEN whether they are errors; they are, for table 11 calls them a battery fault."""

    def __init__(self, store: ObjectStore, power: PowerPlant, errors: PmmErrors) -> None:
        self._store = store
        self._power = power
        self._errors = errors
        self._low_s = [0.0] * (_BLOC_OBJECTS + 1)

    def clear(self) -> None:
        """Begin anew, as at power-on."""
        self._low_s = [0.0] * (_BLOC_OBJECTS + 1)

    @property
    def pending(self) -> bool:
        """Bit 3 of 3000h (table 11)."""
        return any(BATTERY_LOW <= code <= BATTERY_LOW + _BLOC_OBJECTS for code in self._errors.pending)

    def step(self, dt_s: float) -> None:
        """Look at battery and blocs."""
        power = self._power
        bloc_v = LEAST_SHARE * self._store.number(0x3020, 5) / 1000
        blocs = connected(self._store, power)
        self._errors.error(BATTERY_SILENT, power.blocs_silent)
        self._watch(0, power.battery_v < bloc_v * self._store.number(0x3020, 4), dt_s)
        for number in range(blocs):
            self._watch(number + 1, not power.blocs_silent and power.bloc_v(number) < bloc_v, dt_s)

    def _watch(self, place: int, low: bool, dt_s: float) -> None:
        self._low_s[place] = self._low_s[place] + dt_s if low else 0.0
        self._errors.error(BATTERY_LOW + place, self._low_s[place] >= _LOW_S)


def connected(store: ObjectStore, power: PowerPlant) -> int:
    """Blocs that are there and that 3020h/4 counts."""
    return min(len(power.blocs), store.number(0x3020, 4))


def battery_tenths(store: ObjectStore, power: PowerPlant) -> int:
    """3010h: the coldest bloc where that is below 10 degrees, else the warmest; in 0.1 degrees."""
    temperatures = [bloc.temperature_c for bloc in power.blocs[: connected(store, power)]]
    if power.blocs_silent or not temperatures:
        return NO_SENSOR
    coldest = min(temperatures)
    return round((coldest if coldest < 10.0 else max(temperatures)) * 10)


def bind_blocs(store: ObjectStore, power: PowerPlant) -> None:
    """301Fh and 3061h hold as many values as blocs are connected. OPEN the others; no sensor, and 0 mV."""

    def known(place: int) -> bool:
        return place < connected(store, power) and not power.blocs_silent

    def temperature(place: int) -> Callable[[], Raw]:
        return lambda: round(power.blocs[place].temperature_c * 10) if known(place) else NO_SENSOR

    def voltage(place: int) -> Callable[[], Raw]:
        return lambda: round(power.bloc_v(place) * 1000) if known(place) else 0

    for place in range(_BLOC_OBJECTS):
        store.cell(0x301F, place + 1).source = temperature(place)
        store.cell(0x3061, place + 1).source = voltage(place)


def battery_sources(gauge: Gauge, charger: Charger, power: PowerPlant) -> dict[int, Callable[[], Raw]]:
    """Live objects of battery and charger by index."""
    return {
        0x3001: lambda: charger.status,
        0x3053: lambda: gauge.capacity_mah,
        0x3060: lambda: round(power.battery_v),
        0x3064: lambda: round(charger.output_v),
        0x3067: lambda: round(gauge.off_load_v),
        0x3070: lambda: gauge.battery_ma,
        0x3074: lambda: round(charger.output_ma),
        0x3080: lambda: round(gauge.charge * 100),
        0x3081: lambda: gauge.health_percent,
        0x30B4: lambda: round(gauge.internal_mohm),
    }
