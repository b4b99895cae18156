"""Three-phase mains of a supply: line voltages, lost phases, and what a rectifier gets of them. SI units."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from itertools import combinations
from math import pi, sin, sqrt
from typing import Final

from app.twins.supply_kernel import DT_S, TABLE_LENGTH

_FREQUENCY_HZ: Final = 50.0
_LOST_SHARE: Final = 0.05
"""A phase with less than this is open: it then floats, and no line voltage with it drives a current."""
_SOUND: Final = [1.0, 1.0, 1.0]
_SAMPLES: Final = 20
"""Looks at the sine in a cycle of 1 ms (50 us: the highest is found to 0.01 %)."""


@lru_cache(maxsize=64)
def line_table(phases: tuple[float, float, float]) -> tuple[float, ...]:
    """Highest rectified line voltage in each millisecond of a mains period, as a share of a sound one's peak.

    Phase k has sin(wt - k 120 deg) times its share; a line voltage is the difference of two. With three phases six
    pulses a period (300 Hz) fill one another's gaps; with one lost, one line voltage is left: 100 Hz down to nothing.
    """
    alive = [number for number, share in enumerate(phases) if share > _LOST_SHARE]

    def highest(t_s: float) -> float:
        volts = [phases[k] * sin(2 * pi * (_FREQUENCY_HZ * t_s - k / 3)) / sqrt(3) for k in range(3)]
        return max((abs(volts[a] - volts[b]) for a, b in combinations(alive, 2)), default=0.0)

    return tuple(
        max(highest((cycle + sample / _SAMPLES) * DT_S) for sample in range(_SAMPLES + 1))
        for cycle in range(TABLE_LENGTH)
    )


@dataclass(slots=True)
class Mains:
    """The mains at the terminals of one supply."""

    nominal_v: float
    """Line voltage, root mean square."""
    present: bool = True
    factor: float = 1.0
    phases: list[float] = field(default_factory=lambda: [1.0, 1.0, 1.0])
    """Share of each phase: 1.0 sound, 0.0 lost."""
    swing_v: float = 0.0
    """What it is off its nominal voltage at this moment."""

    @property
    def sound_v(self) -> float:
        """Line voltage of three sound phases; 0 without mains."""
        return self.nominal_v * self.factor + self.swing_v if self.present else 0.0

    @property
    def peak_v(self) -> float:
        """Peak of ``sound_v``."""
        return sqrt(2) * self.sound_v

    @property
    def line_v(self) -> tuple[float, float, float]:
        """Line voltages 1-2, 2-3 and 3-1, as a meter at the terminals sees them.

        |a - b e^(-j120)| = sqrt(a^2 + b^2 + a b); the terminal of an open phase floats half-way between the other two.
        """
        if self.phases == _SOUND:
            sound_v = self.sound_v
            return (sound_v, sound_v, sound_v)
        pairs = ((0, 1), (1, 2), (2, 0))
        lost = [share <= _LOST_SHARE for share in self.phases]
        if sum(lost) > 1:
            return (0.0, 0.0, 0.0)
        volts = [self._between(self.phases[a], self.phases[b]) for a, b in pairs]
        if any(lost):
            left_v = next(v for v, (a, b) in zip(volts, pairs, strict=True) if not lost[a] and not lost[b])
            volts = [left_v / 2 if lost[a] or lost[b] else left_v for a, b in pairs]
        return (volts[0], volts[1], volts[2])

    @property
    def highest_v(self) -> float:
        """The highest line voltage: the one the rectifier lives on."""
        return max(self.line_v)

    def table(self) -> tuple[float, ...]:
        """``line_table`` of the phases as they are."""
        first, second, third = self.phases
        return line_table((first, second, third))

    def _between(self, a: float, b: float) -> float:
        return self.sound_v * sqrt((a * a + b * b + a * b) / 3)
