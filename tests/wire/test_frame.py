"""Time stamps: strictly increasing, and as old as what they stamp."""

from __future__ import annotations

from app.wire.frame import STAMP_STEP_NS, Stamper

WALL_NS = 1_750_000_000 * 1_000_000_000 // STAMP_STEP_NS * STAMP_STEP_NS


class Clock:
    def __init__(self) -> None:
        self.now_ns = 5

    def __call__(self) -> int:
        return self.now_ns


def test_what_came_before_now_is_stamped_with_its_own_time() -> None:
    clock = Clock()
    stamper = Stamper(WALL_NS, clock)
    clock.now_ns += 10_000 * STAMP_STEP_NS
    ages = [300 * STAMP_STEP_NS, 200 * STAMP_STEP_NS + 1, 0]
    stamps = stamper.take_aged(ages)
    assert [(stamp - WALL_NS) // STAMP_STEP_NS for stamp in stamps] == [9_700, 9_799, 10_000]
    assert all(stamp % STAMP_STEP_NS == 0 for stamp in stamps)


def test_no_stamp_is_older_than_one_given_before() -> None:
    clock = Clock()
    stamper = Stamper(WALL_NS, clock)
    clock.now_ns += 1000 * STAMP_STEP_NS
    first = stamper()
    assert stamper.take_aged([500 * STAMP_STEP_NS, 400 * STAMP_STEP_NS, 0, 0]) == [
        first + n * STAMP_STEP_NS for n in (1, 2, 3, 4)
    ]
    assert stamper() == first + 5 * STAMP_STEP_NS
    assert stamper.take_aged([]) == []
