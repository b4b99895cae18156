"""What the PMC watches, what it raises, and what the axis does then (manual, 5.7, tables 38 and 46 to 48)."""

from __future__ import annotations

import pytest

from app.twins.axis_errors import KINDS
from app.twins.cia402 import State
from app.twins.plant import BrakeFault, EncoderFault
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import ENABLE, FAULT_RESET, PMC, START, BladeRig

BRAKE_LIFTED = 1 << 0
WATCHDOG = 1 << 16
WARNING = 7
TABLE_38 = {
    0x2320: (0, "A"), 0x3210: (2, "A"), 0x3220: (3, "B"), 0x7305: (4, "B"), 0x4210: (5, "B"), 0x6320: (6, "B"),
    0x2310: (7, "A"), 0x4310: (8, "B"), 0x6380: (9, "B"), 0x8400: (10, "B"), 0x7320: (11, "B"), 0x6010: (12, "A"),
    0x7321: (13, "B"), 0x8611: (14, "B"), 0x6080: (15, "A"),
}  # fmt: skip
MOTOR_OFF = (0x2310, 0x2320, 0x3210, 0x3220, 0x4210, 0x4310, 0x6010, 0x6080, 0x8400)
NO_COMMAND = (0x6320, 0x6380)
BY_605E = (0x7305, 0x7320, 0x7321, 0x8611)
COMMUNICATION = (0x8100, 0x8110, 0x8120, 0x8130, 0x8140, 0x8230)


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


def in_motion(rig: BladeRig, mode: int = 1) -> None:
    rig.enable(mode)
    rig.put("60FF", -800)
    rig.go(1000)
    rig.run_until(lambda: rig.get("606C") < -700)


def faulty(rig: BladeRig) -> bool:
    return rig.state() in (State.FAULT, State.FAULT_REACTION_ACTIVE)


# -- flags and masks (M4) -------------------------------------------------------------------


@pytest.mark.rule("M4")
@pytest.mark.parametrize("code", TABLE_38)
def test_the_flag_of_each_error(rig: BladeRig, code: int) -> None:
    bit, _priority = TABLE_38[code]
    rig.pmc.raise_error(code)
    assert rig.get("6510:08") == 1 << bit
    assert rig.errors() == [code]
    assert rig.get("603F") == code


@pytest.mark.rule("M4")
@pytest.mark.parametrize("code", TABLE_38)
def test_a_mask_hides_errors_of_priority_b_only(rig: BladeRig, code: int) -> None:
    bit, priority = TABLE_38[code]
    rig.put("6510:07", 0xFFFF ^ 1 << bit)
    rig.pmc.raise_error(code)
    assert rig.get("6510:08") == 1 << bit
    assert (rig.errors() == [code]) is (priority == "A")
    assert faulty(rig) is (priority == "A")


@pytest.mark.rule("M4")
def test_a_cause_that_stands_is_an_error_as_soon_as_its_mask_is_taken_away(rig: BladeRig) -> None:
    rig.put("6510:07", 0)
    rig.blade.axis.encoder_fault = EncoderFault.SINE_COSINE
    rig.master.run(50 * MS)
    assert rig.errors() == []
    rig.put("6510:07", 0xFFFF)
    assert rig.errors() == [0x7305]
    assert faulty(rig)


@pytest.mark.rule("M4")
@pytest.mark.parametrize("code", [code for code in KINDS if code not in TABLE_38 and code != 0x1000])
def test_an_error_without_a_flag_cannot_be_masked(rig: BladeRig, code: int) -> None:
    rig.put("6510:07", 0)
    rig.pmc.raise_error(code)
    assert rig.get("6510:08") == 0
    assert rig.errors() == [code]


def test_the_pmc_has_no_error_of_the_pmm(rig: BladeRig) -> None:
    with pytest.raises(ValueError, match="3110h"):
        rig.pmc.raise_error(0x3110)


