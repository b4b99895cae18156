"""Parameters of one axis as the controller uses them: mm, seconds, per cent; read again when one changes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final, Self

from app.twins.ed2.channel import Channel
from app.twins.ed2.transducers import Scaling

_POSITION: Final = 0.001
_WINDOW: Final = 0.01
_TRAVEL: Final = 0.1
_VELOCITY: Final = 0.1
_HUNDREDTH: Final = 0.01


class ControlMode(IntEnum):
    """0/40."""

    OPEN_LOOP = 6
    POSITION = 9
    PROFILE = -1
    MANUAL = -2


class DeviceMode(IntEnum):
    """0/39."""

    BUS = 1
    LOCAL = 2


SYNCHRONOUS_CONTROLLER: Final = 2
"""12/219."""


@dataclass(frozen=True, slots=True)
class Gains:
    """Of one direction: P in per cent of the valve a mm, I its time and its share of the valve at most."""

    proportional: float
    integral_s: float
    integral_limit: float


@dataclass(frozen=True, slots=True)
class Output:
    """How per cent become currents, or volts of the interface (3/133 = 1)."""

    least_ma: tuple[float, float]
    most_ma: tuple[float, float]
    dither_ma: float
    dither_hz: float
    inverted: bool
    interface: bool
    offset: float
    gain: float


@dataclass(frozen=True, slots=True)
class Params:
    """Everything that a cycle needs."""

    scaling: Scaling
    travel: tuple[float, float] | None
    output: Output
    forward: Gains
    backward: Gains
    velocity: float
    acceleration: float
    fine: float
    coarse: float
    delay_ms: int
    inner: float
    outer: float
    rapid: float
    creep: float
    hand_acceleration: float
    controller: int
    input_type: int
    input_no: int
    input_resolution: float

    @classmethod
    def of(cls, channel: Channel) -> Self:
        """Those of an axis at this moment."""
        number = channel.number
        limits = (number(1, 100) * _TRAVEL, number(1, 101) * _TRAVEL)
        return cls(
            scaling=Scaling(number(1, 97), number(1, 98), number(1, 99)),
            travel=limits if number(1, 106) else None,
            output=_output(channel),
            forward=_gains(channel, 207, 209, 116, 119),
            backward=_gains(channel, 208, 210, 212, 211),
            velocity=number(12, 61) * _VELOCITY,
            acceleration=number(12, 64) * _VELOCITY,
            fine=number(12, 162) * _WINDOW,
            coarse=number(12, 163) * _WINDOW,
            delay_ms=number(12, 164) * 10,
            inner=number(12, 178) * _WINDOW,
            outer=max(number(12, 213), number(12, 178)) * _WINDOW,
            rapid=number(12, 216) * _VELOCITY,
            creep=number(12, 217) * _VELOCITY,
            hand_acceleration=number(12, 218) * _VELOCITY,
            controller=number(12, 219),
            input_type=number(12, 220),
            input_no=number(12, 221),
            input_resolution=number(12, 223) * 1e-6,
        )


_PERCENT_PER_MM: Final = 5.0
"""Gain of the loop with 100 % everywhere (assumed): 10/s on the twin's own bench."""


def _gains(channel: Channel, gain: int, share: int, time: int, limit: int) -> Gains:
    percent = channel.number(12, gain) * _HUNDREDTH * channel.number(12, share) * _HUNDREDTH / 100.0
    return Gains(
        _PERCENT_PER_MM * percent / 100.0,
        channel.number(12, time) * _HUNDREDTH,
        channel.number(12, limit) * _HUNDREDTH,
    )


def _output(channel: Channel) -> Output:
    number = channel.number
    return Output(
        least_ma=(number(3, 73), number(3, 76)),
        most_ma=(number(3, 129), number(3, 130)),
        dither_ma=number(3, 101),
        dither_hz=number(3, 98),
        inverted=bool(number(3, 131)),
        interface=bool(number(3, 133)),
        offset=number(3, 94) * 0.1,
        gain=number(3, 132),
    )


def setpoint_mm(raw: int) -> float:
    """A position of process data."""
    return raw * _POSITION


def raw_position(position_mm: float) -> int:
    """A position for process data."""
    return round(position_mm / _POSITION)
