"""Whose turn it is: the turn is never lost, whoever is cancelled when."""

from __future__ import annotations

import asyncio

import pytest

from app.drivers.turns import Turns

PATIENCE_S = 10.0


async def hold(turns: Turns, urgent: bool = False) -> None:
    async with turns.taken(urgent):
        await asyncio.Event().wait()


@pytest.mark.parametrize("urgent", [False, True])
@pytest.mark.parametrize("waiter_first", [False, True])
async def test_holder_and_waiter_cancelled_in_the_same_moment_lose_no_turn(urgent: bool, waiter_first: bool) -> None:
    turns = Turns(lambda: None)
    holder = asyncio.create_task(hold(turns))
    await asyncio.sleep(0)
    waiter = asyncio.create_task(hold(turns, urgent))
    await asyncio.sleep(0)
    for task in (waiter, holder) if waiter_first else (holder, waiter):
        task.cancel()
    ends = await asyncio.gather(holder, waiter, return_exceptions=True)
    assert [type(end) for end in ends] == [asyncio.CancelledError] * 2
    async with asyncio.timeout(PATIENCE_S), turns.taken(urgent=True):
        assert not turns.wanted_urgently


async def test_who_waits_behind_a_cancelled_one_gets_the_turn() -> None:
    turns, reached = Turns(lambda: None), asyncio.Event()

    async def reach() -> None:
        async with turns.taken():
            reached.set()

    holder = asyncio.create_task(hold(turns))
    await asyncio.sleep(0)
    waiter, last = asyncio.create_task(hold(turns)), asyncio.create_task(reach())
    await asyncio.sleep(0)
    holder.cancel()
    waiter.cancel()
    await asyncio.wait_for(reached.wait(), PATIENCE_S)
    await asyncio.gather(holder, waiter, last, return_exceptions=True)
