"""Serves one PD4-E over Modbus TCP, for several clients, in the device's own thread.

Requests are answered in the order of their arrival, also where several come in one segment or one in several; before
each the device comes to the present. A stream that is no Modbus ends its connection: its borders are lost. A restart
of the device ends all connections, and none is taken until it has booted.
"""

from __future__ import annotations

import logging
import socket
from typing import Final

from app.twins.paced_server import PacedServer
from app.twins.paced_thread import PacedThread
from app.twins.pd4e.device import Pd4e
from app.twins.pd4e.requests import Answering
from app.wire.modbus.adu import AduSplitter, Message, decode_adu
from app.wire.modbus.fields import FormatError

_LOG: Final = logging.getLogger(__name__)
PORT: Final = 1502
_READ_BYTES: Final = 65536
_OUT_LIMIT_BYTES: Final = 1 << 18
"""What a client may leave unread before it is dropped."""
_CLIENTS_MAX: Final = 16


class Pd4eServer(PacedServer["_Client"]):
    """The server of one device. ``port`` 0 takes a free one. Raises OSError where the address cannot be had."""

    def __init__(self, thread: PacedThread, device: Pd4e, host: str = "127.0.0.1", port: int = PORT) -> None:
        super().__init__(thread, host, port, _CLIENTS_MAX)
        self._thread = thread
        self._device = device
        device.on_restart = self._end_all

    # -- on the device's thread --------------------------------------------------------

    def answering(self) -> Answering:
        """What answers the requests of a new connection."""
        return Answering(self._device.store, self._device.process_data)

    def come_to_present(self) -> None:
        """Let the device live up to now: what is asked is answered as of now."""
        self._thread.catch_up()

    def settle(self) -> None:
        """A request has been answered."""
        self._device.settle()

    def forget(self, client: _Client) -> None:
        """A client has closed."""
        self._clients.discard(client)

    def _connected(self, sock: socket.socket, _peer: str) -> _Client | None:
        self._thread.catch_up()
        return _Client(self, self._thread, sock) if self._device.online else None

    def _end_all(self) -> None:
        for client in tuple(self._clients):
            client.end()


class _Client:
    """One connection."""

    def __init__(self, server: Pd4eServer, thread: PacedThread, sock: socket.socket) -> None:
        self._server = server
        self._thread = thread
        self._sock = sock
        self._answering = server.answering()
        self._splitter = AduSplitter()
        self._out = bytearray()
        self._ending = False
        thread.on_readable(sock, self._read)

    def end(self) -> None:
        """Close as soon as everything is sent."""
        self._ending = True
        self._thread.on_readable(self._sock, None)
        if not self._out:
            self.close()

    def close(self) -> None:
        """End the connection."""
        if self._sock.fileno() < 0:
            return
        self._thread.on_readable(self._sock, None)
        self._thread.on_writable(self._sock, None)
        self._sock.close()
        self._server.forget(self)

    def _read(self) -> None:
        try:
            data = self._sock.recv(_READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.close()
            return
        try:
            for adu in self._splitter.feed(data):
                self._obey(adu)
                if self._ending:
                    break
        except FormatError as error:
            _LOG.info("a Modbus client is dropped: %s", error)
            self._ending = True
        except Exception:
            self.close()  # a defect here must not leave a client waiting; the thread tells of it
            raise
        self._send()

    def _obey(self, adu: bytes) -> None:
        self._server.come_to_present()
        request = decode_adu(adu)
        answer = self._answering.answer(request.pdu)
        self._out += Message(request.transaction, request.unit, answer).encode()
        self._server.settle()

    def _send(self) -> None:
        if self._sock.fileno() < 0:
            return
        try:
            sent = self._sock.send(self._out) if self._out else 0
        except BlockingIOError:
            sent = 0
        except OSError:
            self.close()
            return
        del self._out[:sent]
        if len(self._out) > _OUT_LIMIT_BYTES or (self._ending and not self._out):
            self.close()
            return
        self._thread.on_writable(self._sock, self._send if self._out else None)
