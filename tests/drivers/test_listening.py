"""What listening alone tells of a bus."""

from __future__ import annotations

from app.drivers.contract import MasterSign
from app.drivers.listening import BusWatch
from app.wire.frame import Can, Direction, Frame


def heard(*cans: Can, direction: Direction = Direction.RX) -> BusWatch:
    watch = BusWatch()
    watch.on_frames([Frame(n, "can0", direction, can) for n, can in enumerate(cans)])
    return watch


def test_nodes_are_known_by_what_only_nodes_send() -> None:
    ids = (0x081, 0x182, 0x283, 0x384, 0x485, 0x586, 0x707)
    watch = heard(*(Can(can_id, bytes(8)) for can_id in ids))
    assert watch.nodes == (1, 2, 3, 4, 5, 6, 7)
    assert watch.masters == ()


def test_masters_are_known_by_what_only_masters_send() -> None:
    signs = {
        0x000: MasterSign.NMT_COMMAND,
        0x080: MasterSign.SYNC,
        0x100: MasterSign.TIME_STAMP,
        0x201: MasterSign.RPDO,
        0x302: MasterSign.RPDO,
        0x403: MasterSign.RPDO,
        0x504: MasterSign.RPDO,
        0x605: MasterSign.SDO_REQUEST,
    }
    watch = heard(*(Can(can_id, bytes(8)) for can_id in signs))
    assert {seen.can_id: seen.sign for seen in watch.masters} == signs
    assert watch.nodes == ()


def test_what_is_neither_counts_for_nothing() -> None:
    others = (
        Can(0x7E4, bytes(8)),
        Can(0x12345, bytes(8), extended=True),
        Can(0x605, error=True),
        Can(0x185, remote=True),
    )
    watch = heard(*others)
    assert (watch.nodes, watch.masters) == ((), ())


def test_node_guarding_is_a_master_and_hides_no_node() -> None:
    watch = heard(Can(0x705, remote=True, dlc=1), Can(0x705, b"\x7f"))
    assert [seen.sign for seen in watch.masters] == [MasterSign.NODE_GUARDING]
    assert watch.nodes == (5,)


def test_our_own_frames_count_for_nothing() -> None:
    watch = heard(Can(0x000, b"\1\0"), Can(0x605, bytes(8)), direction=Direction.TX)
    assert watch.masters == ()


def test_the_last_time_and_the_number_are_kept() -> None:
    request = Can(0x605, bytes(8))
    watch = heard(request, Can(0x585, bytes(8)), request)
    assert [(seen.t_ns, seen.times) for seen in watch.masters] == [(2, 2)]
    assert watch.last_seen_ns(MasterSign.SDO_REQUEST) == 2
    assert watch.last_seen_ns(MasterSign.SYNC) is None
    watch.forget()
    assert (watch.masters, watch.nodes) == ((), ())
