"""Profile position: targets, their hand-over, ramps, limits, units."""

from __future__ import annotations

from itertools import pairwise

import pytest

from app.twins.pd4e.servo import Bench
from tests.twins.pd4e.rig import Client, Rig

PP = 1
NEW, AT_ONCE, RELATIVE, ON_SET_POINT = 0x10, 0x20, 0x40, 0x200
REACHED, ACKNOWLEDGED, LIMITED, DEVIATES = 0x400, 0x1000, 0x800, 0x2000
ENABLED = 0x0F


def order(client: Client, target: int, *, bits: int = 0) -> None:
    """Hand a target over, with the handshake."""
    client.write("607A", target)
    assert client.control(ENABLED | bits) & ACKNOWLEDGED == 0
    assert client.control(ENABLED | NEW | bits) & ACKNOWLEDGED
    client.write("6040", ENABLED | bits)


def go(client: Client, target: int, *, bits: int = 0) -> int:
    """Go there; gives the time it took."""
    order(client, target, bits=bits)
    return client.until(lambda: client.has(REACHED), 120_000)


@pytest.fixture
def enabled(client: Client) -> Client:
    client.enable(PP)
    return client


def test_a_move_takes_the_time_of_its_trapezoid_and_ends_exactly(enabled: Client) -> None:
    """3 turns with 500/min and 500/min/s: 1 s to get up speed, 1 s to get down; the flat part lies between."""
    enabled.write("6081", 120)
    passed = go(enabled, 10_800)
    flat_s = (3 - 2 * (2 * 0.24 / 2)) / 2
    assert passed == pytest.approx((2 * 0.24 + flat_s) * 1000 + 100, abs=40), "and 6068h, 100 ms"
    assert enabled.read("6064") == 10_800
    assert enabled.read("6062") == 10_800


def test_the_speed_follows_6081_and_stays_within_607f_and_6080(enabled: Client) -> None:
    for where, speed in (("6081", 60), ("607F", 40), ("6080", 20)):
        enabled.write(where, speed)
        order(enabled, 3_600 if enabled.read("6064") < 1_800 else 0)
        enabled.advance(600)
        assert abs(enabled.read("606B")) == speed
        enabled.until(lambda: enabled.has(REACHED), 60_000)


def test_relative_moves_add_up_from_what_60f2_says(enabled: Client) -> None:
    enabled.write("60F2", 0)
    for _ in range(3):
        go(enabled, 300, bits=RELATIVE)
    assert enabled.read("6064") == 900
    enabled.write("6081", 10)
    order(enabled, 3_600, bits=AT_ONCE)
    enabled.advance(3_000)
    order(enabled, 100, bits=RELATIVE | AT_ONCE)
    enabled.until(lambda: enabled.has(REACHED), 120_000)
    assert enabled.read("6064") == 3_700, "relative to the last target"
    enabled.write("60F2", 2)
    order(enabled, 7_200, bits=AT_ONCE)
    enabled.advance(3_000)
    there = enabled.read("6064")
    order(enabled, 100, bits=RELATIVE | AT_ONCE)
    enabled.until(lambda: enabled.has(REACHED), 120_000)
    assert enabled.read("6064") == pytest.approx(there + 100, abs=2), "relative to the actual position"


def test_a_target_waits_until_the_one_before_is_reached(enabled: Client) -> None:
    order(enabled, 1_800)
    order(enabled, 3_600)
    enabled.write("607A", 7_200)
    status = enabled.control(ENABLED | NEW)
    assert status & ACKNOWLEDGED, "one waits: a further one is not taken"
    assert enabled.control(ENABLED) & ACKNOWLEDGED, "and bit 12 stays until one can be"
    speeds = []
    positions = []

    def watched() -> bool:
        speeds.append(enabled.read("606B"))
        positions.append(enabled.read("6062"))
        return enabled.has(REACHED)

    enabled.until(watched, 60_000, 1)
    assert 0 in [speed for speed, place in zip(speeds, positions, strict=True) if place == 1_800], "fully reached"
    assert enabled.read("6064") == 3_600
    assert enabled.control(ENABLED) & ACKNOWLEDGED == 0


