"""Faults of drives and what surrounds them, as their objects and messages show them, and that all of them can end."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.errors import UsageError
from app.model.fault import CATALOGUE, FaultOrder, FaultTarget
from app.twins.faults import MAX_ACTIVE
from app.twins.plant import BrakeFault
from app.wire.nmt import NmtCommand
from app.wire.sdo import Abort
from tests.twins.harness import MS, AbortedError
from tests.twins.turbine_rig import PMCS, PMMS, TurbineRig

BLADE, PMM, PMC = 2, 2, 12
SAVE = (0x65766173).to_bytes(4, "little")


@pytest.fixture
def rig() -> TurbineRig:
    return TurbineRig()


def put(rig: TurbineRig, kind: str, **more: float) -> int:
    """A fault at blade 2, or its PMC; gives its id."""
    target = CATALOGUE[kind].target
    blade = BLADE if target is FaultTarget.BLADE else None
    node = PMC if target is FaultTarget.NODE else None
    return rig.instructor.inject(FaultOrder(kind, blade, node, more)).id


# -- mains ------------------------------------------------------------------------------


def test_mains_of_the_turbine_fail_and_return(rig: TurbineRig) -> None:
    fault = put(rig, "mains_failure")
    rig.run(0.5)
    for node in PMMS:
        assert rig.number(node, "3062") == 0
        assert rig.number(node, "3000") >> 5 & 1, "runs on battery"
    rig.instructor.clear(fault)
    rig.run(0.5)
    for node in PMMS:
        assert rig.number(node, "3062") == pytest.approx(400, abs=10)
        assert not rig.number(node, "3000") >> 5 & 1


def test_mains_of_one_blade_sag(rig: TurbineRig) -> None:
    rig.instructor.inject(FaultOrder("mains_failure", BLADE, None, {"remaining_percent": 60}, 1.0))
    rig.run(0.5)
    assert rig.number(PMM, "3062") == pytest.approx(240, abs=10)
    assert rig.number(1, "3062") == pytest.approx(400, abs=10)
    rig.run(1.0)
    assert rig.number(PMM, "3062") == pytest.approx(400, abs=10)


def test_two_faults_of_one_mains_end_with_the_last(rig: TurbineRig) -> None:
    everywhere = put(rig, "mains_failure")
    here = rig.fault("mains_failure", blade=BLADE).id
    rig.instructor.clear(everywhere)
    rig.run(0.2)
    assert [rig.number(node, "3062") > 0 for node in PMMS] == [True, False, True]
    rig.instructor.clear(here)
    rig.run(0.2)
    assert rig.number(PMM, "3062") > 0


def test_a_phase_is_lost(rig: TurbineRig) -> None:
    assert not rig.number(PMM, "3000") >> 7 & 1
    fault = put(rig, "phase_loss", phase=2)
    rig.run(1)
    assert rig.number(PMM, "3000") >> 7 & 1
    rig.instructor.clear(fault)
    rig.run(1)
    assert not rig.number(PMM, "3000") >> 7 & 1


# -- battery, sensors, temperatures -----------------------------------------------------


def test_a_weak_bloc_drops_deeper_under_load(rig: TurbineRig) -> None:
    """Its own voltage in 3061h, against its neighbours, while the booster feeds an axis that drives to feather."""
    rig.turbine.blades[1].axis.extra_load_nm = -30_000  # a blade that is heavy to turn
    put(rig, "bloc_weak", bloc=4, ohm_factor=20)
    put(rig, "mains_failure")
    deepest = 0
    for _ in range(60):
        rig.run(0.1)
        volts = [rig.number(PMM, f"3061:0{number}") for number in range(1, 7)]
        deepest = max(deepest, min(volts[:3] + volts[4:]) - volts[3])
    assert deepest > 2000, "mV below its weakest neighbour"


@pytest.mark.parametrize(("kind", "shown"), [("sensor_short", -32768), ("sensor_open", 32767)])
@pytest.mark.parametrize(("sensor", "where"), [(1, "3012"), (2, "3013")])
@pytest.mark.rule("H4")
def test_a_temperature_sensor_breaks(rig: TurbineRig, kind: str, shown: int, sensor: int, where: str) -> None:
    fault = put(rig, kind, sensor=sensor)
    rig.run(0.5)
    assert rig.number(PMM, where, signed=True) == shown
    rig.instructor.clear(fault)
    rig.run(0.5)
    assert 150 < rig.number(PMM, where, signed=True) < 400


@pytest.mark.parametrize(("value", "watts", "where"), [("heat_sink_w", 5000, "3011"), ("battery_w", 3000, "3010")])
def test_heat_is_seen(rig: TurbineRig, value: str, watts: float, where: str) -> None:
    before = rig.number(PMM, where, signed=True)
    fault = put(rig, "over_temperature", **{"heat_sink_w": 0, value: watts})
    rig.run(10)
    warm = rig.number(PMM, where, signed=True)
    assert warm > before + 5
    rig.instructor.clear(fault)
    assert rig.number(1, where, signed=True) < before + 30, "only of this blade"


# -- axis -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "code"),
    [("encoder_sine_cosine", 0x7305), ("encoder_data", 0x7320), ("blade_encoder_failed", 0x7321)],
)
def test_an_encoder_fails(rig: TurbineRig, kind: str, code: int) -> None:
    put(rig, kind)
    rig.run(0.5)
    assert code in rig.errors(PMC)
    assert rig.errors(11) == []


def test_the_blade_encoder_slips(rig: TurbineRig) -> None:
    rig.run(1)
    before = rig.number(PMC, "68F4", signed=True)
    fault = put(rig, "blade_encoder_slip", slip_deg=5)
    rig.run(0.5)
    assert abs(rig.number(PMC, "68F4", signed=True) - before) == pytest.approx(500, abs=10)
    rig.instructor.clear(fault)
    rig.run(0.5)
    assert rig.number(PMC, "68F4", signed=True) == pytest.approx(before, abs=10)


@pytest.mark.parametrize(("lifted", "state"), [(0, BrakeFault.ENGAGED), (1, BrakeFault.LIFTED)])
def test_the_brake_is_stuck(rig: TurbineRig, lifted: int, state: BrakeFault) -> None:
    fault = put(rig, "brake_stuck", lifted=lifted)
    assert rig.turbine.blades[1].axis.brake_stuck is state
    rig.instructor.clear(fault)
    assert rig.turbine.blades[1].axis.brake_stuck is BrakeFault.NONE


def test_the_touch_probe_captures_where_the_mark_begins_and_ends(rig: TurbineRig) -> None:
    position = rig.number(PMC, "6064", signed=True)
    fault = put(rig, "touch_probe")
    assert rig.number(PMC, "60FD") & 1 << 17
    assert rig.number(PMC, "60BA", signed=True) == position
    assert rig.number(PMC, "60BB", signed=True) == 0
    rig.instructor.clear(fault)
    assert not rig.number(PMC, "60FD") & 1 << 17
    assert rig.number(PMC, "60BB", signed=True) == position


def test_a_lifted_brake_lets_the_blade_turn_under_load(rig: TurbineRig) -> None:
    """Nothing holds an axis whose output stage is off."""
    before = rig.number(PMC, "6064", signed=True)
    put(rig, "overload", moment_nm=-30_000)
    rig.run(2)
    assert rig.number(PMC, "6064", signed=True) == pytest.approx(before, abs=20), "the brake holds"
    put(rig, "brake_stuck", lifted=1)
    rig.run(2)
    assert rig.number(PMC, "6064", signed=True) < before - 500


def drive(rig: TurbineRig, target: int) -> None:
    """Blade 2 is on its way to ``target`` in 0.01 degrees."""
    rig.master.put(PMC, "6060", 1, 1)
    rig.master.put(PMC, "6081", 800, 4)
    rig.master.put(PMC, "607A", target, 4)
    for word in (0x010F, 0x000F, 0x001F, 0x000F):
        rig.master.put(PMC, "6040", word, 2)
    rig.run(1)
    assert abs(rig.turbine.blades[1].axis.speed_rad_s) > 50


@pytest.mark.rule("M9")
@pytest.mark.parametrize(("option", "told"), [(0, False), (2, True), (3, True)])
def test_an_axis_that_is_bus_off_does_what_6007_says(rig: TurbineRig, option: int, told: bool) -> None:
    """It stops at once, or goes on until its PMM misses it; the safety chain then feathers all blades."""
    rig.master.put(PMC, "6007", option, 2)
    drive(rig, 2000)
    axis = rig.turbine.blades[1].axis
    was = axis.speed_rad_s
    rig.fault("bus_off", node=PMC, seconds=2)
    rig.run(0.2)
    assert (abs(axis.speed_rad_s) < abs(was) / 3) is told
    rig.run(2)
    assert axis.speed_rad_s > 50, "to feather"
    assert (0x8140 in rig.errors(PMC)) is told


def test_an_axis_whose_power_is_cut_is_braked_and_goes_nowhere_after(rig: TurbineRig) -> None:
    drive(rig, 2000)
    axis = rig.turbine.blades[1].axis
    rig.fault("power_cut", node=PMC, off_s=3)
    rig.run(1.5)
    assert axis.speed_rad_s == 0.0
    stands_deg = axis.angle_deg
    rig.run(1)
    assert axis.angle_deg == pytest.approx(stands_deg, abs=0.1)


# -- memory and supply ------------------------------------------------------------------


def test_a_slow_memory(rig: TurbineRig) -> None:
    fault = put(rig, "eeprom_slow", save_ms=3000)
    since_ns = rig.line.now_ns
    rig.master.write(PMC, "1010:03", SAVE)
    assert 3000 * MS < rig.line.now_ns - since_ns < 3010 * MS
    rig.instructor.clear(fault)
    since_ns = rig.line.now_ns
    rig.master.write(PMC, "1010:03", SAVE)
    assert rig.line.now_ns - since_ns < 310 * MS


@pytest.mark.parametrize(("node", "where"), [(PMM, "30E0"), (PMC, "6066")])
def test_a_memory_that_takes_nothing_keeps_what_it_has(tmp_path: Path, node: int, where: str) -> None:
    """The save is refused, 5530h is told, and after a restart the old value stands."""
    rig = TurbineRig(state_dir=tmp_path)
    rig.master.put(node, where, 3330, 2)
    rig.master.write(node, "1010:03", SAVE)
    fault = rig.fault("eeprom_failing", node=node)
    rig.master.put(node, where, 4440, 2)
    with pytest.raises(AbortedError) as caught:
        rig.master.write(node, "1010:03", SAVE)
    assert caught.value.code == Abort.HARDWARE
    rig.run(0.1)
    assert 0x5530 in rig.errors(node)
    rig.instructor.clear(fault.id)
    rig.master.nmt(NmtCommand.RESET_NODE, node)
    rig.run(1)
    assert rig.number(node, where) == 3330
    rig.master.put(node, where, 4440, 2)
    rig.master.write(node, "1010:03", SAVE)


def test_a_power_cut_loses_ram_and_keeps_the_memory(tmp_path: Path) -> None:
    rig = TurbineRig(state_dir=tmp_path)
    rig.master.put(PMC, "6066", 50, 2)
    rig.master.write(PMC, "1010:03", SAVE)
    rig.master.put(PMC, "6066", 20, 2)
    since_ns = rig.line.now_ns
    rig.fault("power_cut", node=PMC, off_s=1.5)
    rig.run(1.4)
    assert rig.heard_since(since_ns + MS, 0x700 + PMC) == 0
    boot = rig.master.wait(lambda can: can.can_id == 0x700 + PMC)
    assert boot.can.data == b"\0"
    assert boot.t_ns - since_ns > 1500 * MS
    assert rig.instructor.active == ()
    assert rig.number(PMC, "6066") == 50


def test_a_cleared_power_cut_ends_at_once(rig: TurbineRig) -> None:
    fault = rig.fault("power_cut", node=PMM, off_s=1000)
    rig.run(1)
    rig.instructor.clear(fault.id)
    assert rig.master.wait_id(0x700 + PMM).can.data == b"\0"


@pytest.mark.parametrize("at_ms", [1, 100, 299, 301, 350])
def test_power_cut_while_saving_leaves_the_old_or_the_new_set(tmp_path: Path, at_ms: int) -> None:
    """Two values that belong together: both are old, or both are new, after the restart and for another process."""
    rig = TurbineRig(state_dir=tmp_path)
    for number, value in (("6068", 100), ("6066", 40)):
        rig.master.put(PMC, number, value, 2)
    rig.master.write(PMC, "1010:03", SAVE)
    for number, value in (("6068", 200), ("6066", 60)):
        rig.master.put(PMC, number, value, 2)
    rig.master.send(0x600 + PMC, bytes([0x23, 0x10, 0x10, 3]) + SAVE)
    rig.run(at_ms / 1000)
    rig.fault("power_cut", node=PMC, off_s=0.2)
    rig.run(1)
    again = TurbineRig(state_dir=tmp_path)
    for found in (rig, again):
        pair = found.number(PMC, "6068"), found.number(PMC, "6066")
        assert pair == ((100, 40) if at_ms < 300 else (200, 60))


def test_a_power_cut_loses_what_was_counted_and_not_written(tmp_path: Path) -> None:
    """3050h goes to the memory each minute; a cut before loses what came after the last time."""
    rig = TurbineRig(state_dir=tmp_path)
    rig.master.put(PMM, "3050", 77, 4)
    rig.run(61)
    rig.master.put(PMM, "3050", 99, 4)
    rig.fault("power_cut", node=PMM, off_s=0.2)
    rig.run(1)
    assert 77 <= rig.number(PMM, "3050") < 99


# -- wind -------------------------------------------------------------------------------


def test_a_gust_comes_and_goes(rig: TurbineRig) -> None:
    before = rig.surroundings.rotor.wind_mps
    rig.fault("gust", rise_mps=15, duration_s=10)
    rig.run(4)
    assert rig.surroundings.rotor.wind_mps > before + 10
    rig.run(7)
    assert rig.surroundings.rotor.wind_mps < before + 5
    assert rig.instructor.active == ()


def test_a_cleared_gust_is_over(rig: TurbineRig) -> None:
    fault = put(rig, "gust", rise_mps=30)
    rig.run(4)
    strong = rig.surroundings.rotor.wind_mps
    rig.instructor.clear(fault)
    assert rig.surroundings.rotor.wind_mps < strong - 20


# -- all of them ------------------------------------------------------------------------


@pytest.mark.parametrize("kind", sorted(CATALOGUE))
def test_every_fault_ends_by_itself(rig: TurbineRig, kind: str) -> None:
    target, momentary = CATALOGUE[kind].target, CATALOGUE[kind].momentary
    blade = BLADE if target is FaultTarget.BLADE else None
    node = PMC if target is FaultTarget.NODE else None
    shortest = {"gust": {"duration_s": 0.5}, "power_cut": {"off_s": 0.5}}.get(kind, {})
    fault = rig.instructor.inject(FaultOrder(kind, blade, node, shortest, None if momentary else 0.5))
    assert list(rig.instructor.active) == [fault]
    assert fault.since_ns == rig.line.now_ns
    rig.run(0.45)
    assert list(rig.instructor.active) == [fault]
    rig.run(0.1)
    assert list(rig.instructor.active) == []
    with pytest.raises(UsageError):
        rig.instructor.clear(fault.id)


@pytest.mark.parametrize("kind", sorted(CATALOGUE))
def test_every_fault_can_be_put_in_twice_and_all_be_cleared(rig: TurbineRig, kind: str) -> None:
    put(rig, kind)
    rig.run(0.05)
    put(rig, kind)
    rig.run(0.05)
    rig.instructor.clear_all()
    assert rig.instructor.active == ()
    rig.run(3)
    for node in (*PMMS, *PMCS):
        assert rig.number(node, "1018:02") > 0, "all answer again"


def test_too_many_faults_are_refused(rig: TurbineRig) -> None:
    for _ in range(MAX_ACTIVE):
        put(rig, "sensor_open")
    with pytest.raises(UsageError):
        put(rig, "sensor_open")
    rig.instructor.clear_all()
    put(rig, "sensor_open")
