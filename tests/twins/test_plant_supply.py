"""Physics of the supply alone: rectifier, DC link, chopper, booster, battery, 24 V; and its books."""

from __future__ import annotations

from cmath import exp
from collections.abc import Callable
from math import e, pi, sin, sqrt

import pytest

from app.twins import supply_kernel as k
from app.twins.plant_battery import Bloc, charge_of, open_circuit_v
from app.twins.plant_kernel import run_compiled
from app.twins.plant_power import PowerConstants, PowerPlant
from app.twins.plant_thermal import Losses

Cycles = Callable[[PowerPlant, int], None]


def plain(power: PowerPlant, cycles: int) -> None:
    for _ in range(cycles):
        k.supply_cycle(power.s, power.p)


def _ignore(_: int) -> None:
    """The number of cycles run is known."""


def drive(power: PowerPlant, cycles: Cycles) -> list[list[float]]:
    """20 s with a mains failure, a lost phase, booster and chopper; the state every 100 ms."""
    states = []
    for tenth in range(200):
        power.mains_present = not 20 <= tenth < 120
        power.phases[1] = 0.0 if tenth >= 160 else 1.0
        power.commands.mains_failed = 20 <= tenth < 121
        power.commands.charge_a = 1.0 if tenth < 15 else 0.0
        power.motor_power_w = (6000.0, -7000.0, 0.0, 48000.0)[tenth // 5 % 4]
        power.prepare()
        cycles(power, 100)
        power.settle()
        states.append(list(power.s))
    return states


def test_compiled_and_plain_cycles_are_equal_to_the_last_bit() -> None:
    run = run_compiled()
    compiled = drive(PowerPlant(seed=2), lambda power, cycles: _ignore(run(power.s, power.p, cycles)))
    states = drive(PowerPlant(seed=2), plain)
    assert compiled == states
    assert {state[k.BOOSTER_GOVERNOR] for state in states} == {0.0, 1.0}
    assert any(state[k.CHOPPER_ON] for state in states)


# -- mains and DC link -----------------------------------------------------------------


def sound(seed: int = 3) -> PowerPlant:
    return PowerPlant(seed, PowerConstants(mains_swing_v=0.0))


def course(power: PowerPlant, cycles: int) -> list[float]:
    """The DC link's voltage after each cycle."""
    power.prepare()
    voltages = []
    for _ in range(cycles):
        k.supply_cycle(power.s, power.p)
        voltages.append(power.dc_link_v)
    power.settle()
    return voltages


@pytest.mark.rule("D7")
def test_an_unloaded_dc_link_stands_at_the_peak_of_the_mains() -> None:
    power = sound()
    course(power, 1000)
    assert power.dc_link_v == pytest.approx(400 * sqrt(2), rel=0.001)
    power.mains_factor = 0.9
    course(power, 3000)
    assert power.dc_link_v == pytest.approx(360 * sqrt(2), rel=0.001)


def test_a_dc_link_without_mains_empties_as_its_energy_says() -> None:
    """C V^2 / 2 falls by power times time: V = sqrt(V0^2 - 2 P t / C)."""
    power = sound()
    power.mains_present = False
    power.motor_power_w = 2000.0
    began_v = power.dc_link_v
    load_w = 2000.0 + power.constants.idle_load_w + power.adapter_w
    for cycle, voltage in enumerate(course(power, 150), 1):
        expected = sqrt(began_v**2 - 2 * load_w * cycle * k.DT_S / power.constants.capacity_f)
        assert voltage == pytest.approx(expected, rel=1e-6)


def test_a_lost_phase_leaves_a_ripple_of_100_hz() -> None:
    """Between two pulses 10 ms apart the capacitor alone gives the power; with three phases the gaps are a third."""
    power = sound()
    power.motor_power_w = 6000.0
    whole = course(power, 500)[-200:]
    power.phases = [1.0, 0.0, 1.0]
    lost = course(power, 500)[-200:]
    assert max(whole) - min(whole) < 12
    assert 25 < max(lost) - min(lost) < 60
    assert lost[:10] == pytest.approx(lost[10:20], abs=0.5)
    assert min(lost) > 420, "it goes on with two"
    power.phases = [1.0, 0.0, 0.0]
    assert course(power, 500)[-1] < 100


@pytest.mark.parametrize("phases", [[1.0, 1.0, 1.0], [1.0, 0.8, 1.0], [0.9, 1.0, 0.7]])
def test_line_voltages_are_those_of_the_phasors(phases: list[float]) -> None:
    power = sound()
    power.phases = phases
    phasors = [share * 400 / sqrt(3) * exp(-2j * pi * number / 3) for number, share in enumerate(phases)]
    expected = [abs(phasors[a] - phasors[b]) for a, b in ((0, 1), (1, 2), (2, 0))]
    assert power.mains.line_v == pytest.approx(expected)


@pytest.mark.rule("G5")
def test_the_chopper_switches_in_the_very_cycle() -> None:
    power = sound()
    power.motor_power_w = -3000.0
    switched = []
    was, before = False, power.dc_link_v
    power.prepare()
    for _ in range(3000):
        k.supply_cycle(power.s, power.p)
        if power.chopper_on is not was:
            was = power.chopper_on
            switched.append((was, before))
        before = power.dc_link_v
    assert len(switched) > 4
    assert all(670 <= voltage < 673 if on else 648 < voltage < 650 for on, voltage in switched)


@pytest.mark.rule("G1")
def test_the_booster_starts_in_the_very_cycle() -> None:
    power = sound()
    power.mains_present = False
    power.commands.mains_failed = True
    power.motor_power_w = 4000.0
    voltages = course(power, 2000)
    assert 416 < min(voltages) < 420
    assert voltages[-1] == pytest.approx(600, abs=0.5)


# -- battery -----------------------------------------------------------------------------


def on_battery(power: PowerPlant, motor_w: float) -> None:
    power.mains_present = False
    power.commands.mains_failed = True
    power.motor_power_w = motor_w


def test_the_battery_gives_the_power_that_is_drawn() -> None:
    power = sound()
    on_battery(power, 5000.0)
    power.step(1.0)
    constants = power.constants
    output_w = 5000.0 + constants.idle_load_w
    taken_w = output_w / constants.booster_efficiency + power.adapter_w
    assert power.booster_a * power.dc_link_v == pytest.approx(output_w, rel=0.01)
    assert power.battery_a * power.battery_v == pytest.approx(taken_w, rel=0.001)


def test_the_slow_part_of_the_voltage_drop_follows_its_time_constant() -> None:
    power = sound()
    on_battery(power, 6000.0)
    power.dc_link_v = 600.0
    power.step(60.0)
    power.motor_power_w = 0.0
    power.step(0.1)
    slow_v = power.s[k.POLARISATION_V]
    assert slow_v == pytest.approx(32 * 0.4 * power.battery_ohm, rel=0.2)
    power.step(power.constants.polarisation_s)
    assert power.s[k.POLARISATION_V] == pytest.approx(slow_v / e, rel=0.03)


def test_charge_and_what_flowed_agree() -> None:
    power = sound()
    before = [bloc.charge for bloc in power.blocs]
    power.blocs[2].capacity_share = 0.5
    on_battery(power, 5000.0)
    power.step(20.0)
    flowed_as = power.s[k.DISCHARGED_AS]
    assert flowed_as > 300
    for number, bloc in enumerate(power.blocs):
        held_as = 10800 * (0.5 if number == 2 else 1.0)
        assert (before[number] - bloc.charge) * held_as == pytest.approx(flowed_as, rel=0.001)


@pytest.mark.parametrize(("change", "factor"), [("age", 3.0), ("cold", 1.7), ("empty", 5.0), ("hot", 0.85)], ids=str)
def test_internal_resistance_over_age_temperature_and_charge(change: str, factor: float) -> None:
    bloc = Bloc(0.8, 0.0, 25.0, 0.0)
    assert bloc.ohm == pytest.approx(0.025)
    if change == "age":
        bloc.ohm_factor = 3.0
    elif change == "empty":
        bloc.charge = 0.0
    else:
        bloc.temperature_c = 0.0 if change == "cold" else 45.0
    assert bloc.ohm == pytest.approx(0.025 * factor)


def test_the_open_circuit_curve_and_its_inverse() -> None:
    for percent in range(101):
        charge = percent / 100
        assert charge_of(open_circuit_v(charge)) == pytest.approx(charge, abs=1e-9)
    assert open_circuit_v(1.0) == 41.0
    assert Bloc(0.3, 0.0, -20.0, 0.0).rest_v < 10 < 31 < Bloc(0.5, 0.0, -20.0, 0.0).rest_v


def test_a_bloc_that_runs_empty_takes_its_voltage_with_it() -> None:
    power = sound()
    power.blocs[1].capacity_share = 0.02
    on_battery(power, 5000.0)
    power.step(2.0)
    assert power.bloc_v(1) > 30
    power.step(15.0)
    assert power.bloc_v(1) < 5
    assert power.bloc_v(0) > 35


# -- books ---------------------------------------------------------------------------------


def efc(power: PowerPlant) -> None:
    """A way to feather on the battery: start, steady travel, gusts that feed back, stop; 12 s."""
    on_battery(power, 0.0)
    power.dc_link_v = 560.0
    for tick in range(2400):
        t_s = tick * 0.005
        power.motor_power_w = 0.0
        if t_s < 11:
            power.motor_power_w = 8000.0 if t_s < 0.6 else 3500.0 + 4500.0 * sin(2.3 * t_s)
        power.brake_lifted = t_s < 11
        power.step(0.005)


def stored_j(power: PowerPlant) -> float:
    return 0.5 * power.constants.capacity_f * power.dc_link_v**2


def test_energy_is_kept_over_a_whole_efc_on_the_battery() -> None:
    """What the blocs lost, by their charge and open-circuit curves alone, is found in losses, loads and DC link."""
    power = sound(1)
    for bloc in power.blocs:
        bloc.temperature_c = 25.0
    charges = [bloc.charge for bloc in power.blocs]
    began_j = stored_j(power)
    efc(power)
    s = power.s
    given_j = 0.0
    for bloc, charge in zip(power.blocs, charges, strict=True):
        steps = 1000
        width = (charge - bloc.charge) / steps
        middles = (bloc.charge + (step + 0.5) * width for step in range(steps))
        given_j += sum((open_circuit_v(middle) + bloc.offset_v) * width * bloc.capacity_as for middle in middles)
    used_j = s[k.INVERTER_IN_J] + s[k.IDLE_J] + s[k.ADAPTER_J] + s[k.CHOPPER_J]
    lost_j = s[k.BATTERY_LOSS_J] + s[k.BOOSTER_LOSS_J]
    assert s[k.INVERTER_IN_J] > 30_000
    assert s[k.MAINS_J] == s[k.MISSING_J] == s[k.CHARGER_LOSS_J] == 0
    assert given_j + began_j == pytest.approx(used_j + lost_j + stored_j(power), rel=0.005)
    assert given_j == pytest.approx(s[k.BATTERY_J], rel=0.002)


def test_energy_is_kept_on_the_mains_with_charger_and_chopper() -> None:
    power = sound(2)
    began_j = stored_j(power)
    power.commands.charge_a = 1.0
    for tick in range(1000):
        power.motor_power_w = 5000.0 * sin(0.02 * tick)
        power.step(0.01)
    s = power.s
    charged_j = -s[k.BATTERY_J] + s[k.BATTERY_LOSS_J] + s[k.CHARGER_LOSS_J]
    used_j = s[k.INVERTER_IN_J] + s[k.IDLE_J] + s[k.ADAPTER_J] + s[k.CHOPPER_J] + charged_j + s[k.LINE_LOSS_J]
    assert s[k.CHOPPER_J] > 1000
    assert s[k.MAINS_J] + began_j == pytest.approx(used_j + stored_j(power), rel=1e-6)


def test_the_supply_does_not_depend_on_how_time_is_cut() -> None:
    cut: list[list[float]] = []
    for tick_s in (0.001, 0.005, 0.02, 0.1):
        power = PowerPlant(seed=1)
        on_battery(power, 3000.0)
        for _ in range(round(3.0 / tick_s)):
            power.step(tick_s)
        cut.append([*power.s, *(bloc.charge for bloc in power.blocs), power.heat_sink_c, power.thermal.box_c])
    assert all(state == cut[0] for state in cut)


# -- 24 V and temperatures --------------------------------------------------------------------


def test_24_v_falls_with_its_load_and_rests_while_fed_from_outside() -> None:
    power = sound()
    idle_v = power.supply_v
    power.brake_lifted = True
    assert power.supply_v == pytest.approx(idle_v - 0.075)
    assert power.adapter_w == pytest.approx(power.supply_v * power.supply_a / 0.85)
    power.external_v = 25.0
    assert power.supply_v == pytest.approx(24.3)
    assert power.adapter_w == 0


def test_temperatures_settle_where_losses_and_conductances_say() -> None:
    power = PowerPlant(1, PowerConstants(mains_swing_v=0.0, ambient_swing_c=0.0))
    thermal, constants = power.thermal, power.thermal.constants
    losses = Losses(600.0, 800.0, [1.5] * 6)
    for _ in range(40_000):
        thermal.step(1.0, 20.0, losses, power.blocs)
    assert thermal.heat_sink_c == pytest.approx(20 + 600 * constants.heat_sink_k_per_w, abs=0.1)
    assert thermal.motor_c == pytest.approx(20 + 800 * constants.motor_k_per_w, abs=0.1)
    assert thermal.box_c == pytest.approx(20 + 9.0 / constants.box_w_per_k, abs=0.1)
    for bloc in power.blocs:
        assert bloc.temperature_c == pytest.approx(
            thermal.box_c + bloc.warmer_c + 1.5 / constants.bloc_w_per_k, abs=0.1
        )
    thermal.motor_fan = True
    for _ in range(10_000):
        thermal.step(1.0, 20.0, losses, power.blocs)
    assert thermal.motor_c == pytest.approx(20 + 400 * constants.motor_k_per_w, abs=0.1)


def test_work_warms_heat_sink_motor_and_blocs() -> None:
    worked, rested = PowerPlant(seed=1), PowerPlant(seed=1)
    on_battery(worked, 6000.0)
    for power in (worked, rested):
        power.step(20.0)
    assert worked.heat_sink_c > rested.heat_sink_c + 0.5
    assert worked.motor_c > rested.motor_c
    assert min(a.temperature_c - b.temperature_c for a, b in zip(worked.blocs, rested.blocs, strict=True)) > 0.3
    hot = PowerPlant(seed=1)
    hot.extra_heat_sink_w, hot.extra_motor_w, hot.extra_battery_w = 1000.0, 5000.0, 3000.0
    hot.step(20.0)
    assert hot.heat_sink_c > rested.heat_sink_c + 2
    assert hot.motor_c > rested.motor_c + 3
    assert hot.blocs[0].temperature_c > rested.blocs[0].temperature_c + 5
