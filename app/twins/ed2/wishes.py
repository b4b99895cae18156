"""What process data ask of the axes: modes, control word, setpoint and ramps, from the bus or from local inputs."""

from __future__ import annotations

from typing import Final

from app.twins.ed2.channel import Channel
from app.twins.ed2.commands import CONTROL_MODE_AT, DEVICE_MODE_AT
from app.twins.ed2.kernel import Kernel, Wish
from app.twins.ed2.motion import Order
from app.twins.ed2.params import ControlMode, DeviceMode, Params, setpoint_mm
from app.twins.ed2.states import Control
from app.wire.profibus.telegrams import (
    CONTROL_MODE_SET,
    CONTROL_WORD,
    DEVICE_MODE_SET,
    RAMP_ACCELERATION,
    RAMP_DECELERATION,
    RAMP_VELOCITY,
    SETPOINT,
    Signal,
)

_RUN: Final = Control.DISABLE | Control.HOLD | Control.ACTIVE
_COURSE: Final = Control.START | Control.POSITIVE | Control.NEGATIVE
"""Bits that a mode makes something of."""
_PROFILE: Final = 10
"""12/221: the local setpoint is a profile, which only the maker's tool can give."""
_BIPOLAR: Final = (8, 9)
"""12/220: signals with a sign."""
_SETPOINT_AT: Final = (12, 21)
_Taken = tuple[tuple[Signal, tuple[int, int]], ...]
"""Signals and the parameters that they overwrite."""
_MODES: Final[_Taken] = (
    # The mode of operation first: the mode of the device may follow from it.
    (CONTROL_MODE_SET, CONTROL_MODE_AT),
    (DEVICE_MODE_SET, DEVICE_MODE_AT),
)
_VALUES: Final[_Taken] = (
    (SETPOINT, _SETPOINT_AT),
    (RAMP_VELOCITY, (12, 61)),
    (RAMP_ACCELERATION, (12, 64)),
)


class Wishes:
    """Both axes."""

    def __init__(self, channels: tuple[Channel, Channel], kernel: Kernel) -> None:
        self._channels = channels
        self._kernel = kernel

    def take(self) -> None:
        """Process data overwrite their parameters (4.4), except locally. OPEN for what is out of range: not taken."""
        if self._kernel.local:
            return
        for number, channel in enumerate(self._channels):
            # Synchronous axes have one mode: that of the first telegram.
            taken: _Taken = _MODES + _VALUES if number == 0 or self._kernel.single else _VALUES
            for signal, (ind, pnu) in taken:
                if signal in channel.received:
                    channel.offer(ind, pnu, channel.received[signal])
            if CONTROL_WORD in channel.received:
                channel.store.cell(0, 37).raw = channel.received[CONTROL_WORD]

    def of(self, params: tuple[Params, Params]) -> tuple[Wish, Wish]:
        """What is wanted in this cycle."""
        first = self._wish(self._channels[0], params[0])
        second = self._wish(self._channels[1], params[1])
        if not self._kernel.single:
            first = self._joint(first, second)
        return first, second

    def _wish(self, channel: Channel, params: Params) -> Wish:
        mode = ControlMode(channel.number(*CONTROL_MODE_AT))
        by_bus = channel.number(*DEVICE_MODE_AT) == DeviceMode.BUS
        word = channel.received.get(CONTROL_WORD, 0)
        if not by_bus and mode in (ControlMode.PROFILE, ControlMode.MANUAL):
            word &= ~_COURSE  # these have no local setpoint
        place = setpoint_mm(channel.number(*_SETPOINT_AT)) if by_bus else self._local_place(params)
        deceleration = channel.received.get(RAMP_DECELERATION)
        # Where no telegram carries it, it is a parameter that only the maker's tool knows: taken for the acceleration.
        slowing = params.acceleration if deceleration is None else deceleration * 0.1
        return Wish(mode, word, Order(place, params.velocity, params.acceleration, slowing))

    def _joint(self, first: Wish, second: Wish) -> Wish:
        """Synchronous axes obey the telegram of the first. Where the second has one, both must ask to run (OPEN)."""
        if self._channels[1].telegram is None:
            return first
        allowed = second.word & _RUN | ~_RUN
        return first._replace(word=first.word & allowed | second.word & Control.STOP)

    def _local_place(self, params: Params) -> float:
        """A setpoint at an analog input (12/220, 12/221, 12/223)."""
        if params.input_no == _PROFILE:
            return self._kernel.axes[0].motion.target
        share = self._kernel.conditions.analog[params.input_no] / 100.0
        if params.input_type in _BIPOLAR:
            share = 2.0 * share - 1.0
        return share * params.input_resolution
