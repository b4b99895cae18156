"""Finds telegrams in the raw bytes of a line, and says what it skipped and why."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from app.wire.profibus.fdl import MAX_TELEGRAM, SC, SD4, decode, size_of
from app.wire.profibus.fields import FormatError
from app.wire.records import Fault

MAX_SKIPPED: Final = 256
"""Bytes that are told in one piece; more make several."""


class Found(NamedTuple):
    """A telegram that is whole and right, at byte ``offset`` of the stream."""

    offset: int
    data: bytes


class Skipped(NamedTuple):
    """Bytes at ``offset`` that belong to no telegram; ``error`` is the first thing wrong, by its place there."""

    offset: int
    data: bytes
    error: FormatError


Piece = Found | Skipped


class Splitter:
    """Cuts what comes from a line, however it is split or joined. It holds less than a telegram and a piece skipped.

    Token and SC have no check sum: after something was skipped they are taken for noise until a telegram with one, or a
    silence, shows where telegrams begin.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._base = 0
        self._skipped = bytearray()
        self._error: FormatError | None = None
        self._in_step = True

    @property
    def pending(self) -> int:
        """Bytes of a telegram that is not whole yet."""
        return len(self._buffer)

    def feed(self, data: bytes) -> Iterator[Piece]:
        """Take bytes and give what is certain now, in the order of the stream. Never raises on any bytes."""
        self._buffer += data
        return self._cut()

    def _cut(self) -> Iterator[Piece]:
        while self._buffer:
            try:
                size = size_of(self._buffer)
                if size is None or len(self._buffer) < size:
                    break
                self._check(size)
            except FormatError as error:
                yield from self._skip(error)
                continue
            yield from self._tell_skipped()
            yield Found(self._base, bytes(self._buffer[:size]))
            self._in_step = True
            self._drop(size)

    def silence(self) -> Iterator[Piece]:
        """The line was idle long enough (33 bits) that no telegram goes on: what is not whole never will be."""
        while self._buffer:
            missing = FormatError(Fault.LENGTH, len(self._buffer), "the telegram ends too early")
            yield from self._skip(missing)
            yield from self._cut()
        yield from self._tell_skipped()
        self._in_step = True

    def _check(self, size: int) -> None:
        """Raises FormatError where the telegram in front is none."""
        decode(bytes(self._buffer[:size]))
        if not self._in_step and self._buffer[0] in (SC, SD4):
            raise FormatError(Fault.DELIMITER, 0, "no check sum tells this byte from noise")

    def _skip(self, error: FormatError) -> Iterator[Piece]:
        if self._error is None:
            self._error = FormatError(error.fault, self._base + error.offset, error.reason)
        self._skipped.append(self._buffer[0])
        self._in_step = False
        self._drop(1)
        if len(self._skipped) >= MAX_SKIPPED:
            yield from self._tell_skipped()

    def _tell_skipped(self) -> Iterator[Piece]:
        if self._error is not None:
            yield Skipped(self._base - len(self._skipped), bytes(self._skipped), self._error)
        self._skipped.clear()
        self._error = None

    def _drop(self, size: int) -> None:
        del self._buffer[:size]
        self._base += size


assert MAX_TELEGRAM < MAX_SKIPPED
