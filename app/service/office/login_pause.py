"""Failed logins: after a few under one name from one address each must wait longer than the one before."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from app.errors import LoginPausedError

FREE: Final = 3
"""Failures that cost no pause."""
FIRST_S: Final = 1.0
LONGEST_S: Final = 300.0
FORGET_S: Final = 3600.0
KEPT: Final = 10_000


@dataclass(slots=True)
class _Failures:
    count: int = 0
    until_s: float = 0.0
    last_s: float = 0.0


class LoginPause:
    """``monotonic_s`` is the clock. Names that nobody has count just the same."""

    def __init__(self, monotonic_s: Callable[[], float]) -> None:
        self._monotonic_s = monotonic_s
        self._failures: OrderedDict[tuple[str, str], _Failures] = OrderedDict()

    def check(self, name_key: str, address: str) -> None:
        """Raises LoginPausedError while the pause runs."""
        failures = self._failures.get((name_key, address))
        left_s = 0.0 if failures is None else failures.until_s - self._monotonic_s()
        if left_s > 0:
            raise LoginPausedError(retry_after_s=math.ceil(left_s))

    def failed(self, name_key: str, address: str) -> None:
        """A login failed, or is being tried: a success takes it back."""
        now_s = self._monotonic_s()
        failures = self._failures.setdefault((name_key, address), _Failures())
        if now_s - failures.last_s > FORGET_S:
            failures.count = 0
        failures.count += 1
        failures.last_s = now_s
        self.begin(name_key, address)
        self._failures.move_to_end((name_key, address))
        while len(self._failures) > KEPT:
            self._failures.popitem(last=False)

    def begin(self, name_key: str, address: str) -> None:
        """Have the pause that is due run from now on: trying took its time."""
        failures = self._failures.get((name_key, address))
        if failures is not None and failures.count > FREE:
            exponent = min(failures.count - FREE - 1, 30)
            failures.until_s = self._monotonic_s() + min(LONGEST_S, FIRST_S * 2.0**exponent)

    def succeeded(self, name_key: str, address: str) -> None:
        """Forget what failed."""
        self._failures.pop((name_key, address), None)
