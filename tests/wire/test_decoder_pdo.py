"""The decoder on NMT, heartbeat, EMCY, SYNC and on PDOs by the mapping in force."""

from __future__ import annotations

from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address
from app.model.description_file import load_builtin
from app.wire import pdo, sdo
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Direction, Frame
from app.wire.nmt import NmtCommand, NmtState
from app.wire.records import (
    BootUpSeen,
    EmcySeen,
    Fault,
    GapSeen,
    MalformedSeen,
    NmtCommandSeen,
    Record,
    Source,
    StateSeen,
    SyncSeen,
    ValueSeen,
)
from tests.wire import traffic
from tests.wire.traffic import BUS, Line, frame, frames

STATUS, POSITION, CONTROL = Address(0x6041), Address(0x6064), Address(0x6040)


class Seen(NamedTuple):
    node: int
    address: Address
    data: bytes
    source: Source


def seen(records: list[Record]) -> list[Seen]:
    return [Seen(r.node, r.address, r.data, r.source) for r in records if isinstance(r, ValueSeen)]


def u32(raw: int) -> bytes:
    return raw.to_bytes(4, "little")


def mapping(index: int, *entries: tuple[Address, int]) -> list[Line]:
    """The writes by which a client maps a PDO."""
    lines = traffic.write(Address(index, 0), b"\0")
    for sub, (address, bits) in enumerate(entries, 1):
        lines += traffic.write(Address(index, sub), u32(pdo.mapping_entry(address, bits)))
    return lines + traffic.write(Address(index, 0), bytes((len(entries),)))


def pdos(decoder: CanOpenDecoder, can_id: int, data: bytes) -> list[Seen]:
    return seen(list(decoder.feed(frame(9, can_id, data))))


def test_nmt_heartbeat_boot_up_sync() -> None:
    decoder = CanOpenDecoder(BUS)
    assert decoder.feed_all(
        [
            frame(1, 0x000, b"\x81\x0b", Direction.TX),
            frame(2, 0x70B, b"\x00"),
            frame(3, 0x70B, b"\x7f"),
            frame(4, 0x70B, b"\x85"),
            frame(5, 0x080, b""),
            frame(6, 0x080, b"\x07"),
            frame(7, 0x100, bytes(6)),
            frame(8, 0x7E5, bytes(8)),
        ]
    ) == [
        NmtCommandSeen(1, BUS, 11, NmtCommand.RESET_NODE, Direction.TX),
        BootUpSeen(2, BUS, 11),
        StateSeen(3, BUS, 11, NmtState.PRE_OPERATIONAL),
        StateSeen(4, BUS, 11, NmtState.OPERATIONAL),
        SyncSeen(5, BUS, 0, None),
        SyncSeen(6, BUS, 0, 7),
    ]


def test_emcy_gives_the_error_register_too() -> None:
    assert CanOpenDecoder(BUS).feed_all([frame(1, 0x08B, bytes.fromhex("1186210102030405"))]) == [
        EmcySeen(1, BUS, 11, 0x8611, 0x21, b"\1\2\3\4\5"),
        ValueSeen(1, BUS, 11, Address(0x1001), b"\x21", Source.EMCY),
    ]


@pytest.mark.parametrize(
    ("can_id", "data", "node", "fault"),
    [
        (0x000, b"\x01", 0, Fault.LENGTH),
        (0x000, b"\x05\x01", 0, Fault.COMMAND),
        (0x000, b"\x01\xff", 0, Fault.COMMAND),
        (0x701, b"", 1, Fault.LENGTH),
        (0x701, b"\x03", 1, Fault.STATE),
        (0x081, bytes(7), 1, Fault.LENGTH),
        (0x080, bytes(2), 0, Fault.LENGTH),
        (0x601, bytes(7), 1, Fault.LENGTH),
        (0x581, b"", 1, Fault.LENGTH),
        (0x601, b"\xe0" + bytes(7), 1, Fault.COMMAND),
    ],
)
def test_malformed(can_id: int, data: bytes, node: int, fault: Fault) -> None:
    assert CanOpenDecoder(BUS).feed_all([frame(1, can_id, data)]) == [MalformedSeen(1, BUS, node, can_id, fault, data)]


