"""The lease and the dead man, by a clock that the test drives."""

from __future__ import annotations

import pytest

from app.errors import LeaseError, LeaseHeldError, LeaseNeededError
from app.service.motion.dead_man import SILENCE_S, DeadMan
from app.service.motion.lease import ANSWER_S, AWAY_S, LEASE_S, Lease


class Clock:
    def __init__(self) -> None:
        self.s = 1000.0

    def __call__(self) -> float:
        return self.s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def lease(clock: Clock) -> Lease:
    return Lease(clock, lambda: 5)


def test_one_page_has_it_and_numbers_rise(lease: Lease) -> None:
    first = lease.take("anna", "a")
    assert lease.take("anna", "a").fence == first.fence, "the same page keeps it"
    with pytest.raises(LeaseHeldError) as raised:
        lease.take("anna", "another tab of hers")
    assert raised.value.details["holder"] == "anna"
    lease.give_back(first.fence)
    second = lease.take("ben", "b")
    assert second.fence > first.fence >= 5
    with pytest.raises(LeaseError):
        lease.check(first.fence)
    lease.give_back(second.fence)
    with pytest.raises(LeaseNeededError):
        lease.check(second.fence)


def test_it_ends_unused_and_when_its_page_is_gone(lease: Lease, clock: Clock) -> None:
    fence = lease.take("anna", "a").fence
    for _ in range(int(LEASE_S / 4)):
        clock.s += 4.0
        lease.heard("a")
    assert lease.tick(in_motion=False), "its page was there, but nobody used it"
    assert lease.holder is None
    fence = lease.take("anna", "a").fence
    clock.s += AWAY_S - 0.1
    assert not lease.tick(in_motion=False)
    lease.check(fence)
    clock.s += AWAY_S - 0.1
    assert not lease.tick(in_motion=False)
    clock.s += 0.2
    assert lease.tick(in_motion=False)


def test_whoever_asks_is_answered(lease: Lease, clock: Clock) -> None:
    first = lease.take("anna", "a").fence
    wish = lease.ask("ben", "b")
    assert wish is not None
    with pytest.raises(LeaseHeldError):
        lease.ask("carl", "c")
    lease.answer(first, hand_over=False)
    assert lease.refused == "b"
    lease.ask("ben", "b")
    assert lease.refused != "b"
    lease.answer(first, hand_over=True)
    assert lease.holder is not None
    assert lease.holder.page == "b"
    with pytest.raises(LeaseError):
        lease.check(first)
    lease.ask("anna", "a")
    lease.withdraw("a")
    assert lease.wish is None


def test_a_holder_who_does_not_answer_loses_it_but_never_in_motion(lease: Lease, clock: Clock) -> None:
    lease.take("anna", "a")
    lease.ask("ben", "b")
    for _ in range(int(ANSWER_S) + 1):
        clock.s += 1.0
        lease.heard("a")
        assert not lease.tick(in_motion=True)
    assert lease.tick(in_motion=False)
    assert lease.holder is not None
    assert lease.holder.person == "ben"


def test_a_page_that_asks_for_a_free_lease_has_it(lease: Lease) -> None:
    assert lease.ask("ben", "b") is None
    assert lease.holder is not None
    assert lease.holder.page == "b"


def test_beats_hold_only_in_order_and_of_this_lease(clock: Clock) -> None:
    man = DeadMan(clock)
    man.start(7)
    assert man.silent_s is None
    held = []
    for after_s, fence, number in (
        (0.0, 7, 1),
        (SILENCE_S - 0.01, 7, 0),  # an older beat changes nothing, also not the time
        (0.02, 7, 1),  # silent for too long, and one that was sent before
        (0.0, 6, 2),  # of an older lease
        (0.0, 7, 2),
    ):
        clock.s += after_s
        man.beat(fence, number, holding=True)
        held.append(man.holding)
    assert held == [True, True, False, False, True]
    assert man.ignored == 3


def test_what_was_let_go_by_us_must_be_pressed_anew(clock: Clock) -> None:
    man = DeadMan(clock)
    man.start(1)
    man.beat(1, 1, holding=True)
    man.release()
    held = [man.holding]
    for number, pressed in ((2, True), (3, False), (4, True)):
        man.beat(1, number, pressed)
        held.append(man.holding)
    assert held == [False, False, False, True], "the same press holds nothing any more"
    assert man.present


def test_a_line_that_grows_slower_holds_nothing_any_more(clock: Clock) -> None:
    man = DeadMan(clock)
    man.start(1)
    sent_s, start_s = 5000.0, clock.s
    held_at_ms = []
    for number in range(1, 30):
        way_s = 0.02 + max(0, number - 5) * 0.02  # each beat takes 20 ms longer than the one before
        clock.s = start_s + 0.1 * number + way_s
        man.beat(1, number, holding=True, sent_s=sent_s + 0.1 * number)
        if man.holding:
            held_at_ms.append(round(1000 * way_s))
    assert max(held_at_ms) == pytest.approx(1000 * (SILENCE_S + 0.02), abs=25)


def test_the_shortest_way_is_the_measure_whatever_both_clocks_show(clock: Clock) -> None:
    man = DeadMan(clock)
    man.start(1)
    held = []
    man.beat(1, 1, holding=True, sent_s=clock.s + 3600.0)  # the page's clock is an hour ahead
    held.append(man.holding)
    clock.s += 0.1
    man.beat(1, 2, holding=True, sent_s=clock.s + 3600.0 - 0.25)
    for after_s in (0.04, 0.02):
        clock.s += after_s
        held.append(man.holding)
    man.start(2)
    man.beat(2, 1, holding=True, sent_s=0.0)
    held.append(man.holding)
    assert held == [True, True, False, True], "it was 250 ms under way; another lease measures anew"


def test_clocks_that_run_apart_do_not_stop_an_axis(clock: Clock) -> None:
    man = DeadMan(clock)
    man.start(1)
    start_s = clock.s
    for number in range(1, 9000):  # a quarter of an hour
        clock.s = start_s + 0.1 * number
        man.beat(1, number, holding=True, sent_s=0.1 * number * (1 - 2e-4))
        assert man.holding
        assert man.silent_s == pytest.approx(0.0, abs=0.001)
