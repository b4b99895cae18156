"""A TCP server on the thread of a simulation: it listens, takes so many clients, and closes all of them at its end."""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
from typing import Final, Generic, Protocol, Self, TypeVar

from app.twins.paced_thread import PacedThread

_LOG: Final = logging.getLogger(__name__)


class Connected(Protocol):
    """One connection."""

    def close(self) -> None:
        """End it; it has its server forget it."""


Client = TypeVar("Client", bound=Connected)


class PacedServer(Generic[Client]):
    """What servers of twins have in common. ``port`` 0 takes a free one. Raises OSError where it cannot be had.

    ``start`` and ``stop`` may be called from any thread, ``stop`` also after the simulation's thread has ended; all
    else runs on that thread.
    """

    def __init__(self, thread: PacedThread, host: str, port: int, clients_max: int) -> None:
        self._paced = thread
        self._clients: set[Client] = set()
        self._clients_max = clients_max
        self._closed = threading.Event()
        self._listener = socket.create_server((host, port), backlog=clients_max)
        self._listener.setblocking(False)
        self.host: str = self._listener.getsockname()[0]
        self.port: int = self._listener.getsockname()[1]

    def start(self) -> None:
        """Begin to accept clients."""
        self._paced.call_soon(self._open)

    def stop(self, timeout_s: float = 5.0) -> None:
        """Close all connections. Raises TimeoutError where the thread does not do it in time."""
        if not self._paced.is_alive():
            self._close()
            return
        self._paced.call_soon(self._close)
        if not self._closed.wait(timeout_s):
            raise TimeoutError(f"the server did not stop within {timeout_s} s")

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_exc: object) -> None:
        self.stop()

    # -- for those who derive from it ----------------------------------------------------

    def _connected(self, sock: socket.socket, peer: str) -> Client | None:
        """A client of a new connection, ``HOST:PORT``; None refuses it."""
        raise NotImplementedError

    def _opened(self) -> None:
        """It accepts clients from now on."""

    def _closing(self) -> None:
        """It accepts none any more; those that there are will be closed."""

    # -- inside --------------------------------------------------------------------------

    def _open(self) -> None:
        self._paced.on_readable(self._listener, self._accept)
        self._opened()

    def _accept(self) -> None:
        with contextlib.suppress(BlockingIOError, ConnectionAbortedError):
            sock, (host, port, *_) = self._listener.accept()
            if len(self._clients) >= self._clients_max:
                _LOG.warning("client %s refused: there are %d already", host, len(self._clients))
                sock.close()
                return
            sock.setblocking(False)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            client = self._connected(sock, f"{host}:{port}")
            if client is None:
                sock.close()
            else:
                self._clients.add(client)

    def _close(self) -> None:
        if self._closed.is_set():
            return
        self._paced.on_readable(self._listener, None)
        self._closing()
        self._listener.close()
        for client in tuple(self._clients):
            client.close()
        self._closed.set()
