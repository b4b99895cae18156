"""Transitions of the PMC, their events and actions (manual, 5.8.1, tables 50 to 52), its inputs and outputs (5.16)."""

from __future__ import annotations

import pytest

from app.twins.cia402 import Command, State, command_of
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import (
    DISABLE_VOLTAGE,
    EFC,
    ENABLE,
    FAULT_RESET,
    NEW_TARGET,
    PMC,
    QUICK_STOP,
    SHUTDOWN,
    START,
    SWITCH_ON,
    BladeRig,
)

BRAKE_LIFTED = 1 << 0
WATCHDOG = 1 << 16
BEYOND = 1 << 14 | 1


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


def outputs(rig: BladeRig) -> tuple[bool, bool]:
    """Brake lifted, output stage on."""
    return bool(rig.pmc.digital_outputs() & BRAKE_LIFTED), rig.pmc.drive.energised


# -- commands (table 52) ------------------------------------------------------------------------


@pytest.mark.rule("J9")
@pytest.mark.parametrize(
    ("word", "command"),
    [
        (0x0106, Command.SHUTDOWN),
        (0x010E, Command.SHUTDOWN),
        (0x0107, Command.SWITCH_ON),
        (0x010F, Command.ENABLE_OPERATION),
        (0x000F, Command.ENABLE_OPERATION),
        (0x001F, Command.ENABLE_OPERATION),
        (0x010C, Command.DISABLE_VOLTAGE),
        (0x0000, Command.DISABLE_VOLTAGE),
        (0x010D, Command.DISABLE_VOLTAGE),
        (0x010B, Command.QUICK_STOP),
        (0x0002, Command.QUICK_STOP),
    ],
)
def test_commands_by_their_bits(word: int, command: Command) -> None:
    assert command_of(word) is command


@pytest.mark.rule("J9")
def test_start_new_position_and_stop(rig: BladeRig) -> None:
    rig.enable()
    rig.put("607A", 7000)
    rig.command(START, NEW_TARGET)
    rig.run_until(lambda: rig.get("606C") < -700)
    rig.command(ENABLE)
    rig.run_until(lambda: rig.get("606C") == 0, SECOND)
    assert rig.state() is State.OPERATION_ENABLED
    rig.command(START)
    rig.run_until(lambda: rig.get("606C") < -700)


@pytest.mark.rule("J9")
def test_fault_reset_is_an_edge(rig: BladeRig) -> None:
    rig.command(FAULT_RESET)
    rig.pmc.raise_error(0x2320)
    rig.command(FAULT_RESET)
    assert rig.state() is State.FAULT
    rig.command(SHUTDOWN, FAULT_RESET)
    assert rig.state() is State.READY


@pytest.mark.rule("J3")
def test_one_controlword_leads_from_ready_to_enabled_and_back(rig: BladeRig) -> None:
    rig.command(ENABLE)
    assert rig.transitions[-2:] == [3, 4]
    rig.command(SHUTDOWN)
    rig.wait_state(State.READY)
    assert outputs(rig) == (False, False)


# -- transitions (table 50) ---------------------------------------------------------------------


@pytest.mark.rule("J2")
@pytest.mark.rule("J8")
def test_t0_and_t1(rig: BladeRig) -> None:
    rig.command(ENABLE)
    rig.master.nmt(NmtCommand.RESET_NODE, PMC)
    rig.master.run(2 * MS)
    assert rig.transitions == [0]
    assert outputs(rig) == (False, False)
    assert not rig.pmc.digital_outputs() & WATCHDOG
    rig.master.wait_id(0x700 + PMC)
    rig.master.run(5 * MS)
    assert rig.transitions[:2] == [0, 1]
    assert rig.pmc.digital_outputs() & WATCHDOG


@pytest.mark.rule("J6")
@pytest.mark.rule("J2")
def test_autostart_spares_the_first_shut_down_and_switches_nothing_on(rig: BladeRig) -> None:
    assert rig.get("60FB:03") & 1
    rig.master.run(SECOND)
    assert rig.transitions == [0, 1, 2]
    assert outputs(rig) == (False, False)
    rig.command(DISABLE_VOLTAGE)
    rig.command(ENABLE)
    rig.master.run(SECOND)
    assert rig.state() is State.SWITCH_ON_DISABLED  # only after power-on
    rig.command(SHUTDOWN)
    assert rig.state() is State.READY


@pytest.mark.rule("J6")
@pytest.mark.rule("J5")
def test_autostart_waits_for_the_enable_input() -> None:
    rig = BladeRig()
    rig.pmc.inputs.enable = False
    rig.restart()
    rig.master.run(SECOND)
    assert rig.transitions == [0, 1]
    rig.pmc.inputs.enable = True
    rig.wait_state(State.READY)


