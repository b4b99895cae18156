"""Battery, charger and battery test of the PMM, over the wire (rules F)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from app.twins.plant_power import Stage
from app.twins.supply_kernel import DISCHARGED_AS
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import PMM, BladeRig

CHARGE, TEST, BOOST, RESET = 0x01, 0x02, 0x04, 0x80
ACTIVE, CONSTANT_CURRENT, CONSTANT_VOLTAGE = 1 << 1, 1 << 2, 1 << 3
"""Bits of 3001h."""
PASSED, STARTED, RUNNING, FAILED, IMPOSSIBLE = 0b11, 1 << 2, 1 << 3, 0b10010, 1 << 5
"""3005h."""

Get = Callable[[str], int]


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


@pytest.fixture
def get(rig: BladeRig) -> Get:
    return lambda where: rig.get(where, PMM)


def settle(rig: BladeRig, duration_ns: int = 250 * MS) -> None:
    rig.master.run(duration_ns)


def set_charge(rig: BladeRig, charge: float) -> None:
    for bloc in rig.blade.power.blocs:
        bloc.charge, bloc.offset_v = charge, 0.0


def run_on_battery(rig: BladeRig, load_w: float, duration_ns: int) -> None:
    """A mains failure under load, from the booster's start on; then the mains is back."""
    power = rig.blade.power
    power.mains_present = False
    power.extra_load_w = load_w
    rig.run_until(lambda: power.booster_on)
    rig.master.run(duration_ns)
    power.extra_load_w = 0.0
    power.mains_present = True


# -- measured values --------------------------------------------------------------------


@pytest.mark.rule("F1")
def test_battery_temperature_is_the_lowest_below_10_degrees_and_else_the_highest(rig: BladeRig, get: Get) -> None:
    blocs = rig.blade.power.blocs
    for bloc, temperature_c in zip(blocs, (21.0, 35.0, 10.0, 22.0, 23.0, 24.0), strict=True):
        bloc.temperature_c = temperature_c
    assert get("3010") == get("301F:02") == 350
    blocs[2].temperature_c = 9.9
    assert get("3010") == get("301F:03") == 99
    blocs[5].temperature_c = -3.2
    assert get("3010") == get("301F:06") == -32


@pytest.mark.rule("F1")
def test_battery_temperature_drives_supervisor_and_controller(rig: BladeRig, get: Get) -> None:
    """One cold bloc beside a hot one: the lower limit of 3110h and the heater of 3201h follow the cold one."""
    blocs = rig.blade.power.blocs
    for bloc in blocs:
        bloc.temperature_c = 60.0
    settle(rig)
    assert get("3006") == 1 << 5 | 1 << 4 | 1 << 3 | 1 << 1
    rig.put("3110:03", 50, PMM)
    rig.put("3201:01", 50, PMM)
    rig.put("3201:07", 0, PMM)
    blocs[4].temperature_c = 2.0
    settle(rig)
    assert get("3006") == 1 << 0 | 1 << 2 | 1 << 1


@pytest.mark.rule("F2")
def test_battery_current_counts_out_as_positive_and_in_as_negative(rig: BladeRig, get: Get) -> None:
    assert get("3070") == 0
    rig.put("3020:03", 503, PMM)
    rig.put("3040", CHARGE, PMM)
    settle(rig)
    assert get("3070") in (-502, -503)  # 201 steps of 2.5 mA
    power = rig.blade.power
    power.mains_present = False
    power.extra_load_w = 1000.0
    rig.run_until(lambda: power.booster_on)
    settle(rig)
    assert get("3070") > 0
    assert get("3070") % 400 == 0
    assert get("3070") == pytest.approx(power.battery_a * 1000, abs=201)


@pytest.mark.rule("F2")
def test_the_coarse_resolution_is_that_of_discharge_only(rig: BladeRig, get: Get) -> None:
    rig.put("3020:03", 90, PMM)
    rig.put("3040", CHARGE, PMM)
    settle(rig)
    assert get("3070") == -90
    rig.blade.power.mains_present = False
    settle(rig)
    assert 0 < rig.blade.power.battery_a < 0.2  # the 24 V adapter, fed by the battery
    assert get("3070") == 0


