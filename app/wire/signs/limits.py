"""Values that have a limit in another object: the limit in force is that of the traffic, else the one as delivered."""

from __future__ import annotations

import math
from collections.abc import Iterator
from decimal import Decimal
from enum import Enum
from typing import Any, Final, NamedTuple

from app.model.address import parse_address
from app.model.description import Description, Entry
from app.wire.events import Severity
from app.wire.signs.sign import SignKind


class Side(Enum):
    """On which side of its limit a value is wrong; ``BEYOND``: its amount, whatever its sign."""

    ABOVE = "above"
    FROM = "from"
    """The limit itself is wrong already."""
    BELOW = "below"
    BEYOND = "beyond"


class Guard(NamedTuple):
    """One value and its limit.

    ``factor``: share of the limit that counts; ``off``: limits that switch it off; ``broken``: values that tell a
    broken sensor and no measurement.
    """

    value: str
    limit: str
    side: Side
    severity: Severity
    kind: SignKind = SignKind.LIMIT
    factor: float = 1.0
    off: tuple[int, ...] = ()
    broken: tuple[int, ...] = ()


_ERROR, _WARNING, _INFO = Severity.ERROR, Severity.WARNING, Severity.INFO
_SENSOR: Final = (-32768, 32767)
"""Short circuit, wire break or not connected (manual, 4.6.2.4)."""
MAINS_SHARE: Final = 0.85 / math.sqrt(2)
"""The manual gives no limit of 3062h: 85 % of the mains that belong to the nominal DC link, U x 1.414 (4.2.2.4)."""


def _supervised(value: str, limits: str, broken: tuple[int, ...] = ()) -> tuple[Guard, ...]:
    """A temperature of the power unit with its three limits (manual, table 32)."""
    return (
        Guard(value, f"{limits}:01", Side.FROM, _WARNING, broken=broken),
        Guard(value, f"{limits}:02", Side.FROM, _ERROR, broken=broken),
        Guard(value, f"{limits}:03", Side.BELOW, _WARNING, broken=broken),
    )


GUARDS: Final[dict[str, tuple[Guard, ...]]] = {
    "oat-pmc": (
        Guard("60F4", "6065", Side.BEYOND, _WARNING, off=(0xFFFFFFFF,)),
        # OPEN in the manual whether a window of 0 is off; as delivered it is 0, and no axis would run otherwise.
        Guard("68F4", "6865", Side.BEYOND, _WARNING, off=(0,)),
        Guard("6079", "6510:04", Side.BELOW, _ERROR),
        Guard("6079", "6510:05", Side.ABOVE, _ERROR),
        Guard("6510:03", "6510:06", Side.FROM, _WARNING),
        Guard("6510:03", "6510:02", Side.FROM, _ERROR),
        Guard("6410:09", "6410:08", Side.FROM, _WARNING),
        Guard("6410:09", "6410:07", Side.FROM, _ERROR),
    ),
    "oat-pmm": (
        Guard("3062", "30FA:01", Side.BELOW, _ERROR, SignKind.MAINS_LOW, MAINS_SHARE),
        Guard("3063", "30FA:03", Side.BELOW, _WARNING),
        Guard("3063", "30FA:02", Side.ABOVE, _ERROR),
        *_supervised("3010", "3110"),
        *_supervised("3011", "3111"),
        *_supervised("3012", "3112", _SENSOR),
        *_supervised("3013", "3113", _SENSOR),
    ),
}
_BACK_SHARE: Final = 0.05
"""A value is back when it is this share of the limit on the right side of it."""
_UNITS: Final = {"mV": ("V", Decimal("0.001")), "mA": ("A", Decimal("0.001"))}


class WatchedLimit:
    """A value of one node against its limit. ``limit_raw`` may change: tell it with ``learn``."""

    __slots__ = ("_beyond", "_entry", "_guard", "_share", "address", "limit_at", "limit_raw", "subject")

    def __init__(self, guard: Guard, entry: Entry, limit: Entry) -> None:
        self._guard = guard
        self._entry = entry
        self._share = guard.factor * float(_in_base(limit) / _in_base(entry))
        self.address = entry.address
        self.limit_at = limit.address
        self.limit_raw = limit.default if isinstance(limit.default, int) else None
        self.subject = f"{entry.address.short}>{limit.address.short}"
        self._beyond = False

    @property
    def kind(self) -> SignKind:
        """The kind of its signs."""
        return self._guard.kind

    @property
    def severity(self) -> Severity:
        """How much it matters."""
        return self._guard.severity

    def holds(self, raw: int) -> bool | None:
        """Whether ``raw`` is on the wrong side; None where that cannot be told. Has a hysteresis."""
        guard, limit = self._guard, self.limit_raw
        if limit is None or limit in guard.off or raw in guard.broken:
            return None
        bound = limit * self._share
        back = max(abs(bound) * _BACK_SHARE, 1.0) if self._beyond else 0.0
        if guard.side is Side.BELOW:
            self._beyond = raw < bound + back
        elif guard.side is Side.FROM:
            self._beyond = raw >= bound - back
        else:
            amount = abs(raw) if guard.side is Side.BEYOND else raw
            self._beyond = amount > bound - back
        return self._beyond

    def details(self, raw: int) -> dict[str, Any]:
        """What the sign says: name, value and limit with unit, as numbers and as text."""
        entry, quantity = self._entry, self._entry.quantity
        limit = 0 if self.limit_raw is None else self.limit_raw
        return {
            "address": entry.address.short,
            "limit_address": self.limit_at.short,
            "name": entry.title,
            "side_key": f"sign_side.{self._guard.side.value}",
            "raw": raw,
            "amount": _text(raw * float(quantity.scale), quantity.scale),
            "bound": _text(limit * self._share * float(quantity.scale), quantity.scale),
            "unit": quantity.unit,
        }


def watched_limits(description: Description) -> Iterator[WatchedLimit]:
    """The guards of a device whose objects it has."""
    for guard in GUARDS.get(description.id, ()):
        entry, limit = (description.entries.get(parse_address(one)) for one in (guard.value, guard.limit))
        if entry is not None and limit is not None:
            yield WatchedLimit(guard, entry, limit)


def _in_base(entry: Entry) -> Decimal:
    """Factor from raw to the unit without a prefix."""
    return entry.quantity.scale * _UNITS.get(entry.quantity.unit, ("", Decimal(1)))[1]


def _text(number: float, scale: Decimal) -> str:
    exponent = scale.normalize().as_tuple().exponent
    return f"{number:.{max(0, -exponent) if isinstance(exponent, int) else 0}f}"
