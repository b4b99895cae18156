"""Serves a simulated line over the socketcand protocol on TCP, raw mode, for any number of clients.

Text elements ``< ... >`` in both directions:

========================================  ==========================================================================
client to server                          server to client
========================================  ==========================================================================
(connects)                                ``< hi >``
``< open can0 >``                         ``< ok >``, or ``< error could not open bus >``
``< rawmode >``                           ``< ok >``; from then on every frame of the others:
                                          ``< frame ID SECONDS.MICROSECONDS DATA >``
                                          ``< rtr ID SECONDS.MICROSECONDS DLC >``
                                          ``< error CLASS SECONDS.MICROSECONDS >``
``< send ID DLC B0 B1 ... >``             nothing
``< sendrtr ID DLC >``                    nothing
``< echo >``                              ``< echo >``
anything else                             ``< error unknown command >``, ``< error unknown frame format >``
========================================  ==========================================================================

An identifier of 8 hex digits is extended, of 3 base. A client gets no echo of its own frames. The time is wall time at
the end of the frame.

python-can's client cannot connect when a frame comes in one read with the ``< ok >`` of raw mode: frames are held for
a moment, or until that client sends something. The same client sends a remote frame as ``send`` without data: it is
taken as one.
"""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Callable
from enum import Enum
from typing import Final

from app.twins.line import Port, TxOrder
from app.twins.line_thread import LineThread
from app.twins.paced_server import PacedServer
from app.wire.frame import Can

_LOG: Final = logging.getLogger(__name__)
_HOLD_NS: Final = 100_000_000
_READ_BYTES: Final = 65536
_ELEMENT_MAX: Final = 200
_OUT_LIMIT_BYTES: Final = 1 << 20
"""What a client may leave unread (some 5 s of a full line at 500 kbit/s) before it is dropped."""
_SYSTEM_BUFFER_BYTES: Final = 1 << 17
"""The system's share of that; left to itself it grows to megabytes."""
_PENDING_LIMIT: Final = 512
"""Frames of one client that wait for the line before nothing more is read from it."""
_RESUME_NS: Final = 10_000_000
_CLIENTS_MAX: Final = 64


class _Mode(Enum):
    """How far a client has come."""

    NO_BUS = "no_bus"
    OPEN = "open"
    RAW = "raw"


class SocketcandServer(PacedServer["_Client"]):
    """The server.

    ``port`` 0 takes a free one; ``wall_ns`` is the clock for the time stamps of frames; a client with
    more than ``out_limit_bytes`` unread is dropped, and the line never waits.
    """

    def __init__(
        self,
        thread: LineThread,
        host: str = "127.0.0.1",
        port: int = 0,
        channel: str = "can0",
        wall_ns: Callable[[], int] = time.time_ns,
        out_limit_bytes: int = _OUT_LIMIT_BYTES,
    ) -> None:
        super().__init__(thread, host, port, _CLIENTS_MAX)
        self.channel = channel
        self.out_limit_bytes = out_limit_bytes
        self.dropped_clients = 0
        """Clients that were dropped because they did not read."""
        self._thread = thread
        self._wall_offset_ns = wall_ns() - thread.monotonic_ns()
        self._formatted: tuple[int, Can, bytes] = (0, Can(0), b"")

    # -- on the line's thread --------------------------------------------------------

    def _opened(self) -> None:
        self._thread.after_step(self._flush)

    def _closing(self) -> None:
        self._thread.forget(self._flush)

    def _connected(self, sock: socket.socket, peer: str) -> _Client:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SYSTEM_BUFFER_BYTES)
        return _Client(self, self._thread, sock, peer)

    def _flush(self) -> None:
        for client in tuple(self._clients):
            client.flush()

    def forget(self, client: _Client, dropped: bool) -> None:
        """A client has closed."""
        self._clients.discard(client)
        self.dropped_clients += dropped

    def element(self, can: Can, t_ns: int) -> bytes:
        """The text of a frame; made once for all clients."""
        last_ns, last, text = self._formatted
        if last_ns != t_ns or last is not can:
            text = frame_element(can, t_ns + self._thread.offset_ns + self._wall_offset_ns)
            self._formatted = (t_ns, can, text)
        return text


