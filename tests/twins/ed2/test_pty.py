"""The pty: pieces, time, several slaves on one line, masters that come and go."""

from __future__ import annotations

import os

from app.model.description_file import load_builtin
from app.twins.ed2.device import Ed2, Settings
from app.twins.ed2.pty_line import PtyLine
from app.twins.ed2.segment import Segment
from app.twins.paced_thread import PacedThread
from app.wire.profibus import dp
from app.wire.profibus.control import Station
from app.wire.profibus.fdl import decode
from tests.twins.ed2.rig import MASTER, MS, Clock, Master, PtyWire, on_pty

STATUS = dp.encode_request(dp.FdlStatus(), MASTER, 6).encode()
IS_THERE = dp.StatusAnswer(Station.SLAVE)


def test_a_request_in_two_pieces_is_one_request() -> None:
    with on_pty() as (_, master, wire):
        os.write(wire._handle, STATUS[:2])
        wire.wait(1)
        assert len(wire.exchange(STATUS[2:])) == 1
        master.start()


def test_after_a_long_pause_the_rest_of_a_request_is_none() -> None:
    with on_pty() as (_, master, wire):
        assert wire.exchange(STATUS[:2]) == []
        assert wire.exchange(STATUS[2:]) == []
        wire.wait(50)
        assert master.ask(dp.FdlStatus()) == IS_THERE


def test_an_answer_comes_in_pieces_as_its_characters_become_whole() -> None:
    with on_pty(baud=9_600) as (_, master, wire):
        master.start()
        request = master.frame(dp.SlaveDiag()).encode()
        os.write(wire._handle, request)
        pieces: list[bytes] = []
        for _ in range(400):
            wire.wait(1)
            piece = wire.read()
            if piece:
                pieces.append(piece)
            if len(b"".join(pieces)) == 17:
                break
        assert len(pieces) > 3
        decode(b"".join(pieces))


def test_a_master_can_leave_and_come_back() -> None:
    with on_pty() as (_, master, wire):
        master.start()
        path = os.ttyname(wire._handle)
        wire.close()
        again = PtyWire(path, wire._clock, wire._thread)
        other = Master(again, address=3)
        assert other.ask(dp.FdlStatus()) == IS_THERE
        assert other.diagnosis().master == MASTER
        again.close()
        wire._handle = os.open(path, os.O_RDWR | os.O_NOCTTY)


def test_several_slaves_share_a_line() -> None:
    description = load_builtin("wandfluh-ed2")
    devices = [Ed2(description, Settings(address=address)) for address in (6, 7, 9)]
    for device in devices:
        device.run_until(1_000 * MS)
    line = PtyLine(Segment([device.slave for device in devices], 1_500_000), devices)
    clock = Clock()
    thread = PacedThread(line, clock, max_lag_ns=10**18)
    line.serve(thread)
    with thread:
        wire = PtyWire(line.path, clock, thread)
        masters = [Master(wire, address) for address in (6, 7, 9)]
        for number, master in enumerate(masters, 1):
            master.start()
            master.write("12/207", number)
        assert [master.read("12/207") for master in masters] == [1, 2, 3]
        assert Master(wire, 8).send(dp.FdlStatus()) == []
        wire.close()
    assert thread.handler_errors == 0
    line.close()


def test_noise_before_a_request_is_skipped() -> None:
    with on_pty() as (_, master, wire):
        assert wire.exchange(b"\xff\x00\x68\x05") == []
        wire.wait(50)
        assert master.ask(dp.FdlStatus()) == IS_THERE
