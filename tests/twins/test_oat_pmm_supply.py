"""Mains, timers, DC link, 24 V, booster and chopper of the PMM, over the wire (rules D, E and G)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import sqrt

import pytest

from app.twins.plant_power import Stage
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import PMM, BladeRig

BOOST = 0x04
SAFETY_CHAIN = 1 << 16
TOO_LOW, TOO_HIGH = 0x06090032, 0x06090031
CURRENT, VOLTAGE = 1 << 2, 1 << 3
"""Bits of 3002h."""

Get = Callable[[str], int]


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


@pytest.fixture
def get(rig: BladeRig) -> Get:
    return lambda where: rig.get(where, PMM)


def settle(rig: BladeRig, duration_ns: int = 250 * MS) -> None:
    rig.master.run(duration_ns)


# -- mains and timers ----------------------------------------------------------------


@pytest.mark.rule("D1")
@pytest.mark.rule("B6")
@pytest.mark.parametrize(
    ("factor", "code", "bits"), [(1.10, 0, 0), (1.25, 0x3110, 1 << 6), (0.85, 0, 0), (0.7, 0x3120, 1 << 5 | 1 << 4)]
)
def test_mains_voltage_and_its_thresholds(rig: BladeRig, get: Get, factor: float, code: int, bits: int) -> None:
    rig.blade.power.mains_factor = factor
    settle(rig)
    assert get("3062") == pytest.approx(400 * factor, abs=4)
    assert get("603F") == code
    assert get("3000") == bits | (2 if code else 1)
    assert rig.errors(PMM) == []


@pytest.mark.rule("D1")
@pytest.mark.rule("B6")
def test_a_lost_phase_is_told_and_is_no_mains_failure(rig: BladeRig, get: Get) -> None:
    rig.blade.power.phases[1] = 0.0
    settle(rig)
    assert (get("603F"), get("3000")) == (0x3130, 1 << 7 | 2)
    assert get("3062") == pytest.approx(400, abs=4)
    assert get("30B2") == 3000
    rig.blade.power.phases[1] = 0.9
    settle(rig)
    assert (get("603F"), get("3000")) == (0, 1)


@pytest.mark.rule("D2")
def test_the_hold_up_time_counts_milliseconds_down_to_the_emergency_stop(rig: BladeRig, get: Get) -> None:
    rig.put("30E0", 4000, PMM)
    rig.blade.power.mains_present = False
    settle(rig, 1500 * MS)
    assert get("30B2") == pytest.approx(2500, abs=30)
    settle(rig, 2300 * MS)
    assert 0 < get("30B2") < 220
    assert get("30FE:03") & SAFETY_CHAIN
    settle(rig, 300 * MS)
    assert get("30B2") == 0
    assert not get("30FE:03") & SAFETY_CHAIN


@pytest.mark.rule("D2")
@pytest.mark.rule("D3")
def test_the_delivered_times_cover_hold_up_and_the_way_to_feather(get: Get) -> None:
    assert (get("30E0"), get("30E1")) == (3000, 30)
    assert (get("30B2"), get("30B3")) == (3000, 30)


@pytest.mark.rule("D3")
def test_the_time_to_power_down_counts_seconds_to_the_shut_down(rig: BladeRig, get: Get) -> None:
    rig.put("30E1", 6, PMM)
    rig.blade.power.mains_present = False
    settle(rig, 2500 * MS)
    assert get("30B3") == 4
    assert get("3000") & 1 << 4
    settle(rig, 3400 * MS)
    assert get("3000") & 1 << 4
    settle(rig, 400 * MS)
    with pytest.raises(TimeoutError):
        get("3000")


@pytest.mark.rule("D4")
def test_both_timers_begin_with_the_failure_and_are_full_again_when_the_mains_returns(rig: BladeRig, get: Get) -> None:
    rig.blade.power.mains_present = False
    settle(rig, 2100 * MS)
    hold_up_ms, power_down_s = get("30B2"), get("30B3")
    assert 3000 - hold_up_ms == pytest.approx(2100, abs=30)
    assert power_down_s == 28
    rig.blade.power.mains_present = True
    settle(rig, 50 * MS)
    assert (get("30B2"), get("30B3"), get("3000")) == (3000, 30, 1)
    rig.blade.power.mains_present = False
    settle(rig, 100 * MS)
    assert get("30B2") > 2800


# -- DC link -------------------------------------------------------------------------------

ORDER = ("30FA:03", "30FB:08", "30FA:01", "30FB:07", "30FC:02", "30FC:01", "30FA:02")
"""Table 19, from the lowest voltage of the PMM to the highest."""


@pytest.mark.rule("D5")
def test_the_delivered_voltages_keep_their_order(rig: BladeRig, get: Get) -> None:
    voltages = [get(where) for where in ORDER]
    assert voltages == [400, 420, 560, 600, 650, 670, 750]
    assert rig.get("6510:04") < voltages[0]
    assert voltages[-1] <= rig.get("6510:05")


@pytest.mark.rule("D5")
@pytest.mark.parametrize(("low", "high"), list(pairwise(ORDER)))
def test_a_voltage_out_of_order_is_refused(rig: BladeRig, get: Get, low: str, high: str) -> None:
    assert rig.refused(low, get(high) + 1, PMM) == TOO_HIGH
    assert rig.refused(low, get(high), PMM) == TOO_HIGH
    assert rig.refused(high, get(low) - 1, PMM) == TOO_LOW
    assert rig.refused(high, get(low), PMM) == TOO_LOW
    rig.put(low, get(high) - 1, PMM)


@pytest.mark.rule("D5")
@pytest.mark.rule("D8")
def test_the_dc_link_meets_its_thresholds_in_their_order(rig: BladeRig, get: Get) -> None:
    """Downwards booster before error, upwards chopper before error: with sound power stages no error comes."""
    power = rig.blade.power
    power.mains_present = False
    power.extra_load_w = 2000.0
    rig.run_until(lambda: power.booster_on)
    settle(rig, SECOND)
    assert get("3063") == pytest.approx(600, abs=3)
    power.extra_load_w = -2500.0
    rig.run_until(lambda: power.chopper_on)
    settle(rig, SECOND)
    assert 640 <= get("3063") <= 680
    assert rig.errors(PMM) == []


@pytest.mark.rule("D6")
def test_the_axis_may_live_on_the_bare_battery_voltage(rig: BladeRig, get: Get) -> None:
    """The PMC's least voltage lies below the battery, 6 x 36 V: at that voltage in the DC link it sees no error."""
    battery_v = get("3020:04") * get("3020:05") / 1000
    assert battery_v == 216
    assert rig.get("6510:04") == 100
    assert rig.get("6510:04") < battery_v
    power = rig.blade.power
    power.shorted.add(Stage.BOOSTER)
    power.mains_present = False
    rig.put("30E0", 60000, PMM)
    power.extra_load_w = 500.0
    rig.run_until(lambda: power.dc_link_v < battery_v)
    assert rig.get("603F") != 0x3220
    rig.run_until(lambda: power.dc_link_v < 95)
    settle(rig)
    assert rig.get("603F") == 0x3220