@pytest.mark.rule("F5")
@pytest.mark.parametrize("count", [6, 4])
def test_bloc_voltages_of_connected_blocs_only(rig: BladeRig, get: Get, count: int) -> None:
    assert get("3020:04") == 6
    rig.put("3020:04", count, PMM)
    voltages = [get(f"3061:{number:02X}") for number in range(1, 9)]
    assert get("3061:00") == 8
    assert all(38000 < voltage < 41100 for voltage in voltages[:count])
    assert voltages[count:] == [0] * (8 - count)
    assert [get(f"301F:{number:02X}") for number in range(count + 1, 9)] == [32767] * (8 - count)


# -- counters and gauge ----------------------------------------------------------------------


@pytest.mark.rule("F3")
def test_charge_counters(rig: BladeRig, get: Get, tmp_path: Path) -> None:
    """3050h adds up, 3051h and 3052h count since the last charging cycle began; all outlive a power-off."""
    rig = BladeRig(state_dir=tmp_path)
    rig.put("3050", 1000, PMM)
    set_charge(rig, 0.95)
    run_on_battery(rig, 4000.0, 10 * SECOND)
    expended = rig.get("3051", PMM)
    assert expended == pytest.approx(rig.blade.power.s[DISCHARGED_AS] / 3.6, abs=1.5)
    assert expended > 40
    assert (rig.get("3050", PMM), rig.get("3052", PMM)) == (1000, 0)
    rig.blade.power_off()
    rig = BladeRig(state_dir=tmp_path)
    assert (rig.get("3050", PMM), rig.get("3051", PMM)) == (1000, expended)
    set_charge(rig, 0.9)
    settle(rig)
    assert rig.get("3001", PMM) & ACTIVE
    assert (rig.get("3051", PMM), rig.get("3052", PMM)) == (0, 0)
    settle(rig, 36 * SECOND)
    assert rig.get("3052", PMM) == pytest.approx(10, abs=1)
    assert rig.get("3050", PMM) == 1000 + rig.get("3052", PMM)
    rig.put("3050", 0, PMM)
    assert rig.get("3050", PMM) == 0


@pytest.mark.rule("F4")
def test_off_load_voltage_stands_still_while_current_flows(rig: BladeRig, get: Get) -> None:
    set_charge(rig, 0.95)
    settle(rig)
    before = get("3067")
    assert before == get("3060")
    power = rig.blade.power
    power.mains_present = False
    power.extra_load_w = 5000.0
    rig.run_until(lambda: power.booster_on)
    settle(rig, 10 * SECOND)
    assert get("3060") < before - 5
    assert get("3067") == before
    power.extra_load_w = 0.0
    power.mains_present = True
    settle(rig, 100 * MS)
    rig.run_until(lambda: get("3067") != before)
    assert get("3067") < before


@pytest.mark.rule("F4")
def test_charge_is_counted_while_current_flows_and_read_from_the_voltage_at_rest(rig: BladeRig, get: Get) -> None:
    """What the voltage says of a charge that was changed behind its back shows at rest only, not under load."""
    set_charge(rig, 0.95)
    settle(rig, 65 * SECOND)
    assert get("3080") == 95
    assert get("3053") == pytest.approx(2850, abs=30)
    power = rig.blade.power
    power.mains_present = False
    power.extra_load_w = 5000.0
    rig.run_until(lambda: power.booster_on)
    began_mah, began_as = get("3053"), power.s[DISCHARGED_AS]
    set_charge(rig, 0.5)
    settle(rig, 10 * SECOND)
    counted_mah = began_mah - get("3053")
    assert counted_mah == pytest.approx((power.s[DISCHARGED_AS] - began_as) / 3.6, abs=3)
    assert get("3080") > 90
    rig.put("30F1:05", 100, PMM)  # no recharge
    power.extra_load_w = 0.0
    power.mains_present = True
    settle(rig, 70 * SECOND)
    assert get("3080") == pytest.approx(power.charge * 100, abs=2)
    assert get("3053") == pytest.approx(power.charge * 3000, abs=60)


