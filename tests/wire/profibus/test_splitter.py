"""Telegrams in raw bytes: cut anywhere, damaged, among noise; no byte is lost sight of."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

from hypothesis import given
from hypothesis import strategies as st

from app.wire.profibus.fdl import MAX_TELEGRAM, decode
from app.wire.profibus.splitter import MAX_SKIPPED, Found, Piece, Skipped, Splitter
from app.wire.records import Fault
from tests.wire.profibus.test_fdl import TELEGRAMS

STATUS: Final = bytes.fromhex("10 02 01 49 4C 16")
DIAGNOSIS: Final = bytes.fromhex("68 05 05 68 88 81 6D 3C 3E F0 16")
TOKEN: Final = bytes.fromhex("DC 02 01")


def pieces(*chunks: bytes) -> list[Piece]:
    splitter = Splitter()
    found = [piece for chunk in chunks for piece in splitter.feed(chunk)]
    return found + list(splitter.silence())


def told(found: list[Piece]) -> list[tuple[type[Piece], int, bytes]]:
    return [(type(piece), piece.offset, piece.data) for piece in found]


@given(st.lists(TELEGRAMS, max_size=6), st.data())
def test_a_stream_cut_anywhere_gives_its_telegrams(telegrams: list, data: st.DataObject) -> None:  # type: ignore[type-arg]
    stream = b"".join(one.encode() for one in telegrams)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    found = pieces(*(stream[start:stop] for start, stop in pairwise((0, *cuts, len(stream)))))
    assert [type(piece) for piece in found] == [Found] * len(telegrams)
    assert [decode(piece.data) for piece in found] == telegrams


def test_noise_is_told_and_what_follows_is_found() -> None:
    found = pieces(STATUS + b"\x00\x68\x05" + DIAGNOSIS + STATUS)
    assert told(found) == [
        (Found, 0, STATUS),
        (Skipped, 6, b"\x00\x68\x05"),
        (Found, 9, DIAGNOSIS),
        (Found, 20, STATUS),
    ]
    skipped = found[1]
    assert isinstance(skipped, Skipped)
    assert (skipped.error.fault, skipped.error.offset) == (Fault.DELIMITER, 6)


def test_a_damaged_telegram_is_skipped_whole_by_its_check_sum() -> None:
    damaged = DIAGNOSIS[:6] + b"\x6c" + DIAGNOSIS[7:]
    found = pieces(damaged + STATUS)
    assert told(found) == [(Skipped, 0, damaged), (Found, 11, STATUS)]
    assert isinstance(found[0], Skipped)
    assert (found[0].error.fault, found[0].error.offset) == (Fault.CHECKSUM, 9)


def test_token_and_acknowledge_in_noise_are_noise_until_a_check_sum_or_a_silence() -> None:
    assert told(pieces(b"\x01" + TOKEN + b"\xe5" + STATUS + TOKEN)) == [
        (Skipped, 0, b"\x01" + TOKEN + b"\xe5"),
        (Found, 5, STATUS),
        (Found, 11, TOKEN),
    ]
    splitter = Splitter()
    assert list(splitter.feed(b"\x01")) == []
    assert told(list(splitter.silence())) == [(Skipped, 0, b"\x01")]
    assert told(list(splitter.feed(b"\xe5" + TOKEN))) == [(Found, 1, b"\xe5"), (Found, 2, TOKEN)]


def test_a_silence_ends_a_telegram_that_is_not_whole() -> None:
    splitter = Splitter()
    assert list(splitter.feed(DIAGNOSIS[:8])) == []
    assert splitter.pending == 8
    (piece,) = splitter.silence()
    assert isinstance(piece, Skipped)
    assert (piece.offset, piece.data, piece.error.fault, piece.error.offset) == (0, DIAGNOSIS[:8], Fault.LENGTH, 8)
    assert told(list(splitter.feed(STATUS))) == [(Found, 8, STATUS)]


def test_a_telegram_hidden_in_a_broken_one_is_found() -> None:
    """A wrong length swallows nothing for good."""
    assert told(pieces(b"\x68\x40\x40\x68" + STATUS)) == [(Skipped, 0, b"\x68\x40\x40\x68"), (Found, 4, STATUS)]


@given(st.lists(st.binary(max_size=400), max_size=6))
def test_of_any_bytes_each_is_told_once_and_in_order(chunks: list[bytes]) -> None:
    stream, splitter, found = b"".join(chunks), Splitter(), []
    for chunk in chunks:
        found += list(splitter.feed(chunk))
        assert splitter.pending < MAX_TELEGRAM
    found += list(splitter.silence())
    assert b"".join(piece.data for piece in found) == stream
    at = 0
    for piece in found:
        assert piece.offset == at
        at += len(piece.data)
        if isinstance(piece, Found):
            assert decode(piece.data).encode() == piece.data
        else:
            assert len(piece.data) <= MAX_SKIPPED
            assert piece.offset <= piece.error.offset <= len(stream)
    assert splitter.pending == 0
