"""Statusword of the PMC (tables 49, 53 and 54), in every state and mode."""

from __future__ import annotations

import pytest

from app.twins.cia402 import State
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import (
    DISABLE_VOLTAGE,
    ENABLE,
    NEW_TARGET,
    PMC,
    QUICK_STOP,
    SHUTDOWN,
    START,
    SWITCH_ON,
    BladeRig,
)

TABLE_49 = {
    State.NOT_READY: (0x4F, 0x00),
    State.SWITCH_ON_DISABLED: (0x4F, 0x40),
    State.READY: (0x6F, 0x21),
    State.SWITCHED_ON: (0x6F, 0x23),
    State.OPERATION_ENABLED: (0x6F, 0x27),
    State.QUICK_STOP_ACTIVE: (0x6F, 0x07),
    State.FAULT_REACTION_ACTIVE: (0x4F, 0x0F),
    State.FAULT: (0x4F, 0x08),
}
VOLTAGE, WARNING, REMOTE, REACHED, LIMIT, BIT_12, BIT_13 = 4, 7, 9, 10, 11, 12, 13


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


def in_motion(rig: BladeRig) -> None:
    rig.enable()
    rig.go(2000)
    rig.run_until(lambda: rig.get("606C") < -700)


def bring_into(rig: BladeRig, state: State) -> None:
    match state:
        case State.NOT_READY:
            rig.master.nmt(NmtCommand.RESET_NODE, PMC)
            rig.master.run(2 * MS)
        case State.SWITCH_ON_DISABLED:
            rig.command(DISABLE_VOLTAGE)
        case State.SWITCHED_ON:
            rig.command(SWITCH_ON)
        case State.OPERATION_ENABLED:
            rig.command(ENABLE)
        case State.QUICK_STOP_ACTIVE:
            in_motion(rig)
            rig.command(QUICK_STOP)
        case State.FAULT_REACTION_ACTIVE:
            in_motion(rig)
            rig.pmc.raise_error(0x8611)
        case State.FAULT:
            rig.pmc.raise_error(0x2320)


@pytest.mark.rule("J1")
@pytest.mark.rule("J10")
@pytest.mark.parametrize("state", list(State))
def test_each_state_by_its_bits(rig: BladeRig, state: State) -> None:
    bring_into(rig, state)
    word = rig.pmc.statusword()
    found = [known for known, (mask, pattern) in TABLE_49.items() if word & mask == pattern]
    assert found == [state]
    assert not word & 0x8100


@pytest.mark.rule("J10")
@pytest.mark.parametrize("word", [0x8106, 0x0106, 0xC006])
def test_bit_14_follows_the_controlword_and_bits_8_and_15_do_not(rig: BladeRig, word: int) -> None:
    rig.command(word)
    assert rig.bit(14) is bool(word & 0x4000)
    assert not rig.status() & 0x8100


@pytest.mark.rule("J10")
def test_bit_4_tells_of_the_dc_link(rig: BladeRig) -> None:
    assert rig.bit(VOLTAGE)
    rig.put("6510:04", 700)
    assert not rig.bit(VOLTAGE)
    rig.put("6510:04", 100)
    assert rig.bit(VOLTAGE)


@pytest.mark.rule("J10")
@pytest.mark.rule("L2")
def test_while_the_efc_input_controls_the_controlword_does_not(rig: BladeRig) -> None:
    rig.pmc.raise_error(0x8611)
    rig.wait_state(State.FAULT)
    rig.blade.axis.place(92.0)
    rig.pmc.inputs.efc = False
    rig.master.run(50 * MS)
    assert not rig.bit(REMOTE)
    rig.command(0, 0x0080)
    assert rig.state() is State.FAULT
    rig.pmc.inputs.efc = True
    rig.master.run(50 * MS)
    assert rig.bit(REMOTE)
    assert rig.state() is State.FAULT
    rig.command(0, 0x0080)
    assert rig.state() is not State.FAULT


@pytest.mark.rule("J11")
def test_bit_11_in_a_cyclic_mode_too(rig: BladeRig) -> None:
    rig.put("607D:02", 8200)
    rig.put("607A", 8100)
    rig.enable(mode=8)
    rig.command(START)
    rig.master.run(50 * MS)
    assert not rig.bit(LIMIT)
    rig.put("60B0", 200)
    rig.master.run(50 * MS)
    assert rig.bit(LIMIT)
    rig.master.run(SECOND)
    assert rig.get("6064") == pytest.approx(8200, abs=2)


# -- bit 10 ---------------------------------------------------------------------------------


@pytest.mark.rule("J12")
def test_bit_10_of_a_position(rig: BladeRig) -> None:
    rig.enable()
    rig.go(7500)
    assert not rig.bit(REACHED)
    rig.wait_bit(REACHED)
    assert rig.get("6064") == pytest.approx(7500, abs=10)


