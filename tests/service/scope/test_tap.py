"""The listener on the receive thread: it takes what is wanted, never raises, and never lets its memory grow."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from threading import Thread

from app.model.address import Address
from app.service.scope.signals import Place
from app.service.scope.tap import BEHIND, PORTION, SILENT_NS, Heard, Tap
from app.wire.records import EmcySeen, GapSeen, Record, Source, SyncSeen, ValueSeen

STATUSWORD = Address(0x6041)


def value(
    t_ns: int, address: Address = STATUSWORD, node: int = 11, source: Source = Source.PDO_TX, bus: str = "can0"
) -> ValueSeen:
    return ValueSeen(t_ns, bus, node, address, b"\x21\x00", source)


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


async def turns(count: int = 5) -> None:
    """The loop goes round."""
    for _ in range(count):
        await asyncio.sleep(0)


async def test_a_loop_that_falls_behind_gets_a_gap_and_no_more_than_fits() -> None:
    batches = [[value(n) for n in range(10 * batch, 10 * batch + 10)] for batch in range(5)]
    heard: list[Heard] = []
    tap = Tap({Place("can0", 11, STATUSWORD): 0}, asyncio.get_running_loop(), heard.extend, 25)
    for batch in batches:
        tap.hear(batch)
    assert len(tap._queue) <= 26
    await turns()
    tap.hear([value(99)])
    await turns()
    assert [one.t_ns for one in heard if isinstance(one, ValueSeen)] == [*range(20), 99]
    (gap,) = [one for one in heard if isinstance(one, GapSeen)]
    assert (gap.t_ns, gap.reason) == (20, BEHIND), "where the loss begins"


async def test_a_loss_is_marked_at_once_and_at_its_own_bus() -> None:
    """Also where nothing comes any more, and where another bus is heard next."""
    heard: list[Heard] = []
    places = {Place(bus, 11, STATUSWORD): 0 for bus in ("can0", "can1", "can2")}
    tap = Tap(places, asyncio.get_running_loop(), heard.extend, 4)
    tap.hear([value(n) for n in (1, 2, 3)])
    tap.hear([value(n, bus="can1") for n in (4, 5)])
    tap.hear([value(6, bus="can1")])
    tap.hear([value(7, bus="can2")])
    await tap.drain()
    assert [(one.t_ns, one.bus) for one in heard if isinstance(one, GapSeen)] == [(4, "can1"), (7, "can2")]
    assert [one.t_ns for one in heard if isinstance(one, ValueSeen)] == [1, 2, 3]
    tap.hear([value(8, bus="can1")])
    tap.hear([value(n) for n in range(9, 20)])
    await tap.drain()
    gaps = [(one.t_ns, one.bus) for one in heard if isinstance(one, GapSeen)]
    assert gaps[2:] == [(9, "can0")], "none for what came through again"


async def test_what_has_gathered_is_taken_in_portions_and_in_order() -> None:
    """The loop goes on between: a long queue holds up nobody for long."""
    portions: list[int] = []
    heard: list[Heard] = []

    def take(some: Sequence[Heard]) -> None:
        portions.append(len(some))
        heard.extend(some)

    tap = Tap({Place("can0", 11, STATUSWORD): 0}, asyncio.get_running_loop(), take)
    count = 10 * PORTION + 1
    tap.hear([value(n) for n in range(count)])
    await turns(1)
    assert sum(portions) < count
    tap.hear([value(count)])
    await tap.drain()
    assert max(portions) == PORTION
    assert [one.t_ns for one in heard] == list(range(count + 1))


async def test_time_is_settled_as_far_as_everything_was_handed_over() -> None:
    tap = Tap({Place("can0", 11, STATUSWORD): 0}, asyncio.get_running_loop(), lambda _heard: None)
    assert tap.settled_ns(500, 10) == 500, "nothing was ever heard"
    tap.hear([value(100), value(120)])
    assert tap.settled_ns(500, 10) == 100, "it waits in the queue"
    await tap.drain()
    assert tap.settled_ns(500, 10) == 130, "what the bus told last vouches for what came before"
    assert tap.settled_ns(125, 10) == 125
    tap.hear([SyncSeen(400, "can1", 0, None)])
    assert tap.settled_ns(500, 10) == 130, "the one bus does not vouch for the other"
    assert tap.settled_ns(120 + SILENT_NS, 10) == 410, "nobody waits for a silent bus"


async def test_a_defect_ends_the_listening_and_not_the_thread() -> None:
    tap = Tap({}, asyncio.get_running_loop(), lambda _heard: None)
    tap._wanted = None  # type: ignore[assignment]
    tap.hear([value(1)])
    assert (tap.closed, tap.failed) == (True, True)
