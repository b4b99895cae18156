"""What a client asks of one node, step by step: generators that yield transfers and are told how each one ended.

They decide and never wait: the client (``sdo_client``) sends, times and resumes them. So a job costs no thread, and the
next request leaves in the very callback that brought the last answer.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from enum import Enum
from typing import Final, TypeVar

from app.drivers.contract import Written
from app.drivers.sdo_transfer import Download, Transfer, Upload
from app.errors import (
    BusLostError,
    HubsideError,
    NoAnswerError,
    OvertakenError,
    ProtocolError,
    SdoAbortError,
    UnverifiedError,
)
from app.model.address import Address
from app.model.description import Verify
from app.wire import sdo

T = TypeVar("T")


class End(Enum):
    """How a transfer ended for its job."""

    DONE = "done"
    REFUSED = "refused"
    BROKEN = "broken"
    TIMED_OUT = "timed_out"
    INTERRUPTED = "interrupted"
    """Sent, then given up for something urgent."""
    SILENT = "silent"
    """Not sent at all: the node answered nothing, not even the fence."""
    OVERTAKEN = "overtaken"
    """Not sent at all: an urgent command went to the object after the write was asked for."""
    LOST = "lost"
    """The bus is gone."""


Steps = Generator[Transfer, End, T]

READ_TRIES: Final = 2
"""A read changes nothing, so it may be asked once more."""


class Counters:
    """What went other than planned; read from any thread, written by the receive thread only."""

    __slots__ = (
        "aborts_received",
        "fences",
        "ignored",
        "interrupted",
        "late",
        "read_retries",
        "readbacks",
        "timeouts",
        "transfers",
    )

    def __init__(self) -> None:
        self.transfers = 0
        self.timeouts = 0
        self.read_retries = 0
        self.readbacks = 0
        self.fences = 0
        self.ignored = 0
        self.late = 0
        self.interrupted = 0
        self.aborts_received = 0

    def as_dict(self) -> dict[str, int]:
        """All counters by name."""
        return {name: getattr(self, name) for name in self.__slots__}


def abort_error(node: int, address: Address, code: int) -> SdoAbortError:
    """The error for an abort code of the device."""
    return SdoAbortError(node=node, address=str(address), abort_code=code, text_key_reason=sdo.abort_text_key(code))


def read_steps(
    node: int,
    timeouts_ns: Mapping[Address, int],
    results: dict[Address, bytes | HubsideError],
    counters: Counters,
    bus: str = "",
) -> Steps[None]:
    """Read every address of ``timeouts_ns`` in order into ``results``; never raises for a single object.

    A node that falls silent altogether ends the list: the rest is NoAnswerError at once, not one time-out each.
    """
    end = End.DONE
    for address, timeout_ns in timeouts_ns.items():
        transfer, end = yield from _upload(address, timeout_ns, counters)
        results[address] = transfer.data if end is End.DONE else _read_error(node, transfer, end, bus)
        if end is End.SILENT or end is End.LOST:
            break
    for address, timeout_ns in timeouts_ns.items():
        if address not in results:
            results[address] = _read_error(node, Upload(address, timeout_ns), end, bus)


def _upload(address: Address, timeout_ns: int, counters: Counters) -> Steps[tuple[Upload, End]]:
    timed_out = 0
    while True:
        transfer = Upload(address, timeout_ns)
        end = yield transfer
        if end is End.TIMED_OUT:
            timed_out += 1
            if timed_out == READ_TRIES:
                return transfer, end
            counters.read_retries += 1
        elif end is not End.INTERRUPTED:
            return transfer, end


def _read_error(node: int, transfer: Transfer, end: End, bus: str) -> HubsideError:
    if end is End.REFUSED:
        return abort_error(node, transfer.address, transfer.abort_code)
    if end is End.BROKEN:
        return ProtocolError(
            bus=bus, node=node, address=str(transfer.address), reason=sdo.abort_text_key(transfer.abort_code)
        )
    if end is End.LOST:
        return BusLostError(bus=bus, node=node, address=str(transfer.address), reason="lost while reading")
    return NoAnswerError(node=node, address=str(transfer.address), timeout_s=transfer.timeout_ns / 1e9)


class WriteStep(Download):
    """A download that knows whether its acknowledge could be that of an earlier, given up write to the same object.

    ``known``: urgent commands to the object that it may follow; after another one it is not sent. None: it is sent.
    """

    __slots__ = ("doubtful", "known")

    def __init__(self, address: Address, timeout_ns: int, data: bytes, known: int | None = None) -> None:
        super().__init__(address, timeout_ns, data)
        self.doubtful = False
        self.known = known


def write_steps(
    node: int,
    address: Address,
    data: bytes,
    timeout_ns: int,
    read_timeout_ns: int,
    verify: Verify,
    counters: Counters,
    bus: str = "",
    known: int | None = None,
) -> Steps[Written]:
    """Write once, never twice. Without a clear answer the object is read and that decides. ``known``: see WriteStep.

    Raises SdoAbortError (refused, even where the refusal came late), UnverifiedError (sent, but the object holds
    something else, or its outcome cannot be read), NoAnswerError (the node is silent), OvertakenError (not sent: an
    urgent command came first), BusLostError.
    """
    transfer = WriteStep(address, timeout_ns, data, known)
    end = yield transfer
    if end is End.DONE and not (transfer.doubtful and verify is Verify.EQUAL):
        return Written.ACKNOWLEDGED
    if end is End.REFUSED:
        raise abort_error(node, address, transfer.abort_code)
    if end is End.OVERTAKEN:
        raise OvertakenError(bus=bus, node=node, address=address.short)
    if end is End.SILENT:
        raise NoAnswerError(node=node, address=str(address), timeout_s=timeout_ns / 1e9)
    if end is End.LOST:
        raise BusLostError(bus=bus, node=node, address=str(address), reason_key="bus_lost.while_writing")
    counters.readbacks += 1
    readback, end = yield from _upload(address, read_timeout_ns, counters)
    return _decide(node, transfer, readback, end, verify, bus)


def _decide(node: int, written: Transfer, readback: Upload, end: End, verify: Verify, bus: str) -> Written:
    address, late_abort = written.address, written.late_abort
    if late_abort is not None and not (end is End.REFUSED and readback.abort_code == late_abort):
        raise abort_error(node, address, late_abort)
    if end is End.LOST:
        raise BusLostError(bus=bus, node=node, address=str(address), reason_key="bus_lost.while_writing")
    if end is End.TIMED_OUT or end is End.SILENT:
        raise NoAnswerError(node=node, address=str(address), timeout_s=written.timeout_ns / 1e9, outcome="unknown")
    found = readback.data.hex() if end is End.DONE else None
    if end is End.DONE and verify is Verify.EQUAL and readback.data == written.data:
        written.executed = True
        return Written.READ_BACK
    reason = "other_value" if end is End.DONE and verify is Verify.EQUAL else "unknown"
    raise UnverifiedError(
        node=node, address=str(address), sent=written.data.hex(), found=found, reason_key=f"unverified.{reason}"
    )
