"""A page at the desk, as a test plays it: it has the lease, and beats as long as it holds."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from time import monotonic

from app.model.address import Address
from app.service.connection import Connection
from app.service.motion.dead_man import BEAT_S
from app.service.motion.desk import MotionDesk
from app.service.motion.interlocks import POSITION, Confirmed

AXIS = "wtg-07/blade-1/pmc"
PAGE = "page of the test"


class SteadyClock:
    """The monotonic clock without the times in which the whole machine stood still: nobody let go in those.

    It is asked many times in ``_STILL_S``, or else nothing ran. What stops an axis on the real clock is held in
    ``test_stopping.py``, where the server is a process of its own.
    """

    _STILL_S = 0.1

    def __init__(self) -> None:
        self._seen_s = self._now_s = monotonic()

    def __call__(self) -> float:
        """The time in s."""
        seen_s = monotonic()
        self._now_s += min(seen_s - self._seen_s, self._STILL_S)
        self._seen_s = seen_s
        return self._now_s


class Page:
    """Beats every 100 ms from ``open`` on; ``hold`` presses, ``let_go`` lets go, ``die`` is silence."""

    def __init__(self, desk: MotionDesk, person: str = "tester", name: str = PAGE) -> None:
        self.desk = desk
        self.name = name
        self.fence = desk.take_lease(person, name).fence
        self.holding = False
        self._number = 0
        self._task: asyncio.Task[None] | None = None

    def open(self) -> None:
        """Begin to beat."""
        self._task = asyncio.create_task(self._beat_forever())

    async def die(self) -> None:
        """Not a word any more."""
        if self._task is not None:
            self._task.cancel()
            with suppress(asyncio.CancelledError):
                await self._task
            self._task = None

    def hold(self) -> None:
        """Press; at once."""
        self.holding = True
        self.beat()

    def let_go(self) -> None:
        """Let go; at once."""
        self.holding = False
        self.beat()

    def beat(self) -> None:
        """One beat."""
        self._number += 1
        self.desk.beat(self.name, self.fence, self._number, self.holding)

    async def _beat_forever(self) -> None:
        while True:
            self.beat()
            await asyncio.sleep(BEAT_S)


@asynccontextmanager
async def at_the_desk(connection: Connection, confirmed: bool = True) -> AsyncIterator[tuple[MotionDesk, Page]]:
    """A desk with a page that has the lease and has confirmed what a person must look at."""
    desk = MotionDesk(connection, connection.journal, now_s=SteadyClock())
    page = Page(desk)
    page.open()
    if confirmed:
        desk.confirm(page.fence, Confirmed(rotor_locked=True, people_out=True))
    try:
        yield desk, page
    finally:
        await page.die()
        await desk.close()


async def number(connection: Connection, address: Address, slug: str = AXIS) -> int:
    """What an object of the axis holds now."""
    target = connection.target(slug)
    data = await connection.driver(target).read(target.node, address)
    return int.from_bytes(data, "little", signed=address in (POSITION,))


async def angle_deg(connection: Connection, slug: str = AXIS) -> float:
    """Where the blade is."""
    return await number(connection, POSITION, slug) / 100
