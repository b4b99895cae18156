"""An open CAN adapter, whatever it is: frames in bulk, one frame out, and its end.

``open_link`` makes the one for a ``CanConfig``. Every error of python-can or of the system becomes ``LinkError`` here:
the link is then of no more use, except after ``LinkBusyError``.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import socket
import struct
import time
from typing import Any, Final, Protocol

import can

from app.drivers.can_config import CanConfig, CanInterface
from app.drivers.socketcand import Received, SocketcandBus
from app.wire.frame import Can

_LOG: Final = logging.getLogger(__name__)
_BATCH: Final = 256
_POSIX: Final = os.name == "posix"
_SLCAN_SETTLE_S: Final = 0.1
"""python-can waits 2 s for boards that restart when opened; adapters for CAN do not."""


class LinkError(Exception):
    """The adapter, or what is between it and us, is gone."""


class LinkBusyError(Exception):
    """The adapter took no further frame in time: the bus does not carry what is sent already."""


class CanLink(Protocol):
    """An open adapter. ``recv_many`` is called by one thread, ``send`` by one at a time."""

    dropped: int
    """Frames that the system says it has dropped because we read too slowly, so far."""

    def fileno(self) -> int | None:
        """What ``select`` can wait for; None where there is no such thing."""

    def recv_many(self, timeout_s: float) -> list[Received]:
        """Frames that are there, own ones left out; waits at most ``timeout_s`` for the first. Raises LinkError."""

    def send(self, frame: Can) -> None:
        """Hand one frame to the adapter. Raises LinkError, LinkBusyError."""

    def close(self) -> None:
        """Close the adapter; never raises for one that is gone."""


class SocketcandLink:
    """A socketcand server; the frames of the client are made without python-can's messages."""

    def __init__(self, config: CanConfig, timeout_s: float) -> None:
        self.dropped = 0
        self._bus = SocketcandBus(config.channel, config.host, config.port, timeout_s, **config.extra)

    def fileno(self) -> int | None:
        """The connection; frames read during the handshake are given by the first ``recv_many``."""
        return self._bus.fileno()

    def recv_many(self, timeout_s: float) -> list[Received]:
        """See CanLink."""
        try:
            return self._bus.recv_many(timeout_s)
        except can.CanError as error:
            raise LinkError(_text(error)) from error

    def send(self, frame: Can) -> None:
        """See CanLink."""
        try:
            self._bus.send_frame(frame)
        except can.CanError as error:
            raise LinkError(_text(error)) from error

    def close(self) -> None:
        """See CanLink."""
        self._bus.shutdown()


class PythonCanLink:
    """Any interface of python-can."""

    def __init__(self, bus: can.BusABC) -> None:
        self.dropped = 0
        self.bus = bus
        self._fileno: int | None = None
        if _POSIX:
            with contextlib.suppress(NotImplementedError, can.CanError):
                self._fileno = bus.fileno()

    def fileno(self) -> int | None:
        """See CanLink."""
        return self._fileno

    def recv_many(self, timeout_s: float) -> list[Received]:
        """See CanLink."""
        received: list[Received] = []
        try:
            message = self.bus.recv(timeout_s)
            while message is not None:
                if message.is_rx and not message.is_fd:
                    received.append(_received(message))
                if len(received) >= _BATCH:
                    break
                message = self.bus.recv(0)
        except Exception as error:
            # Drivers of vendors raise what they like; a frame that came before the error still counts.
            if received:
                _LOG.info("the adapter failed after %d frames of a batch: %s", len(received), error)
                return received
            raise LinkError(_text(error)) from error
        return received

    def send(self, frame: Can) -> None:
        """See CanLink."""
        try:
            self.bus.send(message_of(frame), timeout=0.1)
        except can.CanOperationError as error:
            if error.error_code == errno.ENOBUFS or "buffer full" in str(error):
                raise LinkBusyError(_text(error)) from error
            raise LinkError(_text(error)) from error
        except Exception as error:
            raise LinkError(_text(error)) from error

    def close(self) -> None:
        """See CanLink."""
        try:
            self.bus.shutdown()
        except Exception as error:  # noqa: BLE001 - an adapter that is gone cannot be told to close
            _LOG.info("while closing the adapter: %s", _text(error))
            port = getattr(self.bus, "serialPortOrig", None)
            if port is not None:
                with contextlib.suppress(OSError):
                    port.close()


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
            raise LinkError(_text(error)) from error
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


def open_link(config: CanConfig, timeout_s: float) -> CanLink:
    """Open the adapter. Raises LinkError.

    ``timeout_s`` holds for socketcand; other interfaces take the time that their drivers take.
    """
    try:
        if config.interface is CanInterface.SOCKETCAND:
            return SocketcandLink(config, timeout_s)
        arguments = config.bus_arguments()
        if config.interface is CanInterface.SLCAN:
            arguments.setdefault("sleep_after_open", _SLCAN_SETTLE_S)
            if _POSIX:
                arguments.setdefault("timeout", 0)
        if config.interface is CanInterface.PCAN and config.listen_only:
            arguments["state"] = can.BusState.PASSIVE
        bus = can.Bus(ignore_config=True, **arguments)
        return SocketcanLink(bus) if config.interface is CanInterface.SOCKETCAN else PythonCanLink(bus)
    except Exception as error:
        raise LinkError(_text(error)) from error


def message_of(frame: Can) -> can.Message:
    """The frame for python-can."""
    return can.Message(
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        dlc=frame.length,
        data=None if frame.remote else frame.data,
        timestamp=time.time(),
    )


def _received(message: can.Message) -> Received:
    t_ns = round(message.timestamp * 1e6) * 1000 if message.timestamp else None
    if message.is_remote_frame:
        return Can(message.arbitration_id, b"", message.is_extended_id, remote=True, dlc=message.dlc), t_ns
    data = bytes(message.data)
    return Can(message.arbitration_id, data, message.is_extended_id, error=message.is_error_frame), t_ns


def _text(error: BaseException) -> str:
    return str(error) or type(error).__name__


__all__: list[Any] = ["CanLink", "LinkBusyError", "LinkError", "message_of", "open_link"]
