"""A socketcand client for python-can, without the traps of the one that comes with it.

It speaks raw mode with socketcand itself and with the server in ``app.twins.socketcand_server``. Against python-can's
own client: the end of the connection raises CanOperationError, where that one returns None for ever; elements
may be split or joined over reads anyhow, a frame in the read of the last ``< ok >`` included; empty frames are right;
remote frames are sent (``sendrtr``) and received (``rtr``); every wait has an end; ``recv_many`` gives all there is.
"""

from __future__ import annotations

import contextlib
import logging
import select
import socket
import time
from collections import deque
from typing import Any, Final

import can

from app.wire.frame import Can

_LOG: Final = logging.getLogger(__name__)
_READ_BYTES: Final = 1 << 18
_ELEMENT_MAX: Final = 200
_SEND_TIMEOUT_S: Final = 1.0
_KEEPALIVE_OPTIONS: Final = {"TCP_KEEPIDLE": 2, "TCP_KEEPINTVL": 1, "TCP_KEEPCNT": 3, "TCP_USER_TIMEOUT": 5000}
"""A peer that is gone without a word (cable, power) is noticed within some 5 s."""

Received = tuple[Can, int | None]
"""A frame and its time stamp by the adapter in ns, where it has one."""


class SocketcandBus(can.BusABC):
    """A python-can bus on a socketcand server; ``host``, ``port`` and ``channel`` name it.

    Raises CanInitializationError where the server does not answer as it should within ``timeout_s``.
    """

    def __init__(
        self, channel: str, host: str, port: int, timeout_s: float = 3.0, can_filters: Any = None, **kwargs: Any
    ) -> None:
        self.channel = channel
        self.channel_info = f"socketcand {channel}@{host}:{port}"
        self.malformed = 0
        """Elements that could not be read so far; the first ones are logged."""
        self._rest = b""
        self._received: deque[Received] = deque()
        self._replies: deque[bytes] = deque()
        deadline = time.monotonic() + timeout_s
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
        except OSError as error:
            self._is_shutdown = True
            raise can.CanInitializationError(f"{host}:{port}: {error.strerror or error}", error.errno) from error
        try:
            self._tune()
            self._handshake(deadline)
        except (OSError, can.CanError) as error:
            self._is_shutdown = True
            self._socket.close()
            raise can.CanInitializationError(f"{host}:{port}: {error}") from error
        super().__init__(channel=channel, can_filters=can_filters, **kwargs)

    # -- python-can's interface ------------------------------------------------------

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._received:
            self._fill(timeout)
        if not self._received:
            return None, False
        frame, t_ns = self._received.popleft()
        return _message(frame, t_ns, self.channel), False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame. Raises CanOperationError where the connection does not take it; ``timeout`` is not used."""
        if msg.is_error_frame or msg.is_fd:
            raise can.CanOperationError("socketcand cannot send error frames or CAN FD frames")
        if msg.is_remote_frame:
            self.send_frame(Can(msg.arbitration_id, b"", msg.is_extended_id, remote=True, dlc=msg.dlc))
        else:
            self.send_frame(Can(msg.arbitration_id, bytes(msg.data), msg.is_extended_id))

    def fileno(self) -> int:
        """For ``select``; there may be frames already read for which it does not get readable."""
        return self._socket.fileno()

    def shutdown(self) -> None:
        """Close the connection."""
        super().shutdown()
        self._socket.close()

    # -- in bulk -------------------------------------------------------------------------

    def recv_many(self, timeout_s: float | None) -> list[Received]:
        """All frames that are there; waits for the first one at most ``timeout_s``. Filters do not apply.

        Raises CanOperationError where the connection is lost.
        """
        if not self._received:
            self._fill(timeout_s)
        frames = list(self._received)
        self._received.clear()
        return frames

    def send_frame(self, frame: Can) -> None:
        """Send one frame. Raises CanOperationError where the connection does not take it within a second."""
        self._transmit(_send_element(frame))

    # -- inside --------------------------------------------------------------------------

    def _tune(self) -> None:
        sock = self._socket
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, number in _KEEPALIVE_OPTIONS.items():
            if hasattr(socket, name):
                with contextlib.suppress(OSError):
                    sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), number)
        sock.settimeout(_SEND_TIMEOUT_S)

    def _handshake(self, deadline: float) -> None:
        self._expect(b"hi", deadline)
        self._transmit(f"< open {self.channel} >".encode())
        self._expect(b"ok", deadline)
        self._transmit(b"< rawmode >")
        self._expect(b"ok", deadline)
        # Shows a server that holds frames back for slow clients that this one has read its answer.
        self._transmit(b"< echo >")

    def _expect(self, word: bytes, deadline: float) -> None:
        while not self._replies:
            left_s = deadline - time.monotonic()
            if left_s <= 0:
                raise can.CanOperationError(f"no '< {word.decode()} >' in time")
            self._fill(left_s)
        reply = self._replies.popleft()
        if reply != word:
            raise can.CanOperationError(f"'{reply.decode('ascii', 'replace')}' instead of '{word.decode()}'")

    def _transmit(self, element: bytes) -> None:
        try:
            self._socket.sendall(element)
        except OSError as error:
            # Part of the element may be out: nothing sent after it would be understood.
            raise can.CanOperationError(f"connection lost while sending: {error}", error.errno) from error

    def _fill(self, timeout_s: float | None) -> None:
        """Read once, waiting at most ``timeout_s``; raises CanOperationError at the end of the connection."""
        try:
            if not select.select([self._socket], [], [], timeout_s)[0]:
                return
            data = self._socket.recv(_READ_BYTES)
        except (OSError, ValueError) as error:
            raise can.CanOperationError(f"connection lost: {error}") from error
        if not data:
            raise can.CanOperationError("connection closed by the server")
        *elements, self._rest = (self._rest + data).split(b">")
        for element in elements:
            self._take(element)
        if len(self._rest) > _ELEMENT_MAX:
            raise can.CanOperationError("no socketcand protocol: an element without end")

    def _take(self, element: bytes) -> None:
        words = element.split()
        kind = words[1] if len(words) > 1 and words[0] == b"<" else b""
        try:
            if kind == b"frame":
                data = bytes.fromhex(words[4].decode()) if len(words) > 4 else b""
                self._add(Can(int(words[2], 16), data, len(words[2]) == 8), words[3])
            elif kind == b"rtr":
                frame = Can(int(words[2], 16), b"", len(words[2]) == 8, remote=True, dlc=int(words[4]))
                self._add(frame, words[3])
            elif kind == b"error" and len(words) == 4 and b"." in words[3]:
                self._add(Can(int(words[2], 16), error=True), words[3])
            elif kind:
                self._reply(words[1:])
            else:
                self._mangled(element)
        except (ValueError, IndexError):
            self._mangled(element)

    def _add(self, frame: Can, stamp: bytes) -> None:
        if len(frame.data) > 8:
            raise ValueError(f"{len(frame.data)} data bytes")
        self._received.append((frame, round(float(stamp) * 1e6) * 1000))

    def _reply(self, words: list[bytes]) -> None:
        if words == [b"echo"]:
            return
        if words[0] == b"error":
            _LOG.warning("%s: %s", self.channel_info, b" ".join(words).decode("ascii", "replace"))
        self._replies.append(b" ".join(words))
        if len(self._replies) > 16:
            self._replies.popleft()

    def _mangled(self, element: bytes) -> None:
        self.malformed += 1
        if self.malformed <= 10:
            _LOG.warning("%s: not understood: %r", self.channel_info, element[:_ELEMENT_MAX])


def _send_element(frame: Can) -> bytes:
    identifier = f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"
    if frame.remote:
        return f"< sendrtr {identifier} {frame.length:X} >".encode()
    # An empty frame gets two blanks, as python-can's client sends it and every server reads it.
    return f"< send {identifier} {len(frame.data):X} {frame.data.hex(' ')} >".encode()


def _message(frame: Can, t_ns: int | None, channel: str) -> can.Message:
    return can.Message(
        timestamp=(t_ns or 0) / 1e9,
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        is_error_frame=frame.error,
        channel=channel,
        dlc=frame.length,
        data=frame.data,
    )
