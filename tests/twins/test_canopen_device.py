"""The CANopen mount over the line: SDO, NMT, heartbeat, memory."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from app.model.address import parse_address
from app.model.datatypes import DataType
from app.model.description import Access, Condition, LimitRef
from app.twins.canopen_device import CanopenDevice, Mount
from app.twins.line import CanLine
from app.wire.frame import Can
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND, Heard, Master, description, entry

NODE = 5
SAVE = 0x65766173
LOAD = 0x64616F6C

SMALL = description(
    entry("1000", DataType.UNSIGNED32, Access.RO, default=0x20192),
    entry("1001", DataType.UNSIGNED8, Access.RO),
    entry("1003:00", DataType.UNSIGNED8, Access.RW),
    entry("1003:01", DataType.UNSIGNED32, Access.RO),
    entry("1003:02", DataType.UNSIGNED32, Access.RO),
    entry("1005", DataType.UNSIGNED32, default=0x80),
    entry("1008", DataType.VISIBLE_STRING, Access.CONST, default="A device with a long name"),
    entry("1010:00", DataType.UNSIGNED8, Access.RO, default=1),
    entry("1010:01", DataType.UNSIGNED32),
    entry("1011:00", DataType.UNSIGNED8, Access.RO, default=1),
    entry("1011:01", DataType.UNSIGNED32),
    entry("1014", DataType.UNSIGNED32, default=0x80, node_id=True),
    entry("1016:00", DataType.UNSIGNED8, Access.RO, default=2),
    entry("1016:01", DataType.UNSIGNED32, saved=True),
    entry("1016:02", DataType.UNSIGNED32, saved=True),
    entry("1017", DataType.UNSIGNED16, default=0, saved=True),
    entry("2000", DataType.UNSIGNED16, default=500, saved=True),
    entry("2001", DataType.INTEGER16, default=-5, minimum=-100, maximum=100),
    entry("2002", DataType.UNSIGNED8, Access.WO),
    entry("2003", DataType.DOMAIN),
    entry("2004", DataType.UNSIGNED16, Access.FACTORY, default=7, saved=True),
    entry("2005", DataType.UNSIGNED16, requires=(Condition(parse_address("2000"), (6,)),)),
    entry("2006", DataType.UNSIGNED16, default=1, maximum=LimitRef(parse_address("2000"))),
    entry("2007:00", DataType.UNSIGNED8, Access.RO, default=1),
    entry("2007:01", DataType.UNSIGNED16, default=3, saved=True),
    entry("2008", DataType.VISIBLE_STRING, default="short"),
    entry("2009", DataType.UNSIGNED64, default=1),
)


class Bench:
    """A line, a master and one device."""

    def __init__(self, bitrate: int = 500_000, **mount: object) -> None:
        self.line = CanLine(bitrate)
        self.master = Master(self.line)
        self.device = CanopenDevice(self.line, NODE, SMALL, Mount(boot_ns=50 * MS, **mount))  # type: ignore[arg-type]
        self.device.power_on(0)
        self.master.wait_id(0x700 + NODE, since=0)

    def restart(self) -> Heard:
        self.master.nmt(NmtCommand.RESET_NODE, NODE)
        return self.master.wait_id(0x700 + NODE)

    def save(self, sub: int = 1, signature: int = SAVE) -> None:
        self.master.put(NODE, f"1010:{sub:02X}", signature, 4)


def tap_times(taken: list[tuple[int, int]]) -> Callable[[int, int, Can], None]:
    return lambda start_ns, end_ns, _can: taken.append((start_ns, end_ns))


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_boot_up_takes_its_time(bench: Bench) -> None:
    boot = bench.master.all_of(0x700 + NODE)[0]
    assert boot.can.data == b"\0"
    assert 50 * MS < boot.t_ns < 51 * MS


def test_silent_while_booting(bench: Bench) -> None:
    bench.master.nmt(NmtCommand.RESET_NODE, NODE)
    bench.master.run(20 * MS)
    bench.master.send(0x600 + NODE, bytes.fromhex("4000200000000000"))
    bench.master.run(20 * MS)
    assert not bench.master.all_of(0x580 + NODE)


def test_expedited_read_and_write(bench: Bench) -> None:
    master = bench.master
    assert master.number(NODE, "2000") == 500
    master.put(NODE, "2000", 1234, 2)
    assert master.number(NODE, "2000") == 1234
    assert master.number(NODE, "2001", signed=True) == -5


def test_expedited_write_without_size(bench: Bench) -> None:
    bench.master.exchange(NODE, bytes.fromhex("2200200034120000"))
    assert bench.master.number(NODE, "2000") == 0x1234


def test_turnaround_delays_the_answer() -> None:
    for turnaround_ns in (1 * MS, 7 * MS):
        bench = Bench(turnaround_ns=turnaround_ns)
        taken: list[tuple[int, int]] = []
        bench.line.tap(tap_times(taken))
        bench.master.number(NODE, "2000")
        (_, request_end), (answer_start, _) = taken
        assert answer_start - request_end == turnaround_ns


def test_segmented_read_and_write(bench: Bench) -> None:
    master = bench.master
    assert master.read(NODE, "1008") == b"A device with a long name"
    data = bytes(range(200))
    master.write(NODE, "2003", data)
    assert master.read(NODE, "2003") == data
    master.write(NODE, "2009", bytes(range(8)))
    assert master.read(NODE, "2009") == bytes(range(8))


@pytest.mark.parametrize("size", [1, 6, 7, 8, 14, 889, 890, 2000])
def test_block_transfers(bench: Bench, size: int) -> None:
    data = bytes(number * 7 & 0xFF for number in range(size))
    bench.master.block_write(NODE, "2003", data)
    assert bench.master.block_read(NODE, "2003", block_size=20) == data


def test_block_download_repeats_a_lost_segment(bench: Bench) -> None:
    data = bytes(range(256)) * 4
    bench.master.block_write(NODE, "2003", data, lose=5)
    assert bench.master.read(NODE, "2003") == data


def test_block_download_with_wrong_crc_changes_nothing(bench: Bench) -> None:
    data = bytes(range(100))
    bench.master.block_write(NODE, "2003", data)
    code = bench.master.refused(lambda: bench.master.block_write(NODE, "2003", bytes(100), crc=1))
    assert code == 0x05040004
    assert bench.master.read(NODE, "2003") == data


def test_block_upload_repeats_from_the_acknowledged_segment(bench: Bench) -> None:
    master = bench.master
    master.write(NODE, "2003", bytes(range(30)))
    master.exchange(NODE, bytes.fromhex("A403200005000000"))
    place = len(master.heard)
    master.send(0x600 + NODE, bytes([0xA3]) + bytes(7))
    master.run(20 * MS)
    assert [heard.can.data[0] for heard in master.heard[place:]] == [1, 2, 3, 4, 0x85]
    place = len(master.heard)
    master.send(0x600 + NODE, bytes([0xA2, 3, 5]) + bytes(5))
    master.run(20 * MS)
    again = [heard.can.data for heard in master.heard[place:]]
    assert again == [bytes([1, *range(21, 28)]), bytes([0x82, 28, 29, 0, 0, 0, 0, 0])]


ABORTS: list[tuple[str, int, Callable[[Master], object]]] = [
    ("unknown object", 0x06020000, lambda m: m.read(NODE, "4711")),
    ("unknown object, write", 0x06020000, lambda m: m.put(NODE, "4711", 1, 1)),
    ("unknown sub-index", 0x06090011, lambda m: m.read(NODE, "2007:02")),
    ("read-only", 0x06010002, lambda m: m.put(NODE, "1000", 1, 4)),
    ("constant", 0x06010002, lambda m: m.write(NODE, "1008", b"another name")),
    ("factory", 0x06010002, lambda m: m.put(NODE, "2004", 1, 2)),
    ("write-only", 0x06010001, lambda m: m.read(NODE, "2002")),
    ("too long", 0x06070012, lambda m: m.put(NODE, "2000", 1, 4)),
    ("too short", 0x06070013, lambda m: m.put(NODE, "2000", 1, 1)),
    ("segmented, too long", 0x06070012, lambda m: m.write(NODE, "2000", bytes(9))),
    ("too high", 0x06090031, lambda m: m.put(NODE, "2001", 101, 2, signed=True)),
    ("too low", 0x06090032, lambda m: m.put(NODE, "2001", -101, 2, signed=True)),
    ("above another object", 0x06090031, lambda m: m.put(NODE, "2006", 501, 2)),
    ("device state", 0x08000022, lambda m: m.put(NODE, "2005", 1, 2)),
    ("no data", 0x08000024, lambda m: m.read(NODE, "1003:01")),
    ("bad command", 0x05040001, lambda m: m.exchange(NODE, bytes.fromhex("E000200000000000"))),
    ("segment of nothing", 0x05040001, lambda m: m.exchange(NODE, bytes.fromhex("6000000000000000"))),
    ("block size 0", 0x05040002, lambda m: m.exchange(NODE, bytes.fromhex("A403200000000000"))),
    ("block download of nothing", 0x05040001, lambda m: m.exchange(NODE, bytes.fromhex("C100000000000000"))),
]


@pytest.mark.parametrize(("code", "action"), [case[1:] for case in ABORTS], ids=[case[0] for case in ABORTS])
def test_abort_codes(bench: Bench, code: int, action: Callable[[Master], object]) -> None:
    assert bench.master.refused(lambda: action(bench.master)) == code
    assert bench.master.number(NODE, "2000") == 500


def test_toggle_error_ends_the_transfer(bench: Bench) -> None:
    master = bench.master
    master.exchange(NODE, bytes.fromhex("4008100000000000"))
    assert master.refused(lambda: master.exchange(NODE, bytes.fromhex("7000000000000000"))) == 0x05030000
    assert master.refused(lambda: master.exchange(NODE, bytes.fromhex("6000000000000000"))) == 0x05040001


def test_segmented_write_of_another_length_than_announced(bench: Bench) -> None:
    master = bench.master
    master.exchange(NODE, bytes.fromhex("2103200014000000"))
    assert master.refused(lambda: master.exchange(NODE, b"\x01" + bytes(7))) == 0x06070010


def test_factory_objects_open_with_the_factory_switch() -> None:
    bench = Bench(factory=True)
    bench.master.put(NODE, "2004", 1, 2)
    assert bench.master.number(NODE, "2004") == 1


def test_saved_values_come_back_and_others_do_not(bench: Bench) -> None:
    master = bench.master
    master.put(NODE, "2000", 11, 2)
    master.put(NODE, "2007:01", 12, 2)
    master.put(NODE, "2001", 13, 2)
    bench.save()
    master.put(NODE, "2007:01", 99, 2)
    bench.restart()
    assert master.number(NODE, "2000") == 11
    assert master.number(NODE, "2007:01") == 12
    assert master.number(NODE, "2001", signed=True) == -5


def test_save_takes_its_time_and_wants_its_signature(bench: Bench) -> None:
    began_ns = bench.line.now_ns
    bench.save()
    assert bench.line.now_ns - began_ns >= 300 * MS
    assert bench.master.refused(lambda: bench.save(signature=0x65766172)) == 0x08000020
    assert bench.master.number(NODE, "1010:01") == 1


def test_requests_during_a_save_are_answered_after_it(bench: Bench) -> None:
    master = bench.master
    place = len(master.heard)
    master.send(0x600 + NODE, bytes.fromhex("2310100173617665"))
    master.run(50 * MS)
    master.send(0x600 + NODE, bytes.fromhex("4000200000000000"))
    master.run(200 * MS)
    assert len(master.heard) == place
    master.run(100 * MS)
    assert [heard.can.data[0] for heard in master.heard[place:]] == [0x60, 0x4B]


def test_a_restart_during_a_save_saves_nothing(bench: Bench) -> None:
    master = bench.master
    master.put(NODE, "2000", 11, 2)
    began_ns = bench.line.now_ns
    master.send(0x600 + NODE, bytes.fromhex("2310100173617665"))
    master.run(100 * MS)
    bench.restart()
    master.run(SECOND)
    assert not master.all_of(0x580 + NODE, began_ns)
    assert master.number(NODE, "2000") == 500


def test_load_is_in_force_after_the_restart(bench: Bench) -> None:
    master = bench.master
    master.put(NODE, "2000", 11, 2)
    bench.save()
    assert master.refused(lambda: master.put(NODE, "1011:01", SAVE, 4)) == 0x08000020
    master.put(NODE, "1011:01", LOAD, 4)
    assert master.number(NODE, "2000") == 11
    bench.restart()
    assert master.number(NODE, "2000") == 500


def test_a_new_process_finds_the_file(tmp_path: Path) -> None:
    path = tmp_path / "state" / "device.json"
    bench = Bench(state_path=path)
    bench.master.put(NODE, "2000", 77, 2)
    bench.save()
    assert json.loads(path.read_text())["saved"]["2000:00"] == "4d00"
    again = Bench(state_path=path)
    assert again.device.memory.problem is None
    assert again.master.number(NODE, "2000") == 77


def test_reset_communication_brings_back_communication_objects_only(bench: Bench) -> None:
    master = bench.master
    master.put(NODE, "1017", 100, 2)
    master.put(NODE, "2000", 11, 2)
    master.nmt(NmtCommand.RESET_COMMUNICATION, NODE)
    master.wait_id(0x700 + NODE)
    assert master.number(NODE, "1017") == 0
    assert master.number(NODE, "2000") == 11


def test_heartbeat_producer_shows_the_state(bench: Bench) -> None:
    master = bench.master
    master.put(NODE, "1017", 100, 2)
    began_ns = bench.line.now_ns
    master.run(350 * MS)
    beats = master.all_of(0x700 + NODE, began_ns)
    assert [beat.can.data[0] for beat in beats] == [127, 127, 127]
    assert 99 * MS < beats[1].t_ns - beats[0].t_ns < 101 * MS
    for command, state in ((NmtCommand.START, 5), (NmtCommand.STOP, 4), (NmtCommand.PRE_OPERATIONAL, 127)):
        master.nmt(command, NODE)
        assert master.wait_id(0x700 + NODE).can.data[0] == state


def test_stopped_node_answers_no_sdo(bench: Bench) -> None:
    bench.master.nmt(NmtCommand.STOP, NODE)
    bench.master.run(5 * MS)
    with pytest.raises(TimeoutError):
        bench.master.exchange(NODE, bytes.fromhex("4000200000000000"), SECOND)


def test_nmt_of_other_nodes_and_nonsense_is_ignored(bench: Bench) -> None:
    place = len(bench.master.heard)
    bench.master.nmt(NmtCommand.RESET_NODE, NODE + 1)
    bench.master.send(0, b"\x07\x00")
    bench.master.send(0, b"\x01")
    bench.master.run(SECOND)
    assert len(bench.master.heard) == place
    bench.master.nmt(NmtCommand.RESET_NODE, 0)
    assert bench.master.wait_id(0x700 + NODE)


def test_heartbeat_consumer_watches_from_the_first_beat(bench: Bench) -> None:
    bench.master.put(NODE, "1016:01", 0x7F << 16 | 200, 4)
    bench.master.run(SECOND)
    assert not bench.master.all_of(0x80 + NODE)
    for _ in range(5):
        bench.master.send(0x77F, b"\x05")
        bench.master.run(150 * MS)
    assert not bench.master.all_of(0x80 + NODE)


def test_a_node_can_be_watched_once(bench: Bench) -> None:
    bench.master.put(NODE, "1016:01", 9 << 16 | 200, 4)
    assert bench.master.refused(lambda: bench.master.put(NODE, "1016:02", 9 << 16 | 300, 4)) == 0x06040043


def test_lost_heartbeat_reaches_history_and_register(bench: Bench) -> None:
    master = bench.master
    bench.device.application.communication_error = bench.device.emergency.occur  # type: ignore[method-assign]
    master.put(NODE, "1016:01", 0x7F << 16 | 200, 4)
    master.send(0x77F, b"\x05")
    message = master.wait_id(0x80 + NODE).can.data
    assert message[:3] == bytes([0x30, 0x81, 0x11])
    assert master.number(NODE, "1003:00") == 1
    assert master.number(NODE, "1003:01") & 0xFFFF == 0x8130
    assert master.number(NODE, "1001") == 0x11
    assert master.refused(lambda: master.put(NODE, "1003:00", 1, 1)) == 0x06090030
    master.put(NODE, "1003:00", 0, 1)
    assert master.number(NODE, "1003:00") == 0


def test_sync_producer_is_refused(bench: Bench) -> None:
    assert bench.master.refused(lambda: bench.master.put(NODE, "1005", 1 << 30 | 0x80, 4)) == 0x06090030


def test_emergency_identifier_cannot_change_while_in_use(bench: Bench) -> None:
    master = bench.master
    assert master.refused(lambda: master.put(NODE, "1014", 0x90, 4)) == 0x06090030
    master.put(NODE, "1014", 1 << 31 | 0x90, 4)
    master.put(NODE, "1014", 0x90, 4)
    assert master.number(NODE, "1014") == 0x90
