"""Bus load against figures worked out by hand."""

from __future__ import annotations

import pytest

from app.wire.busload import SECOND_NS, BusLoad

MS = 1_000_000


def test_load_over_one_second() -> None:
    """1000 frames of 125 bits a second on 500 kbit/s are 25 %."""
    load = BusLoad(500_000)
    for i in range(3000):
        load.feed(i * MS, 125, 0x181 if i % 5 else 0x080)
    now_ns = 3000 * MS
    assert load.load(now_ns) == pytest.approx(0.25)
    assert load.shares(now_ns) == {0x181: pytest.approx(0.2), 0x080: pytest.approx(0.05)}
    assert load.load(now_ns + 500 * MS) == pytest.approx(0.125)
    assert load.load(now_ns + 2000 * MS) == 0


def test_history_second_by_second_with_silence() -> None:
    load = BusLoad(1000, history_s=4)
    load.feed(0, 100, 1)
    load.feed(10 * MS, 100, 1)
    load.feed(3 * SECOND_NS, 500, 1)
    load.feed(4 * SECOND_NS, 1, 1)
    assert list(load.history) == [(0, 0.2, 2), (1, 0.0, 0), (2, 0.0, 0), (3, 0.5, 1)]
    load.feed(1_000_000 * SECOND_NS, 1, 1)
    assert len(load.history) == 4 and load.history[-1] == (999_999, 0.0, 0)


def test_extended_identifiers_are_kept_apart() -> None:
    load = BusLoad(1000)
    load.feed(0, 10, 5)
    load.feed(0, 20, 5, extended=True)
    assert load.shares(SECOND_NS) == {5 | 1 << 29: 0.02, 5: 0.01}


def test_bit_rate_must_be_positive() -> None:
    with pytest.raises(ValueError):
        BusLoad(0)
