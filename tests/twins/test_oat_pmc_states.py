"""State machine of the PMC over the wire: every transition of table 50, and what goes with it."""

from __future__ import annotations

import pytest

from app.twins.cia402 import State
from app.twins.plant import EncoderFault
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS
from tests.twins.oat_rig import (
    DISABLE_VOLTAGE,
    EFC,
    ENABLE,
    FAULT_RESET,
    PMC,
    QUICK_STOP,
    SHUTDOWN,
    START,
    SWITCH_ON,
    BladeRig,
)

BRAKE_LIFTED = 1 << 0
WATCHDOG = 1 << 16


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


@pytest.mark.rule("J6")
def test_t0_t1_t2_after_power_on_with_autostart(rig: BladeRig) -> None:
    assert rig.transitions == [0, 1, 2]
    assert rig.state() is State.READY
    assert rig.get("60FE:03") & WATCHDOG


@pytest.mark.rule("J6")
def test_without_autostart_shutdown_is_wanted(rig: BladeRig) -> None:
    rig.put("60FB:03", 0)
    rig.save()
    rig.restart()
    assert rig.state() is State.SWITCH_ON_DISABLED
    rig.command(ENABLE)
    assert rig.state() is State.SWITCH_ON_DISABLED
    rig.command(SHUTDOWN)
    assert rig.state() is State.READY
    assert rig.transitions == [0, 1, 2]


@pytest.mark.rule("J5")
def test_t2_wants_the_enable_input(rig: BladeRig) -> None:
    rig.pmc.inputs.enable = False
    rig.wait_state(State.SWITCH_ON_DISABLED)
    rig.command(SHUTDOWN)
    assert rig.state() is State.SWITCH_ON_DISABLED
    rig.pmc.inputs.enable = True
    rig.wait_state(State.READY)
    assert rig.transitions[-2:] == [7, 2]


@pytest.mark.rule("J9")
@pytest.mark.parametrize(
    ("before", "words", "after", "transitions"),
    [
        ([], [SWITCH_ON], State.SWITCHED_ON, [3]),
        ([], [ENABLE], State.OPERATION_ENABLED, [3, 4]),
        ([SWITCH_ON], [ENABLE], State.OPERATION_ENABLED, [4]),
        ([ENABLE], [SWITCH_ON], State.SWITCHED_ON, [5]),
        ([SWITCH_ON], [SHUTDOWN], State.READY, [6]),
        ([], [DISABLE_VOLTAGE], State.SWITCH_ON_DISABLED, [7]),
        ([], [QUICK_STOP], State.SWITCH_ON_DISABLED, [7]),
        ([ENABLE], [SHUTDOWN], State.READY, [8]),
        ([ENABLE], [DISABLE_VOLTAGE], State.SWITCH_ON_DISABLED, [9]),
        ([SWITCH_ON], [QUICK_STOP], State.SWITCH_ON_DISABLED, [10]),
        ([SWITCH_ON], [DISABLE_VOLTAGE], State.SWITCH_ON_DISABLED, [10]),
        ([ENABLE], [QUICK_STOP], State.SWITCH_ON_DISABLED, [11, 12]),
        ([DISABLE_VOLTAGE], [SHUTDOWN, SWITCH_ON], State.SWITCHED_ON, [2, 3]),
    ],
)
def test_commands(rig: BladeRig, before: list[int], words: list[int], after: State, transitions: list[int]) -> None:
    rig.put("6060", 1)
    rig.command(*before)
    done = len(rig.transitions)
    rig.command(*words)
    rig.wait_state(after)
    assert rig.transitions[done:] == transitions


@pytest.mark.rule("J3")
def test_t3_and_t4_by_one_controlword(rig: BladeRig) -> None:
    rig.command(ENABLE)
    assert rig.state() is State.OPERATION_ENABLED
    assert rig.get("60FE:03") & BRAKE_LIFTED


@pytest.mark.rule("J4")
@pytest.mark.rule("J14")
def test_the_new_state_shows_after_the_brake_time(rig: BladeRig) -> None:
    rig.put("60F9:04", 300)
    rig.command(ENABLE)
    rig.command(SHUTDOWN)
    assert rig.state() is State.OPERATION_ENABLED
    assert not rig.get("60FE:03") & BRAKE_LIFTED
    rig.master.run(250 * MS)
    assert rig.state() is State.OPERATION_ENABLED
    rig.master.run(70 * MS)
    assert rig.state() is State.READY


@pytest.mark.parametrize("words", [[SWITCH_ON], [ENABLE]])
@pytest.mark.rule("J5")
def test_losing_the_enable_input_switches_off(rig: BladeRig, words: list[int]) -> None:
    rig.command(*words)
    rig.pmc.inputs.enable = False
    rig.wait_state(State.SWITCH_ON_DISABLED)
    assert rig.transitions[-1] == (9 if words == [ENABLE] else 10)


