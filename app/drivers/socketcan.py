"""SocketCAN with what python-can does not ask for: a large receive buffer and the count of dropped frames."""

from __future__ import annotations

import socket
import struct
from typing import Final

import can

from app.drivers.can_link import LinkError, PythonCanLink, error_text
from app.drivers.socketcand import Received
from app.wire.frame import Can

_BATCH: Final = 256


class SocketcanLink(PythonCanLink):
    """SocketCAN, read with what python-can does not ask for: a large receive buffer and the count of dropped frames.

    python-can's own reader cannot be used with that count: it expects one piece of ancillary data.
    """

    _SO_RXQ_OVFL: Final = 40
    _SO_TIMESTAMPNS: Final = 35
    _SO_RCVBUFFORCE: Final = 33
    _BUFFER_BYTES: Final = 4 << 20
    _FRAME: Final = struct.Struct("=IB3x8s")
    _ANCILLARY_BYTES: Final = 128

    def __init__(self, bus: can.BusABC) -> None:
        super().__init__(bus)
        self._socket: socket.socket = bus.socket  # type: ignore[attr-defined]
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, self._SO_RCVBUFFORCE, self._BUFFER_BYTES)
        except OSError:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, self._BUFFER_BYTES)
        self._socket.setsockopt(socket.SOL_SOCKET, self._SO_RXQ_OVFL, 1)
        self._socket.setblocking(False)

    def recv_many(self, timeout_s: float) -> list[Received]:
        """See CanLink; the caller has waited with ``select``, so ``timeout_s`` is not used."""
        received: list[Received] = []
        try:
            while len(received) < _BATCH:
                data, ancillary, flags, _ = self._socket.recvmsg(self._FRAME.size, self._ANCILLARY_BYTES)
                t_ns = self._read_ancillary(ancillary)
                if not flags & socket.MSG_DONTROUTE or not flags & socket.MSG_CONFIRM:
                    received.append((self.parse(data), t_ns))
        except BlockingIOError:
            return received
        except (OSError, struct.error) as error:
            if received:
                return received
            raise LinkError(error_text(error)) from error
        return received

    def _read_ancillary(self, ancillary: list[tuple[int, int, bytes]]) -> int | None:
        t_ns = None
        for level, kind, data in ancillary:
            if level == socket.SOL_SOCKET and kind == self._SO_TIMESTAMPNS:
                seconds, nanos = struct.unpack_from("@ll", data)
                t_ns = seconds * 1_000_000_000 + nanos
            elif level == socket.SOL_SOCKET and kind == self._SO_RXQ_OVFL:
                self.dropped = struct.unpack_from("=I", data)[0]
        return t_ns

    @classmethod
    def parse(cls, data: bytes) -> Can:
        """A ``struct can_frame`` of linux/can.h. Raises struct.error where it has another size."""
        raw_id, length, payload = cls._FRAME.unpack(data)
        extended, remote, error = bool(raw_id >> 31), bool(raw_id >> 30 & 1), bool(raw_id >> 29 & 1)
        can_id = raw_id & (0x1FFFFFFF if extended or error else 0x7FF)
        if remote:
            return Can(can_id, b"", extended, remote=True, dlc=length)
        return Can(can_id, payload[: min(length, 8)], extended, error=error)
