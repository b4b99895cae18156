"""Which answers a transfer accepts: bytes against bytes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.drivers.sdo_transfer import MAX_BYTES, Download, Step, Transfer, Upload
from app.model.address import Address
from app.wire import sdo

A = Address(0x6065, 1)
B = Address(0x6066, 1)
T = 500_000_000


def test_an_expedited_upload_takes_each_length() -> None:
    for data in (b"\1", b"\1\2", b"\1\2\3", b"\1\2\3\4"):
        transfer = Upload(A, T)
        assert transfer.request == sdo.upload_request(A)
        assert transfer.feed(sdo.upload_response(A, data)) is Step.DONE
        assert transfer.data == data


def test_an_expedited_upload_without_a_size_has_four_bytes() -> None:
    transfer = Upload(A, T)
    assert transfer.feed(bytes([0x42, 0x65, 0x60, 1, 9, 8, 7, 6])) is Step.DONE
    assert transfer.data == bytes([9, 8, 7, 6])


@pytest.mark.parametrize(
    "answer",
    [
        sdo.upload_response(B, b"\1"),
        sdo.upload_response(A._replace(minor=2), b"\1"),
        sdo.download_response(A),
        sdo.abort(B, sdo.Abort.NO_OBJECT),
        sdo.upload_segment_response(b"\1", False, True),
        sdo.download_segment_response(False),
        sdo.upload_response(A, b"\1")[:7],
        b"",
    ],
)
def test_an_upload_ignores_what_is_no_answer_to_it(answer: bytes) -> None:
    transfer = Upload(A, T)
    assert transfer.feed(answer) is Step.IGNORED
    assert transfer.feed(sdo.upload_response(A, b"\7")) is Step.DONE
    assert transfer.data == b"\7"


@pytest.mark.parametrize(
    "answer",
    [
        sdo.download_response(B),
        sdo.download_response(A._replace(minor=0)),
        sdo.upload_response(A, b"\1"),
        sdo.abort(B, sdo.Abort.NO_OBJECT),
        sdo.download_segment_response(False),
        sdo.download_response(A)[:4],
    ],
)
def test_a_download_ignores_what_is_no_answer_to_it(answer: bytes) -> None:
    transfer = Download(A, T, b"\1\2")
    assert transfer.feed(answer) is Step.IGNORED
    assert transfer.feed(sdo.download_response(A)) is Step.DONE


@pytest.mark.parametrize("transfer", [Upload(A, T), Download(A, T, b"\1"), Download(A, T, bytes(20))])
def test_an_abort_with_the_address_refuses(transfer: Transfer) -> None:
    assert transfer.feed(sdo.abort(A, sdo.Abort.DEVICE_STATE)) is Step.REFUSED
    assert transfer.abort_code == sdo.Abort.DEVICE_STATE


def test_segments_with_a_wrong_toggle_or_command_are_ignored() -> None:
    transfer = Upload(A, T)
    assert transfer.feed(sdo.upload_response(A, bytes(10))) is Step.SEND
    assert transfer.request == sdo.upload_segment_request(False)
    assert transfer.feed(sdo.upload_segment_response(b"1234567", True, False)) is Step.IGNORED
    assert transfer.feed(sdo.download_segment_response(False)) is Step.IGNORED
    assert transfer.feed(sdo.upload_response(A, bytes(10))) is Step.IGNORED
    assert transfer.feed(sdo.abort(B, sdo.Abort.GENERAL)) is Step.IGNORED
    assert transfer.feed(sdo.upload_segment_response(b"1234567", False, False)) is Step.SEND
    assert transfer.feed(sdo.upload_segment_response(b"1234567", False, False)) is Step.IGNORED
    assert transfer.feed(sdo.upload_segment_response(b"890", True, True)) is Step.DONE
    assert transfer.data == b"1234567890"


def test_more_or_less_than_announced_breaks_the_upload() -> None:
    for size, code in ((5, sdo.Abort.LENGTH_TOO_HIGH), (9, sdo.Abort.LENGTH_TOO_LOW)):
        transfer = Upload(A, T)
        transfer.feed(sdo.upload_response(A, bytes(size)))
        assert transfer.feed(sdo.upload_segment_response(b"1234567", False, True)) is Step.BROKEN
        assert transfer.request == sdo.abort(A, code)


def test_an_upload_beyond_all_sense_is_aborted() -> None:
    transfer = Upload(A, T)
    huge = bytes([0x41, 0x65, 0x60, 1]) + (MAX_BYTES + 1).to_bytes(4, "little")
    assert transfer.feed(huge) is Step.BROKEN
    assert transfer.request == sdo.abort(A, sdo.Abort.OUT_OF_MEMORY)


@given(st.binary(max_size=60))
def test_a_download_carries_every_length(data: bytes) -> None:
    transfer = Download(A, T, data)
    first = sdo.multiplexed(transfer.request)
    received = sdo.expedited_data(first) or b""
    if not received:
        assert sdo.announced_size(first) == len(data)
    step, toggle = transfer.feed(sdo.download_response(A)), False
    while step is Step.SEND:
        part = sdo.segment(transfer.request)
        assert part.toggle is toggle
        received += part.data
        assert part.last is (len(received) == len(data))
        assert transfer.feed(sdo.download_segment_response(not toggle)) is Step.IGNORED
        step, toggle = transfer.feed(sdo.download_segment_response(toggle)), not toggle
    assert step is Step.DONE
    assert received == data


@given(st.binary(max_size=60), st.booleans())
def test_an_upload_carries_every_length(data: bytes, announced: bool) -> None:
    transfer = Upload(A, T)
    answer = sdo.upload_response(A, data)
    if not answer[0] & 2 and not announced:
        answer = bytes([0x40]) + answer[1:4] + bytes(4)
    step, toggle, offset = transfer.feed(answer), False, 0
    while step is Step.SEND:
        assert transfer.request == sdo.upload_segment_request(toggle)
        part = data[offset : offset + 7]
        offset += len(part)
        step = transfer.feed(sdo.upload_segment_response(part, toggle, offset >= len(data)))
        toggle = not toggle
    assert step is Step.DONE
    assert transfer.data == data


@given(st.lists(st.binary(min_size=8, max_size=8), max_size=20), st.booleans())
def test_no_bytes_whatever_bring_a_transfer_down(answers: list[bytes], reading: bool) -> None:
    transfer = Upload(A, T) if reading else Download(A, T, bytes(9))
    for answer in answers:
        if transfer.feed(answer) in (Step.DONE, Step.REFUSED, Step.BROKEN):
            break
