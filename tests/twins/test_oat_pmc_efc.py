"""The emergency feather command (EFC): what calls for it, how it is driven, how it ends (manual, 5.8.1 and 5.15)."""

from __future__ import annotations

import pytest

from app.twins.axis_drive import Feedback
from app.twins.cia402 import State
from app.twins.plant import EncoderFault
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import (
    DISABLE_VOLTAGE,
    EFC,
    ENABLE,
    FAULT_RESET,
    NEW_TARGET,
    QUICK_STOP,
    SHUTDOWN,
    START,
    SWITCH_ON,
    BladeRig,
)

COPIES = {"567A": "607A", "5681": "6081", "5683": "6083", "5684": "6084"}
VALUES = {"567A": 8950, "5681": 640, "5683": 1700, "5684": 1900}


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


def call(rig: BladeRig, by_input: bool) -> None:
    if by_input:
        rig.pmc.inputs.efc = False
        rig.master.run(25 * MS)
    else:
        rig.command(EFC)


def feathers(rig: BladeRig, timeout_ns: int = 30 * SECOND) -> None:
    rig.run_until(lambda: rig.blade.axis.at_90, timeout_ns)
    rig.run_until(lambda: rig.pmc.drive.at_rest)
    assert 89.8 < rig.angle_deg < 93


@pytest.mark.rule("L1")
@pytest.mark.rule("L2")
@pytest.mark.rule("J10")
@pytest.mark.parametrize("by_input", [True, False])
def test_what_calls_for_it(rig: BladeRig, by_input: bool) -> None:
    assert rig.get("60FD") >> 18 & 1
    call(rig, by_input)
    assert bool(rig.get("60FD") >> 18 & 1) is not by_input
    assert rig.bit(9) is not by_input
    assert rig.state() is State.OPERATION_ENABLED
    assert rig.pmc.machine.feathering
    feathers(rig)


@pytest.mark.rule("L1")
@pytest.mark.rule("J9")
def test_its_bit_counts_in_any_controlword(rig: BladeRig) -> None:
    rig.command(SHUTDOWN | 0x0800)
    assert rig.pmc.machine.feathering


@pytest.mark.rule("L3")
@pytest.mark.parametrize("by_input", [True, False])
def test_its_objects_become_those_of_the_position_mode(rig: BladeRig, by_input: bool) -> None:
    for where, number in VALUES.items():
        rig.put(where, number)
    call(rig, by_input)
    assert {source: rig.get(target) for source, target in COPIES.items()} == VALUES
    rig.run_until(lambda: rig.get("606C") > 600)
    rig.master.run(300 * MS)
    assert rig.get("606C") == pytest.approx(640, abs=10)


@pytest.mark.rule("L3")
def test_its_target_by_default_is_90_degrees(rig: BladeRig) -> None:
    assert rig.get("567A") == 9000
    rig.command(EFC)
    assert rig.get("607A") == 9000


@pytest.mark.rule("L2")
@pytest.mark.rule("K3")
def test_the_mode_it_chose_remains_and_cannot_be_changed_meanwhile(rig: BladeRig) -> None:
    rig.enable(mode=9)
    call(rig, by_input=True)
    assert rig.get("6061") == 1
    assert rig.refused("6060", 9) == 0x08000021
    feathers(rig)
    rig.pmc.inputs.efc = True
    rig.master.run(50 * MS)
    rig.command(SHUTDOWN)
    rig.wait_state(State.READY)
    assert rig.get("6061") == 1


@pytest.mark.rule("L2")
@pytest.mark.parametrize("word", [DISABLE_VOLTAGE, QUICK_STOP, SHUTDOWN, SWITCH_ON, ENABLE, NEW_TARGET])
def test_no_controlword_stops_it_while_the_input_calls(rig: BladeRig, word: int) -> None:
    call(rig, by_input=True)
    rig.put("607A", 1000)
    rig.command(word)
    feathers(rig)
    assert rig.get("6061") == 1


@pytest.mark.rule("L2")
def test_edges_of_the_controlword_meanwhile_are_lost(rig: BladeRig) -> None:
    rig.enable()
    call(rig, by_input=True)
    rig.put("607A", 7000)
    rig.command(START, NEW_TARGET)
    rig.pmc.inputs.efc = True
    rig.master.run(SECOND)
    assert not rig.bit(12)
    assert rig.angle_deg > 80


