"""Work that must come to its end does, however often whoever waits for it is cancelled."""

from __future__ import annotations

import asyncio

import pytest

from app.service.whole import whole


@pytest.mark.parametrize("times", [0, 1, 3])
async def test_it_comes_to_its_end_before_whoever_waits(times: int) -> None:
    done, may_end = [], asyncio.Event()

    async def work() -> str:
        await may_end.wait()
        done.append("work")
        return "result"

    async def wait() -> str:
        try:
            return await whole(work())
        finally:
            done.append("waiter")

    waiter = asyncio.create_task(wait())
    for _ in range(times):
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        waiter.cancel()
    await asyncio.sleep(0)
    may_end.set()
    (result,) = await asyncio.gather(waiter, return_exceptions=True)
    assert done == ["work", "waiter"]
    assert result == "result" if times == 0 else isinstance(result, asyncio.CancelledError)
