"""A scope in front of twins on a served line, and every frame that crosses the wire beside it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from app.service.connection import Connection
from app.service.office.audit import AuditLog
from app.service.polling import USUAL
from app.service.scope.captures import Captures
from app.service.scope.desk import ScopeDesk
from app.service.scope.order import ScopeOrder, TriggerOrder
from app.store.store import Store
from app.wire.frame import Can, Frame

AXIS = "wtg-07/blade-1/pmc"
POWER = "wtg-07/blade-1/pmm"
STATUSWORD = f"{AXIS}/6041"
POSITION = f"{AXIS}/6064"
DEADLINE_S = 20.0
BY_HAND = TriggerOrder("manual", None, None, None, None, None, None, None)


def trigger(**given: object) -> TriggerOrder:
    """A trigger; what is not given is None."""
    names = ("kind", "signal", "level", "slope", "side", "event", "device", "code")
    return TriggerOrder(**{name: given.get(name) for name in names})  # type: ignore[arg-type]


def order(*signals: str, on: TriggerOrder = BY_HAND, **changed: object) -> ScopeOrder:
    """A setting of the scope: 0.6 s with 0.2 s before the trigger, once."""
    usual = {"total_s": 0.6, "pre_s": 0.2, "mode": "single", "hold_off_s": 0.0, "auto_s": 2.0}
    return ScopeOrder(signals=signals, trigger=on, **{**usual, **changed})  # type: ignore[arg-type]


@dataclass
class Wire:
    """Every CAN frame that the driver handed over."""

    frames: list[Frame] = field(default_factory=list)

    def between(self, can_id: int, from_ns: int, to_ns: int) -> list[tuple[int, bytes]]:
        """Time and data of those with an identifier, in a stretch of time with both ends."""
        return [
            (one.t_ns, one.payload.data)
            for one in list(self.frames)
            if isinstance(one.payload, Can) and one.payload.can_id == can_id and from_ns <= one.t_ns <= to_ns
        ]


@asynccontextmanager
async def scope_at(connection: Connection, store: Store | None = None) -> AsyncIterator[tuple[ScopeDesk, Wire]]:
    """A scope for ``connection``; without a ``store`` it forgets at its end."""
    kept = store or Store.in_memory()
    audit = AuditLog(kept, connection.stamper)
    wire = Wire()
    connection.buses["can0"].driver.subscribe(wire.frames.extend)
    desk = ScopeDesk(Captures(kept, audit), connection.journal, connection.stamper, lambda: USUAL, lambda: True)
    desk.attach(connection)
    try:
        yield desk, wire
    finally:
        await desk.close()
        await audit.close()
        if store is None:
            kept.close()


async def until(holds: Callable[[], bool], every_s: float = 0.01) -> None:
    """Until a condition holds, within the deadline; looked at ``every_s`` seconds."""
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(every_s)


async def kept(desk: ScopeDesk, count: int = 1) -> list[str]:
    """The ids of the captures that are kept, latest first, once there are so many."""
    async with asyncio.timeout(DEADLINE_S):
        while len(found := await desk.captures.all()) < count:  # noqa: ASYNC110  the store has no event for it
            await asyncio.sleep(0.02)
    return [one.id for one in found]