def test_bit_9_passes_the_first_target_without_a_stop(enabled: Client) -> None:
    order(enabled, 1_800, bits=ON_SET_POINT)
    order(enabled, 3_600, bits=ON_SET_POINT)
    least = 1_000

    def watched() -> bool:
        nonlocal least
        if abs(enabled.read("6062") - 1_800) < 60:
            least = min(least, enabled.read("606B"))
        return enabled.has(REACHED)

    enabled.until(watched, 60_000, 1)
    assert 100 < least < 1_000
    assert enabled.read("6064") == 3_600


def test_bit_5_changes_at_once(enabled: Client) -> None:
    order(enabled, 36_000)
    enabled.advance(500)
    order(enabled, 0, bits=AT_ONCE)
    enabled.until(lambda: enabled.has(REACHED), 60_000)
    assert enabled.read("6064") == 0


def test_halt_and_on_to_the_same_target(enabled: Client) -> None:
    order(enabled, 7_200)
    enabled.advance(200)
    enabled.write("6040", 0x010F)
    enabled.until(enabled.stands)
    assert 0 < enabled.read("6064") < 7_200
    enabled.until(lambda: enabled.has(REACHED), 100)  # with halt it tells that the motor stands
    enabled.write("6040", ENABLED)
    enabled.advance(20)
    assert not enabled.has(REACHED)
    enabled.until(lambda: enabled.has(REACHED), 60_000)
    assert enabled.read("6064") == 7_200


@pytest.mark.parametrize("option", [0x10, 0x20])
def test_the_drive_may_reset_bit_4_itself(enabled: Client, option: int) -> None:
    enabled.write("60F2", option)
    enabled.write("607A", 360)
    enabled.write("6040", ENABLED | NEW)
    if option == 0x20:
        assert enabled.read("6040") == ENABLED, "as soon as the target was taken"
    else:
        assert enabled.read("6040") == ENABLED | NEW
    enabled.until(lambda: enabled.has(REACHED))
    if option == 0x10:
        enabled.until(lambda: enabled.read("6040") == ENABLED, 50)
    assert enabled.read("6064") == 360


def test_a_target_beyond_the_software_limit_ends_there(enabled: Client) -> None:
    enabled.write("607D:01", -1_000)
    enabled.write("607D:02", 1_000)
    go(enabled, 5_000)
    assert enabled.read("6064") == 1_000
    assert enabled.has(LIMITED)
    go(enabled, 500)
    assert enabled.read("6064") == 500
    assert not enabled.has(LIMITED)


def test_outside_the_software_limit_it_only_moves_back(enabled: Client) -> None:
    go(enabled, 3_000)
    enabled.write("607D:01", -1_000)
    enabled.write("607D:02", 1_000)
    go(enabled, 4_000)
    assert enabled.read("6064") == 1_000, "towards the allowed range, never on"


def test_target_reached_waits_for_the_window_and_its_time(enabled: Client) -> None:
    enabled.write("6068", 400)
    slow = go(enabled, 360)
    enabled.write("6068", 0)
    assert slow - go(enabled, 0) == pytest.approx(400, abs=40), "less the end of the ramp, already within the window"