# -- reactions (M7, M8) -----------------------------------------------------------------------


@pytest.mark.rule("M7")
@pytest.mark.parametrize("code", [*MOTOR_OFF, *NO_COMMAND])
def test_errors_that_turn_the_motor_off(rig: BladeRig, code: int) -> None:
    """605Eh has no say in them (M8): a ramp is asked for here, and the stage goes off at once."""
    rig.put("605E", 1)
    in_motion(rig)
    rig.pmc.raise_error(code)
    assert not rig.pmc.drive.energised
    assert rig.state() is State.FAULT
    assert not rig.get("60FE:03") & BRAKE_LIFTED


@pytest.mark.rule("M8")
@pytest.mark.parametrize("code", [*BY_605E, 0x7300, 0x8620])
def test_errors_that_ask_605e(rig: BladeRig, code: int) -> None:
    rig.put("605E", 1)
    in_motion(rig)
    rig.pmc.raise_error(code)
    rig.master.run(100 * MS)
    assert rig.state() is State.FAULT_REACTION_ACTIVE
    assert rig.get("60FE:03") & BRAKE_LIFTED
    rig.wait_state(State.FAULT)


@pytest.mark.rule("M8")
@pytest.mark.parametrize(("option", "stops_in_s"), [(1, 0.53), (2, 0.09), (3, 0.09)])
def test_how_605e_stops(rig: BladeRig, option: int, stops_in_s: float) -> None:
    """800 units/s by 6084h (1500 units/s2) or by the current limit (59.6 Nm on 0.031 kgm2)."""
    rig.put("605E", option)
    in_motion(rig)
    rig.master.run(SECOND)
    assert rig.get("606C") == pytest.approx(-800, abs=10)
    began_ns = rig.line.now_ns
    rig.pmc.raise_error(0x8611)
    rig.master.until(lambda: rig.pmc.drive.at_rest, step_ns=MS)
    assert (rig.line.now_ns - began_ns) / SECOND == pytest.approx(stops_in_s, rel=0.4)


@pytest.mark.rule("M8")
def test_605e_0_lets_the_axis_go(rig: BladeRig) -> None:
    rig.put("605E", 0)
    in_motion(rig)
    rig.pmc.raise_error(0x8611)
    assert not rig.pmc.drive.energised
    assert rig.state() is State.FAULT


@pytest.mark.rule("M8")
@pytest.mark.rule("J8")
def test_605e_minus_1_is_a_message_that_opens_the_watchdog_contact_only(rig: BladeRig) -> None:
    rig.put("605E", -1)
    in_motion(rig)
    rig.pmc.raise_error(0x8611)
    rig.master.run(300 * MS)
    assert rig.state() is State.OPERATION_ENABLED
    assert rig.get("606C") == pytest.approx(-800, abs=20)
    assert rig.bit(WARNING)
    assert rig.errors() == [0x8611]
    assert not rig.get("60FE:03") & WATCHDOG
    rig.command(START, START | 0x80)
    assert rig.get("60FE:03") & WATCHDOG
    assert rig.state() is State.OPERATION_ENABLED


# -- communication (M9) -----------------------------------------------------------------------


@pytest.mark.rule("M9")
@pytest.mark.rule("J8")
@pytest.mark.parametrize("code", COMMUNICATION)
@pytest.mark.parametrize("option", [0, 1, 2, 3])
def test_each_communication_error_by_6007(code: int, option: int) -> None:
    rig = BladeRig()
    rig.put("6007", option)
    in_motion(rig)
    before = rig.angle_deg
    rig.pmc.communication_error(code)
    assert rig.pmc.drive.energised is (option != 2)
    rig.master.run(400 * MS)
    assert rig.errors() == ([] if option == 0 else [code])
    assert rig.bit(WARNING) is (option == 1)
    assert bool(rig.get("60FE:03") & WATCHDOG) is (option == 0)
    if option in (0, 1):
        assert rig.state() is State.OPERATION_ENABLED
        rig.wait_bit(10)
        assert rig.angle_deg == pytest.approx(10.0, abs=0.05)  # the last task was finished
    else:
        assert rig.state() is State.FAULT
        ramp_deg = 8.0**2 / (2 * 15.0)
        assert before - rig.angle_deg < (ramp_deg / 2 if option == 3 else 10.0)


