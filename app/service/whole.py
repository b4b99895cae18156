"""What must come to its end, also where whoever waits for it is cancelled."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from contextlib import suppress
from typing import Any, TypeVar

T = TypeVar("T")


async def whole(work: Coroutine[Any, Any, T]) -> T:
    """Run to its end, which every time-out of a driver brings about, however often the task is cancelled meanwhile."""
    task = asyncio.ensure_future(work)
    try:
        return await asyncio.shield(task)
    except asyncio.CancelledError:
        await ended(task)
        raise


async def ended(task: asyncio.Task[Any]) -> None:
    """Wait for the end of a task, however often whoever waits is cancelled; what came of it is left to the caller."""
    while not task.done():
        with suppress(asyncio.CancelledError):
            await asyncio.wait([task])
