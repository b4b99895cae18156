"""Velocity, profile velocity, torque, cyclic and interpolated modes."""

from __future__ import annotations

import pytest

from app.twins.pd4e.servo import Bench
from tests.twins.pd4e.rig import Client, Rig, running

REACHED, LIMITED, BIT_12, DEVIATES = 0x400, 0x800, 0x1000, 0x2000


def test_velocity_ramps_by_delta_speed_over_delta_time(client: Client) -> None:
    client.write("6048:01", 300)
    client.write("6048:02", 2)
    client.write("6049:01", 600)
    client.enable(2)
    client.write("6042", 300)
    assert client.until(lambda: client.has(REACHED), 10_000) == pytest.approx(2_000, abs=20)
    assert client.read("6043") == 300
    assert client.read("6044") == pytest.approx(300, abs=2)
    assert client.read("606C") == pytest.approx(300, abs=2)
    client.write("6042", 0)
    assert client.until(client.stands, 10_000) == pytest.approx(500, abs=30)


def test_velocity_keeps_to_its_limits(client: Client) -> None:
    client.write("6046:01", 50)
    client.write("6046:02", 200)
    client.enable(2)
    for target, wanted, limited in ((1_000, 200, True), (10, 50, True), (-1_000, -200, True), (100, 100, False)):
        client.write("6042", target)
        client.advance(3_000)
        assert client.read("606B") == wanted
        assert client.has(LIMITED) == limited
    client.write("6080", 80)
    client.advance(1_000)
    assert client.read("606B") == 80


def test_the_dimension_factor_divides_what_velocity_shows(client: Client) -> None:
    client.write("604C:01", 10)
    client.enable(2)
    client.write("6042", 12)
    client.until(lambda: client.has(REACHED))
    assert client.read("606B") == 120
    assert client.read("6043") == 12
    assert client.read("6044") == pytest.approx(12, abs=1)


def test_quick_stop_of_velocity_is_604a(client: Client) -> None:
    client.write("604A:01", 1_000)
    client.write("6048:01", 5_000)
    client.enable(2)
    client.write("6042", 500)
    client.until(lambda: client.has(REACHED))
    client.advance(100)
    client.write("6040", 0x0B)
    assert client.until(client.stands, 10_000) == pytest.approx(500, abs=30)


def test_profile_velocity_reaches_holds_and_tells(client: Client) -> None:
    client.write("606E", 100)
    client.enable(3)
    assert client.has(BIT_12), "it stands"
    client.write("60FF", -240)
    passed = client.until(lambda: client.has(REACHED), 10_000)
    assert passed == pytest.approx((240 - 30) / 500 * 1000 + 100, abs=30), "6083h, and 606Eh within 606Dh"
    assert not client.has(BIT_12)
    assert client.read("606C") == pytest.approx(-240, abs=2)
    assert client.read("6064") < 0


@pytest.mark.parametrize(("where", "limit"), [("607F", 120), ("6080", 90)])
def test_profile_velocity_keeps_below_the_smaller_limit(client: Client, where: str, limit: int) -> None:
    client.write(where, limit)
    client.enable(3)
    client.write("60FF", 300)
    client.advance(1_500)
    assert client.read("606B") == limit


def test_slippage_is_a_fault_by_3700(rig: Rig) -> None:
    client = rig.client
    client.write("3700", 1)
    client.write("60F8", 100)
    client.write("203F", 80)
    client.enable(3)
    client.write("60FF", 240)
    client.until(lambda: client.has(REACHED))
    assert not client.has(DEVIATES)
    rig.device.servo.load_nm = -50.0
    client.until(lambda: client.read("6041") & DEVIATES != 0, 2_000, 1)
    rig.device.servo.load_nm = 0.0
    client.until(client.fault, 10_000)
    assert client.read("603F") == 0x8400
    assert client.read("1003:01") >> 24 == 30


def test_torque_needs_the_closed_loop(client: Client) -> None:
    client.write("6072", 500)
    client.write("6071", 300)
    client.enable(4)
    client.advance(100)
    assert client.read("6077") == 0
    assert client.stands()
    assert not client.has(0x8000)