@pytest.mark.rule("D7")
@pytest.mark.parametrize("factor", [0.9, 1.0, 1.1])
def test_the_unloaded_dc_link_is_the_peak_of_the_mains(rig: BladeRig, get: Get, factor: float) -> None:
    rig.blade.power.mains_factor = factor
    settle(rig, 4 * SECOND)
    assert get("3063") == pytest.approx(get("3062") * sqrt(2), abs=2)


@pytest.mark.rule("D7")
def test_the_nominal_dc_link_is_that_of_400_v(get: Get) -> None:
    assert get("30FA:01") == pytest.approx(400 * sqrt(2), abs=6)


@pytest.mark.rule("D8")
def test_dc_link_too_low(rig: BladeRig, get: Get) -> None:
    rig.put("30FA:03", 415, PMM)
    power = rig.blade.power
    power.shorted.add(Stage.BOOSTER)
    power.mains_present = False
    power.extra_load_w = 500.0
    rig.run_until(lambda: power.dc_link_v < 418)
    assert 0x3220 not in rig.errors(PMM)
    rig.run_until(lambda: power.dc_link_v < 410)
    assert 0x3220 in rig.errors(PMM)


@pytest.mark.rule("D8")
@pytest.mark.rule("G4")
def test_dc_link_too_high(rig: BladeRig, get: Get) -> None:
    power = rig.blade.power
    rig.put("30FA:02", 740, PMM)
    power.shorted.add(Stage.CHOPPER)
    power.extra_load_w = -500.0
    rig.run_until(lambda: power.dc_link_v > 730)
    assert 0x3211 not in rig.errors(PMM)
    assert not get("3002") & 1 << 5
    rig.run_until(lambda: power.dc_link_v > 745)
    assert 0x3211 in rig.errors(PMM)
    assert get("3002") & 0x21 == 1 << 5


@pytest.mark.rule("D9")
def test_the_dc_link_in_volts_and_millivolts(rig: BladeRig, get: Get) -> None:
    millivolts = rig.get("6079")
    assert get("3063") == pytest.approx(millivolts / 1000, abs=1)
    assert rig.get("5079") == pytest.approx(millivolts / 1000, abs=1)
    assert 500_000 < millivolts < 620_000