@pytest.mark.rule("J2")
@pytest.mark.rule("J5")
@pytest.mark.parametrize(
    ("words", "transition", "state"),
    [([], 7, State.READY), ([SWITCH_ON], 10, State.SWITCHED_ON), ([ENABLE], 9, State.OPERATION_ENABLED)],
)
def test_the_enable_input_is_needed(rig: BladeRig, words: list[int], transition: int, state: State) -> None:
    assert rig.get("60FD") >> 3 & 1
    rig.command(*words)
    assert rig.state() is state
    rig.pmc.inputs.enable = False
    rig.wait_state(State.SWITCH_ON_DISABLED)
    assert not rig.get("60FD") >> 3 & 1
    assert rig.transitions[-1] == transition
    assert outputs(rig) == (False, False)
    rig.command(DISABLE_VOLTAGE, SHUTDOWN)
    assert rig.state() is State.SWITCH_ON_DISABLED


@pytest.mark.rule("J2")
def test_t3_lifts_the_brake_and_begins_at_the_actual_position(rig: BladeRig) -> None:
    rig.put("6060", 1)
    rig.command(SWITCH_ON)
    assert outputs(rig) == (True, True)
    assert rig.pmc.drive.profile.position == pytest.approx(rig.pmc.drive.position, abs=0.01)
    rig.put("607A", 7000)
    rig.command(SWITCH_ON | 0x10)
    rig.master.run(SECOND)
    assert rig.angle_deg == pytest.approx(80.0, abs=0.01)  # not enabled: it cannot be moved


@pytest.mark.rule("J2")
@pytest.mark.rule("J4")
@pytest.mark.parametrize("by_switch", [True, False])
def test_t5_shows_when_the_axis_has_stopped_by_its_ramp(by_switch: bool) -> None:
    rig = BladeRig(angle_deg=80.0)
    rig.enable()
    rig.go(9400)
    if by_switch:
        rig.master.until(lambda: rig.blade.axis.at_90, step_ns=MS)
        rig.master.run(20 * MS)
    else:
        rig.run_until(lambda: rig.get("606C") > 750)
        rig.command(SWITCH_ON)
    began_ns, speed = rig.line.now_ns, rig.get("606C")
    assert rig.state() is State.OPERATION_ENABLED
    rig.wait_state(State.SWITCHED_ON)
    assert rig.transitions[-1] == 5
    assert abs(rig.get("606C")) < 60
    assert (rig.line.now_ns - began_ns) / SECOND == pytest.approx(speed / 1500, abs=0.08)
    assert outputs(rig) == (True, True)


@pytest.mark.rule("J2")
@pytest.mark.parametrize(
    ("words", "transition", "after"),
    [
        ([ENABLE, DISABLE_VOLTAGE], 9, State.SWITCH_ON_DISABLED),
        ([ENABLE, SHUTDOWN], 8, State.READY),
        ([ENABLE, QUICK_STOP], 11, State.QUICK_STOP_ACTIVE),
    ],
)
def test_on_the_way_through_t5_stronger_commands_count(
    rig: BladeRig, words: list[int], transition: int, after: State
) -> None:
    rig.enable()
    rig.go(2000)
    rig.run_until(lambda: rig.get("606C") < -700)
    rig.command(SWITCH_ON)
    assert rig.state() is State.OPERATION_ENABLED
    rig.command(words[-1])
    rig.wait_state(after, SECOND)
    assert rig.transitions[-1] == transition


@pytest.mark.rule("J2")
@pytest.mark.rule("J4")
@pytest.mark.rule("J14")
@pytest.mark.parametrize(
    ("words", "word", "transition", "after"),
    [
        ([SWITCH_ON], SHUTDOWN, 6, State.READY),
        ([ENABLE], SHUTDOWN, 8, State.READY),
        ([ENABLE], DISABLE_VOLTAGE, 9, State.SWITCH_ON_DISABLED),
        ([SWITCH_ON], DISABLE_VOLTAGE, 10, State.SWITCH_ON_DISABLED),
        ([SWITCH_ON], QUICK_STOP, 10, State.SWITCH_ON_DISABLED),
        ([ENABLE], QUICK_STOP, 12, State.SWITCH_ON_DISABLED),
    ],
)
def test_the_brake_gets_its_time_before_control_ends_and_the_state_shows(
    rig: BladeRig, words: list[int], word: int, transition: int, after: State
) -> None:
    rig.put("60F9:04", 400)
    rig.command(*words)
    assert outputs(rig) == (True, True)
    rig.command(word)
    rig.master.run(10 * MS)
    assert outputs(rig) == (False, True)
    assert rig.pmc.drive.profile.velocity == 0
    assert rig.state() is not after
    rig.master.run(360 * MS)
    assert rig.state() is not after
    assert outputs(rig) == (False, True)
    rig.master.run(50 * MS)
    assert rig.state() is after
    assert outputs(rig) == (False, False)
    assert rig.transitions[-1] == transition


