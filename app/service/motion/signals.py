"""Test signals for one axis: what they look like, how far they reach, and whether the drive's limits allow them. Pure.

A signal is an offset in degrees from where the blade stands, over the time in s. Each begins and ends there, at rest.
A sine fades in and out; a ramp has rounded corners; a step is a jump of the target, made by the ramps of the drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import pi, sqrt
from typing import Final, NoReturn

import numpy as np
from numpy.typing import NDArray

from app.errors import LimitError

Curve = NDArray[np.float64]

MOST_DEG: Final = 10.0
"""The furthest that a test signal reaches to either side."""
MOST_DPS: Final = 5.0
"""The fastest that a person moves a blade by hand."""
FREQUENCY_HZ: Final = (0.05, 2.0)
MOST_CYCLES: Final = 20
HOLD_S: Final = (0.2, 10.0)
MOST_S: Final = 60.0
"""The longest of a run: it is held by hand all the while."""
REST_S: Final = 0.5
"""It stands for so long before and after, so that the course shows rest."""
CORNER_S: Final = 0.25
"""A ramp takes so long to come to its speed."""
FADE_S: Final = 0.5
"""A sine fades in and out for one period, but at least so long."""
RESERVE: Final = 0.8
"""What is sent uses this share of a limit, so that the axis can catch up."""
_GRID_S: Final = 0.001


class Shape(Enum):
    """The value is the end of the text key ``page.signal.shape.…``."""

    SINE = "sine"
    STEP = "step"
    RAMP = "ramp"


@dataclass(frozen=True, slots=True)
class Signal:
    """``amplitude_deg`` is signed, negative towards 0 degrees; a sine begins to that side.

    ``frequency_hz`` counts for a sine, ``speed_dps`` and ``hold_s`` for step and ramp; ``cycles`` of full amplitude.
    """

    shape: Shape
    amplitude_deg: float
    frequency_hz: float
    cycles: int
    speed_dps: float
    hold_s: float

    @property
    def fade_s(self) -> float:
        """Time in which a sine grows to its full amplitude."""
        return max(1.0 / self.frequency_hz, FADE_S)

    @property
    def leg_s(self) -> float:
        """Time of one way of a ramp, corners included."""
        return abs(self.amplitude_deg) / self.speed_dps + CORNER_S

    @property
    def cycle_s(self) -> float:
        """Time of one cycle of full amplitude."""
        if self.shape is Shape.SINE:
            return 1.0 / self.frequency_hz
        way_s = self.leg_s if self.shape is Shape.RAMP else 0.0
        return 2 * (way_s + self.hold_s)

    @property
    def duration_s(self) -> float:
        """From the first target to the last."""
        fades_s = 2 * self.fade_s if self.shape is Shape.SINE else 0.0
        return 2 * REST_S + fades_s + self.cycles * self.cycle_s

    @property
    def steady_s(self) -> tuple[float, float]:
        """The stretch of full amplitude."""
        begin_s = REST_S + (self.fade_s if self.shape is Shape.SINE else 0.0)
        return begin_s, begin_s + self.cycles * self.cycle_s

    def offset_deg(self, t_s: float) -> float:
        """Where the target is at ``t_s``, from where the blade stood."""
        return float(self.offsets_deg(np.array([t_s]))[0])

    def offsets_deg(self, times_s: Curve) -> Curve:
        """The same of many times at once: an event loop that moves an axis must not be held up."""
        begin_s, end_s = self.steady_s
        if self.shape is Shape.SINE:
            outside_s = np.maximum(np.maximum(begin_s - times_s, times_s - end_s), 0.0)
            envelope = 0.5 + 0.5 * np.cos(pi * np.minimum(outside_s / self.fade_s, 1.0))
            sine: Curve = self.amplitude_deg * envelope * np.sin(2 * pi * self.frequency_hz * (times_s - begin_s))
            return sine
        within_s = (times_s - begin_s) % self.cycle_s
        if self.shape is Shape.STEP:
            share = np.where(within_s < self.hold_s, 1.0, 0.0)
        else:
            share = _way(within_s, self.leg_s) - _way(within_s - self.leg_s - self.hold_s, self.leg_s)
        offsets: Curve = np.where((times_s >= begin_s) & (times_s < end_s), self.amplitude_deg * share, 0.0)
        return offsets

    def course(self, step_s: float = _GRID_S) -> tuple[Curve, Curve]:
        """Times in s and offsets in degrees, every ``step_s``."""
        times = np.arange(0.0, self.duration_s + step_s, step_s)
        return times, self.offsets_deg(times)


def _way(times_s: Curve, leg_s: float) -> Curve:
    """The share of a ramp's way, 0 to 1: accelerated for ``CORNER_S``, even, slowed down."""
    t_s = np.clip(times_s, 0.0, leg_s)
    even_s = leg_s - CORNER_S
    begin = t_s**2 / (2 * CORNER_S * even_s)
    end = 1.0 - (leg_s - t_s) ** 2 / (2 * CORNER_S * even_s)
    share: Curve = np.select([t_s < CORNER_S, t_s <= even_s], [begin, (t_s - CORNER_S / 2) / even_s], end)
    return share


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """What the drive allows: degrees, per second, per second squared.

    ``following_deg`` is 6065h, None where it is off; ``gain_per_s`` is 60FBh/1, ``precontrol`` 60FBh/2 as a share;
    ``window_deg`` is 6067h.
    """

    low_deg: float
    high_deg: float
    velocity_dps: float
    acceleration_dps2: float
    deceleration_dps2: float
    following_deg: float | None
    gain_per_s: float
    precontrol: float
    window_deg: float