@pytest.mark.rule("F4")
def test_resistance_and_health_are_found_in_a_discharge_only(rig: BladeRig, get: Get) -> None:
    power = rig.blade.power
    for bloc in power.blocs:
        bloc.ohm_factor = 2.0
    settle(rig, 5 * SECOND)
    assert (get("30B4"), get("3081")) == (150, 100)
    rig.put("3040", CHARGE, PMM)
    settle(rig, 5 * SECOND)
    assert get("30B4") == 150
    rig.put("3040", 0, PMM)
    run_on_battery(rig, 5000.0, 3 * SECOND)
    settle(rig)
    assert get("30B4") == pytest.approx(power.battery_ohm * 1000, rel=0.08)
    assert get("3081") == pytest.approx(100 * 150 / get("30B4"), abs=1)
    for bloc in power.blocs:
        bloc.ohm_factor = 1.0
    found = get("30B4")
    settle(rig, 5 * SECOND)
    assert get("30B4") == found


# -- charger ---------------------------------------------------------------------------------


@pytest.mark.rule("F6")
def test_charging_voltage_is_that_of_all_blocs(get: Get) -> None:
    assert get("30F1:04") == get("3020:06") / 1000 * get("3020:04") == 246


@pytest.mark.rule("F6")
@pytest.mark.rule("F8")
@pytest.mark.parametrize("charging_v", [246, 244])
def test_the_second_stage_holds_the_charging_voltage(rig: BladeRig, get: Get, charging_v: int) -> None:
    rig.put("30F1:04", charging_v, PMM)
    rig.put("30F1:06", 100, PMM)
    set_charge(rig, 0.97)
    rig.put("3040", CHARGE, PMM)
    settle(rig)
    assert get("3001") == 1 | ACTIVE | CONSTANT_CURRENT
    set_charge(rig, 1.0 - (246.0 - charging_v + 0.2) / 6 / 16)
    rig.run_until(lambda: bool(get("3001") & CONSTANT_VOLTAGE))
    settle(rig, 2 * SECOND)
    assert get("3001") == 1 | ACTIVE | CONSTANT_VOLTAGE
    assert rig.blade.power.battery_v == pytest.approx(charging_v, abs=0.05)
    assert -1000 < get("3070") < -100


@pytest.mark.rule("F7")
def test_recharge_begins_below_its_threshold(rig: BladeRig, get: Get) -> None:
    power = rig.blade.power
    assert (get("30F1:05"), get("30F1:06"), get("3020:03")) == (241, 300, 1000)
    assert get("30F1:06") == get("3020:02") / 10
    set_charge(rig, 0.955)
    settle(rig, SECOND)
    assert power.open_circuit_v > 241.2
    assert get("3001") == 1
    set_charge(rig, 0.945)
    settle(rig, SECOND)
    assert get("3001") == 1 | ACTIVE | CONSTANT_CURRENT
    assert get("3070") == -1000
    rig.put("3020:03", 600, PMM)
    settle(rig)
    assert get("3070") == -600


@pytest.mark.rule("F7")
@pytest.mark.parametrize("cut_off_ma", [300, 600])
def test_charging_ends_below_the_switch_off_current(rig: BladeRig, get: Get, cut_off_ma: int) -> None:
    rig.put("30F1:06", cut_off_ma, PMM)
    set_charge(rig, 0.9965)
    rig.put("3040", CHARGE, PMM)
    last_ma = 0
    settle(rig)
    while get("3001") & ACTIVE:
        last_ma = -get("3070")
        settle(rig, SECOND)
        assert rig.line.now_ns < 900 * SECOND
    assert 0.75 * cut_off_ma < last_ma < cut_off_ma
    settle(rig, 5 * SECOND)
    assert (get("3001"), get("3070")) == (1, 0)


