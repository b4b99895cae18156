"""Whose turn it is on a connection that carries one transaction at a time: urgent ones first, else as they came."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager


class Turns:
    """A lock with two queues. ``on_urgent`` is called whenever somebody urgent begins to wait for who holds it."""

    def __init__(self, on_urgent: Callable[[], None]) -> None:
        self._on_urgent = on_urgent
        self._taken = False
        self._urgent: deque[asyncio.Future[None]] = deque()
        self._waiting: deque[asyncio.Future[None]] = deque()

    @property
    def wanted_urgently(self) -> bool:
        """Somebody urgent waits: who holds the lock can make room."""
        return bool(self._urgent)

    @asynccontextmanager
    async def taken(self, urgent: bool = False) -> AsyncIterator[None]:
        """Wait for the turn, and give it on at the end, whatever happens."""
        await self._take(urgent)
        try:
            yield
        finally:
            self._give_on()

    async def _take(self, urgent: bool) -> None:
        if not self._taken:
            self._taken = True
            return
        queue = self._urgent if urgent else self._waiting
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        queue.append(turn)
        if urgent:
            self._on_urgent()
        try:
            await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():
                self._give_on()  # it was given to us in the same moment
            elif turn in queue:
                queue.remove(turn)
            raise

    def _give_on(self) -> None:
        for queue in (self._urgent, self._waiting):
            while queue:
                turn = queue.popleft()
                if not turn.done():  # else its waiter was cancelled in this very moment
                    turn.set_result(None)
                    return
        self._taken = False