def closed_loop(client: Client) -> None:
    client.write("3202", client.read("3202") | 1)


def test_torque_follows_its_slope_and_limits(rig: Rig) -> None:
    client = rig.client
    closed_loop(client)
    rig.device.servo.bench = blocked()
    client.write("6072", 600)
    client.write("6087", 500)
    client.write("203D", 10)
    client.write("203E", 50)
    client.write("6071", 500)
    client.enable(4)
    client.advance(500)
    assert client.read("6074") == pytest.approx(250, abs=5)
    assert client.read("6077") == pytest.approx(250, abs=5)
    assert not client.has(REACHED)
    passed = client.until(lambda: client.has(REACHED), 5_000)
    assert passed == pytest.approx(480 + 50, abs=30)
    client.write("6071", 900)
    client.advance(2_000)
    assert client.read("6077") == 600, "6072h"
    client.write("6073", 400)
    client.advance(2_000)
    assert client.read("6077") == 400, "6073h"


def blocked() -> Bench:
    return Bench(low_stop=0.0, high_stop=0.0)


def test_torque_mode_keeps_below_the_speed_limit(client: Client) -> None:
    closed_loop(client)
    client.write("6080", 300)
    client.write("6072", 500)
    client.write("6071", 500)
    client.enable(4)
    client.advance(3_000)
    assert 250 < client.read("606C") <= 300


def test_cyclic_position_interpolates_between_set_points(client: Client) -> None:
    client.write("60C2:01", 100)
    client.enable(8)
    for target in range(36, 361, 36):
        client.write("607A", target)
        client.advance(100)
        assert client.read("6062") == target
        assert client.has(BIT_12)
    client.advance(100)
    assert client.read("6064") == 360
    client.write("60B0", 40)
    client.advance(200)
    assert client.read("6062") == 400


def test_cyclic_position_does_not_jump_when_it_begins(client: Client) -> None:
    client.write("607A", 100_000)
    client.enable(8)
    client.advance(50)
    assert abs(client.read("6062")) <= 1


def test_cyclic_velocity_has_no_ramp(client: Client) -> None:
    client.enable(9)
    client.write("60FF", 100)
    client.write("60B1", 20)
    client.advance(2)
    assert client.read("606B") == 120


def test_cyclic_torque_takes_set_point_and_offset(rig: Rig) -> None:
    client = rig.client
    closed_loop(client)
    rig.device.servo.bench = blocked()
    client.write("6072", 1_000)
    client.enable(10)
    client.write("6071", 200)
    client.write("60B2", -50)
    client.advance(5)
    assert client.read("6077") == 150


def test_interpolated_position_needs_bit_4(client: Client) -> None:
    client.write("60C2:01", 200)
    client.enable(7)
    client.write("60C1:01", 360)
    client.advance(500)
    assert client.read("6062") == 0
    client.write("60C1:01", 720)
    client.advance(1)
    client.write("6040", 0x1F)
    client.write("60C1:01", 360)
    client.advance(100)
    assert client.read("6062") == pytest.approx(180, abs=5)
    client.advance(200)
    assert client.read("6064") == pytest.approx(360, abs=1)


def test_a_change_of_mode_while_it_turns_brings_it_to_rest_first(client: Client) -> None:
    client.enable(3)
    client.write("60FF", 200)
    client.until(lambda: client.has(REACHED))
    client.write("6060", 1)
    client.advance(5)
    assert client.read("6061") == 1
    assert client.read("606B") > 100, "no jump"
    client.until(client.stands, 5_000)


def test_the_auto_setup_turns_the_motor_and_stores_what_it_found() -> None:
    with running() as rig:
        client = rig.client
        client.write("2030", 7)
        assert client.control(0x06) & 0x0221 == 0x0221
        client.write("6060", -2)
        assert client.control(0x07) & 0x0233 == 0x0233
        assert client.read("6061") == -2
        client.control(0x0F, 0x1F)
        client.advance(500)
        assert client.read("606C") != 0
        client.until(lambda: client.has(BIT_12), 10_000)
        client.advance(10)
        assert client.read("2030") == 50
        client.control(0x00)
        assert rig.restart().read("2030") == 50, "it saves by itself"
