"""An open CAN adapter, whatever it is: frames in bulk, one frame out, and its end.

``app.drivers.can_open`` makes the one for a ``CanConfig``. Every error of python-can or of the system becomes
``LinkError`` here: the link is of no more use then; after ``LinkBusyError`` it still is.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import time
from typing import Final, Protocol

import can

from app.drivers.can_config import CanConfig
from app.drivers.socketcand import Received, SocketcandBus
from app.wire.frame import Can

_LOG: Final = logging.getLogger(__name__)
_BATCH: Final = 256
_POSIX: Final = os.name == "posix"


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
            raise LinkError(error_text(error)) from error

    def send(self, frame: Can) -> None:
        """See CanLink."""
        try:
            self._bus.send_frame(frame)
        except can.CanError as error:
            raise LinkError(error_text(error)) from error

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
            raise LinkError(error_text(error)) from error
        return received

    def send(self, frame: Can) -> None:
        """See CanLink."""
        try:
            self.bus.send(message_of(frame), timeout=0.1)
        except can.CanOperationError as error:
            if error.error_code == errno.ENOBUFS or "buffer full" in str(error):
                raise LinkBusyError(error_text(error)) from error
            raise LinkError(error_text(error)) from error
        except Exception as error:
            raise LinkError(error_text(error)) from error

    def close(self) -> None:
        """See CanLink."""
        try:
            self.bus.shutdown()
        except Exception as error:  # noqa: BLE001 - an adapter that is gone cannot be told to close
            _LOG.info("while closing the adapter: %s", error_text(error))
            port = getattr(self.bus, "serialPortOrig", None)
            if port is not None:
                with contextlib.suppress(OSError):
                    port.close()


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


def error_text(error: BaseException) -> str:
    """What went wrong, never empty."""
    return str(error) or type(error).__name__
