"""Behaviour of the PMM over the wire: status words, commands, mains, charger, temperatures, outputs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from app.twins.pmm_temperature import SensorState
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import PMC, PMM, BladeRig

CHARGE, TEST, BOOST, RESET = 0x01, 0x02, 0x04, 0x80
SAFETY_CHAIN = 1 << 16

Get = Callable[[str], int]


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


@pytest.fixture
def get(rig: BladeRig) -> Get:
    return lambda where: rig.get(where, PMM)


def settle(rig: BladeRig) -> None:
    rig.master.run(250 * MS)


@pytest.mark.rule("B2")
@pytest.mark.rule("B5")
def test_a_healthy_unit(rig: BladeRig, get: Get) -> None:
    assert [get(f"300{number}") for number in range(10)] == [1, 1, 1, 1, 1, 0, 0, 0, 0, 0]
    assert get("603F") == 0
    assert get("30FE:03") & SAFETY_CHAIN
    assert rig.errors(PMM) == []


def test_values_are_plausible(rig: BladeRig, get: Get) -> None:
    assert 390 <= get("3062") <= 410
    assert get("3063") == pytest.approx(get("3062") * 2**0.5, abs=3)
    assert 236 <= get("3060") <= 246
    blocs = [get(f"3061:{number:02X}") for number in range(1, 9)]
    assert all(39000 <= bloc <= 41000 for bloc in blocs[:6])
    assert len(set(blocs[:6])) == 6
    assert blocs[6:] == [0, 0]
    assert sum(blocs) / 1000 == pytest.approx(get("3060"), abs=0.6)
    assert 90 <= get("3080") <= 100
    assert get("3053") == pytest.approx(get("3080") * 30, abs=20)
    for where in ("3010", "3011", "3012", "3013", "301F:01"):
        assert 180 <= get(where) <= 350
    assert 23000 <= get("3065") <= 25000
    assert (get("30B2"), get("30B3")) == (3000, 30)


@pytest.mark.rule("E2")
def test_the_lifted_brake_shows_in_the_24_v_current(rig: BladeRig, get: Get) -> None:
    assert not get("3004") & 4
    rig.enable()
    settle(rig)
    assert get("3004") & 4
    assert get("3075") > get("30C0")


@pytest.mark.rule("H1")
@pytest.mark.rule("H2")
@pytest.mark.rule("B3")
@pytest.mark.parametrize(
    ("supervisor", "status", "value", "high", "low"),
    [
        ("3110", "3006", "3010", 0x4410, 0x4420),
        ("3111", "3007", "3011", 0x4210, 0x4220),
        ("3112", "3008", "3012", 0x4110, 0x4120),
        ("3113", "3009", "3013", 0x4111, 0x4121),
    ],
)
def test_temperature_supervisors(supervisor: str, status: str, value: str, high: int, low: int) -> None:
    rig = BladeRig()
    now = rig.get(value, PMM)
    rig.put(f"{supervisor}:01", now - 5, PMM)
    settle(rig)
    assert rig.get(status, PMM) & 0x31 == 0x10
    assert (rig.get("603F", PMM), rig.get("3000", PMM)) == (high, 2)
    assert rig.errors(PMM) == []
    rig.put(f"{supervisor}:02", now - 5, PMM)
    settle(rig)
    assert rig.get(status, PMM) & 0x31 == 0x30
    assert (rig.get("603F", PMM), rig.get("3000", PMM)) == (high, 4)
    assert rig.errors(PMM) == [high]
    assert not rig.get("30FE:03", PMM) & SAFETY_CHAIN
    rig.put(f"{supervisor}:01", 1000, PMM)
    rig.put(f"{supervisor}:02", 1000, PMM)
    rig.put(f"{supervisor}:03", now + 50, PMM)
    settle(rig)
    rig.put("3040", RESET, PMM)
    assert rig.get(status, PMM) & 0x31 == 0x01
    assert (rig.get("603F", PMM), rig.get("3000", PMM)) == (low, 2)
    assert rig.errors(PMM) == [high]


@pytest.mark.rule("C5")
@pytest.mark.rule("B4")
@pytest.mark.rule("C1")
def test_fault_reset_acts_by_its_edge_and_only_without_cause(rig: BladeRig, get: Get) -> None:
    rig.put("3040", RESET, PMM)
    rig.put("3111:02", 0, PMM)
    settle(rig)
    assert get("3000") & 4
    rig.put("3040", 0, PMM)
    rig.put("3040", RESET, PMM)
    assert get("3000") & 4
    rig.put("3111:02", 800, PMM)
    settle(rig)
    rig.put("3040", RESET, PMM)
    assert get("3000") & 4
    rig.put("3040", 0, PMM)
    rig.put("3040", RESET, PMM)
    assert get("3000") == 1


@pytest.mark.rule("B4")
def test_restart_resets_errors(rig: BladeRig, get: Get) -> None:
    rig.put("3111:02", 0, PMM)
    settle(rig)
    assert get("3000") & 4
    rig.restart(PMM)
    settle(rig)
    assert get("3000") == 1


@pytest.mark.rule("H4")
@pytest.mark.parametrize(
    ("state", "value", "bit"), [(SensorState.SHORT_CIRCUIT, -32768, 1 << 6), (SensorState.INTERRUPTED, 32767, 1 << 7)]
)
def test_a_sensor_that_does_not_measure(rig: BladeRig, get: Get, state: SensorState, value: int, bit: int) -> None:
    rig.pmm.inputs.sensors[1] = state
    settle(rig)
    assert (get("3013"), get("3009"), get("3000")) == (value, bit, 1)


@pytest.mark.rule("H5")
@pytest.mark.rule("H7")
def test_heater_and_fan_with_hysteresis_and_delay(rig: BladeRig, get: Get) -> None:
    now = get("3010")
    rig.put("3201:07", 2, PMM)
    rig.put("3201:01", now + 20, PMM)
    settle(rig)
    assert get("3006") == 0b110
    assert get("30FE:03") & 0xFFFF == 0x0050
    rig.put("3201:01", now - 20, PMM)
    settle(rig)
    assert get("3006") == 0b110
    rig.put("3201:01", now - 80, PMM)
    settle(rig)
    assert get("3006") == 0b010
    rig.master.run(2 * SECOND)
    assert get("3006") == 0
    rig.put("3201:02", now - 20, PMM)
    settle(rig)
    assert get("3006") == 0b1010


@pytest.mark.rule("F1")
def test_battery_temperature_is_the_coldest_below_10_degrees(rig: BladeRig, get: Get) -> None:
    blocs = rig.blade.power.blocs
    blocs[2].temperature_c = 40.0
    assert get("3010") == get("301F:03")
    blocs[4].temperature_c = 9.5
    assert get("3010") == get("301F:05")
    assert get("301F:07") == 32767


@pytest.mark.rule("D2")
@pytest.mark.rule("D3")
@pytest.mark.rule("D4")
@pytest.mark.rule("G1")
def test_power_failure(rig: BladeRig, get: Get) -> None:
    rig.blade.power.mains_present = False
    rig.master.run(1000 * MS)
    assert get("30B2") == pytest.approx(2000, abs=60)
    assert get("30B3") in (29, 30)
    assert get("3000") & 0x32 == 0x32
    assert get("603F") == 0x3120
    assert not get("3002") & 2
    rig.run_until(lambda: bool(get("3002") & 2))
    assert get("30B2") == 0
    settle(rig)
    assert get("3063") == pytest.approx(600, abs=5)
    assert get("3070") > 0
    assert get("3001") & 2 == 0
    rig.blade.power.mains_present = True
    settle(rig)
    assert (get("30B2"), get("30B3"), get("3002")) == (3000, 30, 1)
    assert get("3000") == 1


@pytest.mark.rule("C4")
def test_the_booster_runs_10_s_or_until_it_is_stopped(rig: BladeRig, get: Get) -> None:
    rig.put("3040", BOOST, PMM)
    rig.master.run(9 * SECOND)
    assert get("3002") & 2
    rig.master.run(1500 * MS)
    assert not get("3002") & 2
    rig.put("3040", 0, PMM)
    rig.put("3040", BOOST, PMM)
    settle(rig)
    assert get("3002") & 2
    rig.put("3040", 0, PMM)
    assert not get("3002") & 2


@pytest.mark.rule("C2")
@pytest.mark.rule("F8")
@pytest.mark.rule("F10")
@pytest.mark.rule("F3")
def test_charger_by_command(rig: BladeRig, get: Get) -> None:
    assert get("3064") == get("3067") - 10
    rig.put("3040", CHARGE, PMM)
    settle(rig)
    assert get("3001") & 0b111 == 0b111
    assert get("3070") == -1000
    assert get("3064") == pytest.approx(get("3060") + 1, abs=1)
    assert get("3074") > 1000
    rig.master.run(40 * SECOND)
    assert get("3050") == pytest.approx(11, abs=1)
    assert get("3052") == get("3050")


@pytest.mark.rule("F7")
def test_charging_begins_below_the_threshold_and_ends_with_the_current(rig: BladeRig, get: Get) -> None:
    for bloc in rig.blade.power.blocs:
        bloc.charge = 0.9
    settle(rig)
    assert get("3001") & 0b110 == 0b110
    for bloc in rig.blade.power.blocs:
        bloc.charge, bloc.offset_v = 0.9985, 0.0
    rig.run_until(lambda: bool(get("3001") & 8), 100 * SECOND)
    rig.run_until(lambda: get("3001") == 1, 400 * SECOND)


@pytest.mark.rule("F9")
def test_no_charging_without_mains(rig: BladeRig, get: Get) -> None:
    rig.put("3040", CHARGE, PMM)
    rig.blade.power.mains_present = False
    settle(rig)
    assert get("3001") == 1
    assert get("3070") >= 0


@pytest.mark.rule("C3")
@pytest.mark.rule("F12")
def test_battery_test(rig: BladeRig, get: Get) -> None:
    rig.put("3040", TEST, PMM)
    assert get("3005") == 1 << 2
    rig.master.run(SECOND)
    assert get("3005") == 1 << 2
    rig.put("3040", 0, PMM)
    assert get("3005") == 1 << 3
    rest_v = get("3067")
    rig.master.run(5 * SECOND)
    assert get("3002") & 2
    assert get("3003") & 2
    assert get("3070") > 0
    rig.run_until(lambda: get("3005") == 0b11)
    assert 180 < get("3068") < rest_v


@pytest.mark.rule("F12")
def test_battery_test_is_impossible_while_the_motor_moves(rig: BladeRig, get: Get) -> None:
    rig.enable()
    rig.go(6000)
    rig.master.run(500 * MS)
    rig.put("3040", TEST, PMM)
    rig.put("3040", 0, PMM)
    assert get("3005") == 1 << 5


@pytest.mark.rule("F13")
@pytest.mark.rule("F11")
def test_refused_settings(rig: BladeRig) -> None:
    assert rig.refused("30E3", 59, PMM) == 0x06090032
    rig.put("30E3", 60, PMM)
    rig.put("30E3", 0, PMM)
    assert rig.refused("3020:01", 0x18, PMM) == 0x06090030


@pytest.mark.rule("A2")
def test_factory_objects(rig: BladeRig) -> None:
    for where in ("30F0:01", "30F1:03", "30FB:06"):
        assert rig.refused(where, 1, PMM) == 0x06010002
    rig.put("30F1:04", 245, PMM)
    factory = BladeRig(factory=True)
    factory.put("30F0:01", 1, PMM)
    assert factory.get("30F0:01", PMM) == 1


@pytest.mark.rule("F3")
def test_counters_outlive_a_restart_without_a_save(tmp_path: Path) -> None:
    rig = BladeRig(state_dir=tmp_path)
    rig.put("3050", 4321, PMM)
    rig.put("3110:01", 444, PMM)
    rig.restart(PMM)
    assert (rig.get("3050", PMM), rig.get("3110:01", PMM)) == (4321, 500)
    assert rig.refused("3051", 0, PMM) == 0x06010002
    assert BladeRig(state_dir=tmp_path).get("3050", PMM) == 4321


@pytest.mark.rule("G5")
def test_chopper_limits_what_is_fed_back(rig: BladeRig, get: Get) -> None:
    rig.blade.power.dc_link_v = 740.0
    rig.master.run(25 * MS)
    assert get("3003") & 2
    rig.run_until(lambda: not get("3003") & 2)
    assert get("3063") < 650
    assert get("3000") == 1


@pytest.mark.rule("D8")
def test_dc_link_errors(rig: BladeRig, get: Get) -> None:
    rig.blade.power.commands.chopper_on = False
    rig.blade.power.dc_link_v = 900.0
    rig.master.run(30 * MS)
    assert rig.errors(PMM) == [0x3211]
    assert get("3002") & 0x21 == 0x20
    assert get("3000") & 4


@pytest.mark.rule("I4")
@pytest.mark.rule("I5")
@pytest.mark.rule("I6")
def test_outputs_by_mask(rig: BladeRig, get: Get) -> None:
    rig.put("30FE:01", 0xFFFFFFFF, PMM)
    assert get("30FE:03") & 0xFFFF == 0
    rig.put("30FE:02", 0x0000F00C, PMM)
    assert get("30FE:03") & 0xFFFF == 0xF00C
    rig.put("30FE:01", 0, PMM)
    assert get("30FE:03") & 0xFFFF == 0


@pytest.mark.rule("I7")
@pytest.mark.rule("I8")
@pytest.mark.rule("I9")
def test_alarm_input_of_the_lightning_protection(rig: BladeRig, get: Get) -> None:
    rig.put("3300:01", 0x4200, PMM)
    settle(rig)
    assert get("3000") == 1
    rig.pmm.inputs.digital &= ~(1 << 9)
    settle(rig)
    assert get("603F") == 0xFFF1
    assert get("30FE:03") & 0x10FFF == 0x0800
    assert rig.errors(PMM) == [0xFFF1]
    rig.put("3300:01", 0x0200, PMM)
    settle(rig)
    rig.put("3040", RESET, PMM)
    assert (get("603F"), get("3000")) == (0xFFF1, 2)
    assert get("30FE:03") & 0x10FFF == 0x10400


@pytest.mark.rule("I3")
def test_analog_input_has_10_bits(rig: BladeRig, get: Get) -> None:
    steps = {get("30A0")}
    for tenth in range(40):
        rig.pmm.inputs.analog_mv = 4900.0 + tenth
        steps.add(get("30A0"))
    assert 4 <= len(steps) <= 6


@pytest.mark.rule("I13")
def test_manual_function_by_switch_or_by_object(rig: BladeRig, get: Get) -> None:
    rig.pmm.inputs.selector, rig.pmm.inputs.key = 3, True
    assert (get("5042"), get("5041")) == (0x13, 0x13)
    assert get("30FD") >> 27 == 0b00111
    rig.put("5040", 0x05, PMM)
    assert get("5042") == 0x13
    rig.put("5040", 0x25, PMM)
    assert (get("5042"), get("5041")) == (0x05, 5)


def test_the_moving_axis_warms_and_loads_the_unit(rig: BladeRig) -> None:
    before = rig.get("6410:09"), rig.get("6510:03")
    rig.enable()
    rig.go(2000)
    rig.run_until(lambda: rig.angle_deg < 20.03)
    assert rig.get("6410:09") >= before[0]
    assert rig.get("6510:03") >= before[1]
    assert rig.get("6079") > 500_000
    assert PMC == 11
