"""SDO server (CiA 301, 7.2.4): expedited, segmented and block transfers, one at a time.

Bytes in, bytes out: ``request`` takes the data of a request frame, answers go to the ``reply`` callable. A write that
takes time (a save) is acknowledged when it is done; requests that come meanwhile wait. A transfer whose client falls
silent is aborted: an open one would keep all others out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from app.model.address import Address
from app.twins import sdo_block
from app.twins.object_store import Deferred, ObjectStore, RefusedAccessError
from app.twins.ports import Alarm, Line
from app.wire import sdo
from app.wire.sdo import Abort, Command

_WAITING_LIMIT: Final = 8
"""Requests that wait while a save runs; a client sends one at a time, more are a fault of the client."""
_DOMAIN_LIMIT: Final = 1 << 16
"""Most bytes that a write may carry; no object of these devices is near it."""
TIMEOUT_NS: Final = 1_000_000_000
"""A transfer ends with abort 05040000h when this long none of its frames came, besides the time of a whole block."""
_LONGEST_FRAME_BITS: Final = 135
"""8 data bytes, base identifier, most stuff bits, intermission."""


@dataclass(slots=True)
class _Upload:
    address: Address
    data: bytes
    offset: int = 0
    toggle: bool = False


@dataclass(slots=True)
class _Download:
    address: Address
    announced: int | None
    data: bytearray = field(default_factory=bytearray)
    toggle: bool = False


@dataclass(slots=True)
class _BlockUpload:
    address: Address
    data: bytes
    block_size: int
    with_crc: bool
    start: int = 0
    sent: int = 0
    ended: bool = False


@dataclass(slots=True)
class _BlockDownload:
    address: Address
    announced: int | None
    with_crc: bool
    data: bytearray = field(default_factory=bytearray)
    sequence: int = 0
    complete: bool = False


_Transfer = _Upload | _Download | _BlockUpload | _BlockDownload


class SdoServer:
    """Serves one client. ``reply`` gets the 8 bytes of each answer; ``timeout_ns`` is how long it is waited for."""

    def __init__(
        self,
        store: ObjectStore,
        line: Line,
        reply: Callable[[bytes, int], None],
        timeout_ns: int = TIMEOUT_NS,
    ) -> None:
        self._store = store
        self._reply = reply
        self._transfer: _Transfer | None = None
        self._alarm = Alarm(line)
        self._silence = Alarm(line)
        # Between two frames that count there may be a block of segments, ours or ones to be repeated.
        block_bits = sdo_block.MAX_BLOCK * _LONGEST_FRAME_BITS
        self._timeout_ns = timeout_ns + block_bits * 1_000_000_000 // line.bitrate
        self.late_ns = 0
        """How much later than usual its answers reach the line: the client has as much more time."""
        self._busy = False
        self._waiting: deque[bytes] = deque(maxlen=_WAITING_LIMIT)

    def reset(self) -> None:
        """Forget an open transfer, a running save and waiting requests (restart, NMT stopped)."""
        self._transfer = None
        self._busy = False
        self._waiting.clear()
        self._alarm.clear()
        self._silence.clear()

    def request(self, data: bytes, t_ns: int) -> None:
        """Take a request frame that was complete at ``t_ns``. Frames of a wrong length are ignored."""
        if len(data) != 8:
            return
        if self._busy:
            self._waiting.append(data)
            return
        transfer = self._transfer
        try:
            if isinstance(transfer, _BlockDownload) and not transfer.complete and data[0] != 0x80:
                self._block_segment(transfer, data, t_ns)
            else:
                self._dispatch(data, t_ns)
                self._heard(t_ns)
        except RefusedAccessError as refusal:
            self._abort(data, refusal.code, t_ns)

    def _heard(self, t_ns: int) -> None:
        """A frame of the open transfer came, if one is open: its client lives."""
        if self._transfer is None:
            self._silence.clear()
        else:
            self._silence.set(t_ns + self._timeout_ns + self.late_ns, self._timed_out)

    def _timed_out(self, t_ns: int) -> None:
        transfer, self._transfer = self._transfer, None
        if transfer is not None:
            self._reply(sdo.abort(transfer.address, Abort.TIMED_OUT), t_ns)

    def _dispatch(self, data: bytes, t_ns: int) -> None:
        command = data[0] >> 5
        if command == Command.ABORT:
            self._transfer = None
        elif command == Command.CCS_DOWNLOAD:
            self._download(data, t_ns)
        elif command == Command.CCS_UPLOAD:
            self._upload(data, t_ns)
        elif command == Command.CCS_UPLOAD_SEGMENT:
            self._upload_segment(data, t_ns)
        elif command == Command.CCS_DOWNLOAD_SEGMENT:
            self._download_segment(data, t_ns)
        elif command == Command.CCS_BLOCK_UPLOAD:
            self._block_upload(data, t_ns)
        elif command == Command.CCS_BLOCK_DOWNLOAD:
            self._block_download(data, t_ns)
        else:
            raise RefusedAccessError(Abort.COMMAND_UNKNOWN)

    def _abort(self, request: bytes, code: Abort, t_ns: int) -> None:
        """Answer with an abort that names the open transfer's object, else the request's."""
        transfer = self._transfer
        self._transfer = None
        address = sdo.multiplexed(request).address if transfer is None else transfer.address
        self._reply(sdo.abort(address, code), t_ns)

    # -- expedited and segmented -----------------------------------------------

    def _upload(self, data: bytes, t_ns: int) -> None:
        self._transfer = None
        address = sdo.multiplexed(data).address
        value = self._store.read(address)
        if not 0 < len(value) <= 4:
            self._transfer = _Upload(address, value)
        self._reply(sdo.upload_response(address, value), t_ns)

    def _upload_segment(self, data: bytes, t_ns: int) -> None:
        transfer = self._transfer
        if not isinstance(transfer, _Upload):
            raise RefusedAccessError(Abort.COMMAND_UNKNOWN)
        if sdo.segment(data).toggle != transfer.toggle:
            raise RefusedAccessError(Abort.TOGGLE_BIT)
        piece = transfer.data[transfer.offset : transfer.offset + sdo_block.SEGMENT_SIZE]
        transfer.offset += len(piece)
        last = transfer.offset >= len(transfer.data)
        self._reply(sdo.upload_segment_response(piece, transfer.toggle, last), t_ns)
        transfer.toggle = not transfer.toggle
        if last:
            self._transfer = None

    def _download(self, data: bytes, t_ns: int) -> None:
        self._transfer = None
        frame = sdo.multiplexed(data)
        value = sdo.expedited_data(frame)
        if value is None:
            size = sdo.announced_size(frame)
            self._store.check_writable(frame.address, size)
            self._transfer = _Download(frame.address, size)
            self._reply(sdo.download_response(frame.address), t_ns)
            return
        if not frame.flags & 1:  # no size given: the object's own size counts
            value = value[: self._store.check_writable(frame.address, None).size]
        self._write(frame.address, value, sdo.download_response(frame.address), t_ns)

    def _download_segment(self, data: bytes, t_ns: int) -> None:
        transfer = self._transfer
        if not isinstance(transfer, _Download):
            raise RefusedAccessError(Abort.COMMAND_UNKNOWN)
        piece = sdo.segment(data)
        if piece.toggle != transfer.toggle:
            raise RefusedAccessError(Abort.TOGGLE_BIT)
        transfer.data += piece.data
        self._check_amount(transfer.address, len(transfer.data), transfer.announced)
        answer = sdo.download_segment_response(transfer.toggle)
        transfer.toggle = not transfer.toggle
        if not piece.last:
            self._reply(answer, t_ns)
            return
        self._finish_download(transfer.address, bytes(transfer.data), transfer.announced, answer, t_ns)

    def _check_amount(self, address: Address, amount: int, announced: int | None) -> None:
        if announced is not None and amount > announced:
            raise RefusedAccessError(Abort.LENGTH)
        size = self._store.at(address).size
        if amount > (_DOMAIN_LIMIT if size is None else size):
            raise RefusedAccessError(Abort.LENGTH_TOO_HIGH)

    def _finish_download(self, address: Address, data: bytes, announced: int | None, answer: bytes, t_ns: int) -> None:
        if announced is not None and len(data) != announced:
            raise RefusedAccessError(Abort.LENGTH)
        self._write(address, data, answer, t_ns)
        self._transfer = None

    def _write(self, address: Address, data: bytes, answer: bytes, t_ns: int) -> None:
        deferred = self._store.write(address, data)
        if deferred is None:
            self._reply(answer, t_ns)
        else:
            self._defer(deferred, address, answer, t_ns)

    def _defer(self, deferred: Deferred, address: Address, answer: bytes, t_ns: int) -> None:
        """Answer when the work is done, then serve what came meanwhile."""

        def done(now_ns: int) -> None:
            self._busy = False
            try:
                deferred.finish(now_ns)
            except RefusedAccessError as refusal:
                self._reply(sdo.abort(address, refusal.code), now_ns)
            else:
                self._reply(answer, now_ns)
            waiting = list(self._waiting)
            self._waiting.clear()
            for request in waiting:
                self.request(request, now_ns)

        self._busy = True
        self._alarm.set(t_ns + deferred.duration_ns, done)

    # -- block download ----------------------------------------------------------

    def _block_download(self, data: bytes, t_ns: int) -> None:
        transfer = self._transfer
        if data[0] & 1:
            if not isinstance(transfer, _BlockDownload):
                raise RefusedAccessError(Abort.COMMAND_UNKNOWN)
            self._block_download_end(transfer, data, t_ns)
            return
        self._transfer = None
        frame = sdo.multiplexed(data)
        size = int.from_bytes(frame.data, "little") if frame.flags & 2 else None
        self._store.check_writable(frame.address, size)
        self._transfer = _BlockDownload(frame.address, size, bool(frame.flags & 4))
        self._reply(sdo_block.download_initiated(frame.address, sdo_block.MAX_BLOCK), t_ns)

    def _block_segment(self, transfer: _BlockDownload, data: bytes, t_ns: int) -> None:
        sequence, last = data[0] & 0x7F, bool(data[0] & 0x80)
        in_order = sequence == transfer.sequence + 1
        if in_order:
            transfer.sequence = sequence
            transfer.data += data[1:]
            self._check_amount_padded(transfer)
            transfer.complete = last
            self._heard(t_ns)  # out of order it may as well be a request of another transfer, and does not count
        if last or sequence == sdo_block.MAX_BLOCK:
            # Out of order: the client repeats from the last segment that we tell it (7.2.4.3.11).
            self._reply(sdo_block.download_block_ack(transfer.sequence, sdo_block.MAX_BLOCK), t_ns)
            transfer.sequence = 0

    def _check_amount_padded(self, transfer: _BlockDownload) -> None:
        """Refuse more data than the object takes; the last segment may be padded."""
        limit = self._store.at(transfer.address).size or _DOMAIN_LIMIT
        if len(transfer.data) >= limit + sdo_block.SEGMENT_SIZE:
            raise RefusedAccessError(Abort.LENGTH_TOO_HIGH)

    def _block_download_end(self, transfer: _BlockDownload, data: bytes, t_ns: int) -> None:
        unused = data[0] >> 2 & 7
        value = bytes(transfer.data[: len(transfer.data) - unused])
        if transfer.with_crc and sdo.crc(value) != int.from_bytes(data[1:3], "little"):
            raise RefusedAccessError(Abort.CRC)
        self._finish_download(transfer.address, value, transfer.announced, sdo_block.download_ended(), t_ns)

    # -- block upload ------------------------------------------------------------

    def _block_upload(self, data: bytes, t_ns: int) -> None:
        sub_command = data[0] & 3
        transfer = self._transfer
        if sub_command == 0:
            self._block_upload_start(data, t_ns)
        elif not isinstance(transfer, _BlockUpload):
            raise RefusedAccessError(Abort.COMMAND_UNKNOWN)
        elif sub_command == 3:
            self._send_block(transfer, t_ns)
        elif sub_command == 2:
            self._block_acknowledged(transfer, data, t_ns)
        elif transfer.ended:
            self._transfer = None
        else:
            raise RefusedAccessError(Abort.COMMAND_UNKNOWN)

    def _block_upload_start(self, data: bytes, t_ns: int) -> None:
        self._transfer = None
        frame = sdo.multiplexed(data)
        block_size, switch_size = frame.data[0], frame.data[1]
        value = self._store.read(frame.address)
        if not 1 <= block_size <= sdo_block.MAX_BLOCK:
            raise RefusedAccessError(Abort.BLOCK_SIZE)
        if len(value) <= switch_size:  # the client allows the plain protocol for short data
            self._upload(sdo.upload_request(frame.address), t_ns)
            return
        self._transfer = _BlockUpload(frame.address, value, block_size, bool(frame.flags & 4))
        self._reply(sdo_block.upload_initiated(frame.address, len(value)), t_ns)

    def _send_block(self, transfer: _BlockUpload, t_ns: int) -> None:
        transfer.sent = 0
        step = sdo_block.SEGMENT_SIZE
        while transfer.sent < transfer.block_size:
            offset = transfer.start + transfer.sent * step
            last = offset + step >= len(transfer.data)
            transfer.sent += 1
            self._reply(sdo_block.segment(transfer.sent, transfer.data[offset : offset + step], last), t_ns)
            if last:
                break

    def _block_acknowledged(self, transfer: _BlockUpload, data: bytes, t_ns: int) -> None:
        acknowledged, block_size = data[1], data[2]
        if acknowledged > transfer.sent:
            raise RefusedAccessError(Abort.SEQUENCE_NUMBER)
        if not 1 <= block_size <= sdo_block.MAX_BLOCK:
            raise RefusedAccessError(Abort.BLOCK_SIZE)
        transfer.start += acknowledged * sdo_block.SEGMENT_SIZE
        transfer.block_size = block_size
        if transfer.start < len(transfer.data):
            self._send_block(transfer, t_ns)
            return
        transfer.ended = True
        unused = -len(transfer.data) % sdo_block.SEGMENT_SIZE
        self._reply(sdo_block.upload_end(unused, sdo.crc(transfer.data) if transfer.with_crc else 0), t_ns)
