"""I2t: how long the motor may carry more than its rated current (manual, 7.2; 203Bh, 6073h, 2031h). Pure.

OPEN when the protection is active and in which units its numbers are told. Here: active with a rated current, a
duration of the peak, and a maximum above the rated current; numbers in A2 ms, the limited current in mA.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """Currents in mA: rated (203Bh:01), highest (6073h of it, never above 2031h); ``peak_ms`` is 203Bh:02."""

    rated_ma: int
    highest_ma: int
    peak_ms: int

    @property
    def active(self) -> bool:
        """The protection has what it needs."""
        return self.rated_ma > 0 and self.peak_ms > 0 and self.highest_ma > self.rated_ma

    @property
    def threshold(self) -> float:
        """How much is allowed, A2 ms."""
        return (self.highest_ma**2 - self.rated_ma**2) / 1e6 * self.peak_ms if self.active else 0.0


class Overload:
    """Sums up I2 above the rated I2; at the threshold the current is limited to the rated one until it is gone."""

    def __init__(self) -> None:
        self.spent = 0.0
        """A2 ms so far."""
        self.limiting = False

    def allowed_ma(self, limits: Limits) -> int:
        """The most current that the motor may carry now, mA."""
        if self.limiting and limits.active:
            return limits.rated_ma
        return limits.highest_ma

    def step(self, limits: Limits, current_ma: float) -> None:
        """One millisecond with this current."""
        if not limits.active:
            self.spent, self.limiting = 0.0, False
            return
        self.spent = max(0.0, self.spent + (current_ma**2 - limits.rated_ma**2) / 1e6)
        if self.spent >= limits.threshold:
            self.limiting = True
        elif self.spent == 0.0:
            self.limiting = False
