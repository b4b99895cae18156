"""Homing: where each method ends, with switches, index pulses and blocks on a simulated slide."""

from __future__ import annotations

import pytest

from app.twins.pd4e.servo import Bench
from tests.twins.pd4e.rig import Client, Rig, running

HOMING = 6
REACHED, ATTAINED, FAILED = 0x400, 0x1000, 0x2000
TURN = 3_600
"""Position units in a motor revolution as delivered."""
LOW, HIGH = -1.0, 1.5
LEFT, RIGHT = 0.4, 0.6
"""Edges of the reference switch, in revolutions from the start; limit switches at LOW and HIGH."""
SLIDE = Bench(
    low_stop=LOW - 0.2,
    high_stop=HIGH + 0.2,
    negative_switch=LOW,
    positive_switch=HIGH,
    home_switch=(LEFT, RIGHT),
    index=0.25,
)
ENDLESS_RIGHT = Bench(low_stop=-2, high_stop=2, home_switch=(LEFT, 10.0), index=0.25)
ENDLESS_LEFT = Bench(low_stop=-2, high_stop=2, home_switch=(-10.0, RIGHT), index=0.25)
NEAR = 25
"""Units within which the place is met: a millisecond at the slower speed, and the encoder's step."""

AT_EDGE = {
    17: LOW,
    18: HIGH,
    23: LEFT,
    24: LEFT,
    25: RIGHT,
    26: RIGHT,
    27: RIGHT,
    28: RIGHT,
    29: LEFT,
    30: LEFT,
}
AT_INDEX = {1: -0.75, 2: 1.25, 7: 0.25, 8: 1.25, 9: 0.25, 10: 1.25, 11: 1.25, 12: 0.25, 13: 1.25, 14: 0.25}
"""The first index after the edge, in the direction in which the edge is passed."""


def prepare(client: Client, method: int) -> None:
    client.write("3240:01", 0x7)
    client.write("6098", method)
    client.write("6099:01", 60)
    client.write("6099:02", 10)
    client.enable(HOMING)


def home(client: Client) -> None:
    """Run until it has ended one way or the other."""
    status = client.control(0x1F)
    assert not status & (ATTAINED | FAILED | REACHED), "in progress"
    client.until(lambda: client.read("6041") & (ATTAINED | FAILED) != 0, 60_000)
    client.until(lambda: client.has(REACHED), 1_000)


def zero(rig: Rig) -> float:
    """Where the zero lies now, in revolutions from the start."""
    return rig.device.drive.axis.zero


def start_at(rig: Rig, place: float) -> None:
    """Move the slide by hand, while nobody controls it."""
    rig.device.servo.position = place


@pytest.mark.parametrize("start", [0.0, 0.5, 1.2])
@pytest.mark.parametrize("method", sorted(AT_EDGE | AT_INDEX))
def test_a_method_ends_at_its_edge_or_index_from_anywhere(method: int, start: float) -> None:
    with running(bench=SLIDE) as rig:
        start_at(rig, start)
        prepare(rig.client, method)
        home(rig.client)
        assert rig.client.has(ATTAINED | REACHED)
        assert not rig.client.has(FAILED)
        place = (AT_EDGE | AT_INDEX)[method]
        assert zero(rig) * TURN == pytest.approx(place * TURN, abs=NEAR)
        assert abs(rig.client.read("6064")) < NEAR, "it stops at once"


@pytest.mark.parametrize(
    ("method", "place", "bench", "starts"),
    [
        (19, LEFT, ENDLESS_RIGHT, (0.0, 0.7)),
        (20, LEFT, ENDLESS_RIGHT, (0.0, 0.7)),
        (21, RIGHT, ENDLESS_LEFT, (0.2, 0.9)),
        (22, RIGHT, ENDLESS_LEFT, (0.2, 0.9)),
        (3, 0.25, ENDLESS_RIGHT, (0.0, 0.7)),
        (4, 1.25, ENDLESS_RIGHT, (0.0, 0.7)),
        (5, 1.25, ENDLESS_LEFT, (0.2, 0.9)),
        (6, 0.25, ENDLESS_LEFT, (0.2, 0.9)),
    ],
)
def test_methods_of_one_edge(method: int, place: float, bench: Bench, starts: tuple[float, ...]) -> None:
    for start in starts:
        with running(bench=bench) as rig:
            start_at(rig, start)
            prepare(rig.client, method)
            home(rig.client)
            assert rig.client.has(ATTAINED | REACHED)
            assert zero(rig) * TURN == pytest.approx(place * TURN, abs=NEAR)


@pytest.mark.parametrize(("method", "place"), [(33, -0.75), (34, 0.25)])
def test_the_next_index(method: int, place: float) -> None:
    with running(bench=Bench(index=0.25)) as rig:
        prepare(rig.client, method)
        home(rig.client)
        assert zero(rig) * TURN == pytest.approx(place * TURN, abs=NEAR)


