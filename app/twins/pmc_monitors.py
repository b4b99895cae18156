"""What the PMC watches of its axis and raises errors for: voltages, speed, current, temperatures, encoders, parameters.

The following error is watched where it arises, in the cycles of the axis; limit switches are in ``pmc_inputs``.
"""

from __future__ import annotations

from math import pi
from typing import Final

from app.twins.axis_drive import AxisDrive, Feedback
from app.twins.axis_errors import AxisErrors
from app.twins.canopen_device import MS, SECOND
from app.twins.object_store import ObjectStore
from app.twins.plant import AxisPlant, EncoderFault
from app.twins.plant_power import PowerPlant

POWER_STAGE: Final = 0x0011
"""6510h/1 of a fitted output stage: invented, the manual prints none. 0: it does not identify itself (6380h)."""
SIMULATED_ENCODER: Final = 0xFF
"""5894h: the blade encoder's position is copied from the motor encoder."""
_TEMPERATURE_ALERT_NS: Final = 30 * SECOND
"""Table 48: the motor is turned off 30 s after the alert."""
_OVERSPEED_SHARE: Final = 1.2
"""OPEN the threshold of 8400h; 20 % above 6080h, for a controlled axis stays below."""
_OVERLOAD_NS: Final = 10 * SECOND
"""OPEN when the current at the output is too high (2310h). The controller never lets it pass 6073h; so the error means
that the axis took all that it may have for long, or more, for 10 s on end: twice as long as peak current lasts by
default (60F6h/3)."""
_NOMINAL_PERMILLE: Final = 1000
_LIMIT_PERMILLE: Final = 5
"""So near to a limit the current counts as limited."""
_NEEDED: Final = ((0x6076, 0), (0x6410, 1), (0x6410, 3), (0x6410, 4), (0x6410, 6))
"""Rated current, pole pairs, nominal voltage, speed and frequency: without one of them no motor can be driven."""
JUDGED: Final = frozenset((*_NEEDED, (0x607D, 1), (0x607D, 2)))
"""Parameters whose writing may make them implausible (6320h)."""


def motor_rpm(plant: AxisPlant) -> float:
    """Speed of the motor in revolutions per minute."""
    return plant.speed_rad_s * 60 / (2 * pi)


class Monitors:
    """Watches one axis. ``power_stage`` is the code with which the output stage identifies itself."""

    def __init__(
        self, store: ObjectStore, plant: AxisPlant, power: PowerPlant, drive: AxisDrive, errors: AxisErrors
    ) -> None:
        self.power_stage = POWER_STAGE
        self._store = store
        self._plant = plant
        self._power = power
        self._drive = drive
        self._errors = errors
        self._plausible = True
        self._differs_since_ns = 0
        self._limited_since_ns = 0
        self._hot_since_ns: dict[int, int] = {}

    def restart(self, t_ns: int) -> None:
        """Begin anew."""
        self._differs_since_ns = self._limited_since_ns = t_ns
        self._hot_since_ns.clear()
        self.judge()

    def look(self, t_ns: int) -> None:
        """Look at everything."""
        store, power, errors = self._store, self._power, self._errors
        errors.condition(0x3220, power.dc_link_v < store.number(0x6510, 4))
        errors.condition(0x3210, power.dc_link_v > store.number(0x6510, 5))
        errors.condition(0x8400, abs(motor_rpm(self._plant)) > store.number(0x6080) * _OVERSPEED_SHARE)
        errors.condition(0x6320, not self._plausible)
        errors.condition(0x6380, self.power_stage == 0)
        self._watch_encoders()
        self._watch_difference(t_ns)
        self._watch_current(t_ns)
        self._watch_temperature(0x4210, power.heat_sink_c, store.number(0x6510, 6), store.number(0x6510, 2), t_ns)
        self._watch_temperature(0x4310, power.motor_c, store.number(0x6410, 8), store.number(0x6410, 7), t_ns)

    def judge(self) -> None:
        """See whether the parameters make sense.

        OPEN which ones the drive judges (6320h). Those with which no axis can be driven: position limits that leave no
        room, and motor data that are 0.
        """
        number = self._store.number
        ordered = number(0x607D, 1) <= number(0x607D, 2)
        self._plausible = ordered and all(number(index, sub) for index, sub in _NEEDED)

    # -- encoders -------------------------------------------------------------------------

    @property
    def motor_encoder_failed(self) -> bool:
        """Its position cannot be relied on. Without the data channel the count goes on, but its zero is unknown."""
        return self._plant.encoder_fault is not EncoderFault.NONE

    @property
    def blade_encoder_lost(self) -> bool:
        """There is no position of its own from the additional encoder: it failed, or is copied (5894h = FFh)."""
        return self._plant.blade_encoder_failed or self._store.number(0x5894) == SIMULATED_ENCODER

    @property
    def feedback(self) -> Feedback:
        """With what the axis can still be controlled."""
        if not self.motor_encoder_failed:
            return Feedback.MOTOR_ENCODER
        return Feedback.NONE if self.blade_encoder_lost else Feedback.BLADE_ENCODER

    def _watch_encoders(self) -> None:
        """7305h, 7320h, 7321h (table 6). OPEN what the general error 7300h is; no encoder is left, it is taken."""
        fault, errors = self._plant.encoder_fault, self._errors
        blade = self._plant.blade_encoder_failed and self._store.number(0x5894) != SIMULATED_ENCODER
        errors.condition(0x7305, fault is EncoderFault.SINE_COSINE)
        errors.condition(0x7320, fault is EncoderFault.DATA_CHANNEL)
        errors.condition(0x7321, blade)
        errors.condition(0x7300, self.motor_encoder_failed and blade)

    def _watch_difference(self, t_ns: int) -> None:
        """8620h: the encoders differ by more than 6865h for longer than 6866h ms.

        OPEN what a window of 0 (its default) means; no monitoring, for literally every twin would fail at once.
        """
        window = self._store.number(0x6865)
        difference = abs(self._drive.motor_position - self._drive.blade_position)
        if not window or difference <= window:
            self._differs_since_ns = t_ns
        self._errors.condition(0x8620, t_ns - self._differs_since_ns > self._store.number(0x6866) * MS)

    # -- current and heat -----------------------------------------------------------------

    def _watch_current(self, t_ns: int) -> None:
        """2310h."""
        limit = min(self._store.number(0x6073), _NOMINAL_PERMILLE) - _LIMIT_PERMILLE
        if not self._drive.energised or limit <= 0 or self._drive.current_permille < limit:
            self._limited_since_ns = t_ns
        elif t_ns - self._limited_since_ns >= _OVERLOAD_NS:
            self._limited_since_ns = t_ns
            self._errors.event(0x2310)

    def _watch_temperature(self, code: int, temperature_c: float, warning: int, highest: int, t_ns: int) -> None:
        """Warning at its level; error 30 s after the maximum. OPEN from where the 30 s count.

        From the maximum: from the warning level, a warm day would end in a motor that cannot drive to feather.
        """
        tenths = temperature_c * 10
        self._errors.warning(code, tenths >= warning)
        if tenths < highest:
            self._hot_since_ns.pop(code, None)
            self._errors.condition(code, False)
        elif t_ns - self._hot_since_ns.setdefault(code, t_ns) >= _TEMPERATURE_ALERT_NS:
            self._errors.condition(code, True)
