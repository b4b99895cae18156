"""The header, and cutting a stream: split anywhere, joined, violated, and made of anything."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.wire.modbus.adu import MAX_ADU, MAX_LENGTH, AduSplitter, Message, decode_adu
from app.wire.modbus.fields import FormatError
from app.wire.records import Fault
from tests.wire.modbus.strategies import BYTE, WORD
from tests.wire.modbus.vectors import VECTORS

MESSAGES = st.lists(st.builds(Message, WORD, BYTE, st.binary(min_size=1, max_size=255)), max_size=8)


@given(MESSAGES, st.data())
def test_a_stream_cut_anywhere_gives_the_same_messages(messages: list[Message], data: st.DataObject) -> None:
    stream = b"".join(message.encode() for message in messages)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    splitter, found = AduSplitter(), []
    for start, stop in pairwise((0, *cuts, len(stream))):
        found += [decode_adu(adu) for adu in splitter.feed(stream[start:stop])]
    assert found == messages
    assert splitter.pending == 0
    splitter.end()


def test_byte_by_byte() -> None:
    splitter, found = AduSplitter(), []
    for vector in VECTORS:
        for byte in vector.data:
            found += list(splitter.feed(bytes((byte,))))
    assert found == [vector.data for vector in VECTORS]


def test_what_came_before_a_violation_is_given_and_nothing_after() -> None:
    good = VECTORS[0].data
    splitter = AduSplitter()
    stream = splitter.feed(good + good + b"\0\1\0\7\0\6" + good)
    assert [next(stream), next(stream)] == [good, good]
    with pytest.raises(FormatError) as caught:
        next(stream)
    assert (caught.value.fault, caught.value.offset) == (Fault.PROTOCOL, 2 * len(good) + 3)
    with pytest.raises(FormatError) as again:
        list(splitter.feed(good))
    assert again.value is caught.value
    assert splitter.pending <= len(good)


@pytest.mark.parametrize(
    ("text", "fault", "offset"),
    [
        ("0001 01", Fault.PROTOCOL, 2),
        ("0001 0000 0000", Fault.LENGTH, 4),
        ("0001 0000 0001", Fault.LENGTH, 4),
        ("0001 0000 0101", Fault.LENGTH, 4),
        ("0001 0000 FFFF", Fault.LENGTH, 4),
    ],
)
def test_a_bad_header_is_told_before_all_of_it_is_there(text: str, fault: Fault, offset: int) -> None:
    """Waiting for the 65,535 bytes of a wrong length would be waiting for ever."""
    with pytest.raises(FormatError) as caught:
        list(AduSplitter().feed(bytes.fromhex(text)))
    assert (caught.value.fault, caught.value.offset) == (fault, offset)


def test_a_stream_that_ends_within_a_message() -> None:
    splitter = AduSplitter()
    assert list(splitter.feed(VECTORS[0].data + VECTORS[0].data[:5])) == [VECTORS[0].data]
    with pytest.raises(FormatError) as caught:
        splitter.end()
    assert (caught.value.fault, caught.value.offset) == (Fault.LENGTH, 17)


@given(st.lists(st.binary(max_size=400), max_size=6))
def test_any_stream_gives_messages_or_one_declared_error(chunks: list[bytes]) -> None:
    splitter, taken = AduSplitter(), 0
    for chunk in chunks:
        try:
            for adu in splitter.feed(chunk):
                assert decode_adu(adu).encode() == adu
                taken += len(adu)
        except FormatError as error:
            assert taken <= error.offset <= sum(map(len, chunks))
            break
        assert splitter.pending < MAX_ADU


@pytest.mark.parametrize(
    ("text", "offset"),
    [
        ("0001 0000 00", 5),
        ("0001 0000 0006 00 06 1770", 4),
        ("0001 0000 0003 00 06 1770", 4),
        ("0001 0100 0002 00 07", 2),
    ],
)
def test_a_single_adu_must_be_whole(text: str, offset: int) -> None:
    with pytest.raises(FormatError) as caught:
        decode_adu(bytes.fromhex(text))
    assert caught.value.offset == offset


@pytest.mark.parametrize(
    "message",
    [Message(0x10000, 0, b"\1"), Message(1, 256, b"\1"), Message(1, 0, b""), Message(1, 0, bytes(MAX_LENGTH))],
)
def test_no_header_is_built_that_does_not_fit(message: Message) -> None:
    with pytest.raises(ValueError):
        message.encode()
