"""NMT, heartbeat, SYNC, EMCY and PDO against byte vectors worked out from CiA 301."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address
from app.wire import emcy, nmt, pdo, sync
from app.wire.nmt import NmtCommand, NmtState

A = Address


@pytest.mark.parametrize(
    ("command", "node", "data"),
    [
        (NmtCommand.START, 0, "0100"),
        (NmtCommand.STOP, 11, "020b"),
        (NmtCommand.PRE_OPERATIONAL, 1, "8001"),
        (NmtCommand.RESET_NODE, 127, "817f"),
        (NmtCommand.RESET_COMMUNICATION, 3, "8203"),
    ],
)
def test_nmt_vectors(command: NmtCommand, node: int, data: str) -> None:
    assert nmt.nmt_message(command, node).hex() == data
    assert nmt.parse_nmt_message(bytes.fromhex(data)) == (command, node)


@pytest.mark.parametrize("data", [b"", b"\x01", b"\x07\x01", b"\x01\x80", b"\x01\x01\x00"])
def test_nmt_that_is_none(data: bytes) -> None:
    with pytest.raises(ValueError):
        nmt.parse_nmt_message(data)


def test_nmt_node_out_of_range() -> None:
    with pytest.raises(ValueError):
        nmt.nmt_message(NmtCommand.START, 128)


def test_heartbeat_and_guarding() -> None:
    assert nmt.heartbeat(NmtState.BOOT_UP) == b"\x00"
    assert nmt.parse_heartbeat(b"\x05") == (NmtState.OPERATIONAL, False)
    assert nmt.parse_heartbeat(b"\xff") == (NmtState.PRE_OPERATIONAL, True)
    for bad in (b"", b"\x03", b"\x05\x00"):
        with pytest.raises(ValueError):
            nmt.parse_heartbeat(bad)


def test_commands_lead_to_states() -> None:
    assert NmtCommand.START.leads_to is NmtState.OPERATIONAL
    assert NmtCommand.RESET_NODE.leads_to is None
    assert NmtCommand.RESET_NODE.text_key == "nmt.command.reset_node"
    assert NmtState.PRE_OPERATIONAL.text_key == "nmt.state.pre_operational"


def test_sync() -> None:
    assert sync.sync() == b"" and sync.sync(240) == b"\xf0"
    assert sync.parse_sync(b"") is None and sync.parse_sync(b"\x07") == 7
    with pytest.raises(ValueError):
        sync.sync(241)
    with pytest.raises(ValueError):
        sync.parse_sync(bytes(2))


def test_emcy_vector() -> None:
    data = bytes.fromhex("1186210102000000")
    assert emcy.emcy(0x8611, 0x21, b"\x01\x02") == data
    assert emcy.parse_emcy(data) == (0x8611, 0x21, b"\x01\x02\0\0\0")
    with pytest.raises(ValueError):
        emcy.parse_emcy(data[:7])
    with pytest.raises(ValueError):
        emcy.emcy(0x8611, 0x21, bytes(6))


@pytest.mark.parametrize(
    ("code", "key"),
    [
        (0x0000, "emcy.0000"),
        (0x8611, "emcy.8000"),
        (0x8130, "emcy.8130"),
        (0x8135, "emcy.8100"),
        (0x3110, "emcy.3100"),
        (0x7305, "emcy.7000"),
        (0xFFF3, "emcy.ff00"),
        (0x0F01, "emcy.unknown"),
        (0xA000, "emcy.unknown"),
    ],
)
def test_emcy_classes(code: int, key: str) -> None:
    assert emcy.emcy_text_key(code) == key


def test_pdo_parameters() -> None:
    off = pdo.PdoParameters(0xC000018B, 255)
    assert not off.valid and not off.rtr_allowed and off.can_id == 0x18B
    wide = pdo.PdoParameters(0x20012345)
    assert wide.valid and wide.extended and wide.can_id == 0x12345


def test_mapping_entry_vector() -> None:
    assert pdo.mapping_entry(A(0x6041), 16) == 0x60410010
    assert pdo.parse_mapping_entry(0x60FD0020) == (A(0x60FD), 32)
    with pytest.raises(ValueError):
        pdo.mapping_entry(A(0x6041), 65)


def test_pdo_on_byte_borders() -> None:
    mapping = pdo.Mapping(((A(0x6041), 16), (A(0x0005), 8), (A(0x6064), 32)))
    data = bytes.fromhex("3702 00 401f0000")
    values = {A(0x6041): b"\x37\x02", A(0x6064): (8000).to_bytes(4, "little")}
    assert pdo.pack(mapping, values) == data
    assert dict(pdo.unpack(mapping, data)) == values
    assert mapping.size == 7
    with pytest.raises(ValueError):
        pdo.unpack(mapping, data[:-1])
    with pytest.raises(KeyError):
        pdo.pack(mapping, {})


def test_pdo_with_bits() -> None:
    """Three booleans, a dummy bit and a nibble share one byte, lowest bit first."""
    mapping = pdo.Mapping(((A(0x2000, 1), 1), (A(0x2000, 2), 1), (A(0x0001), 1), (A(0x2000, 3), 1), (A(0x2001), 12)))
    assert mapping.slots is None and mapping.size == 2
    got = pdo.unpack(mapping, bytes((0b0011_1001, 0xAB)))
    assert got == [(A(0x2000, 1), b"\1"), (A(0x2000, 2), b"\0"), (A(0x2000, 3), b"\1"), (A(0x2001), b"\xb3\x0a")]
    assert pdo.pack(mapping, dict(got)) == bytes((0b0011_1001, 0xAB))


@given(st.lists(st.integers(1, 16), min_size=1, max_size=4), st.binary(min_size=8, max_size=8))
def test_unpack_then_pack_gives_the_same_bits(widths: list[int], data: bytes) -> None:
    mapping = pdo.Mapping(tuple((A(0x2000, i), width) for i, width in enumerate(widths)))
    used = int.from_bytes(data, "little") & (1 << mapping.bits) - 1
    packed = pdo.pack(mapping, dict(pdo.unpack(mapping, data)))
    assert int.from_bytes(packed, "little") == used