@pytest.mark.rule("J14")
def test_without_a_brake_control_ends_at_once(rig: BladeRig) -> None:
    assert rig.get("60F9:04") == 100
    rig.put("60F9:04", 0)
    rig.command(ENABLE, SHUTDOWN)
    assert rig.state() is State.READY
    assert outputs(rig) == (False, False)


@pytest.mark.rule("J14")
@pytest.mark.rule("J2")
def test_t14_gives_the_brake_its_time_too(rig: BladeRig) -> None:
    rig.put("60F9:04", 400)
    rig.enable()
    rig.pmc.raise_error(0x8611)
    rig.master.run(100 * MS)
    assert rig.state() is State.FAULT_REACTION_ACTIVE
    assert outputs(rig) == (False, True)
    rig.wait_state(State.FAULT)
    assert outputs(rig) == (False, False)


@pytest.mark.rule("J14")
@pytest.mark.rule("J12")
def test_a_stopped_axis_keeps_its_brake_lifted_and_its_control_on(rig: BladeRig) -> None:
    rig.enable()
    rig.go(2000)
    rig.run_until(lambda: rig.get("606C") < -700)
    rig.command(ENABLE)
    rig.wait_bit(10)
    rig.master.run(SECOND)
    assert outputs(rig) == (True, True)


@pytest.mark.rule("J2")
@pytest.mark.rule("J7")
@pytest.mark.parametrize(
    ("words", "transitions"), [([SWITCH_ON], [10]), ([ENABLE], [11, 12]), ([], [])], ids=["T10", "T11", "ready"]
)
def test_the_0_degree_switch(rig: BladeRig, words: list[int], transitions: list[int]) -> None:
    rig.put("6065", 0xFFFFFFFF)
    rig.command(*words)
    done = len(rig.transitions)
    assert rig.get("60FD") & 1
    rig.blade.axis.place(-1.0)
    rig.master.run(500 * MS)
    assert not rig.get("60FD") & 1
    assert rig.transitions[done:] == transitions


@pytest.mark.rule("J7")
def test_from_the_0_degree_switch_only_the_way_up_is_free() -> None:
    rig = BladeRig(angle_deg=-1.0)
    rig.put("607D:01", -2000)
    rig.enable()
    rig.go(-300)
    rig.wait_state(State.SWITCH_ON_DISABLED)
    assert rig.angle_deg == pytest.approx(-1.0, abs=0.1)
    rig.command(SHUTDOWN, ENABLE)
    rig.move(500)
    assert rig.angle_deg == pytest.approx(5.0, abs=0.05)


@pytest.mark.rule("J7")
@pytest.mark.parametrize("words", [[], [SWITCH_ON], [DISABLE_VOLTAGE]])
def test_the_90_degree_switch_ends_an_enabled_axis_only(rig: BladeRig, words: list[int]) -> None:
    rig.put("6065", 0xFFFFFFFF)
    rig.command(*words)
    done = len(rig.transitions)
    assert not rig.get("60FD") >> 16 & 1
    rig.blade.axis.place(91.0)
    rig.pmc.drive.profile.put(rig.pmc.drive.position)
    rig.master.run(200 * MS)
    assert rig.get("60FD") >> 16 & 1
    assert rig.transitions[done:] == []


@pytest.mark.rule("J7")
@pytest.mark.rule("J2")
@pytest.mark.parametrize("words", [[], [DISABLE_VOLTAGE], [SWITCH_ON], [ENABLE]])
def test_the_95_degree_switch_is_a_fault_from_everywhere(rig: BladeRig, words: list[int]) -> None:
    rig.put("6065", 0xFFFFFFFF)
    rig.command(*words)
    rig.wait_state(rig.state())
    assert rig.get("60FD") >> 1 & 1
    rig.blade.axis.place(96.0)
    rig.wait_state(State.FAULT, SECOND)
    assert not rig.get("60FD") >> 1 & 1
    assert 13 in rig.transitions[-3:]
    assert not rig.get("60FE:03") & WATCHDOG


@pytest.mark.rule("J15")
@pytest.mark.parametrize("angle_deg", [-1.0, 91.0, 96.0])
def test_flag_14_lets_every_switch_be_passed_while_the_node_is_not_operational(angle_deg: float) -> None:
    rig = BladeRig()
    rig.put("60FB:03", BEYOND)
    rig.put("6065", 0xFFFFFFFF)
    rig.enable()
    rig.blade.axis.place(angle_deg)
    rig.pmc.drive.profile.put(rig.pmc.drive.position)
    rig.master.run(300 * MS)
    assert rig.transitions[-1] == 4
    assert rig.state() is State.OPERATION_ENABLED