@pytest.mark.parametrize(("method", "place"), [(-17, LOW - 0.2), (-18, HIGH + 0.2), (-1, -0.75), (-2, 1.25)])
def test_homing_on_block_takes_the_block_for_the_limit(method: int, place: float) -> None:
    bench = Bench(low_stop=LOW - 0.2, high_stop=HIGH + 0.2, index=0.25)
    with running(bench=bench) as rig:
        client = rig.client
        prepare(client, method)
        client.control(0x1F)
        most = 0

        def watched() -> bool:
            nonlocal most
            most = max(most, abs(client.read("2039:02")))
            return client.has(ATTAINED)

        client.until(watched, 60_000)
        assert most <= client.read("203A:01"), "no more current than 203Ah:01"
        client.until(client.stands, 1_000)
        assert zero(rig) * TURN == pytest.approx(place * TURN, abs=NEAR)


def test_a_block_counts_after_its_time(rig: Rig) -> None:
    client = rig.client
    rig.device.servo.bench = Bench(low_stop=-0.01)
    client.write("203A:02", 700)
    prepare(client, -17)
    client.control(0x1F)
    assert 700 <= client.until(lambda: client.has(ATTAINED), 10_000) < 900


@pytest.mark.parametrize("method", [35, 37])
@pytest.mark.parametrize("enabled", [False, True])
def test_the_present_position_needs_no_operation_enabled(rig: Rig, method: int, enabled: bool) -> None:
    client = rig.client
    start_at(rig, 0.5)
    assert client.read("6064") == 1_800
    if enabled:
        prepare(client, method)
    else:
        client.write("6098", method)
        client.write("6060", HOMING)
    client.write("6040", 0x1F if enabled else 0x10)
    client.advance(2)
    assert client.read("6064") == 0
    assert client.has(ATTAINED | REACHED)
    increments = round(0.5 * 320_000)
    assert client.read("6063") == pytest.approx(increments, abs=200), "the encoder's count is not reset"


def test_the_home_offset_moves_the_zero(rig: Rig) -> None:
    client = rig.client
    client.write("607C", 250)
    client.write("6098", 35)
    client.write("6060", HOMING)
    client.write("6040", 0x10)
    client.advance(2)
    assert client.read("6064") == -250


def test_the_switches_must_be_special_functions_first() -> None:
    with running(bench=SLIDE) as rig:
        client = rig.client
        prepare(client, 17)
        client.write("3240:01", 0)
        client.control(0x1F)
        client.advance(10_000)
        assert client.read("6041") & (ATTAINED | REACHED) == 0, "it pushes against the stop and sees no switch"


def test_bit_4_taken_back_gives_the_run_up() -> None:
    with running(bench=SLIDE) as rig:
        client = rig.client
        prepare(client, 17)
        client.control(0x1F)
        client.advance(200)
        client.write("6040", 0x0F)
        client.until(client.stands, 1_000)
        assert client.read("6041") & (ATTAINED | FAILED) == 0
        home(client)
        assert client.has(ATTAINED)


@pytest.mark.parametrize("method", [0, 15, 16, 31, 32, 36, -3, -35])
def test_a_method_that_does_not_exist_is_an_error(rig: Rig, method: int) -> None:
    client = rig.client
    prepare(client, method)
    client.control(0x1F)
    client.advance(5)
    assert client.has(FAILED)
    assert not client.has(ATTAINED)
    assert client.stands()


def test_a_switch_that_is_never_met_is_an_error() -> None:
    with running(bench=Bench(low_stop=-2, high_stop=2, negative_switch=-1.0, positive_switch=1.0)) as rig:
        prepare(rig.client, 23)
        home(rig.client)
        assert rig.client.has(FAILED)
        assert not rig.client.has(ATTAINED)


def test_with_3701_set_a_limit_switch_stops_the_homing() -> None:
    """The manual's tip: -1, as delivered, is needed to home with limit switches."""
    with running(bench=SLIDE) as rig:
        client = rig.client
        client.write("3701", 2)
        prepare(client, 17)
        client.control(0x1F)
        client.until(lambda: client.read("6041") & 0x6F == 0x40, 10_000)
        assert not client.has(ATTAINED)


def test_the_speed_falls_at_the_switch_at_once() -> None:
    with running(bench=SLIDE) as rig:
        client = rig.client
        client.write("609A", 300)
        prepare(client, 17)
        client.control(0x1F)
        fast: list[int] = []
        slow: list[int] = []

        def watched() -> bool:
            (fast if client.read("60FD") & 1 == 0 else slow).append(client.read("606B"))
            return client.has(ATTAINED)

        client.until(watched, 60_000, 1)
        assert min(fast) == -60
        assert fast[50] == pytest.approx(-15, abs=2), "609Ah: 300/min/s"
        assert set(slow[2:-1]) <= set(range(11)), "back with 6099h:02, without a ramp down from 60"
