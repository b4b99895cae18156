"""The DP slave: its states, owners, watchdog, repetition, and what it refuses."""

from __future__ import annotations

import pytest

from app.twins.ed2.device import CONFIGURATIONS, IDENT_EXAMPLE
from app.twins.ed2.dp_slave import DpState, WatchdogState
from app.wire.profibus import dp
from app.wire.profibus.control import Ask, Reply, Station
from app.wire.profibus.diagnosis import NO_MASTER, Status
from app.wire.profibus.fdl import SD3, Telegram
from app.wire.profibus.telegrams import CONTROL_WORD, TELEGRAM_TYPES, assumed_modules
from tests.twins.ed2.rig import MASTER, Master, Rig, VirtualWire, made, on_pty

REFUSED = dp.Refused(Reply.NO_SERVICE)


def state_of(rig: Rig) -> DpState:
    return rig.device.slave.state


def test_before_it_is_parametrised_it_answers_status_and_diagnosis_and_nothing_else() -> None:
    rig = made()
    master, slave = rig.master, rig.device.slave
    before = slave.watchdog
    assert before is WatchdogState.BAUD_SEARCH
    assert master.ask(dp.FdlStatus()) == dp.StatusAnswer(Station.SLAVE)
    diagnosis = master.diagnosis()
    assert diagnosis.status == Status.ALWAYS | Status.PARAMETERS_REQUIRED | Status.NOT_READY
    assert (diagnosis.master, diagnosis.ident, diagnosis.extended) == (NO_MASTER, IDENT_EXAMPLE, b"")
    assert master.ask(dp.DataExchange(master.outputs())) == REFUSED
    assert master.ask(dp.ChkCfg(assumed_modules(TELEGRAM_TYPES[1]))) == REFUSED
    assert slave.state is DpState.WAIT_PRM
    assert slave.watchdog is WatchdogState.BAUD_CONTROL


def test_the_way_to_data_exchange() -> None:
    rig = made()
    master, slave = rig.master, rig.device.slave
    assert master.ask(dp.SetPrm(IDENT_EXAMPLE, watchdog=(2, 50))) == dp.Done()
    assert state_of(rig) is DpState.WAIT_CFG
    assert master.ask(dp.DataExchange(master.outputs())) == REFUSED
    assert master.diagnosis().status == Status.ALWAYS | Status.NOT_READY | Status.WATCHDOG
    assert master.ask(dp.ChkCfg(assumed_modules(TELEGRAM_TYPES[1]))) == dp.Done()
    assert state_of(rig) is DpState.DATA_EXCHANGE
    assert slave.watchdog is WatchdogState.DP_CONTROL
    diagnosis = master.diagnosis()
    assert diagnosis.ready
    assert diagnosis.master == MASTER
    master.exchange()


@pytest.mark.parametrize("number", sorted(TELEGRAM_TYPES))
def test_every_telegram_can_be_configured_for_one_axis_and_for_two(number: int) -> None:
    rig = made()
    rig.master.start(number)
    rig.master.start(number, 1)
    configuration = rig.master.ask(dp.GetCfg())
    expected = assumed_modules(TELEGRAM_TYPES[number]) + assumed_modules(TELEGRAM_TYPES[1])
    assert configuration == dp.ConfigurationAnswer(expected)


def test_before_it_is_configured_it_tells_the_telegram_as_delivered() -> None:
    assert made().master.ask(dp.GetCfg()) == dp.ConfigurationAnswer(assumed_modules(TELEGRAM_TYPES[1]))


def test_outputs_of_eight_bytes_may_come_in_a_telegram_of_fixed_length() -> None:
    rig = made()
    master = rig.master
    master.start(100)
    master.values[0][CONTROL_WORD] = 1
    frame = master.frame(dp.DataExchange(master.outputs()))._replace(fixed=True)
    assert frame.encode()[0] == SD3
    assert len(master.wire.exchange(frame.encode())) == 1
    assert rig.device.outputs_of(1)[CONTROL_WORD] == 1


def test_no_two_configurations_look_alike() -> None:
    assert len(CONFIGURATIONS) == 6 + 36


def test_a_wrong_ident_number_and_a_wrong_configuration_show_in_the_diagnosis() -> None:
    master = made().master
    assert master.ask(dp.SetPrm(IDENT_EXAMPLE + 1)) == dp.Done()
    assert master.diagnosis().status & Status.PARAMETER_FAULT
    master.ask(dp.SetPrm(IDENT_EXAMPLE))
    assert not master.diagnosis().status & Status.PARAMETER_FAULT
    assert master.ask(dp.ChkCfg(assumed_modules(TELEGRAM_TYPES[1])[:1])) == dp.Done()
    status = master.diagnosis().status
    assert status & Status.CONFIGURATION_FAULT
    assert status & Status.PARAMETERS_REQUIRED


def test_outputs_of_a_wrong_length_end_the_exchange() -> None:
    rig = made()
    rig.master.start()
    assert rig.master.ask(dp.DataExchange(rig.master.outputs()[:-1])) == REFUSED
    assert rig.device.slave.state is DpState.WAIT_PRM
    assert rig.master.diagnosis().status & Status.CONFIGURATION_FAULT


