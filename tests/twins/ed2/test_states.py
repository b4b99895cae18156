"""The device state machine over the bus: transitions, errors and their reset, modes and who may change them."""

from __future__ import annotations

import pytest

from app.twins.ed2.device import BUS_NS, Settings
from app.twins.ed2.states import State
from app.wire.profibus.pkw import PkwError
from app.wire.profibus.telegrams import CONTROL_MODE, CONTROL_MODE_SET, DEVICE_MODE, DEVICE_MODE_SET, ERROR_CODE
from tests.twins.ed2.rig import MS, Rig, made

D, H, M, R = 0x1, 0x2, 0x4, 0x8
START = 0x2000


@pytest.fixture
def rig() -> Rig:
    made_one = made()
    made_one.master.start(102)
    made_one.master.values[0] = {DEVICE_MODE_SET: 1, CONTROL_MODE_SET: 9}
    made_one.master.set(0, 250_000)
    return made_one


def nibble(rig: Rig) -> int:
    return rig.master.status & 0xF


def test_after_power_on_the_bus_comes_first_and_then_init() -> None:
    rig = made()
    rig.device.power_off()
    rig.device.power_on()
    started_ns = rig.line.now_ns
    rig.line.run_until(started_ns + BUS_NS + MS)
    rig.master.start(100)
    assert rig.master.status & 0xF == State.NOT_READY.value
    rig.master.until(lambda: rig.master.status & 0xF == State.INIT.value)


def test_each_transition_has_its_bits(rig: Rig) -> None:
    assert nibble(rig) == State.INIT.value
    for word, state in (
        (H | M, State.INIT),
        (D, State.DISABLED),
        (D | M, State.DISABLED),
        (D | H, State.HOLD),
        (D | H | M, State.DEVICE_MODE_ACTIVE),
        (D | H, State.HOLD),
        (D, State.DISABLED),
        (0, State.INIT),
        (D | H | M, State.DEVICE_MODE_ACTIVE),
        (0, State.INIT),
    ):
        rig.master.set(word)
        assert nibble(rig) == state.value, f"{word:X}"


def test_without_the_release_input_nothing_is_held(rig: Rig) -> None:
    rig.master.set(D | H | M)
    rig.device.kernel.conditions.levels = 0
    rig.master.advance(10)
    assert nibble(rig) == State.DISABLED.value
    rig.device.kernel.conditions.levels = 1
    rig.master.advance(10)
    assert nibble(rig) == State.DEVICE_MODE_ACTIVE.value


def test_modes_change_in_init_and_disabled_only(rig: Rig) -> None:
    master = rig.master
    master.start(1)
    master.values[0].clear()
    master.write("0/40", -1)
    master.set(D)
    master.write("0/40", 9)
    master.set(D | H)
    assert master.refused(lambda: master.write("0/40", -1)) is PkwError.NOT_CHANGEABLE
    assert master.refused(lambda: master.write("0/39", 2)) is PkwError.NOT_CHANGEABLE
    assert master.refused(lambda: master.write("0/53", 1)) is PkwError.NOT_CHANGEABLE
    assert master.refused(lambda: master.write("0/41", 1)) is PkwError.NOT_CHANGEABLE
    master.write("12/207", 9_000)


def test_the_device_mode_goes_with_the_control_mode() -> None:
    master = made().master
    master.start(1)
    assert master.refused(lambda: master.write("0/39", 3)) is PkwError.OUT_OF_RANGE
    master.write("0/39", 2)
    assert master.refused(lambda: master.write("0/53", 1)) is PkwError.NOT_CHANGEABLE
    master.write("0/40", -2)
    assert master.read("0/39") == 1
    assert master.refused(lambda: master.write("0/39", 2)) is PkwError.NOT_CHANGEABLE
    master.write("0/40", 6)
    assert master.read("0/39") == 2
    assert master.refused(lambda: master.write("0/39", 1)) is PkwError.NOT_CHANGEABLE


def test_the_mode_word_of_a_telegram_wins_over_pkw(rig: Rig) -> None:
    master = rig.master
    master.write("0/40", -2)
    assert master.read("0/40") == 9
    master.values[0][CONTROL_MODE_SET] = -1
    master.advance(10)
    assert (master.seen[0][DEVICE_MODE], master.seen[0][CONTROL_MODE]) == (1, -1)
    master.set(D | H | M)
    master.values[0][CONTROL_MODE_SET] = -2
    master.advance(10)
    assert master.seen[0][CONTROL_MODE] == -1


def test_local_operation_ignores_the_bus_but_its_own_switch(rig: Rig) -> None:
    master = rig.master
    master.write("0/41", 1)
    master.set(D | H | M)
    assert master.status & 0x1F == State.INIT.value | 0x10
    assert master.read("0/39") == 2
    assert master.refused(lambda: master.write("12/207", 1)) is PkwError.NOT_CHANGEABLE
    assert master.read("12/207") == 10_000
    master.write("0/41", 0)
    master.advance(10)
    assert nibble(rig) == State.DEVICE_MODE_ACTIVE.value