@pytest.mark.rule("J7")
def test_0_degree_switch_is_a_quick_stop() -> None:
    rig = BladeRig(angle_deg=2.0)
    rig.put("607D:01", -1000)
    rig.enable()
    rig.go(-300)
    rig.wait_state(State.SWITCH_ON_DISABLED)
    assert rig.transitions[-2:] == [11, 12]
    assert not rig.get("60FD") & 1
    assert -2.0 < rig.angle_deg < -0.5


@pytest.mark.rule("J7")
def test_90_degree_switch_disables_operation_until_enabled_anew() -> None:
    rig = BladeRig(angle_deg=88.0)
    rig.enable()
    rig.go(9400)
    rig.wait_state(State.SWITCHED_ON)
    assert rig.transitions[-1] == 5
    assert rig.get("60FD") >> 16 & 1
    rig.command(START)
    assert rig.state() is State.SWITCHED_ON
    rig.command(SWITCH_ON, ENABLE)
    assert rig.state() is State.OPERATION_ENABLED
    rig.move(8500)
    assert rig.angle_deg == pytest.approx(85.0, abs=0.03)


@pytest.mark.rule("J7")
@pytest.mark.rule("J8")
def test_95_degree_switch_is_a_fault_that_stays_with_the_switch() -> None:
    rig = BladeRig(angle_deg=94.0)
    rig.enable()
    rig.go(9800)
    rig.wait_state(State.FAULT)
    assert rig.transitions[-2:] == [13, 14]
    assert not rig.get("60FD") >> 1 & 1
    assert not rig.get("60FE:03") & WATCHDOG
    rig.command(FAULT_RESET)
    assert rig.state() is State.FAULT
    rig.blade.axis.place(85.0)
    rig.master.run(50 * MS)
    rig.command(0, FAULT_RESET)
    assert rig.transitions[-2:] == [15, 2]
    assert rig.get("60FE:03") & WATCHDOG


@pytest.mark.rule("J15")
def test_flag_14_leads_past_the_switch_in_pre_operational_only() -> None:
    rig = BladeRig(angle_deg=94.0)
    rig.put("60FB:03", 1 << 14 | 1)
    rig.enable()
    rig.move(9600)
    assert rig.state() is State.OPERATION_ENABLED
    rig.operational()
    rig.wait_state(State.FAULT)


@pytest.mark.rule("J8")
@pytest.mark.rule("B4")
def test_t13_t14_t15_by_an_error_with_motor_off(rig: BladeRig) -> None:
    rig.enable()
    rig.pmc.errors.condition(0x2310, True)
    rig.wait_state(State.FAULT)
    assert rig.transitions[-2:] == [13, 14]
    assert rig.get("603F") == 0x2310
    assert rig.errors() == [0x2310]
    assert rig.get("1003:01") & 0xFFFF == 0x2310
    rig.command(FAULT_RESET)
    assert rig.state() is State.FAULT
    rig.pmc.errors.condition(0x2310, False)
    rig.command(0, FAULT_RESET)
    assert rig.transitions[-2:] == [15, 2]
    assert rig.get("603F") == 0


@pytest.mark.rule("B4")
def test_fault_reset_by_input_and_by_manual_control(rig: BladeRig) -> None:
    rig.pmc.errors.event(0x2310)
    rig.wait_state(State.FAULT)
    rig.pmc.inputs.reset = True
    rig.wait_state(State.SWITCH_ON_DISABLED)
    rig.pmc.errors.event(0x2320)
    rig.wait_state(State.FAULT)
    rig.put("5040", 0x80)
    assert rig.state() is State.SWITCH_ON_DISABLED


@pytest.mark.rule("J1")
def test_statusword_of_a_healthy_axis(rig: BladeRig) -> None:
    assert rig.status() & 0x03FF == 0x0231
    rig.command(ENABLE)
    assert rig.status() & 0x03FF == 0x0237


@pytest.mark.rule("J10")
def test_bit_14_is_reflected(rig: BladeRig) -> None:
    rig.command(0x4000 | SHUTDOWN)
    assert rig.bit(14)
    assert not rig.bit(8)
    assert not rig.bit(15)
    rig.command(SHUTDOWN)
    assert not rig.bit(14)


def test_statusword_cannot_be_written(rig: BladeRig) -> None:
    assert rig.refused("6041", 0) == 0x06010002