def test_gap() -> None:
    assert CanOpenDecoder(BUS).gap(5, "gap.adapter") == (GapSeen(5, BUS, 0, "gap.adapter"),)


def test_default_mapping_of_the_description_with_the_node_number() -> None:
    """Only the first PDOs are active after switch-on; their COB-IDs are 200h and 180h plus the node."""
    decoder = CanOpenDecoder(BUS, {11: load_builtin("oat-pmc")})
    assert pdos(decoder, 0x18B, b"\x37\x02")[0] == Seen(11, STATUS, b"\x37\x02", Source.PDO_TX)
    assert pdos(decoder, 0x20B, b"\x0f\x00")[0] == Seen(11, CONTROL, b"\x0f\x00", Source.PDO_RX)
    assert not pdos(decoder, 0x28B, bytes(8))
    assert not pdos(decoder, 0x18C, bytes(8))


def test_description_set_later() -> None:
    decoder = CanOpenDecoder(BUS)
    assert not pdos(decoder, 0x18B, b"\x37\x02")
    decoder.set_description(11, load_builtin("oat-pmc"))
    assert pdos(decoder, 0x18B, b"\x37\x02")
    decoder.set_description(11, None)
    assert not pdos(decoder, 0x18B, b"\x37\x02")


def test_mapping_learned_from_acknowledged_writes() -> None:
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, mapping(0x1A01, (STATUS, 16), (POSITION, 32))))
    assert [s[:3] for s in pdos(decoder, 0x285, b"\1\2\3\4\5\6")] == [(5, STATUS, b"\1\2"), (5, POSITION, b"\3\4\5\6")]
    decoder.feed_all(frames(5, traffic.write(Address(0x1801, 1), u32(0x80000285))))
    assert not pdos(decoder, 0x285, bytes(6))
    decoder.feed_all(frames(5, traffic.write(Address(0x1801, 1), u32(0x1C5))))
    assert pdos(decoder, 0x1C5, bytes(6)) and not pdos(decoder, 0x285, bytes(6))


def test_mapping_learned_from_reads_and_extended_identifiers() -> None:
    decoder = CanOpenDecoder(BUS)
    for address, data in (
        (Address(0x1A04, 0), b"\1"),
        (Address(0x1A04, 1), u32(0x60640020)),
        (Address(0x1804, 1), u32(0x20012345)),
    ):
        decoder.feed_all(frames(5, traffic.read(address, data)))
    wide = Frame(0, BUS, Direction.RX, Can(0x12345, b"\1\2\3\4", extended=True))
    assert seen(list(decoder.feed(wide))) == [Seen(5, POSITION, b"\1\2\3\4", Source.PDO_TX)]


def test_refused_write_teaches_nothing() -> None:
    decoder = CanOpenDecoder(BUS, {11: load_builtin("oat-pmc")})
    lines = [
        Line(True, sdo.download_request(Address(0x1800, 1), u32(0x80000000))),
        Line(False, sdo.abort(Address(0x1800, 1), 0x06010002)),
    ]
    decoder.feed_all(frames(11, lines))
    assert pdos(decoder, 0x18B, b"\x37\x02")


def test_boot_up_forgets_what_was_not_saved() -> None:
    decoder = CanOpenDecoder(BUS, {11: load_builtin("oat-pmc")})
    before = pdos(decoder, 0x18B, bytes(8))
    decoder.feed_all(frames(11, mapping(0x1A00, (POSITION, 32))))
    assert [s.address for s in pdos(decoder, 0x18B, bytes(8))] == [POSITION]
    decoder.feed(frame(1, 0x70B, b"\0"))
    assert pdos(decoder, 0x18B, bytes(8)) == before


