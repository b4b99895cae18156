"""Requests to one node that were given up without an answer, and whose answer a frame can be that comes late.

A server answers in order (CiA 301 allows one transfer at a time on a channel), so the answer to a later request of
another kind or address proves that older ones are no longer owed: they are *flushed*. A flushed request is still
remembered for a while: should its answer have been held up elsewhere, no write may pass for acknowledged by it.
"""

from __future__ import annotations

from enum import Enum
from typing import Final

from app.drivers.sdo_transfer import Kind, Transfer
from app.wire import sdo

FORGET_NS: Final = 60_000_000_000
"""An answer later than this is not to be feared."""

_KIND_OF_SCS: Final[dict[int, Kind]] = {sdo.Command.SCS_UPLOAD: Kind.UPLOAD, sdo.Command.SCS_DOWNLOAD: Kind.DOWNLOAD}
_NEVER_MEANT_FOR: Final[dict[int, Kind]] = {sdo.Abort.WRITE_ONLY: Kind.DOWNLOAD, sdo.Abort.READ_ONLY: Kind.UPLOAD}


class Claim(Enum):
    """Whose answer a frame is."""

    RUNNING = "running"
    """That of the running transfer, or nobody's."""
    LATE = "late"
    """That of a request given up; it has been booked there."""
    UNCLEAR = "unclear"
    """An abort that may be the running transfer's or an older one's; nothing may be concluded from it."""


class Entry:
    """Requests of one kind to one address that look alike to the bus.

    ``owed`` answers of ``transfers`` are still to come.
    """

    __slots__ = ("at_ns", "flushed", "owed", "transfers")

    def __init__(self, at_ns: int) -> None:
        self.transfers: list[Transfer] = []
        self.owed = 0
        self.at_ns = at_ns
        self.flushed = False

    def candidates(self) -> list[Transfer]:
        """Requests that may have been refused: not those that were seen to be executed."""
        return [transfer for transfer in self.transfers if not transfer.executed]


class Unanswered:
    """The requests that one node owes an answer to."""

    __slots__ = ("_entries",)

    def __init__(self) -> None:
        self._entries: dict[tuple[bytes, Kind], Entry] = {}

    def __bool__(self) -> bool:
        return bool(self._entries)

    def alike(self, transfer: Transfer, now_ns: int) -> Entry | None:
        """The requests whose answer would look like that to ``transfer``."""
        oldest_ns = now_ns - FORGET_NS
        for key in [key for key, entry in self._entries.items() if entry.at_ns < oldest_ns]:
            del self._entries[key]
        return self._entries.get((transfer.mux, transfer.kind))

    def has(self, mux: bytes, kind: Kind) -> bool:
        """Whether such a request was given up."""
        return (mux, kind) in self._entries

    def owes(self, mux: bytes, kind: Kind) -> bool:
        """Whether such a request may not have been executed yet. From any thread."""
        entry = self._entries.get((mux, kind))
        return entry is not None and not entry.flushed

    def remember(self, transfer: Transfer, now_ns: int) -> None:
        """``transfer`` is given up."""
        key = (transfer.mux, transfer.kind)
        entry = self._entries.get(key)
        if entry is None or entry.flushed:
            entry = self._entries[key] = Entry(now_ns)
        entry.transfers.append(transfer)
        entry.owed += 1
        entry.at_ns = now_ns

    def still_owed(self, transfer: Transfer) -> None:
        """An answer has come that is ``transfer``'s or that of one like it: the other one is still to come."""
        entry = self._entries.get((transfer.mux, transfer.kind))
        if entry is not None:
            entry.transfers.append(transfer)
            entry.flushed = False

    def flush(self) -> None:
        """A later request was answered."""
        for entry in self._entries.values():
            entry.flushed = True

    def clear(self) -> None:
        """The node has restarted: it owes nothing."""
        self._entries.clear()

    def claim(self, data: bytes, running: Transfer | None, sure: bool) -> Claim:
        """Whose answer ``data`` is; ``sure`` where no unflushed request looks like ``running``."""
        if len(data) != 8:
            return Claim.RUNNING
        mux, command = data[1:4], data[0] >> 5
        if command == sdo.Command.ABORT:
            return self._claim_abort(mux, int.from_bytes(data[4:], "little"), running, sure)
        kind = _KIND_OF_SCS.get(command)
        if kind is None or (running is not None and running.mux == mux and running.kind is kind):
            return Claim.RUNNING
        return Claim.LATE if self._settle((mux, kind)) else Claim.RUNNING

    def _claim_abort(self, mux: bytes, code: int, running: Transfer | None, sure: bool) -> Claim:
        """The first abort belongs to the oldest request that is owed an answer and can be refused with ``code``."""
        same_object = running is not None and running.mux == mux
        for key, entry in self._entries.items():
            if key[0] != mux or (entry.flushed and same_object) or _NEVER_MEANT_FOR.get(code) is key[1]:
                continue
            candidates = entry.candidates()
            if same_object and running is not None and running.kind is key[1] and not sure:
                if candidates:
                    return Claim.UNCLEAR
                continue
            if len(candidates) == 1:
                candidates[0].late_abort = code
            self._settle(key)
            return Claim.LATE
        return Claim.RUNNING

    def _settle(self, key: tuple[bytes, Kind]) -> bool:
        entry = self._entries.get(key)
        if entry is None:
            return False
        entry.owed -= 1
        if entry.owed <= 0:
            del self._entries[key]
        return True