def test_a_broken_sensor_wire_ends_in_fault_and_is_reset_by_an_edge(rig: Rig) -> None:
    master = rig.master
    master.set(D | H | M)
    rig.device.axes[0].transducer.wire.broken = True
    master.until(lambda: nibble(rig) == State.FAULT.value)
    assert master.seen[0][ERROR_CODE] == 0x5232 == master.read("0/36")
    master.set(R)
    assert nibble(rig) == State.FAULT.value, "its cause is still there"
    rig.device.axes[0].transducer.wire.broken = False
    master.advance(10)
    assert nibble(rig) == State.FAULT.value, "the bit stands, there is no edge"
    master.set(H)
    master.set(H | R)
    assert nibble(rig) == State.FAULT.value, "nothing is held that could be held on"
    master.set(0)
    master.set(R)
    assert nibble(rig) in (State.DISABLED.value, State.INIT.value)
    assert master.seen[0][ERROR_CODE] == 0
    assert master.set(D | H | M) & 0xF == State.DEVICE_MODE_ACTIVE.value


def test_the_supply_ends_in_fault_hold_and_goes_back_to_hold(rig: Rig) -> None:
    master = rig.master
    master.set(D | H | M)
    rig.device.kernel.conditions.supply_v = 15.0
    master.until(lambda: nibble(rig) == State.FAULT_HOLD.value)
    assert master.seen[0][ERROR_CODE] == 0x5100
    rig.device.kernel.conditions.supply_v = 24.0
    assert master.set(D | H | R) & 0xF == State.HOLD.value
    assert master.seen[0][ERROR_CODE] == 0


def test_an_axis_that_is_not_held_is_not_held_by_an_error(rig: Rig) -> None:
    rig.device.kernel.conditions.supply_v = 40.0
    rig.master.until(lambda: nibble(rig) == State.FAULT.value)


def test_a_worse_error_overtakes_fault_hold(rig: Rig) -> None:
    rig.master.set(D | H | M)
    rig.device.kernel.conditions.supply_v = 15.0
    rig.master.until(lambda: nibble(rig) == State.FAULT_HOLD.value)
    rig.device.axes[0].transducer.wire.broken = True
    rig.master.until(lambda: nibble(rig) == State.FAULT.value)
    assert rig.master.seen[0][ERROR_CODE] == 0x5100, "the first one is told"


def test_synchronous_axes_react_together_and_single_ones_apart() -> None:
    rig = made()
    master = rig.master
    master.start(102, 102)
    for axis in (1, 2):
        master.values[axis - 1].update({DEVICE_MODE_SET: 1, CONTROL_MODE_SET: 9})
        master.set(D | H | M, 250_000, axis=axis)
    rig.device.axes[1].transducer.wire.broken = True
    master.until(lambda: nibble(rig) == State.FAULT.value)
    assert master.seen[0][ERROR_CODE] == master.seen[1][ERROR_CODE] == 0x5236
    rig.device.axes[1].transducer.wire.broken = False
    for word in (0, R, 0):
        master.set(word, axis=1)
        master.set(word, axis=2)
    master.write("0/53", 1)
    for axis in (1, 2):
        master.set(D | H | M, axis=axis)
    rig.device.axes[1].transducer.wire.broken = True
    master.until(lambda: master.seen[1][ERROR_CODE] != 0)
    assert nibble(rig) == State.DEVICE_MODE_ACTIVE.value
    assert master.seen[0][ERROR_CODE] == 0


def test_synchronous_axes_with_two_telegrams_run_when_both_ask() -> None:
    rig = made()
    rig.master.start(1, 1)
    rig.master.set(D | H | M, 250_000, axis=1)
    assert nibble(rig) == State.INIT.value
    rig.master.set(D | H | M, axis=2)
    assert nibble(rig) == State.DEVICE_MODE_ACTIVE.value


def test_single_axes_with_incremental_sensors_do_not_run() -> None:
    rig = made(Settings(transducer=64))
    rig.master.start(1)
    assert rig.master.set(D | H | M, 0) & 0xF == State.DEVICE_MODE_ACTIVE.value
    rig.master.set(0)
    rig.master.write("0/53", 1)
    assert rig.master.set(D | H | M) & 0xF == State.DISABLED.value


def test_when_the_watchdog_bites_the_axis_is_let_go() -> None:
    rig = made()
    rig.master.start(1, watchdog=(10, 1))
    rig.master.set(D | H | M, 250_000)
    assert nibble(rig) == State.DEVICE_MODE_ACTIVE.value
    rig.master.wire.wait(110)
    assert rig.device.axes[0].state is State.INIT
