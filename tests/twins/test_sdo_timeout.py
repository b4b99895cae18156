"""An SDO client that dies within a transfer: the server gives up after a time, says so, and serves again."""

from __future__ import annotations

import pytest

from app.model.address import parse_address
from app.twins import sdo_block
from app.twins.line import MIN_BITRATE
from app.twins.sdo_server import TIMEOUT_NS
from app.wire import sdo
from app.wire.frame import Can
from tests.twins.harness import MS, SECOND, Master
from tests.twins.test_canopen_device import NODE, Bench

REQUEST = sdo.REQUEST_BASE + NODE
RESPONSE = sdo.RESPONSE_BASE + NODE
LONG = bytes(range(200))
SEGMENTED_READ = ("4008100000000000",)
SEGMENTED_WRITE = ("21032000C8000000", "0001020304050607")
BLOCK_READ = ("A403200014000000", "A300000000000000")
BLOCK_READ_ACKNOWLEDGED = (*BLOCK_READ, "A214140000000000")
BLOCK_WRITE = ("C603200064000000",)
BLOCK_WRITE_BEGUN = (*BLOCK_WRITE, "0101020304050607")
BLOCK_WRITE_COMPLETE = (*BLOCK_WRITE, "8101020304050607")
OPEN = {
    "segmented read": ("1008", SEGMENTED_READ),
    "segmented write": ("2003", SEGMENTED_WRITE),
    "block read": ("2003", BLOCK_READ),
    "block read, acknowledged": ("2003", BLOCK_READ_ACKNOWLEDGED),
    "block write": ("2003", BLOCK_WRITE),
    "block write, begun": ("2003", BLOCK_WRITE_BEGUN),
    "block write, complete": ("2003", BLOCK_WRITE_COMPLETE),
}


def timed_out(where: str) -> bytes:
    return sdo.abort(parse_address(where), sdo.Abort.TIMED_OUT)


def send(master: Master, *frames: str) -> None:
    for data in frames:
        master.send(REQUEST, bytes.fromhex(data))
        master.run(20 * MS)


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.master.write(NODE, "2003", LONG)
    return bench


@pytest.mark.parametrize(("where", "frames"), OPEN.values(), ids=OPEN)
def test_an_abandoned_transfer_is_aborted_and_the_server_serves(
    bench: Bench, where: str, frames: tuple[str, ...]
) -> None:
    master = bench.master
    send(master, *frames)
    began_ns, place = bench.line.now_ns, len(master.heard)
    assert timed_out(where) not in [heard.can.data for heard in master.heard]
    abort = master.wait_id(RESPONSE, timeout_ns=2 * TIMEOUT_NS, since=place)
    assert abort.can.data == timed_out(where)
    assert TIMEOUT_NS - 20 * MS <= abort.t_ns - began_ns <= TIMEOUT_NS + 50 * MS
    master.run(5 * SECOND)
    assert len(master.all_of(RESPONSE, began_ns)) == 1
    assert master.number(NODE, "1000") == 0x20192
    assert master.read(NODE, "2003") == LONG


def test_requests_of_another_transfer_do_not_keep_a_block_download_open(bench: Bench) -> None:
    """They look like segments out of order; who polls the node would else lock its server for ever."""
    master = bench.master
    send(master, *BLOCK_WRITE)
    for _ in range(15):
        master.send(REQUEST, bytes.fromhex("4000100000000000"))
        master.run(100 * MS)
    answers = [heard.can.data for heard in master.all_of(RESPONSE)]
    assert answers.count(timed_out("2003")) == 1
    assert answers[-1] == bytes.fromhex("4300100092010200")


def test_a_block_download_begun_anew_after_the_time_out_is_served(bench: Bench) -> None:
    master = bench.master
    send(master, *BLOCK_WRITE_BEGUN)
    master.run(2 * SECOND)
    master.block_write(NODE, "2003", LONG[::-1])
    assert master.read(NODE, "2003") == LONG[::-1]


def test_a_slow_client_is_waited_for(bench: Bench) -> None:
    """Each frame of the transfer gives it the whole time again."""
    master = bench.master
    nearly_ns = TIMEOUT_NS - 50 * MS
    send(master, *BLOCK_WRITE)
    data = LONG[:21]
    for number in (1, 2, 3):
        master.run(nearly_ns)
        master.send(REQUEST, sdo_block.segment(number, data[7 * number - 7 : 7 * number], number == 3))
    master.run(nearly_ns)
    assert master.all_of(RESPONSE)[-1].can.data == sdo_block.download_block_ack(3, sdo_block.MAX_BLOCK)
    master.send(REQUEST, bytes([0x80]) + bytes(7))
    send(master, "4008100000000000")
    for toggle in (False, True):
        master.run(nearly_ns)
        assert master.exchange(NODE, sdo.upload_segment_request(toggle))[0] == toggle << 4


@pytest.mark.parametrize("end", ["8000000000000000", "C100000000000000"])
def test_what_has_ended_does_not_time_out(bench: Bench, end: str) -> None:
    master = bench.master
    send(master, "C603200007000000", "8101020304050607", end)
    began_ns = bench.line.now_ns
    master.run(5 * SECOND)
    assert not master.all_of(RESPONSE, began_ns)


def test_a_restart_ends_the_wait(bench: Bench) -> None:
    send(bench.master, *BLOCK_WRITE)
    began_ns = bench.line.now_ns
    bench.restart()
    bench.master.run(5 * SECOND)
    assert not bench.master.all_of(RESPONSE, began_ns)


def test_a_slow_device_is_not_impatient() -> None:
    """The client cannot go on before it has the answer."""
    bench = Bench(turnaround_ns=2 * TIMEOUT_NS)
    bench.master.write(NODE, "2003", bytes(range(20)))
    assert bench.master.read(NODE, "2003") == bytes(range(20))


def test_a_whole_block_has_its_time_on_the_slowest_line() -> None:
    bench = Bench(bitrate=MIN_BITRATE)
    master = bench.master
    data = b"\xff" * 7 * sdo_block.MAX_BLOCK
    master.block_write(NODE, "2003", data)
    began_ns = bench.line.now_ns
    assert master.block_read(NODE, "2003") == data
    assert bench.line.now_ns - began_ns > TIMEOUT_NS


def test_timed_out_while_the_client_is_about_to_go_on(bench: Bench) -> None:
    """A segment that comes after the abort belongs to nothing."""
    master = bench.master
    send(master, *SEGMENTED_READ)
    master.run(2 * TIMEOUT_NS)
    assert master.refused(lambda: master.exchange(NODE, sdo.upload_segment_request(False))) == 0x05040001


def test_the_sequence_that_locked_the_server(bench: Bench) -> None:
    master = bench.master
    place = len(master.heard)
    send(master, "C603200002000000")
    for _ in range(20):
        send(master, "4000100000000000")
    master.run(2 * TIMEOUT_NS)
    answers = [heard.can for heard in master.heard[place:]]
    assert answers[1:] == [Can(RESPONSE, timed_out("2003"))]
    assert master.number(NODE, "1000") == 0x20192