# -- 24 V ------------------------------------------------------------------------------------


@pytest.mark.rule("E1")
def test_24_v_from_inside_and_from_outside(rig: BladeRig, get: Get) -> None:
    assert get("3065") == pytest.approx(24200, abs=200)
    assert get("3066") == 0
    rig.blade.power.external_v = 26.0
    assert (get("3065"), get("3066")) == (25300, 26000)


@pytest.mark.rule("E1")
@pytest.mark.rule("E2")
def test_24_v_current_is_own_consumption_and_what_is_drawn(rig: BladeRig, get: Get) -> None:
    own_ma = get("3075")
    assert 0 < own_ma < 1000
    rig.blade.power.extra_supply_a = 0.5
    assert get("3075") == own_ma + 500
    assert get("3004") == 1 | 1 << 2
    rig.put("30C0", 1600, PMM)
    assert get("3004") == 1
    rig.enable()
    settle(rig)
    assert get("3075") > 1600
    assert get("3004") == 1 | 1 << 2


@pytest.mark.rule("E2")
def test_24_v_status(rig: BladeRig, get: Get) -> None:
    power = rig.blade.power
    rig.put("30C0", 9000, PMM)
    assert get("3004") == 1
    power.external_v = 24.0
    settle(rig)
    assert get("3004") == 1 | 1 << 1
    for external_v, supply_a, bit, code in ((18.0, 0.0, 5, 0x5112), (29.0, 0.0, 6, 0x5100), (24.0, 7.5, 4, 0x2210)):
        power.external_v, power.extra_supply_a = external_v, supply_a
        settle(rig)
        assert get("3004") == 1 << 1 | 1 << bit
        assert get("603F") == code
        power.external_v, power.extra_supply_a = 24.0, 0.0
        settle(rig)
        rig.put("3040", 0x80, PMM)
        rig.put("3040", 0, PMM)
        assert (get("3004"), get("603F")) == (0b11, 0)
    assert rig.errors(PMM) == [0x5112, 0x5100, 0x2210]


@pytest.mark.rule("E2")
@pytest.mark.parametrize(("external_v", "supply_a"), [(18.8, 0.0), (28.6, 0.0), (24.0, 7.1)])
def test_24_v_just_within_its_limits(rig: BladeRig, get: Get, external_v: float, supply_a: float) -> None:
    rig.put("30C0", 9000, PMM)
    rig.blade.power.external_v, rig.blade.power.extra_supply_a = external_v, supply_a
    settle(rig)
    assert get("3004") == 0b11


# -- booster -----------------------------------------------------------------------------------


@pytest.mark.rule("G1")
def test_the_booster_starts_below_its_switch_on_voltage_and_holds_its_target(rig: BladeRig, get: Get) -> None:
    power = rig.blade.power
    rig.put("30FB:08", 450, PMM)
    power.extra_load_w = 300.0
    power.mains_present = False
    lowest_v = 1000.0
    while not power.booster_on:
        lowest_v = min(lowest_v, power.dc_link_v)
        rig.master.run(MS)
    assert 440 < lowest_v < 460
    settle(rig)
    assert get("3002") == 1 | 1 << 1 | VOLTAGE
    assert get("3063") == pytest.approx(600, abs=2)
    rig.put("30FB:07", 620, PMM)
    settle(rig)
    assert get("3063") == pytest.approx(620, abs=2)
    power.mains_present = True
    settle(rig)
    assert get("3002") == 1


@pytest.mark.rule("G1")
def test_a_low_dc_link_alone_does_not_start_the_booster(rig: BladeRig, get: Get) -> None:
    rig.blade.power.dc_link_v = 300.0
    rig.master.run(30 * MS)
    assert not rig.blade.power.booster_on
    assert get("3063") > 500


@pytest.mark.rule("G2")
@pytest.mark.rule("A2")
def test_the_booster_passes_into_current_control_at_90_a(get: Get) -> None:
    rig = BladeRig(factory=True)
    power = rig.blade.power
    assert rig.get("30FB:03", PMM) == 90
    rig.put("3040", BOOST, PMM)
    power.extra_load_w = 30000.0
    power.mains_present = False
    rig.run_until(lambda: rig.get("3002", PMM) & 2 == 2 and power.booster_limited)
    assert power.battery_a == pytest.approx(90, abs=0.5)
    assert rig.get("3002", PMM) & (CURRENT | VOLTAGE) == CURRENT
    rig.put("30FB:03", 40, PMM)
    settle(rig, 50 * MS)
    assert power.battery_a == pytest.approx(40, abs=0.5)