@pytest.mark.rule("K1")
@pytest.mark.rule("K2")
def test_mode_changes_only_while_the_stage_is_off(rig: BladeRig) -> None:
    assert rig.refused("6060", 4) == 0x06090030
    rig.put("6060", 3)
    assert rig.get("6061") == 3
    rig.put("6060", 0)
    assert rig.get("6061") == 3
    rig.put("6060", -113)
    assert rig.get("6061") == -113
    rig.put("6060", 1)
    rig.command(ENABLE)
    assert rig.refused("6060", 3) == 0x08000022
    assert rig.get("6061") == 1
    rig.command(SWITCH_ON)
    rig.put("6060", 3)
    assert rig.get("6061") == 3


@pytest.mark.rule("M7")
@pytest.mark.rule("M8")
@pytest.mark.parametrize(("option", "rolls"), [(0, True), (1, False), (2, False), (3, False)])
def test_fault_reaction_option(option: int, rolls: bool) -> None:
    rig = BladeRig()
    rig.put("605E", option)
    rig.enable()
    rig.go(2000)
    rig.run_until(lambda: rig.get("606C") < -700)
    rig.pmc.errors.event(0x7305)
    rig.master.run(20 * MS)
    lifted = bool(rig.get("60FE:03") & BRAKE_LIFTED)
    assert lifted is not rolls
    rig.wait_state(State.FAULT)
    rig.run_until(lambda: rig.get("606C") == 0, 500 * MS)


@pytest.mark.rule("M8")
def test_fault_reaction_message_only(rig: BladeRig) -> None:
    rig.put("605E", -1)
    rig.enable()
    rig.pmc.errors.event(0x7305)
    rig.master.run(50 * MS)
    assert rig.state() is State.OPERATION_ENABLED
    assert rig.bit(7)
    assert rig.errors() == [0x7305]


@pytest.mark.rule("M9")
@pytest.mark.parametrize(
    ("option", "state", "codes"),
    [
        (0, State.OPERATION_ENABLED, []),
        (1, State.OPERATION_ENABLED, [0x8130]),
        (2, State.FAULT, [0x8130]),
        (3, State.FAULT, [0x8130]),
    ],
)
def test_lost_heartbeat_reaction(option: int, state: State, codes: list[int]) -> None:
    rig = BladeRig()
    rig.put("6007", option)
    rig.put("1016:01", 127 << 16 | 100)
    rig.enable()
    rig.go(2000)
    rig.master.send(0x77F, b"\x05")
    rig.master.run(600 * MS)
    assert rig.state() is state
    assert rig.errors() == codes
    assert (rig.get("606C") != 0) is (state is State.OPERATION_ENABLED)


@pytest.mark.rule("M4")
def test_masked_errors_and_priority_a(rig: BladeRig) -> None:
    rig.put("6510:07", 0)
    rig.blade.axis.encoder_fault = EncoderFault.SINE_COSINE
    rig.master.run(50 * MS)
    assert rig.state() is State.READY
    assert rig.get("6510:08") == 1 << 4
    rig.pmc.errors.condition(0x2310, True)
    rig.wait_state(State.FAULT)
    assert rig.get("6510:08") == 1 << 4 | 1 << 7


@pytest.mark.rule("M6")
def test_dc_link_voltage_is_watched(rig: BladeRig) -> None:
    rig.put("6510:05", 560)
    rig.wait_state(State.FAULT)
    assert rig.errors() == [0x3210]
    rig.put("6510:05", 750)
    rig.master.run(50 * MS)
    rig.command(FAULT_RESET)
    assert rig.state() is not State.FAULT


@pytest.mark.rule("M5")
def test_heat_sink_warns_and_turns_the_motor_off_after_30_s(rig: BladeRig) -> None:
    rig.enable()
    tenths = rig.get("6510:03")
    rig.put("6510:06", tenths - 10)
    rig.master.run(50 * MS)
    assert rig.bit(7)
    assert rig.get("603F") == 0x4210
    assert rig.errors() == []
    rig.put("6510:02", tenths - 10)
    rig.master.run(29_500 * MS)
    assert rig.state() is State.OPERATION_ENABLED
    rig.master.run(1000 * MS)
    assert rig.state() is State.FAULT
    assert rig.errors() == [0x4210]


def test_a_stopped_node_follows_6007(rig: BladeRig) -> None:
    rig.put("6007", 3)
    rig.enable()
    rig.go(2000)
    rig.master.run(800 * MS)
    rig.master.nmt(NmtCommand.STOP, PMC)
    rig.run_until(lambda: not rig.pmc.drive.energised)
    assert rig.transitions[-2:] == [11, 12]


@pytest.mark.rule("L1")
@pytest.mark.rule("L3")
@pytest.mark.rule("K3")
def test_efc_by_controlword(rig: BladeRig) -> None:
    rig.put("567A", 8900)
    rig.put("6060", 3)
    rig.command(EFC)
    assert rig.transitions[-2:] == [3, 4]
    assert rig.bit(9)
    assert (rig.get("6061"), rig.get("607A"), rig.get("6081")) == (1, 8900, 800)
    assert (rig.get("6083"), rig.get("6084")) == (1500, 1500)
    rig.wait_bit(10)
    assert rig.angle_deg == pytest.approx(89.0, abs=0.03)
    assert rig.state() is State.OPERATION_ENABLED


