"""Which rows of a trace are wanted: kinds of conditions that all must hold, each with any of its choices."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from app.errors import UsageError
from app.model.address import Address
from app.wire.frame import Can, Direction, Frame
from app.wire.trace.service import Service, Speaker
from app.wire.trace.tracer import Item, Tone, TraceRow, direction_of

_IDS: Final = re.compile(r"^([0-9A-Fa-f]{1,8})h?(?:-([0-9A-Fa-f]{1,8})h?)?$")
_BYTES: Final = re.compile(r"^\*?(?:[0-9A-Fa-f?]{2})+$")

MeansText = Callable[[TraceRow], bool]


@dataclass(frozen=True)
class TraceFilter:
    """Empty choices let everything pass. ``ids`` are ranges of CAN identifiers, times are in ns; ends are included.

    ``data`` is a pattern over the data bytes in hexadecimal digits. ``means`` decides by what a row says.
    """

    buses: frozenset[str] = frozenset()
    nodes: frozenset[int] = frozenset()
    services: frozenset[Service] = frozenset()
    direction: Direction | None = None
    ids: tuple[tuple[int, int], ...] = ()
    data: re.Pattern[str] | None = None
    addresses: frozenset[Address] = frozenset()
    only_errors: bool = False
    from_ns: int | None = None
    to_ns: int | None = None
    means: MeansText | None = None

    @property
    def is_empty(self) -> bool:
        """True where every row passes."""
        return self == TraceFilter()

    def passes_item(self, item: Item, speaker: Speaker) -> bool:
        """What can be said before the row is made; gaps pass all but times and buses: silence must be seen."""
        t_ns, bus = item[0], item[1]
        if (self.from_ns is not None and t_ns < self.from_ns) or (self.to_ns is not None and t_ns > self.to_ns):
            return False
        if self.buses and bus not in self.buses:
            return False
        if not isinstance(item, Frame):
            return True
        if self.nodes and speaker.node not in self.nodes:
            return False
        if self.services and speaker.service not in self.services:
            return False
        if self.direction is not None and direction_of(item) is not self.direction:
            return False
        payload = item.payload
        if self.ids and not (isinstance(payload, Can) and any(low <= payload.can_id <= high for low, high in self.ids)):
            return False
        return self.data is None or self.data.match(payload.data.hex()) is not None

    def passes_row(self, row: TraceRow) -> bool:
        """What only the meaning tells; to be asked after ``passes_item``."""
        if row.speaker.service is Service.GAP:
            return True
        if self.only_errors and row.tone is not Tone.ERROR:
            return False
        if self.addresses and not self.addresses.intersection(addresses_of(row)):
            return False
        return self.means is None or self.means(row)


def addresses_of(row: TraceRow) -> list[Address]:
    """The objects that a row is about: that of its transfer, or those that a PDO carries."""
    if row.address is not None:
        return [row.address]
    return [address for record in row.records if (address := getattr(record, "address", None)) is not None]


def parse_ids(text: str) -> tuple[tuple[int, int], ...]:
    """Read ``181, 580-5FF, 70B`` (hexadecimal). Raises UsageError."""
    ranges = []
    for part in filter(None, re.split(r"[,;\s]+", text)):
        match = _IDS.match(part)
        if not match:
            raise UsageError(reason=f"'{part}' is no identifier (examples: 18B, 580-5FF)")
        low = int(match[1], 16)
        ranges.append((low, int(match[2], 16) if match[2] else low))
    return tuple(ranges)


def parse_data(text: str) -> re.Pattern[str] | None:
    """Read ``40 64 60`` (the first bytes), ``4? ?? 60`` (any digit) or ``* 64 60`` (anywhere). Raises UsageError."""
    digits = "".join(text.split())
    if not digits:
        return None
    if not _BYTES.match(digits) or len(digits) > 64:
        raise UsageError(reason=f"'{text}' is no pattern of bytes (examples: 40 64 60, 4? ?? 60, * 64 60)")
    anywhere, plain = ("(?:..)*?", digits[1:]) if digits[0] == "*" else ("", digits)
    return re.compile(anywhere + plain.lower().replace("?", "."))
