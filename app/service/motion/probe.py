"""The touch probe X4.7: the drive keeps its position at each edge (60BAh rising, 60BBh falling; OAT manual, 5.16).

The drive always captures; to arm it is a matter of this tool alone: what comes after is new, and the first of it is
marked. Whether there was an edge is seen by the level (60FDh bit 17) and by the captured value, both read many times a
second while somebody looks. Two edges between two looks show as one capture; its value is the drive's all the same.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.errors import HubsideError
from app.model.address import Address
from app.model.values import to_scaled
from app.service.connection import Connection
from app.service.devices import Target, decode
from app.service.poll import OTHER_CLIENT_NS
from app.service.write import know_what_it_rests_on
from app.wire.records import Record, ValueSeen

log = logging.getLogger(__name__)

RISING: Final = Address(0x60BA)
FALLING: Final = Address(0x60BB)
INPUTS: Final = Address(0x60FD)
LEVEL: Final = 1 << 17
LOOK_S: Final = 0.05
AWAY_S: Final = 2.0
"""Nobody has asked for so long: nothing is read any more."""
_LOAD_CAP: Final = 0.6


class Edge(Enum):
    """Which edge of the input."""

    RISING = "rising"
    FALLING = "falling"


_EDGES: Final = {RISING: Edge.RISING, FALLING: Edge.FALLING}


@dataclass(frozen=True, slots=True)
class Captured:
    """The position that the drive captured. ``t_ns``: when it was seen first; None: it stood there already."""

    edge: Edge
    raw: int
    t_ns: int | None


class Probe:
    """What is known of one probe. Pure; ``take`` what the wire says."""

    def __init__(self) -> None:
        self.captured: dict[Edge, Captured] = {}
        self.level: bool | None = None
        self.armed_ns: int | None = None
        self.first: Captured | None = None
        self._due: set[Edge] = set()
        self._ahead: set[Edge] = set()

    def arm(self, t_ns: int) -> None:
        """What comes from now on is new."""
        self.armed_ns, self.first = t_ns, None

    def is_new(self, captured: Captured) -> bool:
        """It came after the probe was armed."""
        return self.armed_ns is not None and captured.t_ns is not None and captured.t_ns >= self.armed_ns

    def take(self, t_ns: int, address: Address, raw: int) -> None:
        """A value was seen. After a change of the level the next value of that edge is a capture, also the same one."""
        if address == INPUTS:
            level = bool(raw & LEVEL)
            edge = Edge.RISING if level else Edge.FALLING
            if self.level is not None and level is not self.level and edge not in self._ahead:
                self._due.add(edge)
            self.level = level
            self._ahead.clear()
        elif address in _EDGES:
            self._value(t_ns, _EDGES[address], raw)

    def _value(self, t_ns: int, edge: Edge, raw: int) -> None:
        before = self.captured.get(edge)
        if before is None:
            self.captured[edge] = Captured(edge, raw, None)
        elif before.raw != raw or edge in self._due:
            if edge not in self._due:  # it came between both looks: the next one at the level must not count it again
                self._ahead.add(edge)
            self._keep(Captured(edge, raw, t_ns))
        self._due.discard(edge)

    def _keep(self, captured: Captured) -> None:
        self.captured[captured.edge] = captured
        if self.is_new(captured) and self.first is None:
            self.first = captured


@dataclass(frozen=True, slots=True)
class ProbeLine:
    """A probe as a page sees it. Degrees; times in t_ns; None: not known, or not yet.

    ``first``: the edge of the first capture since it was armed.
    """

    level: bool | None
    armed_ns: int | None
    rising_deg: float | None
    rising_ns: int | None
    rising_new: bool
    falling_deg: float | None
    falling_ns: int | None
    falling_new: bool
    first: str | None
    first_deg: float | None
    first_ns: int | None


class Probes:
    """The probes of a connection, read while somebody looks. Belongs to the event loop."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._probes: dict[str, Probe] = {}
        self._looked_s: dict[str, float] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    async def close(self) -> None:
        """Nobody looks any more."""
        for task in self._tasks.values():
            task.cancel()
        await asyncio.gather(*self._tasks.values(), return_exceptions=True)
        self._tasks.clear()

    async def look(self, slug: str) -> ProbeLine:
        """How a probe stands; it is read from now on, for a while. Raises UsageError, UnknownObjectError."""
        target = self._connection.target(slug)
        target.entry(RISING)
        self._looked_s[slug] = asyncio.get_running_loop().time()
        self._probes.setdefault(slug, Probe())
        task = self._tasks.get(slug)
        if task is None or task.done():
            self._tasks[slug] = asyncio.create_task(self._read_on(target))
        return self._line(target)

    async def arm(self, slug: str) -> ProbeLine:
        """Take what comes from now on for new. Raises as ``look`` does."""
        await self.look(slug)
        self._probes[slug].arm(self._connection.stamper())
        return self._line(self._connection.target(slug))

    def _line(self, target: Target) -> ProbeLine:
        probe = self._probes[target.slug]
        rising, falling = probe.captured.get(Edge.RISING), probe.captured.get(Edge.FALLING)
        first = probe.first
        return ProbeLine(
            level=probe.level,
            armed_ns=probe.armed_ns,
            rising_deg=_degrees(target, rising),
            rising_ns=None if rising is None else rising.t_ns,
            rising_new=rising is not None and probe.is_new(rising),
            falling_deg=_degrees(target, falling),
            falling_ns=None if falling is None else falling.t_ns,
            falling_new=falling is not None and probe.is_new(falling),
            first=None if first is None else first.edge.value,
            first_deg=_degrees(target, first),
            first_ns=None if first is None else first.t_ns,
        )

    async def _read_on(self, target: Target) -> None:
        """Read the three objects; what they hold is taken from the wire, whoever has read it."""
        loop, probe = asyncio.get_running_loop(), self._probes[target.slug]
        link = self._connection.buses[target.device.bus]

        def heard(records: Sequence[Record]) -> None:
            for record in records:
                if isinstance(record, ValueSeen) and record.node == target.node:
                    raw = decode(target.entry(record.address), record.data) if record.address in _SEEN else None
                    if isinstance(raw, int):
                        loop.call_soon_threadsafe(probe.take, record.t_ns, record.address, raw)

        link.listen(heard)
        try:
            while loop.time() - self._looked_s[target.slug] < AWAY_S:
                if self._allowed(target):
                    with suppress(HubsideError):
                        await know_what_it_rests_on(self._connection.driver(target), target, target.entry(RISING))
                        await self._connection.driver(target).read_many(target.node, _SEEN)
                await asyncio.sleep(LOOK_S)
        finally:
            link.unlisten(heard)

    def _allowed(self, target: Target) -> bool:
        """As for all polling: the bus has room, and nobody else talks to the device."""
        now_ns = self._connection.stamper()
        link = self._connection.buses[target.device.bus]
        view = self._connection.live.node(link.name, target.node)
        other_ns = None if view is None else view.other_client_ns
        return (other_ns is None or now_ns - other_ns > OTHER_CLIENT_NS) and link.bus_load(now_ns) < _LOAD_CAP


_SEEN: Final = (INPUTS, RISING, FALLING)


def _degrees(target: Target, captured: Captured | None) -> float | None:
    if captured is None:
        return None
    scaled = to_scaled(target.entry(_ADDRESSES[captured.edge]), captured.raw, target.lookup)
    return None if scaled is None else float(scaled.number)


_ADDRESSES: Final = {edge: address for address, edge in _EDGES.items()}