@pytest.mark.rule("J15")
@pytest.mark.parametrize("angle_deg", [-1.0, 91.0, 96.0])
def test_flag_14_does_nothing_while_the_node_is_operational(angle_deg: float) -> None:
    rig = BladeRig()
    rig.put("60FB:03", BEYOND)
    rig.put("6065", 0xFFFFFFFF)
    rig.operational()
    rig.enable()
    rig.blade.axis.place(angle_deg)
    rig.pmc.drive.profile.put(rig.pmc.drive.position)
    rig.master.run(300 * MS)
    assert rig.transitions[-1] in (5, 12, 13, 14)


@pytest.mark.rule("J2")
@pytest.mark.rule("J8")
@pytest.mark.parametrize("words", [[], [DISABLE_VOLTAGE], [SWITCH_ON], [ENABLE]])
def test_t13_t14_and_t15_from_every_state(rig: BladeRig, words: list[int]) -> None:
    rig.command(*words)
    rig.master.run(150 * MS)
    rig.pmc.raise_error(0x2320)
    assert rig.transitions[-2:] == [13, 14]
    assert not rig.get("60FE:03") & WATCHDOG
    rig.command(0, FAULT_RESET)
    assert rig.transitions[-2:] == [15, 2]
    assert rig.get("60FE:03") & WATCHDOG
    assert rig.get("603F") == 0


@pytest.mark.rule("J2")
def test_t15_waits_until_no_error_is_left(rig: BladeRig) -> None:
    rig.pmc.raise_error(0x2320)
    rig.put("6510:05", 300)
    rig.master.run(50 * MS)
    rig.command(0, FAULT_RESET)
    assert rig.state() is State.FAULT
    assert rig.get("603F") == 0x3210
    rig.put("6510:05", 750)
    rig.master.run(50 * MS)
    rig.command(0, FAULT_RESET)
    assert rig.transitions[-2:] == [15, 2]


@pytest.mark.rule("J8")
@pytest.mark.parametrize("code", [0x2320, 0x8611, 0x8130, 0x8620, 0x5530, 0x7321])
def test_every_error_opens_the_watchdog_contact(rig: BladeRig, code: int) -> None:
    rig.put("605E", -1)
    assert rig.get("60FE:03") & WATCHDOG
    rig.pmc.raise_error(code)
    assert not rig.get("60FE:03") & WATCHDOG
    rig.command(0, FAULT_RESET)
    assert rig.get("60FE:03") & WATCHDOG


@pytest.mark.rule("J8")
def test_a_warning_does_not_open_the_watchdog_contact(rig: BladeRig) -> None:
    rig.put("6510:06", rig.get("6510:03") - 10)
    rig.master.run(50 * MS)
    assert rig.bit(7)
    assert rig.get("60FE:03") & WATCHDOG


@pytest.mark.rule("J2")
@pytest.mark.rule("J9")
def test_t16_by_the_controlword(rig: BladeRig) -> None:
    rig.command(DISABLE_VOLTAGE, EFC)
    assert rig.transitions[-1] == 16
    assert outputs(rig) == (True, True)


# -- words of inputs and outputs (tables 72 and 73) ------------------------------------------------


@pytest.mark.rule("J7")
def test_inputs_by_their_clamps(rig: BladeRig) -> None:
    assert rig.get("60FD") == 1 << 0 | 1 << 1 | 1 << 3 | 1 << 18
    for name, bit in (("reference", 2), ("enable", 3), ("probe", 17), ("efc", 18), ("reset", 19), ("free", 20)):
        before = rig.get("60FD")
        setattr(rig.pmc.inputs, name, not getattr(rig.pmc.inputs, name))
        assert rig.get("60FD") ^ before == 1 << bit


@pytest.mark.rule("J14")
def test_outputs_show_and_cannot_be_driven(rig: BladeRig) -> None:
    before = rig.get("60FE:03")
    rig.put("60FE:02", 0xFFFFFFFF)
    rig.put("60FE:01", 0xFFFFFFFF)
    assert rig.get("60FE:03") == before
    assert not before & 0xC0FEFFFE & ~(0x3F << 24)
    assert rig.refused("60FE:03", 0) == 0x06010002
    rig.pmc.raise_error(0x2320)
    assert (rig.get("60FE:03") ^ before) == WATCHDOG | 1 << 25 | 1 << 26


@pytest.mark.rule("B4")
def test_the_reset_input_acts_by_its_edge(rig: BladeRig) -> None:
    rig.pmc.inputs.reset = True
    rig.master.run(50 * MS)
    rig.pmc.raise_error(0x2320)
    rig.master.run(50 * MS)
    assert rig.state() is State.FAULT
    rig.pmc.inputs.reset = False
    rig.master.run(50 * MS)
    rig.pmc.inputs.reset = True
    rig.wait_state(State.SWITCH_ON_DISABLED)
