"""CAN frames as columns, and blocks of them as they come out of a file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from app.recording.cdr import make_can
from app.wire.frame import Can, Direction, Frame

Times = npt.NDArray[np.uint64]
Words = npt.NDArray[np.uint64]
Rows = npt.NDArray[np.intp]
Flags = npt.NDArray[np.bool_]
Bytes = npt.NDArray[np.uint8]
Ids = npt.NDArray[np.uint32]
MAX_LENGTH: Final = 8


class CanColumns(NamedTuple):
    """Frames of one bus by time: one array a field, all of the same length n.

    ``tx``: sent by us; ``dlc`` as on the bus, 0 to 15. ``data`` is n by 8, filled up with zeros; see ``lengths``.
    """

    bus: str
    t_ns: Times
    can_id: Ids
    tx: Flags
    extended: Flags
    remote: Flags
    error: Flags
    dlc: Bytes
    data: Bytes

    @property
    def frames(self) -> int:
        """How many frames these are."""
        return len(self.t_ns)

    @property
    def ids(self) -> Ids:
        """The identifiers."""
        return self.can_id

    @property
    def lengths(self) -> Bytes:
        """Number of data bytes of each frame: 0 for remote frames, at most 8."""
        return np.where(self.remote, np.uint8(0), np.minimum(self.dlc, np.uint8(MAX_LENGTH)))

    @property
    def plain(self) -> Flags:
        """True for data frames with 11-bit identifiers."""
        return ~(self.extended | self.remote | self.error)

    @property
    def words(self) -> Words:
        """The data of each frame as one number, first byte lowest."""
        words: Words = np.ascontiguousarray(self.data).view("<u8").reshape(-1)
        return words

    def can(self, row: int) -> Can:
        """The payload of the frame at ``row``."""
        data = self.data[row].tobytes()
        extended, remote, error = (bool(column[row]) for column in (self.extended, self.remote, self.error))
        return make_can(int(self.can_id[row]), data, extended, remote, error, int(self.dlc[row]))

    def direction(self, row: int) -> Direction:
        """Which way the frame at ``row`` went."""
        return Direction.TX if self.tx[row] else Direction.RX

    def frame(self, row: int) -> Frame:
        """The frame at ``row``."""
        return Frame(int(self.t_ns[row]), self.bus, self.direction(row), self.can(row))

    def gather(self, rows: Any) -> CanColumns:
        """The frames at ``rows``: positions, flags, or a slice."""
        return CanColumns(self.bus, *(column[rows] for column in self[1:]))


class Block(Protocol):
    """Some frames of one bus by time. Columns are made only of the frames that are asked for."""

    @property
    def bus(self) -> str:
        """Their bus."""

    @property
    def t_ns(self) -> Times:
        """Their times."""

    @property
    def ids(self) -> Ids:
        """Their identifiers."""

    def gather(self, rows: Any) -> CanColumns:
        """The columns of the frames at ``rows``: positions, flags, or a slice."""

    def words(self, rows: Rows) -> Words:
        """The data of the frames at ``rows`` as numbers, first byte lowest."""

    def part(self, start: int, stop: int) -> Block:
        """The frames from position ``start`` on and before ``stop``."""


class Columns:
    """Columns as a block."""

    def __init__(self, columns: CanColumns) -> None:
        self._columns = columns
        self.bus, self.t_ns, self.ids = columns.bus, columns.t_ns, columns.can_id

    def gather(self, rows: Any) -> CanColumns:
        """The columns of the frames at ``rows``."""
        return self._columns.gather(rows)

    def words(self, rows: Rows) -> Words:
        """The data of the frames at ``rows`` as numbers."""
        words: Words = self._columns.data[rows].view("<u8").reshape(-1)
        return words

    def part(self, start: int, stop: int) -> Columns:
        """The frames from position ``start`` on and before ``stop``."""
        return Columns(self._columns.gather(slice(start, stop)))


def columns_of(bus: str, frames: Sequence[Frame]) -> CanColumns:
    """The columns of CAN frames of one bus; at least one frame."""
    cans = [frame.payload for frame in frames if isinstance(frame.payload, Can)]
    data = np.frombuffer(b"".join(can.data.ljust(MAX_LENGTH, b"\0") for can in cans), dtype=np.uint8)
    return CanColumns(
        bus,
        np.array([frame.t_ns for frame in frames], dtype=np.uint64),
        np.array([can.can_id for can in cans], dtype=np.uint32),
        np.array([frame.direction is Direction.TX for frame in frames]),
        np.array([can.extended for can in cans]),
        np.array([can.remote for can in cans]),
        np.array([can.error for can in cans]),
        np.array([can.length for can in cans], dtype=np.uint8),
        data.reshape(-1, MAX_LENGTH),
    )


def concatenated(pieces: Sequence[CanColumns]) -> CanColumns:
    """Columns of one bus behind each other; at least one piece."""
    if len(pieces) == 1:
        return pieces[0]
    return CanColumns(pieces[0].bus, *(np.concatenate(column) for column in zip(*(p[1:] for p in pieces), strict=True)))


def by_time(columns: CanColumns) -> CanColumns:
    """The same frames sorted by time; those of equal times stay in their order."""
    if is_sorted(columns.t_ns):
        return columns
    return columns.gather(np.argsort(columns.t_ns, kind="stable"))


def is_sorted(t_ns: Times) -> bool:
    """Whether no time is before the one ahead of it."""
    return bool(np.all(t_ns[:-1] <= t_ns[1:]))
