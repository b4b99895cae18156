"""What a benchmark gives back."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Result:
    """``ratio`` is peer / ours (times better), ``target`` the least that is wanted.

    ``lines`` are the figures behind it, ``shortfalls`` name conditions beside the ratio that were not met.
    """

    ratio: float
    target: float
    lines: tuple[str, ...] = ()
    shortfalls: tuple[str, ...] = field(default=())

    @property
    def ok(self) -> bool:
        """Whether all that was wanted was reached."""
        return self.ratio >= self.target and not self.shortfalls