@pytest.mark.rule("L4")
@pytest.mark.rule("J2")
@pytest.mark.parametrize(
    ("words", "transitions"),
    [
        ([], [3, 4]),
        ([SWITCH_ON], [4]),
        ([ENABLE], []),
        ([DISABLE_VOLTAGE], [16]),
        ([ENABLE, QUICK_STOP], [16]),
    ],
)
def test_it_leads_straight_to_an_enabled_axis(rig: BladeRig, words: list[int], transitions: list[int]) -> None:
    rig.put("6060", 3)
    rig.command(*words)
    rig.master.run(300 * MS)
    done = len(rig.transitions)
    call(rig, by_input=True)
    assert rig.transitions[done:] == transitions
    assert rig.state() is State.OPERATION_ENABLED
    feathers(rig)


@pytest.mark.rule("L4")
@pytest.mark.rule("J2")
def test_it_interrupts_a_quick_stop(rig: BladeRig) -> None:
    rig.enable()
    rig.go(2000)
    rig.run_until(lambda: rig.get("606C") < -700)
    rig.command(QUICK_STOP)
    assert rig.state() is State.QUICK_STOP_ACTIVE
    rig.pmc.inputs.efc = False
    rig.run_until(lambda: rig.pmc.machine.feathering, 100 * MS)
    assert rig.transitions[-2:] in ([11, 16], [12, 16])
    feathers(rig)


@pytest.mark.rule("L4")
@pytest.mark.parametrize("angle_deg", [92.0, 96.0])
@pytest.mark.parametrize("by_input", [True, False])
def test_it_is_not_driven_from_a_limit_switch(angle_deg: float, by_input: bool) -> None:
    rig = BladeRig(angle_deg=angle_deg)
    call(rig, by_input)
    rig.master.run(SECOND)
    assert not rig.pmc.machine.feathering
    assert rig.angle_deg == pytest.approx(angle_deg)


@pytest.mark.rule("L4")
@pytest.mark.parametrize("code", [0x8611, 0x8620, 0x8130, 0x7305])
def test_it_is_driven_in_spite_of_another_error(rig: BladeRig, code: int) -> None:
    rig.put("6007", 3)
    rig.pmc.raise_error(code)
    rig.wait_state(State.FAULT)
    rig.pmc.inputs.efc = False
    rig.run_until(lambda: rig.pmc.machine.feathering, 100 * MS)
    assert not rig.pmc.watchdog_closed
    feathers(rig)
    assert rig.get("603F") == code
    rig.wait_state(State.FAULT)  # the error acts again when the EFC is over
    rig.pmc.inputs.efc = True
    rig.master.run(50 * MS)
    rig.command(0, FAULT_RESET)
    assert rig.state() is not State.FAULT
    assert rig.pmc.watchdog_closed


@pytest.mark.rule("L4")
@pytest.mark.parametrize("code", [0x8611, 0x8130, 0x8620])
def test_an_error_on_the_way_does_not_end_it(rig: BladeRig, code: int) -> None:
    rig.put("6007", 3)
    call(rig, by_input=True)
    rig.run_until(lambda: rig.angle_deg > 82)
    rig.pmc.raise_error(code)
    assert rig.pmc.machine.feathering
    rig.master.run(200 * MS)
    assert rig.errors() == [code]
    assert rig.get("606C") == pytest.approx(800, abs=10)
    feathers(rig)


@pytest.mark.rule("L4")
@pytest.mark.parametrize("code", [0x2320, 0x3210, 0x6380])
def test_it_is_not_driven_while_the_motor_cannot_run(rig: BladeRig, code: int) -> None:
    rig.pmc.errors.condition(code, True)
    if code == 0x6380:
        rig.pmc.monitors.power_stage = 0
    if code == 0x3210:
        rig.put("6510:05", 300)
    rig.master.run(50 * MS)
    rig.pmc.inputs.efc = False
    rig.master.run(SECOND)
    assert rig.state() is State.FAULT
    assert rig.angle_deg == pytest.approx(80.0)


@pytest.mark.rule("L4")
@pytest.mark.parametrize("fault", [EncoderFault.SINE_COSINE, EncoderFault.DATA_CHANNEL])
def test_with_a_dead_motor_encoder_it_goes_by_the_additional_one(rig: BladeRig, fault: EncoderFault) -> None:
    rig.put("567A", 8800)
    rig.blade.axis.encoder_fault = fault
    rig.wait_state(State.FAULT)
    rig.pmc.inputs.efc = False
    rig.master.run(200 * MS)
    assert rig.pmc.drive.feedback is Feedback.BLADE_ENCODER
    rig.master.run(5 * SECOND)
    assert rig.angle_deg == pytest.approx(88.0, abs=0.2)