@pytest.mark.rule("L1")
@pytest.mark.rule("L2")
def test_efc_by_input_ends_at_the_switch_and_keeps_the_mode(rig: BladeRig) -> None:
    rig.enable(mode=3)
    rig.pmc.inputs.efc = False
    rig.wait_bit(9, False)
    assert not rig.get("60FD") >> 18 & 1
    rig.command(DISABLE_VOLTAGE)
    assert rig.refused("6060", 3) == 0x08000021
    rig.run_until(lambda: rig.blade.axis.at_90)
    rig.wait_state(State.SWITCHED_ON)
    assert rig.transitions[-1] == 5
    assert rig.angle_deg == pytest.approx(90.0, abs=0.15)
    rig.pmc.inputs.efc = True
    rig.wait_state(State.SWITCH_ON_DISABLED)
    assert rig.bit(9)
    assert rig.get("6061") == 1


@pytest.mark.rule("J2")
@pytest.mark.parametrize("words", [[DISABLE_VOLTAGE], [ENABLE, QUICK_STOP]])
def test_t16_efc_from_switch_on_disabled(rig: BladeRig, words: list[int]) -> None:
    rig.put("6060", 1)
    rig.command(*words)
    rig.wait_state(State.SWITCH_ON_DISABLED)
    rig.pmc.inputs.efc = False
    rig.wait_state(State.OPERATION_ENABLED)
    assert rig.transitions[-1] == 16


@pytest.mark.rule("L4")
def test_efc_leaves_a_fault_where_the_motor_can_run(rig: BladeRig) -> None:
    rig.pmc.errors.event(0x8611)
    rig.wait_state(State.FAULT)
    rig.pmc.inputs.efc = False
    rig.wait_state(State.OPERATION_ENABLED)
    assert rig.transitions[-2:] == [15, 16]
    rig.run_until(lambda: rig.angle_deg > 89.8)


@pytest.mark.rule("L4")
def test_efc_cannot_run_a_motor_that_is_off_for_good(rig: BladeRig) -> None:
    rig.pmc.errors.condition(0x2320, True)
    rig.wait_state(State.FAULT)
    rig.pmc.inputs.efc = False
    rig.master.run(500 * MS)
    assert rig.state() is State.FAULT
    assert rig.angle_deg == pytest.approx(80.0)


@pytest.mark.rule("L4")
def test_efc_is_not_driven_on_the_90_degree_switch() -> None:
    rig = BladeRig(angle_deg=92.0)
    rig.pmc.inputs.efc = False
    rig.master.run(500 * MS)
    assert rig.state() is State.READY
    assert rig.angle_deg == pytest.approx(92.0)


@pytest.mark.rule("L1")
def test_efc_interrupts_a_move_and_its_halt(rig: BladeRig) -> None:
    rig.enable()
    rig.go(1000)
    rig.run_until(lambda: rig.angle_deg < 75)
    rig.command(ENABLE | 1 << 11)
    rig.run_until(lambda: rig.blade.axis.at_90, 20_000 * MS)


@pytest.mark.rule("L5")
@pytest.mark.parametrize(("flag", "angle_deg"), [(0, 88.0), (1 << 8, 90.0), (1 << 9, 90.0)])
def test_efc_goes_on_to_the_switch_where_the_flags_say_so(rig: BladeRig, flag: int, angle_deg: float) -> None:
    rig.put("567A", 8800)
    rig.put("60FB:03", flag | 1)
    rig.pmc.inputs.efc = False
    rig.master.run(6000 * MS)
    assert rig.angle_deg == pytest.approx(angle_deg, abs=2.2 if flag else 0.03)
    assert rig.blade.axis.at_90 is bool(flag)


@pytest.mark.rule("M3")
def test_difference_of_the_encoders(rig: BladeRig) -> None:
    rig.put("6060", 6)
    rig.put("687C", rig.get("687C") + 50)
    rig.put("6866", 500)
    rig.master.run(1000 * MS)
    assert rig.errors() == []
    rig.put("6865", 40)
    rig.master.run(400 * MS)
    assert rig.errors() == []
    rig.master.run(300 * MS)
    assert rig.errors() == [0x8620]


def test_restart_takes_the_stage_off_and_leaves_the_blade(rig: BladeRig) -> None:
    rig.enable()
    rig.move(7000)
    rig.restart()
    assert rig.state() is State.READY
    assert rig.angle_deg == pytest.approx(70.0, abs=0.03)
    assert rig.get("6064") == pytest.approx(7000, abs=2)
    assert rig.get("6060") == 0
