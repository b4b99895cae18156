"""Faults on the wire, as a client on the bus sees them."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest

from app.errors import UsageError
from app.model.fault import CATALOGUE
from app.twins.line import CanLine
from app.twins.wire_faults import BUS_OFF_BITS, FramesReordered
from app.wire.can_bits import frame_bits
from app.wire.frame import Can
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND, Heard
from tests.twins.turbine_rig import TurbineRig

PMM, PMC = 2, 12
FAST_BEAT = 20


@pytest.fixture
def rig() -> TurbineRig:
    """Every device of blade 2 beats each 20 ms."""
    made = TurbineRig()
    for node in (PMM, PMC):
        made.master.put(node, "1017", FAST_BEAT, 2)
    return made


def beats(rig: TurbineRig, node: int, seconds: float) -> list[Heard]:
    since_ns = rig.line.now_ns + 1
    rig.run(seconds)
    return rig.master.all_of(0x700 + node, since_ns)


def test_a_share_of_the_frames_is_lost(rig: TurbineRig) -> None:
    assert len(beats(rig, PMC, 4)) == 200
    fault = rig.fault("frames_lost", percent=30, first_id=0x700, last_id=0x77F)
    assert 100 < len(beats(rig, PMC, 4)) < 180
    rig.instructor.clear(fault.id)
    assert len(beats(rig, PMC, 4)) == 200


def test_frames_of_one_node_alone_are_lost(rig: TurbineRig) -> None:
    rig.fault("frames_lost", percent=100, node=PMC)
    assert beats(rig, PMC, 1) == []
    assert rig.number(PMM, "3062") > 300
    with pytest.raises(TimeoutError):
        rig.number(PMC, "6064")


def test_a_lost_answer_was_yet_obeyed(rig: TurbineRig) -> None:
    """The request came through, the acknowledge did not: the value stands in RAM."""
    rig.fault("frames_lost", percent=100, first_id=0x580 + PMC, last_id=0x580 + PMC, seconds=1)
    with pytest.raises(TimeoutError):
        rig.master.write(PMC, "6081", (555).to_bytes(4, "little"), SECOND // 2)
    rig.run(1)
    assert rig.number(PMC, "6081") == 555


def test_so_many_frames_are_lost_and_no_more(rig: TurbineRig) -> None:
    rig.fault("frames_lost", percent=100, count=3, first_id=0x700 + PMC, last_id=0x700 + PMC)
    assert len(beats(rig, PMC, 1)) == 47
    assert rig.instructor.active == ()


def test_frames_come_late(rig: TurbineRig) -> None:
    before = beats(rig, PMC, 1)[-1].t_ns
    rig.fault("frames_delayed", percent=100, node=PMC, delay_ms=7)
    late = beats(rig, PMC, 1)[0].t_ns
    assert (late - before) / MS == pytest.approx(FAST_BEAT + 7, abs=0.5)


def test_frames_come_late_by_different_times(rig: TurbineRig) -> None:
    rig.fault("frames_delayed", percent=100, node=PMC, delay_ms=1, spread_ms=15)
    gaps = [(after.t_ns - before.t_ns) / MS for before, after in pairwise(beats(rig, PMC, 2))]
    assert min(gaps) < FAST_BEAT - 3
    assert max(gaps) > FAST_BEAT + 3


def test_frames_come_twice(rig: TurbineRig) -> None:
    fault = rig.fault("frames_doubled", percent=100, node=PMC)
    assert len(beats(rig, PMC, 1)) == 100
    rig.instructor.clear(fault.id)
    assert len(beats(rig, PMC, 1)) == 50


def test_frames_change_their_order(rig: TurbineRig) -> None:
    """The EMCY of a fault reset goes out behind the frame that follows it, though its identifier is lower."""
    line, seen = CanLine(500_000), list[int]()
    sender = line.attach(lambda _can, _t_ns: None)
    line.attach(lambda can, _t_ns: seen.append(can.can_id))
    values = {one.name: one.default for one in CATALOGUE["frames_reordered"].parameters} | {"percent": 100.0}
    fault = FramesReordered(line, values, Random(1), sender, lambda: None)
    for can_id in (0x100, 0x200, 0x300, 0x400):
        sender.send(Can(can_id, bytes(8)))
    line.run_until(10 * MS)
    assert seen == [0x200, 0x100, 0x400, 0x300]
    sender.send(Can(0x123))
    line.run_until(50 * MS)
    assert seen[4:] == [], "it waits for the next one"
    line.run_until(200 * MS)
    assert seen[4:] == [0x123], "but not for ever"
    sender.send(Can(0x124))
    fault.end()
    line.run_until(201 * MS)
    assert seen[5:] == [0x124], "what is held back goes when the fault ends"


def test_a_frame_that_is_held_back_dies_with_its_sender() -> None:
    line, seen = CanLine(500_000), list[int]()
    sender = line.attach(lambda _can, _t_ns: None)
    line.attach(lambda can, _t_ns: seen.append(can.can_id))
    values = {one.name: one.default for one in CATALOGUE["frames_reordered"].parameters} | {"percent": 100.0}
    FramesReordered(line, values, Random(1), None, lambda: None)
    sender.send(Can(0x123))
    sender.clear()
    line.run_until(SECOND)
    assert seen == []


def test_so_many_frames_change_their_order_and_the_last_one_too(rig: TurbineRig) -> None:
    rig.fault("frames_reordered", percent=100, node=PMC, count=1, first_id=0x700, last_id=0x77F, hold_ms=15)
    assert [fault.order.kind for fault in rig.instructor.active] == ["frames_reordered"]
    assert len(beats(rig, PMC, 1)) == 50, "none is lost"
    assert rig.instructor.active == ()


def test_a_node_is_gone_and_returns_as_it_was(rig: TurbineRig) -> None:
    rig.master.put(PMC, "6066", 432, 2)
    rig.master.nmt(NmtCommand.START, PMC)
    rig.run(0.1)
    fault = rig.fault("node_gone", node=PMC)
    assert beats(rig, PMC, 2) == []
    rig.master.nmt(NmtCommand.STOP, PMC)
    with pytest.raises(TimeoutError):
        rig.number(PMC, "6064")
    rig.instructor.clear(fault.id)
    found = beats(rig, PMC, 1)
    assert len(found) == 50, "nothing of the time away comes after"
    assert found[0].can.data == b"\x05", "operational still: it heard no STOP"
    assert rig.number(PMC, "6066") == 432


def test_its_partner_misses_a_node_that_is_gone(rig: TurbineRig) -> None:
    """The heartbeat consumer of the PMM raises 8130h, as with a real plug pulled."""
    rig.master.put(PMM, "1016:01", PMC << 16 | 100, 4)
    rig.run(0.5)
    assert 0x8130 not in rig.errors(PMM)
    rig.fault("node_gone", node=PMC, seconds=1)
    rig.run(0.5)
    assert 0x8130 in rig.errors(PMM)


def test_two_cuts_of_one_node_end_with_the_last(rig: TurbineRig) -> None:
    first, second = rig.fault("node_gone", node=PMC), rig.fault("bus_off", node=PMC)
    rig.instructor.clear(first.id)
    assert beats(rig, PMC, 1) == []
    rig.instructor.clear(second.id)
    assert len(beats(rig, PMC, 1)) > 45


@pytest.mark.parametrize("node", [PMM, PMC])
def test_bus_off_is_told_when_it_is_over(rig: TurbineRig, node: int) -> None:
    rig.fault("bus_off", node=node, seconds=2)
    assert beats(rig, node, 1.9) == []
    assert 0x8140 not in rig.errors(node)
    rig.run(0.5)
    assert 0x8140 in rig.errors(node)
    assert len(beats(rig, node, 1)) == 50


def test_bus_off_lasts_as_long_as_the_standard_wants(rig: TurbineRig) -> None:
    rig.run(0.001)
    since_ns = rig.line.now_ns
    fault = rig.fault("bus_off", node=PMC)
    rig.instructor.clear(fault.id)
    told = rig.master.wait_id(0x80 + PMC)
    assert told.t_ns - since_ns > BUS_OFF_BITS * SECOND // rig.line.bitrate
    assert told.t_ns - since_ns < 4 * MS


def test_what_waits_is_lost_in_bus_off(rig: TurbineRig) -> None:
    """An answer that was asked for before it, and not sent yet."""
    rig.master.send(0x600 + PMC, bytes([0x40, 0x64, 0x60, 0, 0, 0, 0, 0]))
    rig.run(0.0006)
    rig.fault("bus_off", node=PMC, seconds=0.1)
    since_ns = rig.line.now_ns
    rig.run(1)
    assert rig.heard_since(since_ns, 0x580 + PMC) == 0


def test_answers_come_late_and_the_write_was_done_at_once(rig: TurbineRig) -> None:
    fault = rig.fault("late_sdo_ack", node=PMC, delay_ms=1500)
    since_ns = rig.line.now_ns
    rig.master.send(0x600 + PMC, bytes([0x23, 0x81, 0x60, 0]) + (321).to_bytes(4, "little"))
    rig.run(0.01)
    assert rig.turbine.blades[1].pmc.device.store.number(0x6081) == 321
    told = rig.master.wait_id(0x580 + PMC)
    assert (told.t_ns - since_ns) / MS == pytest.approx(1501, abs=1)
    rig.instructor.clear(fault.id)
    since_ns = rig.line.now_ns
    assert rig.number(PMC, "6081") == 321
    assert rig.line.now_ns - since_ns < 5 * MS


def test_a_long_transfer_survives_late_answers(rig: TurbineRig) -> None:
    """The server waits for the next request from the time on at which its answer left, not when it was made."""
    rig.fault("late_sdo_ack", node=PMC, delay_ms=1300)
    assert rig.master.read(PMC, "1008").startswith(b"HUBSIDE TWIN")


@pytest.mark.parametrize("percent", [25, 60, 90])
def test_a_babbling_node_takes_its_share_of_the_bus(rig: TurbineRig, percent: int) -> None:
    fault = rig.fault("babbling_node", load_percent=percent, can_id=0x010)
    since_ns = rig.line.now_ns
    rig.run(1)
    heard = rig.master.all_of(0x010, since_ns)
    busy = sum(frame_bits(one.can) for one in heard) / rig.line.bitrate
    assert busy * 100 == pytest.approx(percent, abs=1)
    rig.instructor.clear(fault.id)
    since_ns = rig.line.now_ns + MS
    rig.run(0.2)
    assert rig.heard_since(since_ns, 0x010) == 0


def test_a_node_that_babbles_all_the_time_shuts_the_others_out(rig: TurbineRig) -> None:
    fault = rig.fault("babbling_node", load_percent=100, can_id=0x010)
    rig.run(0.01)
    assert beats(rig, PMC, 10) == []
    rig.instructor.clear(fault.id)
    assert len(beats(rig, PMC, 1)) < 250, "no queue is endless"
    assert len(beats(rig, PMC, 1)) == 50
    assert 0x8110 in rig.errors(PMC), "frames were lost, and it says so"


def test_a_second_master_writes_back_and_forth(rig: TurbineRig) -> None:
    rig.master.put(PMC, "6081", 700, 4)
    fault = rig.fault("second_master", node=PMC, index=0x6081, raw=123, interval_ms=100)
    since_ns = rig.line.now_ns
    found = set()
    for _ in range(20):
        rig.run(0.07)
        found.add(rig.turbine.blades[1].pmc.device.store.number(0x6081))
    assert found == {700, 123}
    requests = [heard.can.data[0] >> 5 for heard in rig.master.all_of(0x600 + PMC, since_ns)]
    assert {1, 2} <= set(requests), "it reads and writes, as everybody hears"
    rig.instructor.clear(fault.id)
    since_ns = rig.line.now_ns + MS
    rig.run(1)
    assert rig.heard_since(since_ns, 0x600 + PMC) == 0


def test_a_second_master_commands_the_network(rig: TurbineRig) -> None:
    rig.fault("second_master", node=PMC, nmt=int(NmtCommand.STOP), interval_ms=50)
    rig.run(0.3)
    assert beats(rig, PMC, 0.1)[-1].can.data == b"\x04"


def test_a_second_master_bears_with_a_refusal_and_with_silence(rig: TurbineRig) -> None:
    rig.fault("second_master", node=PMC, index=0x2FFF, interval_ms=50, seconds=1)
    rig.fault("node_gone", node=PMM, seconds=1)
    rig.fault("second_master", node=PMM, interval_ms=50, seconds=30)
    rig.run(31)
    assert rig.instructor.active == ()


def test_a_node_that_is_not_there_is_refused(rig: TurbineRig) -> None:
    with pytest.raises(UsageError) as caught:
        rig.fault("node_gone", node=99)
    assert caught.value.details["field"] == "node"
