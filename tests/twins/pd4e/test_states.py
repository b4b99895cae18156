"""Power state machine and option codes, over the wire."""

from __future__ import annotations

from functools import partial

import pytest

from tests.twins.pd4e.rig import Client, Rig

SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED = 0x0240, 0x0221, 0x0233, 0x0237
MASK = 0x027F


def state(client: Client) -> int:
    return client.read("6041") & MASK


def test_the_way_up_and_down_step_by_step(client: Client) -> None:
    assert client.read("6041") == 0x0640, "as the example of the manual shows it (page 115)"
    steps = [(0x06, READY), (0x07, SWITCHED_ON), (0x0F, ENABLED), (0x06, None), (0x00, SWITCH_ON_DISABLED)]
    for word, wanted in steps:
        client.write("6040", word)
        if wanted is None:
            client.until(lambda: state(client) == READY, 100)
        else:
            assert state(client) == wanted


def test_operation_cannot_be_enabled_without_shutdown_first(client: Client) -> None:
    assert client.control(0x0F) & MASK == SWITCH_ON_DISABLED
    assert client.control(0x07) & MASK == SWITCH_ON_DISABLED


def test_ready_goes_up_to_enabled_in_one_word(client: Client) -> None:
    assert client.control(0x06, 0x0F) & MASK == ENABLED


@pytest.mark.parametrize(("from_words", "word"), [((0x06,), 0x00), ((0x06, 0x07), 0x02), ((0x06, 0x0F), 0x00)])
def test_voltage_off_and_quick_stop_lead_to_switch_on_disabled(
    client: Client, from_words: tuple[int, ...], word: int
) -> None:
    client.control(*from_words)
    assert client.control(word) & MASK == SWITCH_ON_DISABLED


def spin(client: Client, rpm: int = 600) -> None:
    """Profile velocity, at its target."""
    client.write("6083", 20_000)
    client.write("60C5", 20_000)
    client.enable(3)
    client.write("60FF", rpm)
    client.until(lambda: client.has(0x400))


def stop_time(client: Client) -> int:
    return client.until(client.stands, 60_000, 5)


RAMP_5000 = 600 / 5000 * 1000
RAMP_500 = 600 / 500 * 1000


@pytest.mark.parametrize(
    ("code", "takes_ms", "ends"),
    [
        (0, 10, SWITCH_ON_DISABLED),
        (1, RAMP_500, SWITCH_ON_DISABLED),
        (2, RAMP_5000, SWITCH_ON_DISABLED),
        (5, RAMP_500, 0x0217),
        (6, RAMP_5000, 0x0217),
    ],
)
def test_quick_stop_by_605a(client: Client, code: int, takes_ms: float, ends: int) -> None:
    client.write("605A", code)
    spin(client)
    client.write("6040", 0x0B)
    assert state(client) == 0x0217, "Quick stop active, with voltage"
    assert stop_time(client) == pytest.approx(takes_ms, abs=60)
    client.until(lambda: state(client) == ends, 100)


def test_quick_stop_that_stays_can_be_left_to_operation_enabled(client: Client) -> None:
    client.write("605A", 6)
    spin(client)
    client.write("6040", 0x0B)
    client.until(client.stands)
    assert client.control(0x0F) & MASK == ENABLED
    client.until(lambda: client.read("606C") > 590)


@pytest.mark.parametrize(("code", "takes_ms"), [(0, 10), (1, RAMP_500)])
def test_shutdown_by_605b_leads_to_ready(client: Client, code: int, takes_ms: float) -> None:
    client.write("605B", code)
    spin(client)
    client.write("6040", 0x06)
    assert stop_time(client) == pytest.approx(takes_ms, abs=60)
    client.until(lambda: state(client) == READY, 100)


@pytest.mark.parametrize(("code", "takes_ms", "ends"), [(0, 10, SWITCHED_ON), (1, RAMP_500, SWITCH_ON_DISABLED)])
def test_disable_by_605c(client: Client, code: int, takes_ms: float, ends: int) -> None:
    client.write("605C", code)
    spin(client)
    client.write("6040", 0x07)
    assert stop_time(client) == pytest.approx(takes_ms, abs=60)
    client.until(lambda: state(client) == ends, 100)


@pytest.mark.parametrize(("code", "takes_ms"), [(1, RAMP_500), (2, RAMP_5000)])
def test_halt_by_605d_stays_enabled_and_goes_on(client: Client, code: int, takes_ms: float) -> None:
    client.write("605D", code)
    spin(client)
    client.write("6040", 0x010F)
    assert stop_time(client) == pytest.approx(takes_ms, abs=60)
    assert state(client) == ENABLED
    client.until(lambda: client.has(0x400), 50)
    client.write("6040", 0x0F)
    client.until(lambda: client.read("606C") > 590)


@pytest.mark.parametrize(("code", "takes_ms"), [(0, 10), (1, RAMP_500), (2, RAMP_5000)])
def test_fault_reaction_by_605e(rig: Rig, code: int, takes_ms: float) -> None:
    client = rig.client
    client.write("605E", code)
    spin(client)
    rig.thread.call_soon(lambda: setattr(rig.device.drive, "temperature_c", 90.0))
    client.until(lambda: client.read("6041") & 0x4F == 0x0F or client.fault(), 100, 1)
    assert client.until(client.fault, 60_000) == pytest.approx(takes_ms, abs=60)
    assert client.read("1001") == 0x09, "generic and temperature"
    assert client.read("603F") == 0x4200


def test_voltage_off_lets_the_shaft_run_out(client: Client) -> None:
    spin(client)
    client.write("6040", 0x00)
    assert state(client) == SWITCH_ON_DISABLED
    client.advance(20)
    assert client.read("606C") > 100, "nothing brakes it but friction"
    assert client.read("6077") == 0


def test_a_fault_is_reset_by_a_rising_bit_when_its_cause_is_gone(rig: Rig) -> None:
    client = rig.client
    rig.device.drive.conditions.supply_mv = 53_000
    client.until(client.fault, 100)
    client.write("6040", 0x80)
    assert client.fault(), "the voltage is still too high"
    rig.device.drive.conditions.supply_mv = 48_000
    client.advance(5)
    client.write("6040", 0x80)
    assert client.fault(), "bit 7 did not rise again"
    assert client.control(0x00, 0x80) & MASK == SWITCH_ON_DISABLED
    assert client.read("1001") == 0
    assert client.read("603F") == 0
    assert client.read("1003:00") == 1, "the stack keeps it"


def test_no_voltage_means_no_current_at_once(rig: Rig) -> None:
    client = rig.client
    spin(client)
    rig.device.drive.conditions.supply_mv = 60_000
    client.advance(2)
    assert client.fault()
    assert client.read("6077") == 0
    assert client.read("1003:01") == 0x01043100


def test_mode_shows_in_6061_and_unknown_ones_are_refused(client: Client) -> None:
    for mode in (-2, -1, 0, 1, 2, 3, 4, 6, 7, 8, 9, 10):
        client.write("6060", mode)
        assert client.read("6061") == mode
    for mode in (5, 11, -3, 127):
        assert client.refused(partial(client.write, "6060", mode)) == 0x06090030
    assert client.read("6061") == 10