@pytest.mark.rule("M9")
def test_with_message_only_a_speed_leads_to_the_limit_switch() -> None:
    rig = BladeRig()
    rig.put("6007", 1)
    rig.put("1016:01", 127 << 16 | 100)
    rig.enable(mode=3)
    rig.put("60FF", 800)
    rig.command(START)
    rig.master.send(0x77F, b"\x05")
    rig.run_until(lambda: 0x8130 in rig.errors())
    assert rig.state() is State.OPERATION_ENABLED
    rig.wait_state(State.SWITCHED_ON)
    assert rig.blade.axis.at_90


@pytest.mark.rule("M9")
@pytest.mark.parametrize("option", [0, 1, 2, 3])
def test_a_stopped_node_is_a_lost_connection(option: int) -> None:
    rig = BladeRig()
    rig.put("6007", option)
    in_motion(rig)
    rig.master.nmt(NmtCommand.STOP, PMC)
    rig.master.run(500 * MS)
    assert rig.pmc.drive.energised is (option in (0, 1))
    assert rig.errors() == []


# -- voltages, speed, current -----------------------------------------------------------------


@pytest.mark.rule("M6")
@pytest.mark.parametrize(("where", "volt", "code"), [("6510:04", 700, 0x3220), ("6510:05", 500, 0x3210)])
def test_dc_link_beyond_its_limits_turns_the_motor_off(rig: BladeRig, where: str, volt: int, code: int) -> None:
    in_motion(rig)
    rig.put(where, volt)
    rig.master.run(20 * MS)
    assert rig.errors() == [code]
    assert not rig.pmc.drive.energised
    assert rig.state() is State.FAULT
    rig.command(0, FAULT_RESET)
    assert rig.state() is State.FAULT
    rig.put(where, 100 if code == 0x3220 else 750)
    rig.master.run(50 * MS)
    rig.command(0, FAULT_RESET)
    assert rig.state() is not State.FAULT


@pytest.mark.rule("M6")
def test_a_dead_mains_without_a_battery_is_under_voltage(rig: BladeRig) -> None:
    rig.pmm.device.power_off()
    rig.blade.power.mains_present = False
    rig.run_until(lambda: rig.get("5079") < 100, 60 * SECOND)
    rig.master.run(50 * MS)
    assert rig.get("603F") == 0x3220


@pytest.mark.rule("M7")
def test_a_motor_that_runs_away_is_turned_off(rig: BladeRig) -> None:
    in_motion(rig)
    rig.put("6080", 1000)
    rig.master.run(10 * MS)
    assert next(iter(rig.errors())) == 0x8400
    assert not rig.pmc.drive.energised
    rig.put("6080", 3000)
    rig.run_until(lambda: rig.get("6044") == 0)
    rig.command(0, FAULT_RESET)
    assert rig.state() is not State.FAULT


@pytest.mark.rule("M7")
def test_a_motor_at_its_current_limit_for_10_s_is_overloaded(rig: BladeRig) -> None:
    rig.put("6065", 0xFFFFFFFF)
    rig.enable()
    rig.blade.axis.brake_stuck = BrakeFault.ENGAGED
    rig.go(2000)
    rig.master.run(6 * SECOND)
    rig.blade.axis.brake_stuck = BrakeFault.NONE  # it runs again: the time counts anew
    rig.master.run(SECOND)
    rig.blade.axis.brake_stuck = BrakeFault.ENGAGED
    rig.master.run(9 * SECOND)
    assert rig.errors() == []
    rig.master.run(2 * SECOND)
    assert rig.errors() == [0x2310]
    assert rig.state() is State.FAULT