@pytest.mark.rule("F8")
def test_faults_of_the_charger(rig: BladeRig, get: Get) -> None:
    rig.put("3040", CHARGE, PMM)
    settle(rig)
    rig.blade.power.shorted.add(Stage.CHARGER)
    settle(rig)
    assert get("3001") == 1 << 4
    assert (get("603F"), get("3070")) == (0x2250, 0)
    rig.blade.power.shorted.clear()
    rig.blade.power.blocs_silent = True
    settle(rig)
    rig.put("3040", RESET, PMM)
    assert get("3001") == 1 << 7
    assert get("603F") == 0x7520
    assert get("3061:01") == 0
    assert rig.errors(PMM) == [0x2250, 0x7520]


@pytest.mark.rule("F9")
@pytest.mark.parametrize("lost", ["mains", "dc link", "battery", "booster"])
def test_the_charger_needs_mains_dc_link_and_battery(rig: BladeRig, get: Get, lost: str) -> None:
    power = rig.blade.power
    rig.put("3040", CHARGE, PMM)
    settle(rig)
    assert get("3001") & ACTIVE
    if lost == "mains":
        power.mains_present = False
    elif lost == "dc link":
        rig.put("30FB:07", 649, PMM)
        rig.put("30FA:01", 640, PMM)
        rig.put("30FB:08", 630, PMM)
        rig.put("30FA:03", 620, PMM)
    elif lost == "battery":
        for bloc in power.blocs:
            bloc.offset_v = -30.0
    else:
        rig.put("3040", BOOST, PMM)
    settle(rig)
    assert get("3001") & (ACTIVE | CONSTANT_CURRENT | CONSTANT_VOLTAGE) == 0
    assert get("3070") >= 0


@pytest.mark.rule("F10")
def test_voltage_and_current_of_the_charger(rig: BladeRig, get: Get) -> None:
    adapter_ma = get("3074")
    assert get("3064") == pytest.approx(get("3067") - 10, abs=1)
    assert adapter_ma == pytest.approx(24.2 * get("3075") / 0.85 / get("3064"), abs=3)
    rig.put("3040", CHARGE, PMM)
    settle(rig)
    assert get("3064") == pytest.approx(get("3060") + 1, abs=1)
    assert get("3064") > get("3067")
    assert get("3074") == pytest.approx(-get("3070") + adapter_ma, abs=10)


@pytest.mark.rule("F11")
@pytest.mark.parametrize("kind", [0x18, 0x19, 0x1A, 0xA2, 0x00])
def test_only_lithium_is_accepted(rig: BladeRig, get: Get, kind: int) -> None:
    assert rig.refused("3020:01", kind, PMM) == 0x06090030
    rig.put("3020:01", 0xA1, PMM)
    assert get("3020:01") == 0xA1


# -- test --------------------------------------------------------------------------------------


def begin_test(rig: BladeRig) -> None:
    rig.put("3040", TEST, PMM)
    rig.put("3040", 0, PMM)


@pytest.mark.rule("F12")
@pytest.mark.rule("C3")
def test_a_test_runs_through_its_states_and_keeps_the_lowest_voltage(rig: BladeRig, get: Get) -> None:
    rig.put("3040", TEST, PMM)
    assert get("3005") == STARTED
    settle(rig, SECOND)
    assert (get("3005"), get("3070")) == (STARTED, 0)
    rig.put("3040", 0, PMM)
    assert get("3005") == RUNNING
    lowest_v = 1000
    rest_v = get("3067")
    for _ in range(90):
        settle(rig, 100 * MS)
        lowest_v = min(lowest_v, get("3060"))
    assert get("3002") & 2 and get("3003") & 2
    assert get("3063") == pytest.approx(600, abs=5)
    assert get("3070") > 10000
    rig.run_until(lambda: get("3005") == PASSED)
    assert get("3068") == pytest.approx(lowest_v, abs=1)
    assert get("3068") < rest_v - 3
    settle(rig, SECOND)
    assert get("3002") == 1
    assert get("3003") == 1


@pytest.mark.rule("F12")
@pytest.mark.rule("F14")
@pytest.mark.parametrize("weak", ["all", "one"])
def test_a_weak_battery_fails_its_test(rig: BladeRig, get: Get, weak: str) -> None:
    blocs = rig.blade.power.blocs
    for bloc in blocs if weak == "all" else blocs[:1]:
        bloc.ohm_factor = 15.0
    begin_test(rig)
    rig.run_until(lambda: get("3005") == FAILED)
    limit_v = 0.94 * 216
    if weak == "all":
        assert get("3068") <= limit_v
    else:
        assert get("3061:01") < 36000 and get("3068") > limit_v
    settle(rig)
    assert get("3002") == 1