@pytest.mark.rule("L4")
def test_by_the_additional_encoder_it_runs_smoothly_although_the_gear_has_play() -> None:
    rig = BladeRig(angle_deg=45.0)
    rig.blade.axis.encoder_fault = EncoderFault.SINE_COSINE
    rig.wait_state(State.FAULT)
    rig.pmc.inputs.efc = False
    rig.run_until(lambda: rig.angle_deg > 60, 5 * SECOND)
    seen = []
    for _ in range(200):
        rig.master.run(5 * MS)
        seen.append((rig.get("6044"), abs(rig.get("6077"))))
    speeds, currents = zip(*seen, strict=True)
    assert max(speeds) - min(speeds) < 0.02 * max(speeds)
    assert max(currents) < 500, "it swings between the limits of the current"


@pytest.mark.rule("L4")
def test_with_a_dead_blade_encoder_it_goes_by_that_of_the_motor_whatever_606a_says(rig: BladeRig) -> None:
    rig.put("567A", 8800)
    rig.put("606A", -1)
    rig.blade.axis.blade_encoder_failed = True
    rig.wait_state(State.FAULT)
    assert rig.errors() == [0x7321]
    rig.pmc.inputs.efc = False
    rig.master.run(6 * SECOND)
    assert rig.angle_deg == pytest.approx(88.0, abs=0.1)


@pytest.mark.rule("L4")
@pytest.mark.parametrize("simulated", [True, False])
def test_with_no_encoder_left_it_goes_with_controlled_speed_to_the_switch(rig: BladeRig, simulated: bool) -> None:
    rig.put("5894", 0xFF if simulated else 0)
    rig.put("567A", 8500)
    rig.put("607D:02", 8600)
    rig.blade.axis.encoder_fault = EncoderFault.SINE_COSINE
    rig.blade.axis.blade_encoder_failed = not simulated
    rig.wait_state(State.FAULT)
    rig.pmc.inputs.efc = False
    rig.run_until(lambda: rig.angle_deg > 84, 5 * SECOND)
    assert rig.pmc.drive.feedback is Feedback.NONE
    rpm = rig.blade.axis.speed_rad_s * 9.5493
    assert rpm == pytest.approx(800 / 21.26717 * 60, rel=0.02)
    feathers(rig)


@pytest.mark.rule("L5")
def test_flag_8_leads_on_to_the_switch(rig: BladeRig) -> None:
    rig.put("567A", 8800)
    rig.put("60FB:03", 1 << 8 | 1)
    call(rig, by_input=True)
    feathers(rig)


@pytest.mark.rule("L5")
def test_flag_8_starts_again_when_the_switch_is_lost_in_feather(rig: BladeRig) -> None:
    rig.put("60FB:03", 1 << 8 | 1)
    call(rig, by_input=True)
    feathers(rig)
    rig.wait_state(State.SWITCHED_ON)
    rig.blade.axis.place(87.0)
    rig.run_until(lambda: rig.pmc.machine.feathering, SECOND)
    feathers(rig)


@pytest.mark.rule("L5")
def test_without_flag_8_it_ends_at_its_target(rig: BladeRig) -> None:
    rig.put("567A", 8800)
    call(rig, by_input=True)
    rig.master.run(5 * SECOND)
    assert rig.get("6064") == pytest.approx(8800, abs=2)
    assert rig.angle_deg == pytest.approx(88.0, abs=0.05)  # the play of the gear lies between
    assert not rig.blade.axis.at_90


@pytest.mark.rule("L5")
def test_flag_9_goes_by_velocity_to_the_switch(rig: BladeRig) -> None:
    """No position is controlled: neither the target nor a following error ends it."""
    rig.put("567A", 8500)
    rig.put("607D:02", 8600)
    rig.put("6065", 0)
    rig.put("6066", 0)
    rig.put("60FB:02", 0)
    rig.put("60FB:03", 1 << 9 | 1)
    call(rig, by_input=True)
    rig.run_until(lambda: rig.angle_deg > 84, 5 * SECOND)
    assert rig.get("606C") == pytest.approx(800, abs=20)
    assert rig.get("60F4") == 0
    assert rig.errors() == []
    feathers(rig)
