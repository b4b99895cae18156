"""The wind of a twin turbine: a mean with slow changes from a seed, and gusts. No clock: ``step`` moves it on.

Slow changes of speed and direction are Ornstein-Uhlenbeck processes (turbulence of the first order). Gusts come on top:
one with flanks of half a cosine and a top, or the extreme operating gust by its shape in IEC 61400-1 (6.3.2.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, isfinite, pi, sin, sqrt
from random import Random
from typing import Final

EXTREME_GUST_S: Final = 10.5
"""How long the extreme operating gust lasts (IEC 61400-1, 6.3.2.2)."""
MAX_WIND_MPS: Final = 80.0
"""No wind is stronger here: 50-year gust of the strongest class of IEC 61400-1 (70 m/s), and some room."""
_EXTREME_TOP: Final = 0.74
"""Top of the shape 0.37 sin(3 pi t / T) (1 - cos(2 pi t / T)), at half its time."""


@dataclass(frozen=True, slots=True)
class WindConstants:
    """Of the wind; all are estimates."""

    mean_mps: float = 7.5
    turbulence: float = 0.14
    """Standard deviation of the slow changes, as a share of the mean (a middle class of IEC 61400-1)."""
    time_s: float = 12.0
    direction_spread_deg: float = 6.0
    direction_time_s: float = 30.0


@dataclass(frozen=True, slots=True)
class Gust:
    """A gust that rises by half a cosine, stays and falls; ``peak_mps`` below 0 is a lull."""

    peak_mps: float
    rise_s: float
    hold_s: float
    fall_s: float

    @property
    def duration_s(self) -> float:
        """From its first breath to its last."""
        return self.rise_s + self.hold_s + self.fall_s

    def at(self, t_s: float) -> float:
        """What it adds to the wind, in m/s, so long after its beginning."""
        if not 0.0 < t_s < self.duration_s:
            return 0.0
        if t_s < self.rise_s:
            return self.peak_mps * (1 - cos(pi * t_s / self.rise_s)) / 2
        left_s = self.duration_s - t_s
        return self.peak_mps * (1 - cos(pi * left_s / self.fall_s)) / 2 if left_s < self.fall_s else self.peak_mps


@dataclass(frozen=True, slots=True)
class ExtremeGust:
    """The extreme operating gust (IEC 61400-1, 6.3.2.2): a dip, a top of ``peak_mps`` above the mean, a dip."""

    peak_mps: float
    duration_s: float = EXTREME_GUST_S

    def at(self, t_s: float) -> float:
        """What it adds to the wind, in m/s, so long after its beginning."""
        if not 0.0 < t_s < self.duration_s:
            return 0.0
        turn = pi * t_s / self.duration_s
        return -0.37 * self.peak_mps / _EXTREME_TOP * sin(3 * turn) * (1 - cos(2 * turn))


class Wind:
    """State of the wind. Two of one ``seed`` that take the same steps are the same."""

    def __init__(self, seed: int, constants: WindConstants | None = None) -> None:
        self.constants = WindConstants() if constants is None else constants
        self.mean_mps = self.constants.mean_mps
        """Settable; ``drift`` lets it go there slowly."""
        self.direction_deg = 0.0
        """Where it comes from, from the nacelle's direction, positive clockwise seen from above."""
        self._random = Random(seed)
        self._slow = 0.0
        self._gusts: list[tuple[float, Gust | ExtremeGust]] = []
        self._t_s = 0.0
        self._goal_mps = self.mean_mps
        self._drift_mps_s = 0.0

    @property
    def speed_mps(self) -> float:
        """At the hub; never below 0."""
        gusts_mps = sum(gust.at(self._t_s - since_s) for since_s, gust in self._gusts)
        return min(max(0.0, self.mean_mps * (1.0 + self._slow) + gusts_mps), MAX_WIND_MPS)

    def set_mean(self, mean_mps: float, over_s: float = 0.0) -> None:
        """Let the mean go to ``mean_mps`` within ``over_s``. Raises ValueError where it is no wind."""
        if not 0.0 <= mean_mps <= MAX_WIND_MPS or not over_s >= 0.0:
            raise ValueError(f"a mean wind of {mean_mps} m/s within {over_s} s")
        self._goal_mps = mean_mps
        if over_s == 0.0:
            self.mean_mps = mean_mps
        self._drift_mps_s = 0.0 if over_s == 0.0 else abs(mean_mps - self.mean_mps) / over_s

    def gust(self, peak_mps: float, rise_s: float, hold_s: float, fall_s: float) -> Gust:
        """A gust from now on, on top of those that blow. Raises ValueError where it has no time or no size."""
        if min(rise_s, hold_s, fall_s) < 0.0 or rise_s + hold_s + fall_s <= 0.0 or not isfinite(peak_mps):
            raise ValueError(f"a gust of {peak_mps} m/s with {rise_s}, {hold_s} and {fall_s} s")
        gust = Gust(peak_mps, rise_s, hold_s, fall_s)
        self._gusts.append((self._t_s, gust))
        return gust

    def calm(self, gust: Gust) -> None:
        """End a gust at once, where it still blows."""
        self._gusts = [(since_s, one) for since_s, one in self._gusts if one is not gust]

    def extreme_gust(self, peak_mps: float, duration_s: float = EXTREME_GUST_S) -> None:
        """The extreme operating gust from now on. Raises ValueError where it has no time or no size."""
        if not duration_s > 0.0 or not isfinite(peak_mps):
            raise ValueError(f"an extreme gust of {peak_mps} m/s within {duration_s} s")
        self._gusts.append((self._t_s, ExtremeGust(peak_mps, duration_s)))

    def step(self, dt_s: float) -> None:
        """Move on by ``dt_s``."""
        constants = self.constants
        self._t_s += dt_s
        self._gusts = [(since_s, gust) for since_s, gust in self._gusts if self._t_s - since_s < gust.duration_s]
        way_mps = self._goal_mps - self.mean_mps
        if self._drift_mps_s:
            most_mps = self._drift_mps_s * dt_s
            self.mean_mps += min(max(way_mps, -most_mps), most_mps)
        self._slow = self._wander(self._slow, dt_s, constants.time_s, constants.turbulence)
        self.direction_deg = self._wander(
            self.direction_deg, dt_s, constants.direction_time_s, constants.direction_spread_deg
        )

    def _wander(self, off: float, dt_s: float, time_s: float, spread: float) -> float:
        """The exact step of an Ornstein-Uhlenbeck process around 0, whatever ``dt_s`` is."""
        kept = exp(-dt_s / time_s)
        return off * kept + spread * sqrt(1 - kept * kept) * self._random.gauss(0.0, 1.0)
