"""Inputs and outputs of the PMM over the wire: chain inputs and their pulses, masks, alarms, position range, manual."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from app.twins.line import CanLine, Fault, drop
from app.twins.pmm_io import CHAIN_INPUTS, PmmInputs
from app.twins.safety_chain import SafetyChain
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import PMC, PMM, BladeRig

RESET = 0x80
SAFETY_CHAIN = 1 << 16
FEEDBACK_SHIFT = 16
CHAIN_BITS = [0, 2, 3]
X14_11 = 1 << 9

Get = Callable[[str], int]


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


@pytest.fixture
def get(rig: BladeRig) -> Get:
    return lambda where: rig.get(where, PMM)


def settle(rig: BladeRig) -> None:
    rig.master.run(250 * MS)


def pulse(rig: BladeRig, mask: int, duration_ns: int) -> None:
    """Take the voltage off inputs for a time."""
    rig.pmm.inputs.digital &= ~mask
    rig.master.run(duration_ns)
    rig.pmm.inputs.digital |= mask


# -- inputs -----------------------------------------------------------------------------


@pytest.mark.rule("I1")
@pytest.mark.parametrize("bit", CHAIN_BITS)
def test_a_test_pulse_shows_for_30e2h_and_triggers_nothing(rig: BladeRig, get: Get, bit: int) -> None:
    feedback = 1 << bit + FEEDBACK_SHIFT
    assert not get("30FD") & feedback
    began_ns = rig.line.now_ns
    pulse(rig, 1 << bit, 40 * MS)
    assert rig.pmm.lets_axis_run
    rig.master.run(1900 * MS - (rig.line.now_ns - began_ns))
    assert get("30FD") & (feedback | 1 << bit) == feedback | 1 << bit
    assert get("30FD") >> FEEDBACK_SHIFT & CHAIN_INPUTS == 1 << bit
    rig.master.run(2001 * MS - (rig.line.now_ns - began_ns))
    assert not get("30FD") & feedback
    rig.put("30E2", 500, PMM)
    began_ns = rig.line.now_ns
    pulse(rig, 1 << bit, 10 * MS)
    rig.master.run(480 * MS - (rig.line.now_ns - began_ns))
    assert get("30FD") & feedback
    rig.master.run(501 * MS - (rig.line.now_ns - began_ns))
    assert not get("30FD") & feedback


@pytest.mark.rule("I1")
@pytest.mark.parametrize("bit", CHAIN_BITS)
def test_a_chain_input_at_0_executes_the_efc_after_50_ms(rig: BladeRig, bit: int) -> None:
    rig.pmm.inputs.digital &= ~(1 << bit)
    levels = [rig.pmm.lets_axis_run]
    for duration_ns in (49 * MS, 2 * MS):
        rig.master.run(duration_ns)
        levels.append(rig.pmm.lets_axis_run)
    rig.pmm.inputs.digital |= 1 << bit
    assert [*levels, rig.pmm.lets_axis_run] == [True, True, False, True]


@pytest.mark.rule("I1")
def test_pulses_do_not_add_up(rig: BladeRig) -> None:
    for _ in range(10):
        pulse(rig, CHAIN_INPUTS, 40 * MS)
        assert rig.pmm.lets_axis_run
        rig.master.run(MS)
    assert rig.pmm.lets_axis_run


@pytest.mark.rule("I1")
@pytest.mark.rule("L1")
def test_behind_the_pulse_filter_stands_x2_3_of_the_pmc(rig: BladeRig) -> None:
    SafetyChain(rig.line, (rig.blade,)).start(rig.line.now_ns)
    rig.pmm.inputs.digital &= ~1  # its wire is broken, the chain is whole
    assert rig.get("60FD") >> 18 & 1
    rig.run_until(lambda: not rig.get("60FD") >> 18 & 1, 100 * MS)
    rig.run_until(lambda: rig.angle_deg > 89.5, 20 * SECOND)


@pytest.mark.rule("I1")
def test_an_input_that_stays_at_0_keeps_its_feedback(rig: BladeRig, get: Get) -> None:
    rig.pmm.inputs.digital &= ~1
    rig.master.run(5 * SECOND)
    assert get("30FD") >> FEEDBACK_SHIFT & CHAIN_INPUTS == 1


@pytest.mark.rule("I1")
def test_pulse_width_is_saved(tmp_path: Path) -> None:
    rig = BladeRig(state_dir=tmp_path)
    assert rig.get("30E2", PMM) == 2000
    rig.put("30E2", 700, PMM)
    rig.save(PMM)
    rig.restart(PMM)
    assert rig.get("30E2", PMM) == 700


@pytest.mark.rule("I2")
def test_bits_of_30fdh(rig: BladeRig, get: Get) -> None:
    never = sum(1 << bit for bit in (1, 5, 6, 7, 13, 14, 15, 17, 21, 22, 23, 24, 25, 26))
    rig.pmm.inputs.digital = 0xFFFFFFFF
    rig.pmm.inputs.selector, rig.pmm.inputs.key = 0, False
    assert get("30FD") == 0x00101F1D
    rig.pmm.inputs.selector, rig.pmm.inputs.key = 15, True
    assert get("30FD") == 0xF8101F1D
    assert not get("30FD") & never
    rig.pmm.inputs.selector = 9
    assert get("30FD") >> 28 == 9
    for bit in (0, 2, 3, 4, 8, 9, 10, 11, 12):
        rig.pmm.inputs.digital = 0xFFFFFFFF & ~(1 << bit)
        assert get("30FD") & 0xFFFF == 0x1F1D & ~(1 << bit)
    assert BladeRig().get("30FD", PMM) & X14_11


@pytest.mark.rule("I3")
def test_analog_input(rig: BladeRig, get: Get) -> None:
    steps = set()
    for tenth in range(1000):
        rig.pmm.inputs.analog_mv = float(tenth)
        steps.add(rig.pmm.inputs.analog_read_mv)
    assert len(steps) == 103  # 1 V in steps of 10 V / 1023
    for applied_mv, shown_mv in ((-500.0, 0), (0.0, 0), (5000.0, 5005), (10000.0, 10000), (12000.0, 10000)):
        rig.pmm.inputs.analog_mv = applied_mv
        assert get("30A0") == shown_mv


# -- outputs ----------------------------------------------------------------------------


@pytest.mark.rule("I4")
@pytest.mark.parametrize("bit", range(16))
def test_each_output_is_programmed_or_internal_by_its_mask_bit(rig: BladeRig, get: Get, bit: int) -> None:
    mask = 1 << bit
    rig.put("30FF:02", mask, PMM)  # the internal function: a warning
    rig.put("3300:01", X14_11, PMM)
    rig.pmm.inputs.digital &= ~X14_11
    settle(rig)
    assert get("30FE:03") & 0xFFFF == mask
    rig.put("30FE:02", mask, PMM)
    assert get("30FE:03") & 0xFFFF == 0
    rig.put("30FE:01", mask, PMM)
    assert get("30FE:03") & 0xFFFF == mask
    rig.pmm.inputs.digital |= X14_11
    settle(rig)
    assert get("30FE:03") & 0xFFFF == mask
    rig.put("30FE:02", 0, PMM)
    assert get("30FE:03") & 0xFFFF == 0


@pytest.mark.rule("I5")
def test_free_outputs_can_be_set_and_relay_and_leds_cannot(rig: BladeRig, get: Get) -> None:
    before = get("30FE:03")
    assert before & 0x3FFF0000 == 0x05010000  # relay, status and watchdog LEDs
    rig.put("30FE:01", 0xFFFFF000, PMM)
    rig.put("30FE:02", 0xFFFFF000, PMM)
    assert get("30FE:03") == before | 0xF000
    rig.put("30FE:01", 0, PMM)
    assert get("30FE:03") == before
    rig.pmm.errors.event(0x5112)
    assert get("30FE:03") >> 16 == 0x0300
    rig.pmm.errors.reset()
    rig.operational(PMM)
    assert get("30FE:03") >> 16 == 0x0D01


@pytest.mark.rule("I6")
def test_outputs_are_paralleled_by_adding_their_masks(rig: BladeRig, get: Get) -> None:
    """X14.3 and X14.4 are 0004h and 0008h, so both together are 000Ch."""
    rig.put("30FF:02", 0x000C, PMM)
    rig.put("3300:01", X14_11, PMM)
    rig.pmm.inputs.digital &= ~X14_11
    settle(rig)
    assert get("30FE:03") & 0xFFFF == 0x000C


@pytest.mark.rule("I7")
def test_signalling_outputs(rig: BladeRig, get: Get) -> None:
    assert (get("30FF:01"), get("30FF:02"), get("30FE:03") & 0xFFFF) == (0x0800, 0x0400, 0)
    rig.put("3300:01", X14_11, PMM)
    rig.put("3300:02", 0x4100, PMM)
    rig.pmm.inputs.digital |= 1 << 8
    rig.pmm.inputs.digital &= ~X14_11
    settle(rig)
    assert get("30FE:03") & 0xFFFF == 0x0400
    rig.pmm.inputs.digital &= ~(1 << 8)
    settle(rig)
    assert get("30FE:03") & 0xFFFF == 0x0C00
    rig.put("30FF:01", 0x0003, PMM)
    assert get("30FE:03") & 0xFFFF == 0x0403


# -- alarm inputs -----------------------------------------------------------------------


@pytest.mark.rule("I8")
@pytest.mark.rule("B7")
@pytest.mark.parametrize("number", range(1, 9))
@pytest.mark.parametrize("fault", [True, False])
@pytest.mark.parametrize("high_active", [True, False])
def test_each_alarm_input_has_its_code_kind_and_level(
    rig: BladeRig, get: Get, number: int, fault: bool, high_active: bool
) -> None:
    code, bit = 0xFFF0 | number, 1 << 10
    rig.pmm.inputs.digital = rig.pmm.inputs.digital & ~bit | (0 if high_active else bit)
    rig.put(f"3300:{number:02X}", bit | fault << 14 | high_active << 15, PMM)
    settle(rig)
    assert get("603F") == 0
    rig.pmm.inputs.digital ^= bit
    settle(rig)
    assert get("603F") == code
    assert get("3000") == (0x04 if fault else 0x02)
    assert rig.errors(PMM) == ([code] if fault else [])
    rig.pmm.inputs.digital ^= bit
    settle(rig)
    assert get("603F") == (code if fault else 0)
    rig.put("3040", RESET, PMM)
    assert get("603F") == 0


@pytest.mark.rule("I8")
@pytest.mark.parametrize("bit", [0, 2, 3, 4, 8, 9, 10, 11, 12])
def test_each_clamp_can_raise_an_alarm(rig: BladeRig, get: Get, bit: int) -> None:
    rig.pmm.inputs.digital |= 1 << bit
    rig.put("3300:05", 1 << bit, PMM)
    settle(rig)
    assert get("603F") == 0
    rig.pmm.inputs.digital &= ~(1 << bit)
    settle(rig)
    assert get("603F") == 0xFFF5


@pytest.mark.rule("I8")
def test_no_input_selected_is_no_alarm(rig: BladeRig, get: Get) -> None:
    for number, mask in enumerate((0x0000, 0x4000, 0x8000, 0xC000), 1):
        rig.put(f"3300:{number:02X}", mask, PMM)
    rig.pmm.inputs.digital = 0
    settle(rig)
    assert get("603F") == 0


@pytest.mark.rule("I10")
@pytest.mark.parametrize("bit", [10, 11])
def test_one_alarming_input_of_a_mask_is_enough(rig: BladeRig, get: Get, bit: int) -> None:
    rig.pmm.inputs.digital |= 0x0C00
    rig.put("3300:01", 0x0C00, PMM)
    settle(rig)
    assert get("603F") == 0
    rig.pmm.inputs.digital &= ~(1 << bit)
    settle(rig)
    assert get("603F") == 0xFFF1


@pytest.mark.rule("I9")
def test_lightning_protection_by_its_printed_mask(rig: BladeRig, get: Get) -> None:
    rig.put("3300:01", 0x4200, PMM)
    settle(rig)
    assert (get("3000"), get("30FE:03") & SAFETY_CHAIN) == (1, SAFETY_CHAIN)
    rig.pmm.inputs.digital &= ~X14_11
    settle(rig)
    assert (get("603F"), get("3000")) == (0xFFF1, 4)
    assert get("30FE:03") & (SAFETY_CHAIN | 0xFFFF) == 0x0800
    assert rig.errors(PMM) == [0xFFF1]


@pytest.mark.rule("I1")
@pytest.mark.rule("I8")
def test_a_test_pulse_is_no_alarm(rig: BladeRig) -> None:
    rig.put("3300:01", 0x4001, PMM)
    for _ in range(20):
        pulse(rig, 1, 40 * MS)
        rig.master.run(7 * MS)
    settle(rig)
    assert rig.errors(PMM) == []


# -- position range ---------------------------------------------------------------------


@pytest.mark.rule("I11")
@pytest.mark.parametrize(
    ("low", "high", "inside"),
    [(-8700, 8700, True), (-8700, 7999, False), (8001, 8700, False), (7990, 8010, True), (8700, -8700, False)],
)
def test_outputs_are_set_between_the_limits(rig: BladeRig, get: Get, low: int, high: int, inside: bool) -> None:
    assert (rig.get("3220:01", PMM), rig.get("3220:02", PMM), get("3220:03")) == (-8700, 8700, 0)
    settle(rig)
    assert get("30FE:03") & 0xFFFF == 0
    rig.put("3220:01", low, PMM)
    rig.put("3220:02", high, PMM)
    rig.put("3220:03", 0x0003, PMM)
    assert get("30FE:03") & 0xFFFF == (0x0003 if inside else 0)


@pytest.mark.rule("I11")
def test_the_limits_themselves_are_outside() -> None:
    rig = BladeRig()
    settle(rig)
    assert rig.pmm.axis is not None
    position = rig.pmm.axis.position_cdeg
    rig.put("3220:03", 1, PMM)
    for low, high, on in ((position, 8700, 0), (-8700, position, 0), (position - 1, position + 1, 1)):
        rig.put("3220:01", low, PMM)
        rig.put("3220:02", high, PMM)
        assert rig.get("30FE:03", PMM) & 1 == on


@pytest.mark.rule("I11")
def test_the_output_follows_the_axis_over_the_link(rig: BladeRig, get: Get) -> None:
    rig.put("3220:03", 0x0002, PMM)
    settle(rig)
    assert get("30FE:03") & 2
    rig.enable()
    rig.move(8800)
    settle(rig)
    assert not get("30FE:03") & 2
    rig.move(8600)
    settle(rig)
    assert get("30FE:03") & 2


@pytest.mark.rule("I11")
def test_an_unknown_position_sets_no_output(rig: BladeRig, get: Get) -> None:
    rig.put("3220:03", 0x0002, PMM)
    settle(rig)
    rig.line.inject(Fault(lambda can: can.can_id == 0x68B, drop, times=None))
    rig.master.run(900 * MS)
    assert get("30FE:03") & 2
    rig.master.run(300 * MS)
    assert not get("30FE:03") & 2
    rig.line.clear_faults()
    settle(rig)
    assert get("30FE:03") & 2
    rig.pmc.errors.condition(0x7305, True)
    settle(rig)
    assert not get("30FE:03") & 2


# -- what there is not, manual functions -------------------------------------------------


@pytest.mark.rule("I12")
def test_the_function_for_a_dc_motor_does_nothing(rig: BladeRig, get: Get) -> None:
    assert [get(f"30DC:{sub:02X}") for sub in range(5)] == [4, 0, 0, 0, 0]
    for sub, number in ((1, 10), (2, 100), (3, 100), (4, 400)):
        rig.put(f"30DC:{sub:02X}", number, PMM)
    before = get("30FE:03"), rig.angle_deg
    rig.master.run(3 * SECOND)
    assert (get("30FE:03"), rig.angle_deg) == before
    assert (get("3000"), rig.blade.axis.speed_rad_s) == (1, 0.0)


@pytest.mark.rule("I13")
@pytest.mark.parametrize("node", [PMM, PMC])
def test_manual_function_from_5040h_or_from_the_switch(rig: BladeRig, node: int) -> None:
    def shown() -> tuple[int, int]:
        rig.master.run(120 * MS)
        return rig.get("5041", node), rig.get("5042", PMM)

    assert shown() == (0, 0)
    rig.pmm.inputs.selector = 6
    assert shown() == (0x06, 0x06)
    rig.pmm.inputs.key = True
    assert shown() == (0x16, 0x16)
    rig.pmm.inputs.selector = 0
    assert shown() == (0x00, 0x10)
    rig.pmm.inputs.selector = 6
    rig.put("5040", 0x1F, node)  # without bit 5 it counts for nothing
    assert shown() == (0x16, 0x16)
    rig.put("5040", 0x2A, node)
    assert shown() == (0x0A, 0x0A if node == PMM else 0x16)
    rig.put("5040", 0x3A, node)
    assert shown() == (0x1A, 0x1A if node == PMM else 0x16)
    rig.restart(node)
    assert shown() == (0x16, 0x16)


def test_inputs_that_rest_at_0_count_from_the_boot_on() -> None:
    line = CanLine(500_000)
    inputs = PmmInputs(lambda: line.now_ns)
    inputs.chain(False)
    line.run_until(10 * SECOND)
    inputs.restart(line.now_ns)
    assert not inputs.feathers
    line.run_until(10 * SECOND + 50 * MS)
    assert inputs.feathers
