"""What a position loop should do with its targets: set-points by the drive's ramps, then the loop itself. Pure.

Set-points (OAT manual, 5.12): a cyclic target is approached straight within the time of 60C2h; where velocity or
acceleration do not allow that, by the ramps. Loop: wanted velocity = precontrol x velocity of the set-point + p gain x
following error (60FBh/1, /2); a velocity loop follows it with one lag.
"""

from __future__ import annotations

from math import copysign, sqrt
from typing import Final

import numpy as np

from app.service.motion.signals import Curve, DriveLimits

STEP_S: Final = 0.001
_LAGS_S: Final = np.geomspace(0.003, 0.3, 25)


def set_points(
    times_s: Curve, targets_deg: Curve, end_s: float, period_s: float, limits: DriveLimits
) -> tuple[Curve, Curve]:
    """Positions in degrees and velocities of the set-point every ``STEP_S`` from 0 on, of targets that came at times.

    ``limits.velocity_dps`` is that in force (6081h within 607Fh).
    """
    count = int(end_s / STEP_S) + 1
    positions, velocities = np.empty(count), np.empty(count)
    ramps = _Ramps(float(targets_deg[0]), period_s, limits)
    due, last = 0, len(times_s)
    whens, wheres = times_s.tolist(), targets_deg.tolist()
    for index in range(count):
        while due < last and whens[due] <= index * STEP_S:
            ramps.take(wheres[due])
            due += 1
        positions[index], velocities[index] = ramps.position, ramps.velocity
        ramps.advance()
    return positions, velocities


class _Ramps:
    """The set-point from one cycle to the next."""

    def __init__(self, position: float, period_s: float, limits: DriveLimits) -> None:
        self.position = self.target = position
        self.velocity = 0.0
        self._straight = False
        self._period_s = period_s
        self._most = limits.velocity_dps
        self._up = limits.acceleration_dps2
        self._down = limits.deceleration_dps2 or limits.acceleration_dps2

    def take(self, target: float) -> None:
        """Another target has come; the same one again changes nothing."""
        if target == self.target:
            return
        self.target = target
        needed = abs(target - self.position) / self._period_s
        change = abs(needed - abs(self.velocity))
        self._straight = needed <= self._most and change <= self._up * self._period_s
        if self._straight:
            self.velocity = copysign(needed, target - self.position)

    def advance(self) -> None:
        """One cycle further."""
        distance = self.target - self.position
        if not self._straight:
            braking = sqrt(2 * self._down * abs(distance))
            wanted = copysign(min(self._most, braking), distance)
            faster = abs(wanted) > abs(self.velocity) and wanted * self.velocity >= 0
            most = (self._up if faster else self._down) * STEP_S
            self.velocity += min(max(wanted - self.velocity, -most), most)
        move = self.velocity * STEP_S
        slow = self._straight or abs(self.velocity) <= 2 * self._down * STEP_S
        if abs(distance) <= abs(move) * 1.000001 and slow:
            self.position, self.velocity = self.target, 0.0
        else:
            self.position += move


def follow(positions: Curve, velocities: Curve, gain_per_s: float, precontrol: float, lag_s: float) -> Curve:
    """Positions of a loop that gets these set-points; it stands at the first one."""
    share = min(STEP_S / max(lag_s, STEP_S), 1.0)
    at, speed = float(positions[0]), 0.0
    found = np.empty(len(positions))
    for index, (wanted, wanted_speed) in enumerate(zip(positions.tolist(), velocities.tolist(), strict=True)):
        found[index] = at
        command = precontrol * wanted_speed + gain_per_s * (wanted - at)
        speed += (command - speed) * share
        at += speed * STEP_S
    return found


def identify_lag(
    times_s: Curve, measured_deg: Curve, positions: Curve, velocities: Curve, gain_per_s: float, precontrol: float
) -> float:
    """The lag of the velocity loop in s with which the model fits what was measured best (least squares).

    It stands for all that delays: filter, current loop, gear, and how old a measured value is.
    """
    grid_s = np.arange(len(positions)) * STEP_S

    def error(lag_s: float) -> float:
        found = follow(positions, velocities, gain_per_s, precontrol, lag_s)
        return float(np.mean((np.interp(times_s, grid_s, found) - measured_deg) ** 2))

    errors = [error(float(lag_s)) for lag_s in _LAGS_S]
    best = int(np.argmin(errors))
    low, high = float(_LAGS_S[max(best - 1, 0)]), float(_LAGS_S[min(best + 1, len(_LAGS_S) - 1)])
    for _ in range(12):  # golden section, to 1 %
        a, b = high - (high - low) * 0.618, low + (high - low) * 0.618
        low, high = (low, b) if error(a) < error(b) else (a, high)
    return (low + high) / 2