class _Client:
    """One connection, and its place on the line."""

    def __init__(self, server: SocketcandServer, thread: LineThread, sock: socket.socket, name: str) -> None:
        self._server = server
        self._thread = thread
        self._sock = sock
        self._name = name
        self._mode = _Mode.NO_BUS
        self._in = b""
        self._out = bytearray(b"< hi >")
        self._held: bytearray | None = None
        self._blocked = False
        self._port: Port | None = None
        thread.on_readable(sock, self._read)

    # -- out ---------------------------------------------------------------------------

    def flush(self) -> None:
        """Send what is there, as far as the connection takes it."""
        if self._out and not self._blocked:
            self._send()

    def _send(self) -> None:
        try:
            sent = self._sock.send(self._out)
        except BlockingIOError:
            sent = 0
        except OSError as error:
            self.close(f"connection lost: {error}")
            return
        del self._out[:sent]
        if bool(self._out) != self._blocked:
            self._blocked = bool(self._out)
            self._thread.on_writable(self._sock, self._send if self._blocked else None)

    def _on_frame(self, can: Can, t_ns: int) -> None:
        out = self._out if self._held is None else self._held
        out += self._server.element(can, t_ns)
        if len(out) > self._server.out_limit_bytes:
            self.close("does not read: dropped", dropped=True)

    def _release(self, _t_ns: int = 0) -> None:
        if self._held is not None:
            self._out += self._held
            self._held = None

    # -- in ------------------------------------------------------------------------------

    def _read(self) -> None:
        try:
            data = self._sock.recv(_READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self.close(f"connection lost: {error}")
            return
        if not data:
            self.close("disconnected")
            return
        *elements, self._in = (self._in + data).split(b">")
        for element in elements:
            self._obey(element)
        if len(self._in) > _ELEMENT_MAX:
            self.close("sent an element without end")
        elif self._port is not None and self._port.pending > _PENDING_LIMIT:
            self._pause()

    def _pause(self) -> None:
        """Read no more for a while: the line is slower than this client, and TCP tells it so."""
        self._thread.on_readable(self._sock, None)
        self._thread.line.call_at(self._thread.line.now_ns + _RESUME_NS, self._resume)

    def _resume(self, t_ns: int) -> None:
        if self._port is None:
            return
        if self._port.pending > _PENDING_LIMIT // 2:
            self._thread.line.call_at(t_ns + _RESUME_NS, self._resume)
        else:
            self._thread.on_readable(self._sock, self._read)

    def _obey(self, element: bytes) -> None:
        words = element.split()
        if len(words) < 2 or words[0] != b"<":
            self._error(b"unknown command")
            return
        self._release()
        if self._port is not None and words[1] in (b"send", b"sendrtr"):
            self._send_frame(words, remote=words[1] == b"sendrtr")
        elif words[1] == b"echo" and self._mode is not _Mode.NO_BUS:
            self._out += b"< echo >"
        elif words[1] == b"open" and self._mode is _Mode.NO_BUS:
            self._open(words[2:])
        elif words[1] == b"rawmode" and self._mode is not _Mode.NO_BUS:
            self._raw()
        else:
            self._error(b"unknown command")

    def _open(self, channel: list[bytes]) -> None:
        if channel != [self._server.channel.encode()]:
            self._error(b"could not open bus")
            return
        self._mode = _Mode.OPEN
        self._out += b"< ok >"

    def _raw(self) -> None:
        self._out += b"< ok >"
        if self._mode is not _Mode.RAW:
            self._mode = _Mode.RAW
            self._held = bytearray()
            self._port = self._thread.line.attach(self._on_frame, order=TxOrder.FIFO)
            self._thread.line.call_at(self._thread.now_ns() + _HOLD_NS, self._release)

    def _send_frame(self, words: list[bytes], remote: bool) -> None:
        can = _frame_of(words[2:], remote)
        if can is None or self._port is None:
            self._error(b"unknown frame format")
        else:
            self._port.send(can, self._thread.now_ns())

    def _error(self, reason: bytes) -> None:
        self._out += b"< error " + reason + b" >"

    # -- end -------------------------------------------------------------------------------

    def close(self, reason: str = "server stops", dropped: bool = False) -> None:
        """Leave the line and close the connection."""
        if self._sock.fileno() < 0:
            return
        _LOG.log(logging.WARNING if dropped else logging.INFO, "socketcand client %s: %s", self._name, reason)
        if self._port is not None:
            self._port.detach()
            self._port = None
        self._thread.on_readable(self._sock, None)
        self._thread.on_writable(self._sock, None)
        self._out.clear()
        self._sock.close()
        self._server.forget(self, dropped)


def frame_element(can: Can, wall_ns: int) -> bytes:
    """The element that tells a client of ``can``."""
    can_id = f"{can.can_id:08X}" if can.extended else f"{can.can_id:03X}"
    seconds, micros = divmod(wall_ns // 1000, 1_000_000)
    if can.error:
        return f"< error {can_id} {seconds}.{micros:06d} >".encode()
    if can.remote:
        return f"< rtr {can_id} {seconds}.{micros:06d} {can.length} >".encode()
    return f"< frame {can_id} {seconds}.{micros:06d} {can.data.hex().upper()} >".encode()


def _frame_of(words: list[bytes], remote: bool) -> Can | None:
    """The frame of a ``send`` (identifier, DLC, data bytes) or ``sendrtr`` element; None where it makes no sense."""
    try:
        identifier, length = int(words[0], 16), int(words[1], 16)
        data = bytes(int(word, 16) for word in words[2:])
    except (ValueError, IndexError):
        return None
    extended = len(words[0]) == 8
    if not 0 <= identifier < (1 << 29 if extended else 1 << 11) or not 0 <= length <= 8:
        return None
    if remote or (length and not data):
        return None if data else Can(identifier, b"", extended, remote=True, dlc=length)
    return Can(identifier, data, extended) if len(data) == length else None
