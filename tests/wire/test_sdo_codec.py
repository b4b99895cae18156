"""SDO frames against byte vectors worked out from the bit tables of CiA 301, 7.2.4.3."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address
from app.wire import sdo
from app.wire.sdo import Abort, BlockStep

A = Address(0x1008, 0)


@pytest.mark.parametrize(
    ("built", "data"),
    [
        (sdo.upload_request(Address(0x3110, 1)), "4010310100000000"),
        (sdo.upload_response(Address(0x3110, 1), b"\xf4\x01"), "4b103101f4010000"),
        (sdo.upload_response(A, b"HUBSIDE"), "4108100007000000"),
        (sdo.download_request(Address(0x1010, 3), b"save"), "2310100373617665"),
        (sdo.download_request(Address(0x6060), b"\x01"), "2f60600001000000"),
        (sdo.download_response(Address(0x6060)), "6060600000000000"),
        (sdo.upload_segment_request(True), "7000000000000000"),
        (sdo.upload_segment_response(b"abc", True, True), "1961626300000000"),
        (sdo.download_segment_request(b"abcdefg", False, False), "0061626364656667"),
        (sdo.download_segment_response(True), "3000000000000000"),
        (sdo.abort(A, Abort.TOGGLE_BIT), "8008100000000305"),
        (sdo.block_download_request(A, 20), "c608100014000000"),
        (sdo.block_download_request(A, None, crc=False), "c008100000000000"),
        (sdo.block_download_response(A, 127), "a40810007f000000"),
        (sdo.block_upload_request(A, 127, pst=21), "a40810007f150000"),
        (sdo.block_upload_response(A, 20), "c608100014000000"),
        (sdo.block_upload_start(), "a300000000000000"),
        (sdo.block_segment(1, b"abcdefg", False), "0161626364656667"),
        (sdo.block_segment(3, b"abcdef", True), "8361626364656600"),
        (sdo.block_acknowledge(3, 127), "a2037f0000000000"),
        (sdo.block_end(1, 0x31C3), "c5c3310000000000"),
        (sdo.block_end_response(), "a100000000000000"),
    ],
)
def test_vectors(built: bytes, data: str) -> None:
    assert built.hex() == data


def test_crc_check_value() -> None:
    """The check value of CRC-16/XMODEM."""
    assert sdo.crc(b"123456789") == 0x31C3
    assert sdo.crc(b"456789", sdo.crc(b"123")) == 0x31C3


def test_parsers_of_block_frames() -> None:
    assert sdo.parse_block_initiate(bytes.fromhex("c608100014000000")) == (A, True, 20)
    assert sdo.parse_block_initiate(bytes.fromhex("c008100000000000")) == (A, False, None)
    assert sdo.parse_block_accept(bytes.fromhex("a40810007f150000")) == (A, True, 127, 21)
    assert sdo.parse_block_segment(bytes.fromhex("8361626364656600")) == (3, True, b"abcdef\0")
    assert sdo.parse_block_acknowledge(bytes.fromhex("a2037f0000000000")) == (3, 127)
    assert sdo.parse_block_end(bytes.fromhex("c5c3310000000000")) == (1, 0x31C3)
    steps = [sdo.block_step(bytes((head,))) for head in (0xC6, 0xC5, 0xA2, 0xA3)]
    assert steps == [BlockStep.INITIATE, BlockStep.END, BlockStep.ACKNOWLEDGE, BlockStep.START]


@pytest.mark.parametrize("sequence", [0, 128])
def test_sequence_number_out_of_range(sequence: int) -> None:
    with pytest.raises(ValueError):
        sdo.block_segment(sequence, b"", False)


@given(st.integers(0, 7), st.integers(0, 0xFFFF))
def test_block_end_round_trip(unused: int, crc: int) -> None:
    assert sdo.parse_block_end(sdo.block_end(unused, crc)) == (unused, crc)


@given(st.binary(min_size=1, max_size=7), st.booleans(), st.booleans())
def test_segment_round_trip(data: bytes, toggle: bool, last: bool) -> None:
    assert sdo.segment(sdo.download_segment_request(data, toggle, last)) == (0, toggle, last, data)


def test_every_abort_code_has_its_own_key() -> None:
    assert len({sdo.abort_text_key(code) for code in Abort}) == len(Abort)
    assert sdo.abort_text_key(0x12345678) == "abort.unknown"
