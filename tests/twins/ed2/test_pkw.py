"""PKW: jobs, their answers and refusals, one at a time, and what is kept without power."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from app.twins.ed2.device import Settings
from app.wire.profibus import dp, pkw
from app.wire.profibus.pkw import PkwError, ReplyKind
from tests.twins.ed2.rig import Master, made, where

SAVE = 0x73617665


@pytest.fixture
def master() -> Master:
    rig = made()
    rig.master.start()
    return rig.master


def test_the_examples_of_the_manual(master: Master) -> None:
    assert master.ask_raw(bytes.fromhex("1027000000000000")) == bytes.fromhex("B027000000000001")
    assert master.ask_raw(bytes.fromhex("A029000000000001")) == bytes.fromhex("B029000000000001")


def test_each_length_has_its_own_answer(master: Master) -> None:
    assert master.do(pkw.read(where("0/40"))).kind is ReplyKind.BYTE
    assert master.do(pkw.read(where("3/73"))).kind is ReplyKind.WORD
    assert master.do(pkw.read(where("12/61"))).kind is ReplyKind.DOUBLE
    master.write("3/98", 50)
    master.write("3/73", 200)
    master.write("12/207", 12_345)
    assert [master.read(one) for one in ("3/98", "3/73", "12/207")] == [50, 200, 12_345]


def test_negative_values_keep_their_sign(master: Master) -> None:
    master.write("1/98", -1_234)
    assert master.read("1/98") == -1_234


@pytest.mark.parametrize(
    ("action", "code"),
    [
        (lambda m: m.do(pkw.read(where("0/99"))), PkwError.UNKNOWN_PNU),
        (lambda m: m.do(pkw.read(where("3/20"))), PkwError.UNKNOWN_PNU),
        (lambda m: m.do(pkw.write(where("0/38"), b"\0\0")), PkwError.NOT_CHANGEABLE),
        (lambda m: m.do(pkw.write(where("1/100"), bytes(4))), PkwError.NOT_CHANGEABLE),
        (lambda m: m.do(pkw.write(where("12/61"), (100_001).to_bytes(4, "little"))), PkwError.OUT_OF_RANGE),
        (lambda m: m.do(pkw.write(where("0/41"), b"\2")), PkwError.OUT_OF_RANGE),
        (lambda m: m.do(pkw.write(where("3/98"), b"\x1e")), PkwError.OUT_OF_RANGE),
        (lambda m: m.do(pkw.write(where("3/73"), (151).to_bytes(2, "little"))), PkwError.OUT_OF_RANGE),
        (lambda m: m.do(pkw.write(where("12/216"), (1_001).to_bytes(4, "little"))), PkwError.OUT_OF_RANGE),
        (lambda m: m.do(pkw.write(where("3/98"), b"\x64\0")), PkwError.WRONG_LENGTH),
        (lambda m: m.do(pkw.write(where("12/61"), b"\x64\0")), PkwError.WRONG_LENGTH),
        (lambda m: m.do(pkw.read(where("0/51"))), PkwError.OTHER),
    ],
)
def test_every_refusal_has_its_code(master: Master, action: Callable[[Master], pkw.PkwAnswer], code: PkwError) -> None:
    answer = action(master)
    assert answer.kind is ReplyKind.REFUSED
    assert answer.value == code


def test_conditions_open_and_close_parameters(master: Master) -> None:
    assert master.refused(lambda: master.write("1/100", -500)) is PkwError.NOT_CHANGEABLE
    master.write("1/106", 1)
    master.write("1/100", -500)
    assert master.refused(lambda: master.write("3/94", 10)) is PkwError.NOT_CHANGEABLE
    assert master.refused(lambda: master.write("1/102", 10)) is PkwError.NOT_CHANGEABLE


def test_an_answer_stands_until_the_next_one_is_ready(master: Master) -> None:
    master.read("12/61")
    master.job = pkw.read(where("12/64"))
    master.exchange()
    assert master.answers[0].address == where("12/61")
    master.until(lambda: master.answers[0].address == where("12/64"))


def test_a_job_that_goes_on_standing_is_done_once(master: Master) -> None:
    master.write("12/207", 500)
    job = pkw.write(where("12/207"), (600).to_bytes(4, "little"))
    master.do(job)
    master.advance(50)
    assert master.job == job
    assert master.answers[0].data == (600).to_bytes(4, "little")


def test_what_is_reserved_is_refused(master: Master) -> None:
    slave_job = bytes.fromhex("5027000000000000")
    data = slave_job + master.outputs()[8:]

    master.ask(dp.DataExchange(data))
    answer = master.ask(dp.DataExchange(data))
    assert isinstance(answer, dp.Inputs)
    assert answer.data[:8] == bytes.fromhex("7027000000000012")


def test_saved_values_are_there_after_power_off_and_others_are_not(tmp_path: Path) -> None:
    rig = made(Settings(state=tmp_path))
    rig.master.start()
    rig.master.write("12/207", 777)
    rig.master.write("0/51", 0)
    rig.restart()
    rig.master.start()
    assert rig.master.read("12/207") == 10_000
    rig.master.write("12/207", 777)
    rig.master.write("0/51", SAVE)
    rig.master.write("12/208", 888)
    rig.restart()
    rig.master.start()
    assert (rig.master.read("12/207"), rig.master.read("12/208")) == (777, 10_000)
    later = made(Settings(state=tmp_path))
    later.master.start()
    assert (later.master.read("12/207"), later.master.read("12/208")) == (777, 10_000)


def test_a_wrong_signature_saves_nothing(master: Master) -> None:
    assert master.refused(lambda: master.write("0/51", 0x65766173)) is PkwError.OUT_OF_RANGE