def check(signal: Signal, start_deg: float, limits: DriveLimits) -> None:
    """Raises LimitError that names the limit: the signal's own bounds first, then those of the drive."""
    _check_itself(signal)
    _check_way(signal, start_deg, limits)
    if limits.acceleration_dps2 <= 0:
        _beyond("6083", "profile acceleration", 0, 0.01, "–", "°/s²")
    if signal.shape is Shape.STEP:
        _check_step(signal, limits)
        peak_dps = step_peak_dps(signal, limits)
    else:
        peak_dps = _check_speeds(signal, limits)
    lag_deg = following_deg(peak_dps, limits)
    most_deg = None if limits.following_deg is None else RESERVE * limits.following_deg
    if most_deg is not None and lag_deg > most_deg:
        _beyond("6065", "following error window", lag_deg, 0, most_deg, "°")


def following_deg(speed_dps: float, limits: DriveLimits) -> float:
    """The following error at a constant speed: V / p gain x (1 - precontrol) (manual, 5.4.1.8)."""
    if limits.gain_per_s <= 0:
        return float("inf")
    return speed_dps / limits.gain_per_s * abs(1.0 - limits.precontrol)


def step_peak_dps(signal: Signal, limits: DriveLimits) -> float:
    """The speed that the drive's ramps come to on the way of a step."""
    up, down = limits.acceleration_dps2, limits.deceleration_dps2 or limits.acceleration_dps2
    reached_dps = sqrt(2 * abs(signal.amplitude_deg) * up * down / (up + down))
    return min(signal.speed_dps, limits.velocity_dps, reached_dps)


def _check_itself(signal: Signal) -> None:
    _within("amplitude", abs(signal.amplitude_deg), 0.05, MOST_DEG, "°")
    _within("cycles", signal.cycles, 1, MOST_CYCLES, "")
    if signal.shape is Shape.SINE:
        _within("frequency", signal.frequency_hz, *FREQUENCY_HZ, "Hz")
    else:
        _within("speed", signal.speed_dps, 0.1, MOST_DPS, "°/s")
        _within("hold", signal.hold_s, *HOLD_S, "s")
    if signal.shape is Shape.RAMP:  # as much of it even as in the corners, else there is no lag to be seen
        _within("amplitude", abs(signal.amplitude_deg), 2 * CORNER_S * signal.speed_dps, MOST_DEG, "°")
    _within("duration", signal.duration_s, 0.0, MOST_S, "s")


def _check_way(signal: Signal, start_deg: float, limits: DriveLimits) -> None:
    _, offsets = signal.course(0.01)
    for end_deg in (start_deg + float(offsets.min()), start_deg + float(offsets.max())):
        if not limits.low_deg <= end_deg <= limits.high_deg:
            _beyond("607D", "software position limit", end_deg, limits.low_deg, limits.high_deg, "°")


def _check_speeds(signal: Signal, limits: DriveLimits) -> float:
    """The highest speed of a sine or ramp, which fits."""
    _, offsets = signal.course()
    speeds = np.diff(offsets) / _GRID_S
    peak_dps = float(np.abs(speeds).max())
    if peak_dps > RESERVE * MOST_DPS + 1e-6:
        _beyond("", "speed", peak_dps, 0, RESERVE * MOST_DPS, "°/s")
    if peak_dps > RESERVE * limits.velocity_dps:
        _beyond("607F", "max profile velocity", peak_dps, 0, RESERVE * limits.velocity_dps, "°/s")
    peak_dps2 = float(np.abs(np.diff(speeds)).max()) / _GRID_S
    for address, name, limit in (
        ("6083", "profile acceleration", limits.acceleration_dps2),
        ("6084", "profile deceleration", limits.deceleration_dps2 or limits.acceleration_dps2),
    ):
        if peak_dps2 > RESERVE * limit:
            _beyond(address, name, peak_dps2, 0, RESERVE * limit, "°/s²")
    return peak_dps


def _check_step(signal: Signal, limits: DriveLimits) -> None:
    """A step stays within the following error window even where the drive should not ramp it (the safer reading)."""
    most_deg = 2.0 if limits.following_deg is None else RESERVE * limits.following_deg
    if abs(signal.amplitude_deg) > most_deg + 1e-9:
        _beyond("6065", "following error window", abs(signal.amplitude_deg), 0, most_deg, "°")
    if signal.speed_dps > limits.velocity_dps:
        _beyond("607F", "max profile velocity", signal.speed_dps, 0, limits.velocity_dps, "°/s")


def _within(name: str, number: float, low: float, high: float, unit: str) -> None:
    if not low <= number <= high:
        _beyond("", name, number, low, high, unit)


def _beyond(address: str, name: str, number: float, low: float, high: float | str, unit: str) -> NoReturn:
    raise LimitError(
        address=address,
        name=name,
        value=f"{number:.4g}",
        minimum=f"{low:.4g}",
        maximum=high if isinstance(high, str) else f"{high:.4g}",
        unit=unit,
    )