def test_jerk_limited_ramps_are_softer_and_end_exactly(enabled: Client) -> None:
    enabled.write("6083", 500)
    enabled.write("6084", 500)
    sharp = go(enabled, 3_600)
    enabled.write("6086", 3)
    for sub in range(1, 5):
        enabled.write(f"60A4:{sub:02X}", 2_000)
    order(enabled, 7_200)
    speeds = []

    def watched() -> bool:
        speeds.append(enabled.read("606B"))
        return enabled.has(REACHED)

    soft = enabled.until(watched, 60_000, 10)
    assert enabled.read("6064") == 7_200
    assert soft == pytest.approx(sharp + 250, abs=80), "longer by acceleration / jerk, less the softer end"
    gains = [after - before for before, after in pairwise(speeds)]
    jerks = [after - before for before, after in pairwise(gains)]
    assert max(abs(jerk) for jerk in jerks) <= 2_000 * 0.01 * 0.01 + 2, "2000/min/s2 over 10 ms, and rounding"


def test_positions_in_other_units(client: Client) -> None:
    """Degrees behind a gear of 10: one turn of the shaft is ten of the motor."""
    client.write("60A8", 0x00410000)
    client.write("6091:01", 10)
    client.write("60A9", 0x00410300)
    client.write("6081", 90)
    client.write("6083", 1_000)
    client.write("6084", 1_000)
    client.write("6065", 20)
    client.enable(PP)
    order(client, 90)
    client.advance(500)
    assert client.read("606B") == 90
    client.until(lambda: client.has(REACHED))
    assert client.read("6064") == 90
    assert client.read("6063") == pytest.approx(90 / 360 * 10 * 320_000, abs=320_000 / 36), "open loop increments"


def test_a_feed_makes_lengths(client: Client) -> None:
    """5000 µm a revolution of the output shaft, gear 2."""
    client.write("60A8", 0xFA010000)
    client.write("6091:01", 2)
    client.write("6092:01", 5_000)
    client.write("6065", 10_000)
    client.enable(PP)
    go(client, 2_500)
    assert client.read("6063") == pytest.approx(320_000, abs=64)


def test_units_do_not_change_while_enabled(enabled: Client) -> None:
    go(enabled, 3_600)
    enabled.write("60A8", 0x00410000)
    assert enabled.read("6064") == 3_600
    enabled.control(0x06)
    enabled.until(lambda: enabled.read("6064") == 360, 200)


def test_polarity_turns_the_motor_the_other_way(rig: Rig) -> None:
    client = rig.client
    client.write("607E", 0x80)
    client.enable(PP)
    go(client, 3_600)
    assert client.read("6064") == 3_600
    assert client.read("6063") == pytest.approx(-320_000, abs=100)


def test_a_blocked_shaft_is_a_following_error(rig: Rig) -> None:
    client = rig.client
    client.write("3700", 2)
    client.write("6066", 50)
    client.enable(PP)
    rig.device.servo.bench = Bench(low_stop=0.0, high_stop=0.0)
    order(client, 3_600)
    client.until(client.fault, 5_000)
    assert client.has(DEVIATES)
    assert client.read("1003:01") == 0x0D208611
    assert client.read("603F") == 0x8611
    assert client.read("1001") == 0x21
    client.control(0x00, 0x80)
    assert not client.has(DEVIATES)


def test_a_load_that_drags_the_shaft_along_does_not_keep_it_from_the_fault(rig: Rig) -> None:
    client = rig.client
    client.write("3700", 0)
    client.enable(PP)
    rig.device.servo.load_nm = -50.0
    client.until(client.fault, 5_000)
    assert client.read("6077") == 0


def test_a_following_error_without_reaction_only_shows(rig: Rig) -> None:
    client = rig.client
    client.enable(PP)
    assert client.read("3700") == -1, "as delivered"
    rig.device.servo.load_nm = -50.0
    order(client, 3_600)
    client.until(lambda: client.has(DEVIATES), 5_000)
    client.advance(500)
    assert not client.fault()


def test_a_window_of_all_ones_is_not_watched(rig: Rig) -> None:
    client = rig.client
    client.write("6065", 0xFFFFFFFF)
    client.enable(PP)
    rig.device.servo.load_nm = -50.0
    order(client, 3_600)
    client.advance(1_000)
    assert not client.has(DEVIATES)