@pytest.mark.rule("F12")
@pytest.mark.parametrize("reason", ["not charged", "no mains", "moves"])
def test_a_test_that_is_not_possible(rig: BladeRig, get: Get, reason: str) -> None:
    if reason == "not charged":
        set_charge(rig, 0.7)
        settle(rig, 200 * MS)
        rig.restart(PMM)
    elif reason == "no mains":
        rig.blade.power.mains_present = False
        settle(rig)
    else:
        rig.enable()
        rig.go(6000)
        settle(rig, 500 * MS)
    begin_test(rig)
    assert get("3005") == IMPOSSIBLE
    settle(rig, SECOND)
    assert get("3005") == IMPOSSIBLE
    assert get("3070") <= 0


@pytest.mark.rule("F12")
def test_a_move_breaks_a_test_off(rig: BladeRig, get: Get) -> None:
    begin_test(rig)
    settle(rig, SECOND)
    assert get("3005") == RUNNING
    rig.enable()
    rig.go(6000)
    rig.run_until(lambda: get("3005") == IMPOSSIBLE)
    settle(rig)
    assert get("3070") <= 0


@pytest.mark.rule("F13")
def test_the_cycle_of_the_test_is_0_or_an_hour_and_more(rig: BladeRig, get: Get) -> None:
    assert get("30E3") == 0
    for minutes in (1, 59):
        assert rig.refused("30E3", minutes, PMM) == 0x06090032
    for minutes in (60, 10080, 0):
        rig.put("30E3", minutes, PMM)
        assert get("30E3") == minutes


@pytest.mark.rule("F13")
def test_tests_come_by_themselves_in_their_cycle_and_never_with_0(rig: BladeRig, get: Get) -> None:
    test = rig.pmm.test
    for _ in range(120 * 60):
        test.step(1.0, axis_moves=False)
    assert get("3005") == 0
    rig.restart(PMM)
    rig.put("30E3", 60, PMM)
    for _ in range(60 * 60 - 5):
        test.step(1.0, axis_moves=False)
    assert get("3005") == 0
    for _ in range(10):
        test.step(1.0, axis_moves=True)
    assert get("3005") == IMPOSSIBLE
    test.step(1.0, axis_moves=False)
    assert get("3005") == RUNNING


# -- alarms --------------------------------------------------------------------------------------


@pytest.mark.rule("F14")
@pytest.mark.rule("B7")
@pytest.mark.parametrize("number", [1, 6])
def test_a_bloc_too_low(rig: BladeRig, get: Get, number: int) -> None:
    """28 V of 36 V, for half a second."""
    bloc = rig.blade.power.blocs[number - 1]
    bloc.offset_v = 28.3 - (bloc.rest_v - bloc.offset_v)
    settle(rig, SECOND)
    assert get(f"3061:{number:02X}") > 28080
    assert get("603F") == 0
    bloc.offset_v -= 0.5
    settle(rig, 300 * MS)
    assert get("603F") == 0
    settle(rig, 600 * MS)
    assert get("603F") == 0x3280 + number
    assert get("3000") & 0b1100 == 0b1100
    assert rig.errors(PMM) == [0x3280 + number]


@pytest.mark.rule("F14")
def test_the_battery_too_low(rig: BladeRig, get: Get) -> None:
    rig.put("3020:04", 8, PMM)  # two blocs are missing
    power = rig.blade.power
    limit_v = 0.78 * 8 * 36
    shift_v = (limit_v + 0.6 - power.open_circuit_v) / 6
    for bloc in power.blocs:
        bloc.offset_v += shift_v
    settle(rig, SECOND)
    assert 0x3280 not in rig.errors(PMM)
    for bloc in power.blocs:
        bloc.offset_v -= 0.5
    settle(rig, SECOND)
    assert rig.errors(PMM) == [0x3280]
    assert get("3000") & 0b1100 == 0b1100
