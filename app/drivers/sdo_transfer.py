"""One SDO transfer, seen from the client (CiA 301, 7.2.4.3): bytes in, bytes out, no bus and no clock.

A reply is accepted only if it answers this very request: the server's command specifier fits, index and sub-index are
equal, the toggle bit is right; an abort must carry the very address. Everything else is ignored, never guessed at.
Segments carry no address. They are safe all the same: a server answers in order, so once the initiate answer with our
address has come, whatever an earlier transfer left behind has come before it.
"""

from __future__ import annotations

from enum import Enum
from typing import Final

from app.model.address import Address
from app.wire import sdo

MAX_BYTES: Final = 16 * 2**20
"""More than this is no parameter: the transfer is aborted."""


class Kind(Enum):
    """``UPLOAD``: the client reads. ``DOWNLOAD``: the client writes."""

    UPLOAD = "upload"
    DOWNLOAD = "download"


class Step(Enum):
    """What a frame of the server meant to a transfer."""

    IGNORED = "ignored"
    """No answer to this request."""
    SEND = "send"
    """Accepted; ``request`` is to be sent next."""
    DONE = "done"
    """Finished; an upload's ``data`` is complete."""
    REFUSED = "refused"
    """The server aborted; see ``abort_code``."""
    BROKEN = "broken"
    """The server's answer breaks the protocol; ``request`` is the abort to send, ``abort_code`` its code."""


class Transfer:
    """Common part of an upload and a download. ``timeout_ns`` is the longest wait for each answer."""

    __slots__ = (
        "_initiated",
        "_size",
        "_toggle",
        "abort_code",
        "address",
        "data",
        "executed",
        "late_abort",
        "mux",
        "request",
        "timeout_ns",
    )

    kind: Kind

    def __init__(self, address: Address, timeout_ns: int, request: bytes, data: bytes) -> None:
        self.address = address
        self.timeout_ns = timeout_ns
        self.request = request
        self.mux = request[1:4]
        self.data = data
        self.abort_code = 0
        self.late_abort: int | None = None
        """Set by the client where the server's abort came after the transfer was given up."""
        self.executed = False
        """Set by its job where reading has shown that a write without an answer was executed."""
        self._initiated = False
        self._toggle = False
        self._size: int | None = None

    def feed(self, data: bytes) -> Step:
        """Take one frame of the server (8 bytes) and say what it meant."""
        if len(data) != 8:
            return Step.IGNORED
        if data[0] >> 5 == sdo.Command.ABORT:
            if data[1:4] != self.mux:
                return Step.IGNORED
            self.abort_code = int.from_bytes(data[4:], "little")
            return Step.REFUSED
        return self._segment(data) if self._initiated else self._initiate(data)

    def abort(self, code: int) -> bytes:
        """The frame with which the client gives this transfer up."""
        return sdo.abort(self.address, code)

    def _initiate(self, data: bytes) -> Step:
        raise NotImplementedError

    def _segment(self, data: bytes) -> Step:
        raise NotImplementedError

    def _broken(self, code: int) -> Step:
        self.abort_code = code
        self.request = self.abort(code)
        return Step.BROKEN


class Upload(Transfer):
    """Reads one object: expedited or segmented, as the server chooses."""

    __slots__ = ("_parts",)

    kind = Kind.UPLOAD

    def __init__(self, address: Address, timeout_ns: int) -> None:
        super().__init__(address, timeout_ns, sdo.upload_request(address), b"")
        self._parts = bytearray()

    def _initiate(self, data: bytes) -> Step:
        head = data[0]
        if head >> 5 != sdo.Command.SCS_UPLOAD or data[1:4] != self.mux:
            return Step.IGNORED
        if head & 2:
            self.data = data[4 : 8 - (head >> 2 & 3)] if head & 1 else data[4:]
            return Step.DONE
        self._initiated = True
        self._size = int.from_bytes(data[4:], "little") if head & 1 else None
        if self._size is not None and self._size > MAX_BYTES:
            return self._broken(sdo.Abort.OUT_OF_MEMORY)
        self.request = sdo.upload_segment_request(self._toggle)
        return Step.SEND

    def _segment(self, data: bytes) -> Step:
        head = data[0]
        if head >> 5 != sdo.Command.SCS_UPLOAD_SEGMENT or bool(head & 0x10) is not self._toggle:
            return Step.IGNORED
        self._parts += data[1 : 8 - (head >> 1 & 7)]
        if len(self._parts) > (MAX_BYTES if self._size is None else self._size):
            return self._broken(sdo.Abort.LENGTH_TOO_HIGH)
        if head & 1:
            return self._complete()
        self._toggle = not self._toggle
        self.request = sdo.upload_segment_request(self._toggle)
        return Step.SEND

    def _complete(self) -> Step:
        if self._size is not None and len(self._parts) != self._size:
            return self._broken(sdo.Abort.LENGTH_TOO_LOW)
        self.data = bytes(self._parts)
        return Step.DONE


class Download(Transfer):
    """Writes one object: expedited up to 4 bytes, else segmented."""

    __slots__ = ("_sent",)

    kind = Kind.DOWNLOAD

    def __init__(self, address: Address, timeout_ns: int, data: bytes) -> None:
        super().__init__(address, timeout_ns, sdo.download_request(address, data), data)
        self._sent = 0

    def _initiate(self, data: bytes) -> Step:
        if data[0] >> 5 != sdo.Command.SCS_DOWNLOAD or data[1:4] != self.mux:
            return Step.IGNORED
        if 0 < len(self.data) <= 4:
            return Step.DONE
        self._initiated = True
        return self._next_segment()

    def _segment(self, data: bytes) -> Step:
        head = data[0]
        if head >> 5 != sdo.Command.SCS_DOWNLOAD_SEGMENT or bool(head & 0x10) is not self._toggle:
            return Step.IGNORED
        if self._sent >= len(self.data):
            return Step.DONE
        self._toggle = not self._toggle
        return self._next_segment()

    def _next_segment(self) -> Step:
        part = self.data[self._sent : self._sent + 7]
        self._sent += len(part)
        self.request = sdo.download_segment_request(part, self._toggle, self._sent >= len(self.data))
        return Step.SEND
