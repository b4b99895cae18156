"""What the finder keeps of one node: its watched objects, its conditions, and when it was heard last."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from app.model.address import Address, Addressing
from app.model.datatypes import DataType, decode_raw
from app.model.description import Description
from app.wire.events import Severity
from app.wire.live import SILENT_FACTOR, SILENT_MARGIN_NS
from app.wire.nmt import NmtState
from app.wire.signs.bits import Test, watched_bits
from app.wire.signs.condition import Condition
from app.wire.signs.limits import WatchedLimit, watched_limits
from app.wire.signs.sign import Sign, SignKind

ERROR_CODES: Final = (Address(0x603F), Address(0, 36, Addressing.PKW))
"""Of CiA 402, and of DSP-408 on PROFIBUS."""
FIRST_PARAMETER: Final = 0x2000
"""Below it are the objects of communication (CiA 301): who writes them sets up a bus, no drive."""


def is_set_up(address: Address) -> bool:
    """Whether it is a parameter of the drive, and none of its communication; PKW has no others."""
    return address.addressing is Addressing.PKW or address.major >= FIRST_PARAMETER


class Watch:
    """One object: what it held last, and what its value may be a sign of."""

    __slots__ = ("data", "limits", "t_ns", "tests", "type")

    def __init__(self, data_type: DataType) -> None:
        self.type = data_type
        self.data: bytes | None = None
        self.t_ns: int | None = None
        self.tests: list[tuple[Test, Condition, Mapping[str, Any]]] = []
        self.limits: list[tuple[WatchedLimit, Condition]] = []

    def number(self, data: bytes) -> int | None:
        """The raw value; None where the bytes are no integer of the object's type."""
        try:
            raw = decode_raw(self.type, data)
        except ValueError:
            return None
        return raw if isinstance(raw, int) else None


class NodeSigns:
    """One node.

    ``heard_ns``: the last frame that it sent itself; ``silent_ns``: that before it fell silent; ``told_codes``: those
    of its emergency messages.
    """

    __slots__ = (
        "_back_ns", "_first_interval_ns", "_interval_ns", "_lost_ns", "bus", "description", "error_code", "heard_ns",
        "heartbeat_ns", "node", "not_operational", "period_ns", "silent", "silent_ns", "told_codes", "was_operational",
        "watches", "written_limits",
    )  # fmt: skip

    def __init__(self, bus: str, node: int, description: Description | None) -> None:
        self.bus = bus
        self.node = node
        self.description = description
        self.heard_ns: int | None = None
        self.heartbeat_ns: int | None = None
        self.period_ns: int | None = None
        self.silent_ns: int | None = None
        self._lost_ns: int | None = None
        self._back_ns: int | None = None
        self._interval_ns: int | None = None
        self._first_interval_ns: int | None = None
        self.error_code = 0
        self.told_codes: set[int] = set()
        self.was_operational = False
        self.silent = self._condition(SignKind.SILENT, "heartbeat", Severity.ERROR)
        self.silent.on = False
        self.not_operational = self._condition(SignKind.NOT_OPERATIONAL, "state", Severity.WARNING)
        self.not_operational.on = False
        self.watches: dict[Address, Watch] = {}
        self.written_limits: dict[Address, list[WatchedLimit]] = {}
        if description is not None:
            self._watch_all(description)

    def _condition(self, kind: SignKind, subject: str, severity: Severity) -> Condition:
        return Condition(self.bus, self.node, kind, subject, severity)

    def _watch_all(self, description: Description) -> None:
        for bit in watched_bits(description):
            condition = self._condition(bit.test.kind, bit.subject, bit.test.severity)
            self._watch(bit.address, description).tests.append((bit.test, condition, bit.details))
        for limit in watched_limits(description):
            condition = self._condition(limit.kind, limit.subject, limit.severity)
            self._watch(limit.address, description).limits.append((limit, condition))
            self._watch(limit.limit_at, description)
            self.written_limits.setdefault(limit.limit_at, []).append(limit)
        for entry in description:
            if (entry.is_parameter and is_set_up(entry.address)) or entry.address in ERROR_CODES:
                self._watch(entry.address, description)

    def _watch(self, address: Address, description: Description) -> Watch:
        watch = self.watches.get(address)
        if watch is None:
            watch = self.watches[address] = Watch(description.entries[address].type)
        return watch

    def conditions(self) -> Iterator[Condition]:
        """All conditions of the node."""
        yield self.silent
        yield self.not_operational
        for watch in self.watches.values():
            for _, condition, _ in watch.tests:
                yield condition
            for _, condition in watch.limits:
                yield condition

    def forget_values(self) -> None:
        """The node has started anew: what its objects held says nothing about what they hold."""
        self.error_code = 0
        for watch in self.watches.values():
            watch.data = None

    def back(self, lost_ns: int | None, t_ns: int) -> None:
        """It is heard again at ``t_ns``; what it did since ``lost_ns`` nobody knows."""
        self._lost_ns, self._back_ns = lost_ns, t_ns

    def looked_ns(self, seen_ns: int | None, heard_ns: int | None) -> int | None:
        """How far back a change that a PDO tells may lie, where the object was seen last at ``seen_ns``."""
        if self._back_ns is not None and (seen_ns is None or seen_ns < self._back_ns):
            return self._lost_ns
        return heard_ns

    # -- heartbeat, as the live state judges it ------------------------------------

    def beat(self, t_ns: int) -> None:
        """A heartbeat came. One interval alone says little: a change of state may send one early."""
        if self.heartbeat_ns is not None and not self.silent.on:
            interval_ns = t_ns - self.heartbeat_ns
            if self._first_interval_ns is None:
                self._first_interval_ns = interval_ns
            else:
                self._interval_ns = max(interval_ns, self._interval_ns or self._first_interval_ns)
        self.heartbeat_ns = t_ns

    def forget_heartbeat(self) -> None:
        """Heartbeats start anew."""
        self.heartbeat_ns = self._interval_ns = self._first_interval_ns = None

    @property
    def overdue_ns(self) -> int | None:
        """When it will count as silent; None where nobody knows how often it beats."""
        period_ns = self.period_ns or self._interval_ns
        if self.silent.on or period_ns is None or self.heartbeat_ns is None:
            return None
        return int(self.heartbeat_ns + period_ns * SILENT_FACTOR + SILENT_MARGIN_NS)

    def fell_silent(self, now_ns: int) -> Sign | None:
        """The sign where its heartbeat is overdue at ``now_ns``."""
        overdue_ns = self.overdue_ns
        if overdue_ns is None or now_ns <= overdue_ns:
            return None
        heard_ns = self.heard_ns or self.heartbeat_ns or now_ns
        self.silent_ns = heard_ns
        details = {"since_ns": heard_ns, "for_ms": round((now_ns - heard_ns) / 1e6)}
        return self.silent.see(now_ns, True, None, details)

    def is_out(self, state: NmtState) -> bool | None:
        """Whether the heartbeat tells that it is operational no longer; None where it never was."""
        operational = state is NmtState.OPERATIONAL
        self.was_operational = self.was_operational or operational
        return not operational if self.was_operational else None