def test_boot_up_keeps_what_was_saved() -> None:
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, mapping(0x1A00, (POSITION, 32)) + traffic.write(Address(0x1010, 2), b"save")))
    decoder.feed_all(frames(5, mapping(0x1A00, (STATUS, 16))))
    decoder.feed(frame(1, 0x705, b"\0"))
    assert [s.address for s in pdos(decoder, 0x185, bytes(4))] == [POSITION]


def test_load_takes_the_defaults_at_the_next_boot_up() -> None:
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, mapping(0x1A00, (POSITION, 32)) + traffic.write(Address(0x1010, 1), b"save")))
    decoder.feed_all(frames(5, traffic.write(Address(0x1011, 1), b"load")))
    assert pdos(decoder, 0x185, bytes(4))
    decoder.feed(frame(1, 0x705, b"\0"))
    assert not pdos(decoder, 0x185, bytes(4))


def test_lost_write_of_a_mapping_falls_back_to_the_stored_one() -> None:
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, mapping(0x1A00, (POSITION, 32))))
    lost = [Line(True, sdo.download_request(Address(0x1A00, 0), b"\0")), *traffic.read(STATUS, b"\0\0")]
    decoder.feed_all(frames(5, lost))
    assert not pdos(decoder, 0x185, bytes(4))


def test_received_pdos_count_only_while_operational() -> None:
    decoder = CanOpenDecoder(BUS, {11: load_builtin("oat-pmc")})
    decoder.feed(frame(1, 0x70B, b"\x7f"))
    assert not pdos(decoder, 0x20B, b"\x0f\x00")
    decoder.feed(frame(2, 0x000, b"\x01\x00"))
    assert pdos(decoder, 0x20B, b"\x0f\x00")


def test_short_pdo_is_malformed_and_long_pdo_is_cut() -> None:
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, mapping(0x1A00, (POSITION, 32))))
    assert decoder.feed_all([frame(9, 0x185, bytes(3))]) == [
        MalformedSeen(9, BUS, 5, 0x185, Fault.PDO_LENGTH, bytes(3))
    ]
    assert pdos(decoder, 0x185, b"\1\2\3\4\5")[0].data == b"\1\2\3\4"


def test_one_pdo_sent_by_one_node_and_taken_by_two() -> None:
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, mapping(0x1A00, (POSITION, 32))))
    for node in (6, 7):
        decoder.feed_all(frames(node, mapping(0x1600, (Address(0x607A), 32))))
        decoder.feed_all(frames(node, traffic.write(Address(0x1400, 1), u32(0x185))))
    assert {(s.node, s.address, s.source) for s in pdos(decoder, 0x185, bytes(4))} == {
        (5, POSITION, Source.PDO_TX),
        (6, Address(0x607A), Source.PDO_RX),
        (7, Address(0x607A), Source.PDO_RX),
    }


def test_multiplex_pdo_is_left_alone() -> None:
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, mapping(0x1A00, (POSITION, 32))))
    decoder.feed_all(frames(5, traffic.write(Address(0x1A00, 0), b"\xff")))
    assert not pdos(decoder, 0x185, bytes(8))


def test_keyframe_carries_the_mapping() -> None:
    decoder, other = CanOpenDecoder(BUS), CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, mapping(0x1A00, (POSITION, 32))))
    other.restore(decoder.snapshot())
    assert pdos(other, 0x185, bytes(4)) == pdos(decoder, 0x185, bytes(4)) != []
    other.restore(CanOpenDecoder(BUS).snapshot())
    assert not pdos(other, 0x185, bytes(4))


@given(st.lists(st.integers(1, 16), min_size=1, max_size=4), st.binary(min_size=8, max_size=8))
def test_learned_mapping_reads_as_unpack_does(widths: list[int], data: bytes) -> None:
    entries = tuple((Address(0x2000, i), width) for i, width in enumerate(widths))
    decoder = CanOpenDecoder(BUS)
    decoder.feed_all(frames(5, mapping(0x1A00, *entries)))
    assert [(s.address, s.data) for s in pdos(decoder, 0x185, data)] == pdo.unpack(pdo.Mapping(entries), data)