# -- temperatures (M5) ------------------------------------------------------------------------


@pytest.mark.rule("M5")
@pytest.mark.parametrize(
    ("code", "actual", "warning", "highest"),
    [(0x4210, "6510:03", "6510:06", "6510:02"), (0x4310, "6410:09", "6410:08", "6410:07")],
)
def test_a_temperature_warns_and_turns_the_motor_off_30_s_after_its_maximum(
    rig: BladeRig, code: int, actual: str, warning: str, highest: str
) -> None:
    rig.enable()
    tenths = rig.get(actual)
    rig.put(warning, tenths + 100)
    rig.put(highest, tenths + 150)
    rig.master.run(50 * MS)
    assert not rig.bit(WARNING)
    rig.put(warning, tenths - 30)
    rig.master.run(50 * MS)
    assert rig.bit(WARNING)
    assert rig.get("603F") == code
    rig.put(highest, tenths - 30)
    rig.master.run(29_500 * MS)
    assert rig.state() is State.OPERATION_ENABLED
    assert rig.errors() == []
    rig.put(highest, tenths + 150)  # cooler again before the time is over: it counts anew
    rig.master.run(50 * MS)
    rig.put(highest, tenths - 30)
    rig.master.run(29_500 * MS)
    assert rig.errors() == []
    rig.master.run(SECOND)
    assert rig.errors() == [code]
    assert rig.state() is State.FAULT
    assert not rig.pmc.drive.energised


@pytest.mark.rule("M5")
def test_temperature_limits_by_default(rig: BladeRig) -> None:
    limits = [rig.get(where) for where in ("6510:06", "6510:02", "6410:08", "6410:07")]
    assert limits == [750, 800, 1300, 1500]


# -- parameters, output stage, processor, memory ------------------------------------------------


@pytest.mark.rule("M7")
@pytest.mark.parametrize(
    ("where", "wrong", "right"),
    [("607D:02", -1, 36000), ("607D:01", 36001, 0), ("6076", 0, 17000), ("6410:01", 0, 1), ("6410:04", 0, 2920)],
)
def test_with_a_wrong_parameter_the_axis_takes_no_command(rig: BladeRig, where: str, wrong: int, right: int) -> None:
    rig.put(where, wrong)
    rig.wait_state(State.FAULT)
    assert rig.errors() == [0x6320]
    rig.command(0, FAULT_RESET, ENABLE)
    assert rig.state() is State.FAULT
    rig.put(where, right)
    rig.master.run(50 * MS)
    rig.command(0, FAULT_RESET, ENABLE)
    assert rig.state() is State.OPERATION_ENABLED


@pytest.mark.rule("M7")
def test_a_wrong_parameter_that_was_saved_is_found_at_power_on(rig: BladeRig) -> None:
    rig.put("607D:02", -1)
    rig.save()
    rig.restart()
    rig.wait_state(State.FAULT)
    assert rig.get("603F") == 0x6320


@pytest.mark.rule("M7")
def test_an_output_stage_that_does_not_identify_itself(rig: BladeRig) -> None:
    assert rig.get("6510:01") != 0
    rig.pmc.monitors.power_stage = 0
    rig.wait_state(State.FAULT)
    assert rig.errors() == [0x6380]
    rig.command(0, FAULT_RESET, ENABLE)
    assert rig.state() is State.FAULT


@pytest.mark.rule("M7")
def test_a_watchdog_reset_restarts_the_unit_and_is_told(rig: BladeRig) -> None:
    in_motion(rig)
    rig.pmc.watchdog_reset()
    assert not rig.pmc.drive.energised
    assert not rig.pmc.watchdog_closed
    rig.master.wait_id(0x700 + PMC)
    rig.master.run(10 * MS)
    assert rig.transitions == [0, 1, 2, 13, 14]
    assert rig.errors() == [0x6010]
    rig.command(0, FAULT_RESET)
    assert rig.state() is State.READY