@pytest.mark.rule("J12")
def test_bit_10_of_a_speed(rig: BladeRig) -> None:
    rig.enable(mode=3)
    rig.put("60FF", -500)
    rig.command(START)
    assert not rig.bit(REACHED)
    rig.wait_bit(REACHED)
    rig.put("60FF", -300)
    assert not rig.bit(REACHED)
    rig.wait_bit(REACHED)


@pytest.mark.rule("J12")
def test_bit_10_is_set_by_a_change_of_mode(rig: BladeRig) -> None:
    rig.put("6060", 3)
    rig.put("60FF", -500)
    rig.command(0x0006)
    assert not rig.bit(REACHED)
    rig.put("6060", 1)
    rig.put("6060", 3)
    assert rig.bit(REACHED)
    rig.put("60FF", -400)
    assert not rig.bit(REACHED)


@pytest.mark.rule("J12")
@pytest.mark.parametrize("mode", [1, 3])
def test_bit_10_under_halt_waits_for_the_axis_to_stand(rig: BladeRig, mode: int) -> None:
    rig.enable(mode)
    rig.put("60FF", -800)
    rig.go(2000)
    rig.run_until(lambda: rig.get("606C") < -700)
    rig.command(ENABLE)
    assert not rig.bit(REACHED)
    assert rig.get("606C") < -100
    rig.wait_bit(REACHED)
    assert abs(rig.get("6044")) < 20


@pytest.mark.rule("J12")
@pytest.mark.parametrize("mode", [8, 9])
def test_bit_10_stays_set_in_the_cyclic_modes(rig: BladeRig, mode: int) -> None:
    rig.put("607A", 8000)
    rig.enable(mode)
    rig.command(START)
    rig.put("607A", 4000)
    rig.put("60FF", -500)
    for _ in range(20):
        rig.master.run(20 * MS)
        assert rig.bit(REACHED)
    assert rig.get("606C") < -100
    rig.command(ENABLE)
    assert rig.bit(REACHED)
    assert rig.get("606C") < -50  # under halt, and on its way yet


# -- bits 12 and 13 -------------------------------------------------------------------------


@pytest.mark.rule("J13")
def test_bit_12_of_a_position_is_the_acknowledge(rig: BladeRig) -> None:
    rig.enable()
    rig.put("607A", 7500)
    rig.command(START)
    assert not rig.bit(BIT_12)
    rig.command(NEW_TARGET)
    assert rig.bit(BIT_12)


@pytest.mark.rule("J13")
def test_bit_12_of_a_speed_is_standstill(rig: BladeRig) -> None:
    rig.enable(mode=3)
    rig.put("60FF", -500)
    rig.command(START)
    rig.master.run(50 * MS)
    assert not rig.bit(BIT_12)
    rig.put("60FF", 0)
    rig.wait_bit(BIT_12)


@pytest.mark.rule("J13")
@pytest.mark.parametrize(("mode", "target"), [(8, "607A"), (9, "60FF")])
def test_bit_12_of_the_cyclic_modes_tells_whether_it_follows(rig: BladeRig, mode: int, target: str) -> None:
    rig.put("607A", 8000)
    rig.enable(mode)
    assert not rig.bit(BIT_12)
    rig.command(START)
    assert rig.bit(BIT_12)
    rig.command(ENABLE)
    assert not rig.bit(BIT_12)


@pytest.mark.rule("J13")
@pytest.mark.parametrize(("mode", "watched"), [(1, True), (8, True), (3, False), (9, False)])
def test_bit_13_tells_of_the_following_error_where_a_position_is_controlled(
    rig: BladeRig, mode: int, watched: bool
) -> None:
    rig.put("6066", 60_000)
    rig.put("607A", 8000)
    rig.enable(mode)
    rig.command(START)
    rig.blade.axis.load_torque_nm = 70.0
    rig.run_until(lambda: rig.angle_deg > 81.2)
    assert rig.bit(BIT_13) is watched


@pytest.mark.rule("J13")
def test_bits_12_and_13_of_homing(rig: BladeRig) -> None:
    rig.put("6060", 6)
    rig.command(SHUTDOWN)
    assert (rig.bit(BIT_12), rig.bit(BIT_13)) == (False, False)
    rig.command(SHUTDOWN | 0x10)
    assert (rig.bit(BIT_12), rig.bit(BIT_13)) == (True, False)
    rig.command(SWITCH_ON)
    rig.command(SWITCH_ON | 0x10)
    assert (rig.bit(BIT_12), rig.bit(BIT_13)) == (False, True)


@pytest.mark.rule("J13")
@pytest.mark.parametrize("mode", [0, -113])
def test_other_modes_have_no_bits_12_and_13(rig: BladeRig, mode: int) -> None:
    rig.put("6060", mode)
    rig.command(ENABLE, START)
    assert not rig.status() & 0x3000
