"""Temperature supervisors and controllers of the PMM (manual, 4.6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.model.datatypes import Raw
from app.twins.object_store import ObjectStore
from app.twins.plant_power import PowerPlant
from app.twins.plant_thermal import Climate
from app.twins.pmm_battery import NO_SENSOR, battery_tenths
from app.twins.pmm_errors import PmmErrors

SENSOR_SHORT: Final = -32768
SENSOR_OPEN: Final = 32767
_MOTOR_FAN: Final = 0x3204


class SensorState(Enum):
    """What a sensor input sees."""

    FITTED = "fitted"
    SHORT_CIRCUIT = "short circuit"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True)
class Place:
    """A measuring place: its supervisor, its controller (None: it has none) and its codes."""

    supervisor: int
    controller: int | None
    high_code: int
    low_code: int


PLACES: Final = (
    Place(0x3110, 0x3201, 0x4410, 0x4420),
    Place(0x3111, None, 0x4210, 0x4220),
    Place(0x3112, 0x3202, 0x4110, 0x4120),
    Place(0x3113, 0x3203, 0x4111, 0x4121),
)
"""Battery, heat sink, sensor 1, sensor 2, in the order of 3006h to 3009h."""


class TemperatureWatch:
    """Supervises one place and drives its heater, cooler and fan."""

    def __init__(self, store: ObjectStore, errors: PmmErrors, place: Place) -> None:
        self._store = store
        self._errors = errors
        self._place = place
        self._heater = self._cooler = self._fan = False
        self._fan_off_s = 0.0
        self.status = 0
        self.outputs = 0

    def clear(self) -> None:
        """Begin anew, as at power-on."""
        self._heater = self._cooler = self._fan = False
        self._fan_off_s = 0.0
        self.status = self.outputs = 0

    def step(self, tenths_c: int, sensor: SensorState, dt_s: float) -> None:
        """Look at a temperature in 0.1 degrees. A sensor that does not measure raises no error (4.6.2.4)."""
        if sensor is not SensorState.FITTED:
            self._supervise(None)
            self._heater = self._cooler = False
            self.status |= 1 << (6 if sensor is SensorState.SHORT_CIRCUIT else 7)
        else:
            self._supervise(tenths_c)
            self._control(tenths_c)
        self._run_fan(dt_s)
        self._show_outputs()

    def _limit(self, sub: int) -> int:
        return self._store.number(self._place.supervisor, sub)

    def _supervise(self, tenths_c: int | None) -> None:
        """Table 32; "reached" is from the limit on, "undercut" below it.

        OPEN whether supervisors have a hysteresis; none is printed, none is taken.
        """
        low = tenths_c is not None and tenths_c < self._limit(3)
        warning = tenths_c is not None and tenths_c >= self._limit(1)
        error = tenths_c is not None and tenths_c >= self._limit(2)
        self._errors.warning(self._place.low_code, low)
        self._errors.warning(self._place.high_code, warning and not error)
        self._errors.error(self._place.high_code, error)
        self.status = low << 0 | warning << 4 | error << 5

    def _control(self, tenths_c: int) -> None:
        controller = self._place.controller
        if controller is None:
            return
        heat, cool, hysteresis = (self._store.number(controller, sub) for sub in (1, 2, 3))
        self._heater = tenths_c < heat or (self._heater and tenths_c < heat + hysteresis)
        self._cooler = tenths_c > cool or (self._cooler and tenths_c > cool - hysteresis)

    def _run_fan(self, dt_s: float) -> None:
        controller = self._place.controller
        if controller is None:
            return
        if self._heater or self._cooler:
            self._fan = True
            self._fan_off_s = self._store.number(controller, 7)
        elif self._fan:
            self._fan_off_s -= dt_s
            self._fan = self._fan_off_s > 0

    def _show_outputs(self) -> None:
        controller = self._place.controller
        if controller is None:
            return
        self.status |= self._fan << 1 | self._heater << 2 | self._cooler << 3
        self.outputs = 0
        for on, sub in ((self._heater, 4), (self._cooler, 5), (self._fan, 6)):
            if on:
                self.outputs |= self._store.number(controller, sub)

    def drive(self, climate: Climate, outputs: int) -> None:
        """Switch what hangs on the outputs that 320xh names, whoever set them (30FEh/3)."""
        controller = self._place.controller
        if controller is not None:
            climate.heater, climate.cooler, climate.fan = (
                bool(outputs & self._store.number(controller, sub)) for sub in (4, 5, 6)
            )


class MotorFan:
    """3204h: on above a motor temperature, off once it has dropped by the hysteresis. Without a mask it is inactive."""

    def __init__(self, store: ObjectStore) -> None:
        self._store = store
        self._on = False

    def clear(self) -> None:
        """Begin anew, as at power-on."""
        self._on = False

    def step(self, motor_tenths_c: int | None) -> None:
        """Look at what the PMC says. OPEN what happens while it says nothing (None); the fan stays as it is."""
        if motor_tenths_c is not None:
            limit, hysteresis = self._store.number(_MOTOR_FAN, 1), self._store.number(_MOTOR_FAN, 2)
            self._on = motor_tenths_c > limit or (self._on and motor_tenths_c > limit - hysteresis)

    @property
    def mask(self) -> int:
        """Outputs of the fan; 0: the function is not used."""
        return self._store.number(_MOTOR_FAN, 3)

    @property
    def outputs(self) -> int:
        """Outputs that it sets."""
        return self.mask if self._on else 0


class PmmTemperatures:
    """All measuring places, their controllers, and the motor fan.

    ``sensors`` is the state of the two external sensors; ``motor_tenths_c`` what the PMC says of its motor.
    """

    def __init__(
        self,
        store: ObjectStore,
        power: PowerPlant,
        errors: PmmErrors,
        sensors: Sequence[SensorState],
        motor_tenths_c: Callable[[], int | None],
    ) -> None:
        self._store = store
        self._power = power
        self._sensors = sensors
        self._motor_tenths_c = motor_tenths_c
        self._watches = tuple(TemperatureWatch(store, errors, place) for place in PLACES)
        self._motor_fan = MotorFan(store)

    def clear(self) -> None:
        """Begin anew, as at power-on."""
        for watch in self._watches:
            watch.clear()
        self._motor_fan.clear()
        self.drive(0)

    def step(self, dt_s: float) -> None:
        """Look at all places."""
        for place, watch in enumerate(self._watches):
            watch.step(self._tenths(place), self._state(place), dt_s)
        self._motor_fan.step(self._motor_tenths_c())

    @property
    def outputs(self) -> int:
        """Outputs that the controllers set."""
        outputs = self._motor_fan.outputs
        for watch in self._watches:
            outputs |= watch.outputs
        return outputs

    def drive(self, outputs: int) -> None:
        """Heaters, coolers and fans follow the outputs as they are, 30FEh/3."""
        thermal = self._power.thermal
        battery, _, first, second = self._watches
        battery.drive(thermal.battery_climate, outputs)
        first.drive(thermal.place_climates[0], outputs)
        second.drive(thermal.place_climates[1], outputs)
        thermal.motor_fan = bool(outputs & self._motor_fan.mask)

    def sources(self) -> dict[int, Callable[[], Raw]]:
        """Live objects by index."""

        def status(place: int) -> Callable[[], Raw]:
            return lambda: self._watches[place].status

        def tenths(place: int) -> Callable[[], Raw]:
            return lambda: self._tenths(place)

        sources = {0x3006 + place: status(place) for place in range(4)}
        return sources | {0x3010 + place: tenths(place) for place in range(4)}

    def _tenths(self, place: int) -> int:
        if place == 0:
            return battery_tenths(self._store, self._power)
        if place == 1:
            return round(self._power.heat_sink_c * 10)
        state = self._sensors[place - 2]
        if state is SensorState.SHORT_CIRCUIT:
            return SENSOR_SHORT
        if state is SensorState.INTERRUPTED:
            return SENSOR_OPEN
        return round(self._power.sensor_c(place - 2) * 10)

    def _state(self, place: int) -> SensorState:
        if place == 0:
            unknown = battery_tenths(self._store, self._power) == NO_SENSOR
            return SensorState.INTERRUPTED if unknown else SensorState.FITTED
        return SensorState.FITTED if place == 1 else self._sensors[place - 2]
