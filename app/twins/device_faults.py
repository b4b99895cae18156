"""Faults of drives and what surrounds them: which value of a plant or device a fault holds, and at what.

Several faults may hold one value: the last one counts, and when it ends, the one before it. When the last one has
ended, the value is what it was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

from app.model.fault import FaultOrder
from app.twins.canopen_device import CanopenDevice
from app.twins.plant import BrakeFault, EncoderFault
from app.twins.pmm_temperature import SensorState
from app.twins.turbine import Blade

_MS: Final = 1_000_000
Hold = tuple[Any, str | int, Any]
"""An object with the name of its attribute, or a list with a place; and the value."""


class Holds:
    """Which fault holds which value."""

    def __init__(self) -> None:
        self._stacks: dict[tuple[int, str | int], _Stack] = {}

    def take(self, owner: int, holds: Iterable[Hold]) -> None:
        """Give values that fault ``owner`` holds from now on."""
        for target, place, value in holds:
            key = id(target), place
            stack = self._stacks.get(key)
            if stack is None:
                stack = self._stacks[key] = _Stack(target, place)
            stack.claims.append((owner, value))
            stack.apply()

    def release(self, owner: int) -> None:
        """Let go of all values that fault ``owner`` holds."""
        for key, stack in list(self._stacks.items()):
            kept = [claim for claim in stack.claims if claim[0] != owner]
            if len(kept) != len(stack.claims):
                stack.claims = kept
                stack.apply()
            if not kept:
                del self._stacks[key]


class _Stack:
    """All that hold one value, and what it was before."""

    def __init__(self, target: Any, place: str | int) -> None:
        self._target = target
        self._place = place
        self._before = target[place] if isinstance(place, int) else getattr(target, place)
        self.claims: list[tuple[int, Any]] = []

    def apply(self) -> None:
        """Give the value of the last that holds it."""
        value = self.claims[-1][1] if self.claims else self._before
        if isinstance(self._place, int):
            self._target[self._place] = value
        else:
            setattr(self._target, self._place, value)


def holds_of_blade(order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    """What an order of a device fault holds at one blade."""
    return _OF_BLADE[order.kind](order, blade)


def holds_of_device(order: FaultOrder, device: CanopenDevice) -> Iterator[Hold]:
    """What an order holds at one device."""
    return _OF_DEVICE[order.kind](order, device)


def _mains_failure(order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    share = order.values["remaining_percent"] / 100.0
    if share:
        yield blade.power, "mains_factor", share
    else:
        yield blade.power, "mains_present", False


def _phase_loss(order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    yield blade.power.phases, int(order.values["phase"]) - 1, 0.0


def _bloc_weak(order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    number = int(order.values["bloc"])
    for bloc in blade.power.blocs if number == 0 else blade.power.blocs[number - 1 : number]:
        yield bloc, "capacity_share", order.values["capacity_percent"] / 100.0
        yield bloc, "ohm_factor", order.values["ohm_factor"]


def _sensor(state: SensorState) -> Callable[[FaultOrder, Blade], Iterator[Hold]]:
    def holds(order: FaultOrder, blade: Blade) -> Iterator[Hold]:
        yield blade.pmm.inputs.sensors, int(order.values["sensor"]) - 1, state

    return holds


def _encoder(fault: EncoderFault) -> Callable[[FaultOrder, Blade], Iterator[Hold]]:
    def holds(_order: FaultOrder, blade: Blade) -> Iterator[Hold]:
        yield blade.axis, "encoder_fault", fault

    return holds


def _slip(order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    yield blade.axis, "blade_encoder_slip_deg", order.values["slip_deg"]


def _blade_encoder(_order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    yield blade.axis, "blade_encoder_failed", True


def _brake(order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    yield blade.axis, "brake_stuck", BrakeFault.LIFTED if order.values["lifted"] else BrakeFault.ENGAGED


def _probe(_order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    """No fault of the drive: the mark is under the sensor as long as this lasts."""
    yield blade.pmc.inputs, "probe", True


def _overload(order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    yield blade.axis, "extra_load_nm", order.values["moment_nm"]


def _heat(order: FaultOrder, blade: Blade) -> Iterator[Hold]:
    for place in ("heat_sink_w", "motor_w", "battery_w"):
        if order.values[place]:
            yield blade.power, f"extra_{place}", order.values[place]


def _eeprom_slow(order: FaultOrder, device: CanopenDevice) -> Iterator[Hold]:
    yield device.memory, "slow_ns", round(order.values["save_ms"] * _MS)


def _eeprom_failing(_order: FaultOrder, device: CanopenDevice) -> Iterator[Hold]:
    yield device.memory, "failing", True


def _late_sdo_ack(order: FaultOrder, device: CanopenDevice) -> Iterator[Hold]:
    yield device, "answer_delay_ns", round(order.values["delay_ms"] * _MS)


_OF_BLADE: Final = {
    "mains_failure": _mains_failure,
    "phase_loss": _phase_loss,
    "bloc_weak": _bloc_weak,
    "sensor_short": _sensor(SensorState.SHORT_CIRCUIT),
    "sensor_open": _sensor(SensorState.INTERRUPTED),
    "encoder_sine_cosine": _encoder(EncoderFault.SINE_COSINE),
    "encoder_data": _encoder(EncoderFault.DATA_CHANNEL),
    "blade_encoder_slip": _slip,
    "blade_encoder_failed": _blade_encoder,
    "brake_stuck": _brake,
    "touch_probe": _probe,
    "overload": _overload,
    "over_temperature": _heat,
}
_OF_DEVICE: Final = {
    "eeprom_slow": _eeprom_slow,
    "eeprom_failing": _eeprom_failing,
    "late_sdo_ack": _late_sdo_ack,
}
OF_BLADE: Final = frozenset(_OF_BLADE)
"""Kinds that hold values of a blade."""
OF_DEVICE: Final = frozenset(_OF_DEVICE)
"""Kinds that hold values of a device."""
