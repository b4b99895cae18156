"""The decoder on SDO traffic of anybody: finished, aborted, replaced, late, malformed, lost and sent again."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.model.address import Address
from app.wire import sdo
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Direction, Frame
from app.wire.records import (
    Fault,
    LoadSeen,
    MalformedSeen,
    OrphanSeen,
    Outcome,
    Protocol,
    Record,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    Side,
    Source,
    ValueSeen,
)
from app.wire.sdo import Abort
from app.wire.sdo_follower import LATE_NS
from tests.wire import traffic
from tests.wire.traffic import BUS, Line, frame, frames

A, B = Address(0x3110, 1), Address(0x6065)
MAKERS = {
    SdoAccess.READ: (traffic.read, traffic.block_read),
    SdoAccess.WRITE: (traffic.write, traffic.block_write),
}


def decode(node: int, lines: list[Line]) -> list[Record]:
    return CanOpenDecoder(BUS).feed_all(frames(node, lines))


def values(records: list[Record]) -> list[tuple[int, Address, bytes, Source]]:
    return [(r.node, r.address, r.data, r.source) for r in records if isinstance(r, ValueSeen)]


def transfers(records: list[Record]) -> list[SdoSeen]:
    return [r for r in records if isinstance(r, SdoSeen)]


def test_expedited_read() -> None:
    records = decode(11, traffic.read(A, b"\xf4\x01"))
    assert records == [
        SdoSeen(
            1_000_000, BUS, 11, SdoAccess.READ, A, Outcome.DONE, b"\xf4\x01", None, None, Protocol.EXPEDITED, 1_000_000,
            Direction.RX,
        ),
        ValueSeen(1_000_000, BUS, 11, A, b"\xf4\x01", Source.SDO_READ),
    ]  # fmt: skip


def test_write_is_a_value_only_when_acknowledged() -> None:
    request, acknowledge = frames(11, traffic.write(B, b"\x64\0\0\0"))
    decoder = CanOpenDecoder(BUS)
    assert not decoder.feed(request)
    assert values(list(decoder.feed(acknowledge))) == [(11, B, b"\x64\0\0\0", Source.SDO_WRITE)]


def test_our_own_transfer_is_told_from_another_client() -> None:
    decoder = CanOpenDecoder(BUS)
    ask, answer = frames(1, traffic.read(A, b"1"))
    ours = [ask._replace(direction=Direction.TX), answer]
    theirs = frames(1, traffic.read(A, b"1"))
    assert [t.client for t in transfers(decoder.feed_all(ours + theirs))] == [Direction.TX, Direction.RX]


@pytest.mark.parametrize("size", [0, 5, 7, 8, 14, 100])
@pytest.mark.parametrize("access", list(SdoAccess))
def test_segmented(size: int, access: SdoAccess) -> None:
    data = bytes(range(size))
    records = decode(1, MAKERS[access][0](A, data))
    (seen,) = transfers(records)
    assert (seen.access, seen.outcome, seen.data, seen.protocol) == (access, Outcome.DONE, data, Protocol.SEGMENTED)
    assert [v[2] for v in values(records)] == [data]
    assert len(records) == 2


@pytest.mark.parametrize("losses", [(), (0,), (3,), (4,), (2, 7, 8), (28,), (0, 1, 2, 3, 4)])
@pytest.mark.parametrize("crc", [True, False])
@pytest.mark.parametrize("access", list(SdoAccess))
def test_block_with_lost_segments_sent_again(losses: tuple[int, ...], crc: bool, access: SdoAccess) -> None:
    data = random.Random(1).randbytes(200)  # 29 segments in blocks of 5
    records = decode(2, MAKERS[access][1](A, data, 5, losses, crc))
    (seen,) = transfers(records)
    assert (seen.access, seen.outcome, seen.data, seen.protocol) == (access, Outcome.DONE, data, Protocol.BLOCK)
    assert [v[2] for v in values(records)] == [data]
    assert len(records) == 2


def test_block_read_answered_by_a_plain_upload() -> None:
    lines = [Line(True, sdo.block_upload_request(A, 127, pst=4)), Line(False, sdo.upload_response(A, b"\1\2"))]
    (seen,) = transfers(decode(1, lines))
    assert (seen.data, seen.protocol) == (b"\1\2", Protocol.EXPEDITED)


def test_block_segment_that_we_missed_gives_no_value() -> None:
    """The receiver acknowledges five, of which the decoder saw four."""
    lines = traffic.block_write(A, bytes(35), 5)
    del lines[4]
    records = decode(1, lines)
    assert [r.fault for r in records if isinstance(r, MalformedSeen)] == [Fault.SEQUENCE]
    assert not values(records)


def test_block_with_a_wrong_crc_gives_no_value() -> None:
    lines = traffic.block_read(A, bytes(35))
    lines[-2] = Line(False, sdo.block_end(0, 0x1234))
    records = decode(1, lines)
    assert [r.fault for r in records if isinstance(r, MalformedSeen)] == [Fault.CRC]
    assert [t.outcome for t in transfers(records)] == [Outcome.BROKEN]
    assert not values(records)


@pytest.mark.parametrize("side", list(Side))
def test_abort_from_either_side(side: Side) -> None:
    lines = [
        Line(True, sdo.download_request(B, b"\1\0")),
        Line(side is Side.CLIENT, sdo.abort(B, Abort.VALUE_RANGE)),
    ]
    (seen,) = transfers(decode(1, lines))
    assert (seen.outcome, seen.abort_code, seen.aborted_by) == (Outcome.ABORTED, Abort.VALUE_RANGE, side)


@pytest.mark.parametrize("access", list(SdoAccess))
@pytest.mark.parametrize("cut", range(3, 12))
def test_abort_within_a_block(access: SdoAccess, cut: int) -> None:
    lines = MAKERS[access][1](A, bytes(70), 4)[:cut]
    for client in (True, False):
        (seen,) = transfers(decode(1, [*lines, Line(client, sdo.abort(A, Abort.GENERAL))]))
        assert seen.outcome is Outcome.ABORTED


def test_new_initiate_replaces_the_open_transfer() -> None:
    lines = [Line(True, sdo.download_request(A, b"\1\0")), *traffic.read(B, b"\2\0")]
    records = decode(1, lines)
    assert [(t.address, t.outcome) for t in transfers(records)] == [(A, Outcome.LOST), (B, Outcome.DONE)]
    assert values(records) == [(1, B, b"\2\0", Source.SDO_READ)]


@pytest.mark.parametrize("cut", range(1, 9))
@pytest.mark.parametrize("maker", [traffic.block_write, traffic.block_read])
def test_initiate_within_a_block_replaces_it(maker: Callable[[Address, bytes, int], list[Line]], cut: int) -> None:
    records = decode(1, [*maker(A, bytes(35), 5)[:cut], *traffic.read(B, b"\2\0")])
    assert [(t.address, t.outcome) for t in transfers(records)] == [(A, Outcome.LOST), (B, Outcome.DONE)]


def test_late_acknowledge_of_a_while_b_is_pending_and_b_is_aborted() -> None:
    lines = [
        Line(True, sdo.download_request(A, b"\1\0")),
        Line(True, sdo.download_request(B, b"\2\0")),
        Line(False, sdo.download_response(A)),
        Line(False, sdo.abort(B, Abort.READ_ONLY)),
    ]
    records = decode(1, lines)
    assert [(t.address, t.outcome) for t in transfers(records)] == [(A, Outcome.LOST), (B, Outcome.ABORTED)]
    assert [(r.address, r.side) for r in records if isinstance(r, OrphanSeen)] == [(A, Side.SERVER)]
    assert not values(records)


@pytest.mark.parametrize(
    "late",
    [
        sdo.upload_response(A, b"\1\0"),
        sdo.download_response(A),
        sdo.abort(A, Abort.TIMED_OUT),
        sdo.block_download_response(A, 10),
        sdo.block_upload_response(A, 10),
    ],
)
def test_late_answer_is_an_orphan_and_disturbs_nothing(late: bytes) -> None:
    ask, answer = traffic.read(B, b"\2\0")
    alone = decode(1, [Line(False, late)])
    assert [(type(r), r.address) for r in alone if isinstance(r, OrphanSeen)] == [(OrphanSeen, A)]
    between = decode(1, [ask, Line(False, late), answer])
    assert values(between) == [(1, B, b"\2\0", Source.SDO_READ)]
    assert len([r for r in between if isinstance(r, OrphanSeen)]) == 1


def test_answer_after_more_than_a_minute_is_an_orphan() -> None:
    ask, answer = frames(1, traffic.read(A, b"\1"))
    decoder = CanOpenDecoder(BUS)
    decoder.feed(ask)
    late = decoder.feed(answer._replace(t_ns=ask.t_ns + LATE_NS + 1))
    assert [type(r) for r in late] == [OrphanSeen]


@pytest.mark.parametrize("position", [2, 3, 4, 5])
@pytest.mark.parametrize("access", list(SdoAccess))
def test_wrong_toggle_gives_no_value(access: SdoAccess, position: int) -> None:
    lines = MAKERS[access][0](A, bytes(30))
    lines[position] = Line(lines[position].client, bytes([lines[position].data[0] ^ 0x10]) + lines[position].data[1:])
    records = decode(1, lines)
    assert [r.fault for r in records if isinstance(r, MalformedSeen)] == [Fault.TOGGLE]
    assert not values(records)


def test_broken_transfer_still_shows_its_abort() -> None:
    lines = [*traffic.read(A, bytes(30))[:3], Line(False, sdo.upload_segment_response(b"abc", True, False))]
    records = decode(1, [*lines, Line(True, sdo.abort(A, Abort.TOGGLE_BIT))])
    assert [t.abort_code for t in transfers(records)] == [Abort.TOGGLE_BIT]


def test_segments_that_do_not_give_the_announced_size() -> None:
    lines = traffic.read(A, bytes(10))
    lines[1] = Line(False, sdo.upload_response(A, bytes(11)))
    records = decode(1, lines)
    assert [r.fault for r in records if isinstance(r, MalformedSeen)] == [Fault.SIZE]
    assert [t.outcome for t in transfers(records)] == [Outcome.BROKEN]


def test_save_and_load() -> None:
    save, load = Address(0x1010, 3), Address(0x1011, 3)
    assert decode(1, traffic.write(save, b"save"))[-1] == SaveSeen(1_000_000, BUS, 1, save, True)
    assert decode(1, traffic.write(load, b"load"))[-1] == LoadSeen(1_000_000, BUS, 1, load, True)
    refused = [Line(True, sdo.download_request(save, b"save")), Line(False, sdo.abort(save, Abort.DEVICE_STATE))]
    assert decode(1, refused)[-1] == SaveSeen(1_000_000, BUS, 1, save, False)
    assert not [r for r in decode(1, traffic.write(save, b"evas")) if isinstance(r, SaveSeen)]


def test_boot_up_and_gap_close_open_transfers() -> None:
    decoder = CanOpenDecoder(BUS)
    ask, answer = frames(5, traffic.write(A, b"\1"))
    decoder.feed(ask)
    booted = decoder.feed(frame(500_000, 0x705, b"\0"))
    assert [t.outcome for t in transfers(list(booted))] == [Outcome.LOST]
    assert [type(r) for r in decoder.feed(answer)] == [OrphanSeen]
    decoder.feed(ask)
    assert [t.outcome for t in transfers(list(decoder.gap(1, "gap.lost")))] == [Outcome.LOST]


def test_learned_cob_ids_of_the_server() -> None:
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, traffic.read(Address(0x1200, 1), (0x6E5).to_bytes(4, "little"))))
    ask, answer = frame(1, 0x6E5, sdo.upload_request(A)), frame(2, 0x585, sdo.upload_response(A, b"\7"))
    assert values(decoder.feed_all([ask, answer])) == [(5, A, b"\7", Source.SDO_READ)]
    assert not decoder.feed(frame(3, 0x605, sdo.upload_request(A)))


def test_learned_cob_id_never_takes_that_of_another_node() -> None:
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, traffic.read(Address(0x1200, 1), (0x615).to_bytes(4, "little"))))
    assert [v[0] for v in values(decoder.feed_all(frames(0x15, traffic.read(A, b"\7"))))] == [0x15]


@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=200))
@settings(max_examples=150, deadline=None)
def test_no_bytes_raise(noise: list[tuple[int, bytes]]) -> None:
    decoder = CanOpenDecoder(BUS)
    for t_ns, (can_id, data) in enumerate(noise):
        decoder.feed(frame(t_ns, can_id, data))
        decoder.feed(frame(t_ns, 0x601 if can_id % 2 else 0x581, data))


@given(st.randoms(use_true_random=False))
@settings(max_examples=100, deadline=None)
def test_noise_on_one_server_never_raises(rng: random.Random) -> None:
    """Frames drawn from valid conversations in any order: every phase meets every frame."""
    pool = [
        line
        for maker in (*MAKERS[SdoAccess.READ], *MAKERS[SdoAccess.WRITE])
        for line in (*maker(A, bytes(30)), Line(True, sdo.abort(A, 1)), Line(False, sdo.abort(B, 1)))
    ]
    decoder = CanOpenDecoder(BUS)
    for number, item in enumerate(frames(3, rng.choices(pool, k=300))):
        for record in decoder.feed(item):
            assert record.node == 3
        if number % 30 == 0:
            json.dumps(decoder.snapshot())


CONVERSATION = st.tuples(
    st.sampled_from(list(SdoAccess)),
    st.booleans(),
    st.integers(0x2000, 0x9FFF),
    st.integers(0, 255),
    st.binary(min_size=1, max_size=120),
    st.integers(1, 20),
    st.sets(st.integers(0, 25), max_size=4),
)


def conversation(item: tuple[SdoAccess, bool, int, int, bytes, int, set[int]]) -> list[Line]:
    access, block, index, sub, data, size, losses = item
    if block:
        return MAKERS[access][1](Address(index, sub), data, size, losses)
    return MAKERS[access][0](Address(index, sub), data)


@given(st.dictionaries(st.integers(1, 127), st.lists(CONVERSATION, max_size=4), max_size=4), st.randoms())
@settings(max_examples=100, deadline=None)
def test_interleaved_transfers_give_the_values_computed_directly(
    plan: dict[int, list[tuple[SdoAccess, bool, int, int, bytes, int, set[int]]]], rng: random.Random
) -> None:
    """Conversations with several nodes, shuffled together frame by frame, with a keyframe anywhere."""
    queues = {node: [line for item in items for line in conversation(item)] for node, items in plan.items()}
    decoder, records, t_ns = CanOpenDecoder(BUS), list[Record](), 0
    while any(queues.values()):
        node = rng.choice([n for n, queue in queues.items() if queue])
        line, t_ns = queues[node].pop(0), t_ns + 1
        records += decoder.feed(frame(t_ns, (0x600 if line.client else 0x580) + node, line.data))
        if rng.random() < 0.01:  # the state goes through JSON, as in a recording
            state = json.loads(json.dumps(decoder.snapshot()))
            decoder = CanOpenDecoder(BUS)
            decoder.restore(state)
    for node, items in plan.items():
        wanted = [(access, Address(index, sub), data) for access, _, index, sub, data, _, _ in items]
        assert [(t.access, t.address, t.data) for t in transfers(records) if t.node == node] == wanted
        assert [v[1:3] for v in values(records) if v[0] == node] == [w[1:] for w in wanted]
    assert {type(r) for r in records} <= {SdoSeen, ValueSeen}
    assert all(a.t_ns <= b.t_ns for a, b in pairwise(records))


def test_other_buses_and_remote_frames_say_nothing() -> None:
    decoder = CanOpenDecoder(BUS)
    assert not decoder.feed(Frame(0, "can1", Direction.RX, Can(0x701, b"\0")))
    assert not decoder.feed(Frame(0, BUS, Direction.RX, Can(0x701, remote=True, dlc=1)))
    assert not decoder.feed(Frame(0, BUS, Direction.RX, Can(0x701, b"\0", extended=True)))