def test_another_master_gets_the_diagnosis_but_not_the_slave() -> None:
    rig = made()
    rig.master.start()
    other = Master(VirtualWire(rig.line), address=3)
    assert other.ask(dp.SetPrm(IDENT_EXAMPLE)) == dp.Done()
    assert other.diagnosis().master == MASTER
    assert other.ask(dp.ChkCfg(assumed_modules(TELEGRAM_TYPES[2]))) == REFUSED
    assert other.ask(dp.DataExchange(rig.master.outputs())) == REFUSED
    rig.master.exchange()


def test_unlocked_it_is_free_for_another_master() -> None:
    rig = made()
    rig.master.start()
    rig.master.ask(dp.SetPrm(IDENT_EXAMPLE, lock=False, unlock=True))
    assert rig.device.slave.state is DpState.WAIT_PRM
    other = Master(VirtualWire(rig.line), address=3)
    other.start()
    assert other.diagnosis().master == 3


def test_a_request_with_the_same_frame_count_bit_gets_the_same_answer_and_does_nothing() -> None:
    rig = made()
    master = rig.master
    master.start()
    first = master.send(dp.DataExchange(master.outputs()))
    master.values[0][CONTROL_WORD] = 0x0001
    again = master.send(dp.DataExchange(master.outputs()), again=True)
    assert again == first
    rig.line.run_until(rig.line.now_ns + 5_000_000)
    assert rig.device.outputs_of(1)[CONTROL_WORD] == 0
    master.exchange()
    assert rig.device.outputs_of(1)[CONTROL_WORD] == 1


def test_the_watchdog_frees_the_slave_and_clears_its_outputs() -> None:
    rig = made()
    master = rig.master
    master.values[0][CONTROL_WORD] = 0x0001
    master.start(1, watchdog=(5, 2))
    for _ in range(10):
        master.wire.wait(90)
        master.exchange()
    assert rig.device.outputs_of(1)[CONTROL_WORD] == 1
    master.wire.wait(101)
    assert rig.device.slave.state is DpState.WAIT_PRM
    assert rig.device.outputs_of(1) == {}
    assert master.ask(dp.DataExchange(master.outputs())) == REFUSED
    master.wire.wait(6_000)
    assert rig.device.slave.watchdog is WatchdogState.BAUD_SEARCH


def test_without_a_watchdog_silence_changes_nothing() -> None:
    rig = made()
    rig.master.start()
    rig.master.wire.wait(60_000)
    rig.master.exchange()


def test_clear_takes_the_outputs_away_until_operate() -> None:
    rig = made()
    master = rig.master
    master.values[0][CONTROL_WORD] = 0x0001
    master.start()
    assert master.send(dp.GlobalControl(dp.Command.CLEAR)) == []
    master.exchange()
    assert rig.device.outputs_of(1) == {}
    master.send(dp.GlobalControl())
    master.exchange()
    assert rig.device.outputs_of(1)[CONTROL_WORD] == 1


def test_sync_holds_outputs_and_freeze_holds_inputs() -> None:
    rig = made()
    master = rig.master
    modules = assumed_modules(TELEGRAM_TYPES[1])
    master.ask(dp.SetPrm(IDENT_EXAMPLE, groups=4, sync=True, freeze=True))
    master.ask(dp.ChkCfg(modules))
    master.exchange()
    master.send(dp.GlobalControl(dp.Command.SYNC, groups=2))
    assert not master.diagnosis().status & Status.SYNC
    master.send(dp.GlobalControl(dp.Command.SYNC, groups=4))
    assert master.diagnosis().status & Status.SYNC
    master.values[0][CONTROL_WORD] = 0x0001
    master.exchange()
    assert rig.device.outputs_of(1)[CONTROL_WORD] == 0
    master.send(dp.GlobalControl(dp.Command.SYNC, groups=4))
    assert rig.device.outputs_of(1)[CONTROL_WORD] == 1
    master.send(dp.GlobalControl(dp.Command.UNSYNC | dp.Command.FREEZE, groups=4))
    status = master.diagnosis().status
    assert not status & Status.SYNC
    assert status & Status.FREEZE


def test_after_power_off_it_waits_for_parameters() -> None:
    rig = made()
    rig.master.start()
    rig.restart()
    assert rig.master.ask(dp.DataExchange(rig.master.outputs())) == REFUSED
    rig.master.start()


def test_telegrams_for_others_and_to_absent_access_points() -> None:
    rig = made()
    rig.master.slave = 7
    assert rig.master.send(dp.SlaveDiag()) == []
    rig.master.slave = 6
    request = dp.Other(Ask.SRD_HIGH, dp.Sap.SET_ADDRESS, dp.MASTER_SAP, b"\x07\x0e\xd2\x00")
    assert rig.master.ask(request) == REFUSED


def test_on_the_pty_the_answer_takes_the_time_of_the_wire() -> None:
    with on_pty(baud=19_200) as (device, master, wire):
        master.start()
        before_ns = wire._clock.now_ns
        master.exchange()
        telegram = dp.encode_request(dp.DataExchange(master.outputs()), MASTER, 6)
        assert isinstance(telegram, Telegram)
        characters = 2 * len(telegram.encode())
        assert wire._clock.now_ns - before_ns >= characters * 11 * 1_000_000_000 // 19_200
        assert device.slave.state is DpState.DATA_EXCHANGE
        assert master.read("12/61") == 1_000
