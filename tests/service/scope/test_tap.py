"""The listener on the receive thread: it takes what is wanted, never raises, and never lets its memory grow."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from threading import Thread

from app.model.address import Address
from app.service.scope.signals import Place
from app.service.scope.tap import BEHIND, Heard, Tap
from app.wire.records import EmcySeen, GapSeen, Record, Source, SyncSeen, ValueSeen

STATUSWORD = Address(0x6041)


def value(t_ns: int, address: Address = STATUSWORD, node: int = 11, source: Source = Source.PDO_TX) -> ValueSeen:
    return ValueSeen(t_ns, "can0", node, address, b"\x21\x00", source)


async def heard_of(batches: Sequence[Sequence[Record]], most: int = 1000, between: bool = True) -> list[Heard]:
    """What comes out in the loop of what another thread hears."""
    heard: list[Heard] = []
    tap = Tap({Place("can0", 11, STATUSWORD): 0}, asyncio.get_running_loop(), heard.extend, most)
    for batch in batches:
        thread = Thread(target=tap.hear, args=(batch,))
        thread.start()
        thread.join()
        if between:
            await asyncio.sleep(0)
    await asyncio.sleep(0)
    return heard


async def test_it_hands_over_what_is_wanted_in_order() -> None:
    emcy = EmcySeen(3, "can0", 12, 0x3120, 1, bytes(5))
    batch: list[Record] = [
        value(1),
        value(2, Address(0x6064)),
        value(2, node=12),
        emcy,
        SyncSeen(4, "can0", 0, None),
        value(5),
    ]
    sent_by_emcy = value(6, source=Source.EMCY)
    assert await heard_of([[*batch, sent_by_emcy], [value(7)]]) == [value(1), emcy, value(5), value(7)]


async def test_a_loop_that_falls_behind_gets_a_gap_and_no_more_than_fits() -> None:
    batches = [[value(n) for n in range(10 * batch, 10 * batch + 10)] for batch in range(5)]
    heard: list[Heard] = []
    tap = Tap({Place("can0", 11, STATUSWORD): 0}, asyncio.get_running_loop(), heard.extend, 25)
    for batch in batches:
        tap.hear(batch)
    assert len(tap._queue) <= 25
    await asyncio.sleep(0)
    tap.hear([value(99)])
    await asyncio.sleep(0)
    assert [one.t_ns for one in heard if isinstance(one, ValueSeen)] == [*range(20), 99]
    (gap,) = [one for one in heard if isinstance(one, GapSeen)]
    assert (gap.t_ns, gap.reason) == (49, BEHIND)


async def test_a_defect_ends_the_listening_and_not_the_thread() -> None:
    tap = Tap({}, asyncio.get_running_loop(), lambda _heard: None)
    tap.hear([None])  # type: ignore[list-item]
    assert not tap.closed, "what is no record is passed by"
    tap._wanted = None  # type: ignore[assignment]
    tap.hear([value(1)])
    assert tap.closed
