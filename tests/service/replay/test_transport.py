"""The cursor's arithmetic: no drift, speed, loop, ends."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import UsageError
from app.service.replay.transport import Attained, Loop, Transport

S = 1_000_000_000
FROM, TO = 1_700_000_000 * S, 1_700_003_600 * S


def test_it_does_not_drift_however_often_it_is_asked() -> None:
    cursor = Transport(FROM, TO)
    cursor.play(5 * S)
    for tick in range(0, 600 * S, 7_777_777):
        cursor.t_ns(5 * S + tick)
    assert cursor.t_ns(605 * S) == FROM + 600 * S


@given(st.floats(0.01, 50), st.integers(0, 60 * S))
def test_a_change_of_speed_keeps_the_place(speed: float, after_ns: int) -> None:
    cursor = Transport(FROM, TO)
    cursor.play(0)
    before = cursor.t_ns(after_ns)
    cursor.set_speed(speed, after_ns)
    assert cursor.t_ns(after_ns) == before
    assert abs(cursor.t_ns(after_ns + S) - min(before + round(speed * S), TO)) <= 1


def test_it_pauses_at_the_end_and_begins_anew() -> None:
    cursor = Transport(FROM, TO)
    cursor.seek(TO - S, 0)
    cursor.play(0)
    assert cursor.t_ns(5 * S) == TO
    assert cursor.wrapped(5 * S) is None
    assert not cursor.playing
    cursor.play(6 * S)
    assert cursor.t_ns(7 * S) == FROM + S


def test_a_loop_begins_again_but_only_for_who_is_before_its_end() -> None:
    cursor = Transport(FROM, TO)
    cursor.set_loop(Loop(FROM + 10 * S, FROM + 12 * S), 0)
    cursor.seek(FROM + 11 * S, 0)
    cursor.play(0)
    assert cursor.wrapped(S // 2) is None
    assert cursor.wrapped(S) == FROM + 10 * S
    cursor.seek(FROM + 20 * S, 2 * S)
    assert cursor.wrapped(4 * S) is None
    assert cursor.t_ns(4 * S) == FROM + 22 * S
    cursor.set_loop(None, 4 * S)
    assert cursor.end_ns == TO


@pytest.mark.parametrize("loop", [(FROM, FROM), (FROM + S, FROM), (FROM - 1, FROM + S), (FROM, TO + 1)])
def test_a_loop_that_is_no_stretch_of_the_recording_is_refused(loop: tuple[int, int]) -> None:
    with pytest.raises(UsageError, match="stretch"):
        Transport(FROM, TO).set_loop(Loop(*loop), 0)


@pytest.mark.parametrize("speed", [0.0, 0.009, 50.1, -1.0, float("nan")])
def test_a_speed_out_of_range_is_refused(speed: float) -> None:
    with pytest.raises(UsageError, match="speed"):
        Transport(FROM, TO).set_speed(speed, 0)


def test_the_speed_attained_is_that_of_the_last_second() -> None:
    attained = Attained()
    assert attained.speed is None
    for n in range(100):
        attained.take(n * S // 10, FROM + n * S // 5 if n < 50 else FROM + 10 * S + (n - 50) * S // 20)
    assert attained.speed == pytest.approx(0.5)
    attained.restart()
    assert attained.speed is None