@pytest.mark.rule("G2")
@pytest.mark.rule("F14")
def test_the_booster_does_not_draw_the_battery_below_its_least_voltage(rig: BladeRig, get: Get) -> None:
    """27 V for each bloc, 162 V: a weak battery limits the current before 30FBh/3 does."""
    power = rig.blade.power
    for bloc in power.blocs:
        bloc.ohm_factor = 8.0
    power.mains_present = False
    power.extra_load_w = 20000.0
    rig.run_until(lambda: power.booster_on)
    settle(rig, 200 * MS)
    assert power.battery_a < 80
    assert power.battery_v == pytest.approx(162, abs=0.5)
    assert get("3002") & (CURRENT | VOLTAGE) == VOLTAGE
    assert get("3060") == 162


@pytest.mark.rule("G3")
def test_no_inrush_when_the_mains_returns_to_a_boosted_dc_link(rig: BladeRig, get: Get) -> None:
    """Its target above the nominal DC link: the rectifier stays blocked, and then takes over gently."""
    power = rig.blade.power
    assert get("30FB:07") > get("30FA:01")
    assert rig.refused("30FB:07", get("30FA:01"), PMM) == TOO_LOW
    power.mains_present = False
    power.extra_load_w = 1000.0
    rig.run_until(lambda: power.booster_on)
    settle(rig, SECOND)
    power.mains_present = True
    highest_a = 0.0
    for _ in range(500):
        rig.master.run(MS)
        highest_a = max(highest_a, power.mains_a)
    assert get("3063") < 575
    assert 0 < highest_a < 15


@pytest.mark.rule("G4")
@pytest.mark.rule("G1")
def test_output_current_and_utilisation_of_the_booster(rig: BladeRig, get: Get) -> None:
    power = rig.blade.power
    assert (get("3073"), get("30B0")) == (0, 0)
    power.mains_present = False
    power.extra_load_w = 3000.0
    rig.run_until(lambda: power.booster_on)
    settle(rig, SECOND)
    assert get("3073") == round(3030 / 600)
    assert get("30B0") == pytest.approx(100 * (1 - get("3060") / get("3063")), abs=1)


@pytest.mark.rule("G4")
def test_short_circuit_of_the_booster(rig: BladeRig, get: Get) -> None:
    rig.blade.power.shorted.add(Stage.BOOSTER)
    settle(rig)
    assert get("3002") == 1 << 4
    assert rig.errors(PMM) == [0x2260]
    rig.put("3040", BOOST, PMM)
    settle(rig)
    assert rig.blade.power.battery_a == 0


# -- chopper -------------------------------------------------------------------------------------


@pytest.mark.rule("G5")
def test_the_chopper_switches_between_its_two_thresholds(rig: BladeRig, get: Get) -> None:
    power = rig.blade.power
    rig.put("30FC:01", 700, PMM)
    power.extra_load_w = -2000.0
    voltages: list[float] = []
    states: set[int] = set()
    for _ in range(4000):
        rig.master.run(MS)
        voltages.append(power.dc_link_v)
        if len(voltages) % 50 == 0:
            states.add(get("3003"))
    seen = voltages[1000:]
    assert 690 <= max(seen) <= 702
    assert 640 <= min(seen) <= 655
    assert states == {1, 3}
    assert rig.errors(PMM) == []


@pytest.mark.rule("G5")
def test_chopper_thresholds_lie_above_the_booster_target(rig: BladeRig, get: Get) -> None:
    assert rig.refused("30FC:02", get("30FB:07") - 1, PMM) == TOO_LOW
    rig.put("30FC:02", get("30FB:07") + 1, PMM)
    rig.put("30FC:01", get("30FB:07") + 2, PMM)
    assert rig.refused("30FB:07", get("30FC:02") + 1, PMM) == TOO_HIGH


@pytest.mark.rule("G5")
def test_status_and_utilisation_of_the_chopper(rig: BladeRig, get: Get) -> None:
    power = rig.blade.power
    assert (get("3003"), get("30B1")) == (1, 0)
    power.extra_load_w = -200.0
    rig.run_until(lambda: power.chopper_on)
    settle(rig, 40 * SECOND)
    assert get("30B1") == pytest.approx((200 - 30 - 25) / 300 * 100, abs=8)
    power.extra_load_w = -2000.0
    settle(rig, 20 * SECOND)
    assert get("30B1") == 100
    rig.run_until(lambda: get("3003") == 0b11)
    power.extra_load_w = 0.0
    rig.run_until(lambda: get("3003") == 1)


@pytest.mark.rule("G5")
def test_short_circuit_of_the_chopper(rig: BladeRig, get: Get) -> None:
    rig.blade.power.shorted.add(Stage.CHOPPER)
    rig.blade.power.dc_link_v = 700.0
    settle(rig)
    assert get("3003") == 1 << 4
    assert rig.errors(PMM) == [0x5420]
