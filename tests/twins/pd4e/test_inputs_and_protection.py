"""Digital inputs and outputs, limit switches, I2t, temperatures, error stack, NanoJ."""

from __future__ import annotations

import pytest

from app.twins.pd4e.servo import Bench
from tests.twins.pd4e.rig import Client, Rig, running

WARNING = 0x80
PINS = 0x3 << 16
"""Outputs 1 and 2; what the others are routed to as delivered is not known."""


def levels(rig: Rig, pins: int) -> None:
    """Set input pins from outside, bit 0 for input 1."""
    rig.device.drive.conditions.levels = pins


def test_inputs_are_seen_plain_and_as_special_functions(rig: Rig) -> None:
    client = rig.client
    levels(rig, 0b01101)
    assert client.read("60FD") == 0b01101 << 16, "special functions are off as delivered"
    assert client.read("3240:05") == 0b01101 << 16 | 0b101
    client.write("3240:01", 0b101)
    assert client.read("60FD") == 0b01101 << 16 | 0b101


def test_inputs_are_inverted_and_forced(rig: Rig) -> None:
    client = rig.client
    client.write("3240:01", 0x7)
    client.write("3240:02", 1 << 17 | 0b1)
    levels(rig, 0b0010)
    assert client.read("60FD") == 0b011, "input 2 inverted is 0, negative limit inverted is 1"
    client.write("3240:03", 1 << 16 | 0b10)
    client.write("3240:04", 1 << 16)
    assert client.read("60FD") == 1 << 16 | 0b001


def test_analogue_inputs_are_read_in_digits_and_with_offset_and_divisor(rig: Rig) -> None:
    client = rig.client
    rig.device.drive.conditions.analogue = (1023, -500)
    assert [client.read(f"3220:0{sub}") for sub in (1, 2)] == [1023, -500]
    assert [client.read(f"3320:0{sub}") for sub in (1, 2)] == [1023, -500], "as delivered: nothing added, divided by 1"
    client.write("3321:01", -23)
    client.write("3322:01", 100)
    client.write("3322:02", -7)
    assert [client.read(f"3320:0{sub}") for sub in (1, 2)] == [10, 71]
    client.write("3321:01", -2000)
    assert client.read("3320:01") == -9, "towards 0"
    assert client.read("3220:01") == 1023, "the digits stay what they are"


def test_routing_begins_as_the_inputs_were_and_then_follows_its_sources(rig: Rig) -> None:
    client = rig.client
    client.write("3240:01", 0b001)
    client.write("3240:02", 0b001)
    levels(rig, 0b0100)
    before = client.read("60FD")
    client.write("3240:08", 1)
    assert client.read("60FD") == before
    assert client.read("3242:01") == 0x81, "input 1 inverted"
    assert client.read("3242:02") == 0
    assert client.read("3242:11") == 1
    client.write("3242:02", 3)
    client.write("3242:03", 0x80)
    client.write("3242:01", 0)
    assert client.read("60FD") & 0x7 == 0b110
    client.write("3240:02", 0xFFFFFFFF)
    assert client.read("60FD") & 0x7 == 0b110, "inversion has no function any more"
    client.write("3240:08", 0)
    assert client.read("60FD") != before


def test_outputs_are_inverted_forced_and_routed(client: Client) -> None:
    client.write("60FE:01", 0b01 << 16)
    assert client.read("3250:05") == 0b01 << 16
    client.write("3250:02", 0b11 << 16)
    assert client.read("3250:05") == 0b10 << 16
    client.write("3250:03", 0b11 << 16)
    client.write("3250:04", 0b01 << 16)
    assert client.read("3250:05") == 0b01 << 16
    client.write("3250:08", 1)
    assert client.read("3250:05") & PINS == 0b01 << 16, "as delivered each follows its bit of 60FEh"
    client.write("60FE:01", 0b10 << 16)
    assert client.read("3250:05") & PINS == 0b10 << 16
    client.write("3252:02", 0x0091)
    client.write("3252:03", 0x0100)
    assert client.read("3250:05") & PINS == 0b01 << 16, "output 1 by the other bit, output 2 always low"


def test_the_brake_opens_with_operation_enabled(client: Client) -> None:
    client.write("3202", client.read("3202") | 0x4)
    assert client.read("3250:05") & 1 == 0
    client.enable(0)
    assert client.read("3250:05") & 1 == 1


def to_the_limit(client: Client, option: int) -> None:
    client.write("3701", option)
    client.write("3240:01", 0x3)
    client.enable(3)
    client.write("60FF", 60)


SWITCHES = Bench(negative_switch=-1.0, positive_switch=1.0)


def test_a_limit_switch_warns_and_as_delivered_does_not_stop() -> None:
    with running(bench=SWITCHES) as rig:
        client = rig.client
        to_the_limit(client, -1)
        client.until(lambda: client.has(WARNING), 10_000)
        assert client.read("1003:01") == 0x0A208612
        assert client.read("606C") > 50, "the manual's safety trap: 3701h is -1 as delivered"
        client.write("60FF", -60)
        client.until(lambda: not client.has(WARNING), 10_000)
        client.until(lambda: client.has(WARNING), 10_000)
        assert client.read("1003:01") == 0x0B208612
        assert client.read("1003:02") == 0x0A208612