def test_an_eeprom_that_fails_is_told(rig: BladeRig) -> None:
    rig.pmc.memory_failed(rig.line.now_ns)
    rig.master.run(5 * MS)
    assert rig.errors() == [0x5530]


# -- encoders ---------------------------------------------------------------------------------


@pytest.mark.rule("M7")
@pytest.mark.parametrize(("fault", "code"), [(EncoderFault.SINE_COSINE, 0x7305), (EncoderFault.DATA_CHANNEL, 0x7320)])
def test_a_motor_encoder_that_fails(rig: BladeRig, fault: EncoderFault, code: int) -> None:
    rig.enable()
    rig.blade.axis.encoder_fault = fault
    rig.wait_state(State.FAULT)
    assert rig.errors() == [code]
    rig.command(0, FAULT_RESET)
    assert rig.state() is State.FAULT
    rig.blade.axis.encoder_fault = EncoderFault.NONE
    rig.master.run(50 * MS)
    rig.command(0, FAULT_RESET)
    assert rig.state() is not State.FAULT


@pytest.mark.rule("M7")
def test_a_blade_encoder_that_fails(rig: BladeRig) -> None:
    rig.blade.axis.blade_encoder_failed = True
    rig.wait_state(State.FAULT)
    assert rig.errors() == [0x7321]


def test_a_blade_encoder_that_is_simulated_cannot_fail(rig: BladeRig) -> None:
    rig.put("5894", 0xFF)
    rig.blade.axis.blade_encoder_failed = True
    rig.master.run(100 * MS)
    assert rig.errors() == []


def test_with_no_encoder_left_the_general_error_comes(rig: BladeRig) -> None:
    rig.blade.axis.encoder_fault = EncoderFault.SINE_COSINE
    rig.blade.axis.blade_encoder_failed = True
    rig.wait_state(State.FAULT)
    assert set(rig.errors()) == {0x7300, 0x7305, 0x7321}


@pytest.mark.rule("M7")
def test_an_axis_whose_encoder_fails_in_motion_is_stopped_by_the_other_one(rig: BladeRig) -> None:
    in_motion(rig)
    before = rig.angle_deg
    rig.blade.axis.encoder_fault = EncoderFault.SINE_COSINE
    rig.wait_state(State.FAULT, SECOND)
    assert rig.get("6864") == pytest.approx(rig.angle_deg * 100, abs=20)
    assert 0 < before - rig.angle_deg < 4


@pytest.mark.rule("M3")
def test_a_slip_of_the_blade_encoder_is_seen(rig: BladeRig) -> None:
    rig.put("6865", 200)
    rig.put("6866", 300)
    rig.blade.axis.blade_encoder_slip_deg = 1.5
    rig.master.run(500 * MS)
    assert rig.errors() == []
    assert rig.get("68F4") == pytest.approx(-150, abs=5)
    rig.blade.axis.blade_encoder_slip_deg = -5.0
    rig.master.run(200 * MS)
    assert rig.errors() == []
    rig.blade.axis.blade_encoder_slip_deg = 0.0
    rig.master.run(50 * MS)
    rig.blade.axis.blade_encoder_slip_deg = -5.0
    rig.master.run(270 * MS)
    assert rig.errors() == []
    rig.master.run(100 * MS)
    assert rig.errors() == [0x8620]
    assert rig.get("68F4") == pytest.approx(500, abs=5)


@pytest.mark.rule("M3")
def test_a_difference_of_the_encoders_is_not_watched_by_default(rig: BladeRig) -> None:
    assert (rig.get("6865"), rig.get("6866")) == (0, 0)
    rig.blade.axis.blade_encoder_slip_deg = 20.0
    rig.master.run(SECOND)
    assert rig.errors() == []
    rig.put("6865", 200)
    rig.master.run(50 * MS)
    assert rig.errors() == [0x8620]
