"""A condition that comes and goes: told at once when it comes, and when it has been away for a while that it went."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from app.wire.events import Severity
from app.wire.signs.sign import Sign, SignKind

SETTLE_NS: Final = 1_000_000_000
"""What comes again within this is the same sign, counted once more."""
UNSURE_NS: Final = 250_000_000
"""A look before the last one that is longer ago than this is told: the condition may have begun since then."""


class Condition:
    """One condition of one node. ``on`` None: not known yet."""

    __slots__ = ("_away_ns", "_begin", "bus", "count", "kind", "node", "on", "severity", "subject")

    def __init__(self, bus: str, node: int, kind: SignKind, subject: str, severity: Severity) -> None:
        self.bus = bus
        self.node = node
        self.kind = kind
        self.subject = subject
        self.severity = severity
        self.on: bool | None = None
        self.count = 0
        self._away_ns: int | None = None
        self._begin: Sign | None = None

    @property
    def settles_ns(self) -> int | None:
        """When it will have been away for long enough; None where it is not going away."""
        return None if self._away_ns is None else self._away_ns + SETTLE_NS

    def see(self, t_ns: int, on: bool, before_ns: int | None, details: Mapping[str, Any]) -> Sign | None:
        """It is so, or not, at ``t_ns``; the look before was at ``before_ns`` (None: this is the first).

        Gives a sign where it begins. Call ``settle`` first where time has passed.
        """
        if not on:
            if self.on:
                self._away_ns = t_ns
            self.on = False
            return None
        if self.on:
            return None
        first_look, self.on = self.on is None, True
        if self._away_ns is not None:
            self._away_ns = None
            self.count += 1
            return None
        self.count = 1
        more: dict[str, Any] = {"subject": self.subject}
        if first_look:
            more["standing"] = True
        elif before_ns is not None and t_ns - before_ns > UNSURE_NS:
            more["since_ns"] = before_ns
        self._begin = Sign(t_ns, self.bus, self.node, self.kind, self.kind.text_key, {**details, **more}, self.severity)
        return self._begin

    def settle(self, now_ns: int) -> Sign | None:
        """The sign that it is over, with the time at which it went, where it has been away for long enough."""
        if self._away_ns is None or self._begin is None or now_ns < self._away_ns + SETTLE_NS:
            return None
        t_ns, self._away_ns = self._away_ns, None
        details: dict[str, Any] = {**self._begin.details, "ends": True, "began_ns": self._begin.t_ns}
        for name in ("standing", "since_ns"):
            details.pop(name, None)
        if self.count > 1:
            details["count"] = self.count
        return Sign(t_ns, self.bus, self.node, self.kind, self.kind.ended_key, details, Severity.INFO)

    def told_again(self) -> Sign | None:
        """The begin with its count, where it chatters still and nothing has told so."""
        if self._begin is None or self.count < 2 or (not self.on and self._away_ns is None):
            return None
        return self._begin._replace(details={**self._begin.details, "count": self.count})
