"""Follows the SDO traffic of one server as a third party (CiA 301, 7.2.4): any client, any protocol, either order.

A server has one transfer at a time. A new initiate replaces an open transfer; an answer counts only where it fits the
open one by command, index, sub-index and toggle bit, and is an orphan else. Nothing here raises on any bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from functools import lru_cache
from typing import Any, Final

from app.model.address import Address
from app.wire import sdo
from app.wire.frame import Direction
from app.wire.records import (
    Fault,
    LoadSeen,
    MalformedSeen,
    OrphanSeen,
    Outcome,
    Protocol,
    Record,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    Side,
    Source,
    ValueSeen,
)
from app.wire.sdo_block import MAX_BYTES, BlockBuffer

LATE_NS: Final = 60_000_000_000
"""An answer to an initiate that takes longer is an orphan: no client waits as long."""
SAVE_INDEX: Final = 0x1010
LOAD_INDEX: Final = 0x1011
_NO_MUX: Final = bytes(3)


class Phase(Enum):
    """What is awaited; the names say whose turn it is only where it matters."""

    IDLE = "idle"
    READ = "read"
    WRITE = "write"
    READ_SEGMENTS = "read_segments"
    WRITE_SEGMENTS = "write_segments"
    BLOCK_READ = "block_read"
    BLOCK_READ_DATA = "block_read_data"
    BLOCK_READ_END = "block_read_end"
    BLOCK_READ_CONFIRM = "block_read_confirm"
    BLOCK_WRITE = "block_write"
    BLOCK_WRITE_DATA = "block_write_data"
    BLOCK_WRITE_END = "block_write_end"
    BLOCK_WRITE_CONFIRM = "block_write_confirm"
    BROKEN = "broken"
    """Can be followed no more; its end is still recognised."""


_IDLE: Final = Phase.IDLE
_READ: Final = Phase.READ
_WRITE: Final = Phase.WRITE
_NOTHING: Final[tuple[Record, ...]] = ()


@lru_cache(maxsize=8192)
def _address(mux: bytes) -> Address:
    return Address(mux[0] | mux[1] << 8, mux[2])


class SdoFollower:
    """The server side of one pair of COB-IDs: that of ``node`` on ``bus``."""

    __slots__ = (
        "_access",
        "_block",
        "_buffer",
        "_bus",
        "_client",
        "_data",
        "_mux",
        "_node",
        "_pending",
        "_phase",
        "_protocol",
        "_size",
        "_start_ns",
        "_toggle",
    )

    def __init__(self, bus: str, node: int) -> None:
        self._bus = bus
        self._node = node
        self._phase = _IDLE
        self._mux = _NO_MUX
        self._start_ns = 0
        self._client = Direction.RX
        self._access = SdoAccess.READ
        self._protocol = Protocol.EXPEDITED
        self._data = b""
        self._size: int | None = None
        self._toggle = False
        self._pending: sdo.Segment | None = None
        self._buffer = bytearray()
        self._block = BlockBuffer()

    @property
    def address(self) -> Address | None:
        """Object of the open transfer, or None."""
        return None if self._phase is _IDLE else _address(self._mux)

    def is_block_segment(self, client: bool, data: bytes) -> bool:
        """Whether ``data``, not yet taken, is a segment of the sub-block that runs, and no protocol step."""
        if client:
            return self._phase is Phase.BLOCK_WRITE_DATA and self._is_segment(data)
        return self._phase is Phase.BLOCK_READ_DATA and data[0] != 0x80

    # -- frames of a client ----------------------------------------------------

    def request(self, t_ns: int, client: Direction, can_id: int, data: bytes) -> Sequence[Record]:
        """Take a frame from client to server."""
        if len(data) != 8:
            return (MalformedSeen(t_ns, self._bus, self._node, can_id, Fault.LENGTH, data),)
        if self._phase is Phase.BLOCK_WRITE_DATA and self.is_block_segment(True, data):
            self._block.add(data)
            return _NOTHING
        match data[0] >> 5:
            case sdo.Command.CCS_UPLOAD:
                return self._open(t_ns, client, data, SdoAccess.READ, Protocol.EXPEDITED, _READ)
            case sdo.Command.CCS_DOWNLOAD:
                return self._open_write(t_ns, client, data)
            case sdo.Command.CCS_UPLOAD_SEGMENT:
                return self._ask_segment(t_ns, can_id, data)
            case sdo.Command.CCS_DOWNLOAD_SEGMENT:
                return self._give_segment(t_ns, can_id, data)
            case sdo.Command.CCS_BLOCK_UPLOAD:
                return self._block_upload_request(t_ns, client, can_id, data)
            case sdo.Command.CCS_BLOCK_DOWNLOAD:
                return self._block_download_request(t_ns, client, can_id, data)
            case sdo.Command.ABORT:
                return self._abort(t_ns, data, Side.CLIENT)
        return (MalformedSeen(t_ns, self._bus, self._node, can_id, Fault.COMMAND, data),)

    def _open(
        self, t_ns: int, client: Direction, data: bytes, access: SdoAccess, protocol: Protocol, phase: Phase
    ) -> Sequence[Record]:
        replaced = _NOTHING if self._phase is _IDLE else self.close(t_ns)
        self._phase = phase
        self._mux = data[1:4]
        self._start_ns = t_ns
        self._client = client
        self._access = access
        self._protocol = protocol
        return replaced

    def _open_write(self, t_ns: int, client: Direction, data: bytes) -> Sequence[Record]:
        head = data[0]
        if head & 2:
            replaced = self._open(t_ns, client, data, SdoAccess.WRITE, Protocol.EXPEDITED, _WRITE)
            self._data = data[4 : 8 - (head >> 2 & 3)] if head & 1 else data[4:]
        else:
            replaced = self._open(t_ns, client, data, SdoAccess.WRITE, Protocol.SEGMENTED, _WRITE)
            self._start_segments(int.from_bytes(data[4:], "little") if head & 1 else None)
        return replaced

    def _start_segments(self, size: int | None) -> None:
        self._size = size
        self._buffer = bytearray()
        self._toggle = False
        self._pending = None

    def _ask_segment(self, t_ns: int, can_id: int, data: bytes) -> Sequence[Record]:
        if self._phase is Phase.BROKEN:
            return _NOTHING
        if self._phase is not Phase.READ_SEGMENTS:
            return self._orphan(t_ns, data, Side.CLIENT)
        asked = sdo.segment(data)
        if asked.toggle != self._toggle:
            return self._break(t_ns, can_id, Fault.TOGGLE, data)
        self._pending = asked
        return _NOTHING

    def _give_segment(self, t_ns: int, can_id: int, data: bytes) -> Sequence[Record]:
        if self._phase is Phase.BROKEN:
            return _NOTHING
        if self._phase is not Phase.WRITE_SEGMENTS:
            return self._orphan(t_ns, data, Side.CLIENT)
        given = sdo.segment(data)
        if given.toggle != self._toggle:
            return self._break(t_ns, can_id, Fault.TOGGLE, data)
        self._pending = given
        return _NOTHING

    def _is_segment(self, data: bytes) -> bool:
        """Whether a client's frame within a block download is a segment.

        The next number always is. Else a number that looks like an initiate is taken for one: the client has given
        the transfer up without an abort.
        """
        head = data[0]
        if head == 0x80:
            return False
        if head & 0x7F == self._block.last_seen + 1:
            return True
        return head not in (0x40, 0xA0, 0xA4, 0xC0, 0xC2, 0xC4, 0xC6) and head & 0xF0 != 0x20

    def _block_upload_request(self, t_ns: int, client: Direction, can_id: int, data: bytes) -> Sequence[Record]:
        step, phase = sdo.block_step(data), self._phase
        if step is sdo.BlockStep.INITIATE:
            replaced = self._open(t_ns, client, data, SdoAccess.READ, Protocol.BLOCK, Phase.BLOCK_READ)
            self._block = BlockBuffer()
            self._block.with_crc = sdo.parse_block_accept(data).crc
            return replaced
        if phase is Phase.BROKEN:
            return _NOTHING
        if step is sdo.BlockStep.START and phase is Phase.BLOCK_READ_DATA:
            return _NOTHING
        if step is sdo.BlockStep.ACKNOWLEDGE and phase is Phase.BLOCK_READ_DATA:
            return self._block_acknowledge(t_ns, can_id, data, Phase.BLOCK_READ_END)
        if step is sdo.BlockStep.END and phase is Phase.BLOCK_READ_CONFIRM:
            return self._finish_block(t_ns, can_id, data)
        return self._orphan(t_ns, data, Side.CLIENT)

    def _block_download_request(self, t_ns: int, client: Direction, can_id: int, data: bytes) -> Sequence[Record]:
        if sdo.block_step(data) is sdo.BlockStep.INITIATE:
            replaced = self._open(t_ns, client, data, SdoAccess.WRITE, Protocol.BLOCK, Phase.BLOCK_WRITE)
            self._block = BlockBuffer()
            initiate = sdo.parse_block_initiate(data)
            self._block.with_crc, self._block.size = initiate.crc, initiate.size
            return replaced
        if self._phase is Phase.BROKEN:
            return _NOTHING
        if self._phase is not Phase.BLOCK_WRITE_END:
            return self._orphan(t_ns, data, Side.CLIENT)
        self._block.end = sdo.parse_block_end(data)
        self._phase = Phase.BLOCK_WRITE_CONFIRM
        return _NOTHING

    # -- frames of the server --------------------------------------------------

    def response(self, t_ns: int, can_id: int, data: bytes) -> Sequence[Record]:
        """Take a frame from server to client."""
        if len(data) != 8:
            return (MalformedSeen(t_ns, self._bus, self._node, can_id, Fault.LENGTH, data),)
        phase, head = self._phase, data[0]
        if phase is _READ:
            if head >> 5 == 2 and data[1:4] == self._mux and t_ns - self._start_ns <= LATE_NS:
                return self._upload_response(t_ns, data)
        elif phase is _WRITE:
            if head >> 5 == 3 and data[1:4] == self._mux and t_ns - self._start_ns <= LATE_NS:
                return self._download_response(t_ns)
        elif phase is Phase.BLOCK_READ_DATA and self.is_block_segment(False, data):
            self._block.add(data)
            return _NOTHING
        if head >> 5 == sdo.Command.ABORT:
            return self._abort(t_ns, data, Side.SERVER)
        if phase is Phase.READ_SEGMENTS and head >> 5 == sdo.Command.SCS_UPLOAD_SEGMENT:
            return self._take_segment(t_ns, can_id, data)
        if phase is Phase.WRITE_SEGMENTS and head >> 5 == sdo.Command.SCS_DOWNLOAD_SEGMENT:
            return self._acknowledge_segment(t_ns, can_id, data)
        if phase is Phase.BROKEN:
            return _NOTHING
        return self._block_response(t_ns, can_id, data)

    def _upload_response(self, t_ns: int, data: bytes) -> Sequence[Record]:
        head = data[0]
        if head & 2:
            return self._finish(t_ns, data[4 : 8 - (head >> 2 & 3)] if head & 1 else data[4:])
        self._phase = Phase.READ_SEGMENTS
        self._protocol = Protocol.SEGMENTED
        self._start_segments(int.from_bytes(data[4:], "little") if head & 1 else None)
        return _NOTHING

    def _download_response(self, t_ns: int) -> Sequence[Record]:
        if self._protocol is Protocol.EXPEDITED:
            return self._finish(t_ns, self._data)
        self._phase = Phase.WRITE_SEGMENTS
        return _NOTHING

    def _take_segment(self, t_ns: int, can_id: int, data: bytes) -> Sequence[Record]:
        given = sdo.segment(data)
        if self._pending is None:
            return self._orphan(t_ns, data, Side.SERVER)
        if given.toggle != self._toggle:
            return self._break(t_ns, can_id, Fault.TOGGLE, data)
        return self._append(t_ns, can_id, given, data)

    def _acknowledge_segment(self, t_ns: int, can_id: int, data: bytes) -> Sequence[Record]:
        if self._pending is None:
            return self._orphan(t_ns, data, Side.SERVER)
        if bool(data[0] & 0x10) != self._toggle:
            return self._break(t_ns, can_id, Fault.TOGGLE, data)
        return self._append(t_ns, can_id, self._pending, data)

    def _append(self, t_ns: int, can_id: int, part: sdo.Segment, data: bytes) -> Sequence[Record]:
        self._pending = None
        self._toggle = not self._toggle
        self._buffer += part.data
        if len(self._buffer) > MAX_BYTES:
            return self._break(t_ns, can_id, Fault.SIZE, data)
        if not part.last:
            return _NOTHING
        if self._size is not None and self._size != len(self._buffer):
            return self._finish_broken(t_ns, can_id, Fault.SIZE, data)
        return self._finish(t_ns, bytes(self._buffer))

    def _block_response(self, t_ns: int, can_id: int, data: bytes) -> Sequence[Record]:
        command, phase = data[0] >> 5, self._phase
        if phase is Phase.BLOCK_READ and data[1:4] == self._mux:
            if command == sdo.Command.SCS_BLOCK_UPLOAD:
                initiate = sdo.parse_block_initiate(data)
                self._block.with_crc &= initiate.crc
                self._block.size = initiate.size
                self._phase = Phase.BLOCK_READ_DATA
                return _NOTHING
            if command == sdo.Command.SCS_UPLOAD:  # up to the threshold a server may answer plainly
                self._protocol = Protocol.EXPEDITED
                return self._upload_response(t_ns, data)
        elif phase is Phase.BLOCK_READ_END and command == sdo.Command.SCS_BLOCK_UPLOAD and data[0] & 1:
            self._block.end = sdo.parse_block_end(data)
            self._phase = Phase.BLOCK_READ_CONFIRM
            return _NOTHING
        elif command == sdo.Command.SCS_BLOCK_DOWNLOAD:
            step = sdo.block_step(data)
            if phase is Phase.BLOCK_WRITE and step is sdo.BlockStep.INITIATE and data[1:4] == self._mux:
                self._block.with_crc &= sdo.parse_block_accept(data).crc
                self._phase = Phase.BLOCK_WRITE_DATA
                return _NOTHING
            if phase is Phase.BLOCK_WRITE_DATA and step is sdo.BlockStep.ACKNOWLEDGE:
                return self._block_acknowledge(t_ns, can_id, data, Phase.BLOCK_WRITE_END)
            if phase is Phase.BLOCK_WRITE_CONFIRM and step is sdo.BlockStep.END:
                return self._finish_block(t_ns, can_id, data)
        return self._orphan(t_ns, data, Side.SERVER)

    def _block_acknowledge(self, t_ns: int, can_id: int, data: bytes, then: Phase) -> Sequence[Record]:
        fault = self._block.acknowledge(sdo.parse_block_acknowledge(data).sequence)
        if fault is not None:
            return self._break(t_ns, can_id, fault, data)
        if self._block.finished:
            self._phase = then
        return _NOTHING

    # -- ends ------------------------------------------------------------------

    def close(self, t_ns: int) -> Sequence[Record]:
        """Give the open transfer up: a new one, a boot-up or a gap came before its end."""
        if self._phase is _IDLE:
            return _NOTHING
        return self._end(t_ns, Outcome.LOST)

    def _finish_block(self, t_ns: int, can_id: int, data: bytes) -> Sequence[Record]:
        whole = self._block.whole()
        if isinstance(whole, Fault):
            return self._finish_broken(t_ns, can_id, whole, data)
        return self._finish(t_ns, whole)

    def _finish(self, t_ns: int, data: bytes) -> Sequence[Record]:
        self._phase = _IDLE
        address, access, bus, node = _address(self._mux), self._access, self._bus, self._node
        dt_ns = t_ns - self._start_ns
        seen = SdoSeen(
            t_ns, bus, node, access, address, Outcome.DONE, data, None, None, self._protocol, dt_ns, self._client
        )
        if access is SdoAccess.READ:
            return (seen, ValueSeen(t_ns, bus, node, address, data, Source.SDO_READ))
        written = ValueSeen(t_ns, bus, node, address, data, Source.SDO_WRITE)
        return (seen, written, *self._commanded(t_ns, data, True))

    def _finish_broken(self, t_ns: int, can_id: int, fault: Fault, data: bytes) -> Sequence[Record]:
        malformed = MalformedSeen(t_ns, self._bus, self._node, can_id, fault, data)
        return (malformed, *self._end(t_ns, Outcome.BROKEN))

    def _abort(self, t_ns: int, data: bytes, side: Side) -> Sequence[Record]:
        mux = data[1:4]
        # Some servers abort a segment without the address. Any other address is that of an earlier transfer.
        if self._phase is _IDLE or (mux != self._mux and (mux != _NO_MUX or self._phase in (_READ, _WRITE))):
            return self._orphan(t_ns, data, side)
        return self._end(t_ns, Outcome.ABORTED, int.from_bytes(data[4:], "little"), side)

    def _end(self, t_ns: int, outcome: Outcome, code: int | None = None, side: Side | None = None) -> Sequence[Record]:
        self._phase = _IDLE
        address, dt_ns = _address(self._mux), t_ns - self._start_ns
        seen = SdoSeen(
            t_ns, self._bus, self._node, self._access, address, outcome, None, code, side, self._protocol, dt_ns,
            self._client,
        )  # fmt: skip
        if self._access is SdoAccess.WRITE and self._protocol is Protocol.EXPEDITED:
            return (seen, *self._commanded(t_ns, self._data, False))
        return (seen,)

    def _commanded(self, t_ns: int, data: bytes, done: bool) -> Sequence[Record]:
        address = _address(self._mux)
        if address.major == SAVE_INDEX and data == b"save":
            return (SaveSeen(t_ns, self._bus, self._node, address, done),)
        if address.major == LOAD_INDEX and data == b"load":
            return (LoadSeen(t_ns, self._bus, self._node, address, done),)
        return _NOTHING

    def _break(self, t_ns: int, can_id: int, fault: Fault, data: bytes) -> Sequence[Record]:
        self._phase = Phase.BROKEN
        return (MalformedSeen(t_ns, self._bus, self._node, can_id, fault, data),)

    def _orphan(self, t_ns: int, data: bytes, side: Side) -> Sequence[Record]:
        address = _address(data[1:4]) if _carries_address(data, side) else None
        return (OrphanSeen(t_ns, self._bus, self._node, address, side, data),)

    # -- keyframes -------------------------------------------------------------

    def snapshot(self) -> dict[str, Any] | None:
        """JSON-able state of the open transfer; None where there is none."""
        if self._phase is _IDLE:
            return None
        return {
            "phase": self._phase.value,
            "mux": self._mux.hex(),
            "start_ns": self._start_ns,
            "client": self._client.value,
            "access": self._access.value,
            "protocol": self._protocol.value,
            "data": self._data.hex(),
            "size": self._size,
            "toggle": self._toggle,
            "pending": None if self._pending is None else [*self._pending[:3], self._pending.data.hex()],
            "buffer": self._buffer.hex(),
            "block": self._block.snapshot() if self._protocol is Protocol.BLOCK else None,
        }

    def restore(self, state: dict[str, Any] | None) -> None:
        """Go on from ``snapshot()``. Raises KeyError or ValueError where ``state`` is none."""
        if state is None:
            self._phase = _IDLE
            return
        self._phase = Phase(state["phase"])
        self._mux = bytes.fromhex(state["mux"])
        self._start_ns = state["start_ns"]
        self._client = Direction(state["client"])
        self._access = SdoAccess(state["access"])
        self._protocol = Protocol(state["protocol"])
        self._data = bytes.fromhex(state["data"])
        self._size = state["size"]
        self._toggle = state["toggle"]
        pending = state["pending"]
        self._pending = None if pending is None else _segment(*pending)
        self._buffer = bytearray.fromhex(state["buffer"])
        self._block = BlockBuffer() if state["block"] is None else BlockBuffer.restore(state["block"])


def _segment(command: int, toggle: bool, last: bool, data: str) -> sdo.Segment:
    return sdo.Segment(command, toggle, last, bytes.fromhex(data))


def _carries_address(data: bytes, side: Side) -> bool:
    command = data[0] >> 5
    if command == sdo.Command.ABORT:
        return True
    if side is Side.SERVER and command in (sdo.Command.SCS_UPLOAD, sdo.Command.SCS_DOWNLOAD):
        return True
    blocks = (sdo.Command.CCS_BLOCK_UPLOAD, sdo.Command.CCS_BLOCK_DOWNLOAD)
    return command in blocks and sdo.block_step(data) is sdo.BlockStep.INITIATE