@pytest.mark.parametrize("option", [0, 1, 2])
def test_with_3701_a_limit_switch_stops_and_bars_its_direction(option: int) -> None:
    with running(bench=SWITCHES) as rig:
        client = rig.client
        to_the_limit(client, option)
        client.until(lambda: client.read("6041") & 0x6F == 0x40, 10_000)
        place = client.read("6064")
        client.enable(3)
        client.advance(1_000)
        assert client.read("6064") == pytest.approx(place, abs=5), "no further"
        client.write("60FF", -60)
        client.until(lambda: not client.has(WARNING), 10_000)
        assert client.read("6041") & 0x6F == 0x27


def i2t(client: Client) -> None:
    """Closed loop on the BLDC type: rated 3 A, twice that for 500 ms."""
    client.write("3202", client.read("3202") | 1)
    client.write("203B:02", 500)
    client.write("6072", 2_000)
    client.write("6071", 2_000)
    client.enable(4)


def test_i2t_lets_the_peak_last_as_long_as_allowed_and_then_limits() -> None:
    with running(variant="pd4-eb59", bench=Bench(low_stop=0.0, high_stop=0.0)) as rig:
        client = rig.client
        i2t(client)
        client.advance(400)
        assert client.read("6077") == 2_000
        assert client.read("203B:05") == 6_000
        assert client.read("203B:04") < client.read("203B:03") == 13_500
        client.advance(200)
        assert client.read("6077") == 1_000, "the rated current"
        assert client.read("203B:05") == 3_000
        assert client.read("203B:06") == 1
        client.write("6071", 0)
        client.advance(2_000)
        client.write("6071", 2_000)
        client.advance(50)
        assert client.read("6077") == 2_000, "free again after a rest"


def test_without_a_duration_there_is_no_i2t() -> None:
    with running(variant="pd4-eb59", bench=Bench(low_stop=0.0, high_stop=0.0)) as rig:
        client = rig.client
        i2t(client)
        client.write("203B:02", 0)
        client.advance(5_000)
        assert client.read("6077") == 2_000
        assert client.read("203B:03") == 0


def test_the_maximum_current_bounds_what_6073_asks_for() -> None:
    with running(variant="pd4-eb59", bench=Bench(low_stop=0.0, high_stop=0.0)) as rig:
        client = rig.client
        client.write("2031", 4_500)
        i2t(client)
        client.advance(10)
        assert client.read("6077") == 1_500


def test_current_warms_the_motor_up(rig: Rig) -> None:
    client = rig.client
    client.write("3202", 1)
    rig.device.servo.bench = Bench(low_stop=0.0, high_stop=0.0)
    client.write("6072", 1_000)
    client.write("6071", 1_000)
    cold = client.read("4014:03")
    assert cold == 250
    client.enable(4)
    client.advance(60_000)
    assert cold + 40 < client.read("4014:03") < cold + 80


def test_supply_voltages_are_measured_and_watched(rig: Rig) -> None:
    client = rig.client
    assert (client.read("4014:01"), client.read("4014:02")) == (48_000, 24_000)
    rig.device.drive.conditions.supply_mv = 9_000
    client.until(client.fault, 100)
    assert client.read("1003:01") == 0x03043100
    assert client.read("1001") == 0x05


def test_the_stack_holds_eight_and_is_emptied_by_a_zero(rig: Rig) -> None:
    client = rig.client
    assert client.read("1003:00") == 0
    assert client.refused(lambda: client.read("1003:01")) == 0x08000024
    for number in range(10):
        supply = 60_000 if number % 2 else 5_000
        rig.device.drive.conditions.supply_mv = supply
        client.until(client.fault, 100)
        rig.device.drive.conditions.supply_mv = 48_000
        client.advance(2)
        client.control(0x00, 0x80)
    assert client.read("1003:00") == 8
    assert [client.read(f"1003:0{place}") >> 24 for place in range(1, 9)] == [1, 3] * 4
    assert client.refused(lambda: client.write("1003:00", 1)) == 0x06090030
    client.write("1003:00", 0)
    assert client.read("1003:00") == 0
    assert client.refused(lambda: client.read("1003:01")) == 0x08000024


def test_a_nanoj_program_runs_and_is_ended(client: Client) -> None:
    client.write("2300", 1)
    assert client.read("2301") == 1
    client.write("2300", 0)
    assert client.read("2301") == 0
    assert client.read("2302") == 0


def test_a_nanoj_program_that_hangs_ends_with_4_and_5(rig: Rig) -> None:
    client = rig.client
    client.write("2300", 1)
    rig.device.nanoj.hangs = True
    client.advance(2)
    assert client.read("2301") == 4
    assert client.read("2302") == 5


def test_without_a_nanoj_program_the_start_is_an_error() -> None:
    with running(nanoj_program=False) as rig:
        rig.client.write("2300", 1)
        assert rig.client.read("2301") == 4
        assert rig.client.read("2302") != 0
