"""Runs the server: a listening port, a launch address that is printed, an end that is clean."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
from collections.abc import AsyncIterator
from typing import Any, Final

import uvicorn

from app.errors import UsageError
from app.web.listen import Tls

HOST: Final = "127.0.0.1"
MAX_MESSAGE: Final = 1 << 30
"""Of a socket's message, in bytes: the 3D view's pictures and meshes must pass."""
SEND_BUFFER: Final = 128 * 1024
"""Of a connection, in bytes: a client that is slow gets what is new, not megabytes of what was."""
START_TIMEOUT_S: Final = 10.0
END_TIMEOUT_S: Final = 3.0


def open_port(port: int, address: str = HOST) -> socket.socket:
    """A listening socket on ``address`` (IPv4 or IPv6); port 0 takes a free one.

    Raises UsageError where it is taken.
    """
    # The protocol is named because asyncio switches Nagle's algorithm off only for sockets that name it; with it a
    # message waits up to 40 ms for the browser's acknowledge of the one before.
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        if sys.platform != "win32":  # there it would let two servers share the port
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)  # taken over by its connections
        listener.bind((address, port))
        listener.listen(128)
    except OSError as error:
        listener.close()
        raise UsageError(reason=f"port {port} of {address} cannot be opened: {error.strerror or error}") from error
    listener.setblocking(False)
    return listener


def port_of(listener: socket.socket) -> int:
    """The port of a listening socket."""
    port: int = listener.getsockname()[1]
    return port


def launch_url(port: int, token: str) -> str:
    """The address that a person opens, once."""
    return f"http://{HOST}:{port}/?token={token}"


class _Server(uvicorn.Server):
    """The process' signals stay with the caller: Ctrl-C must close the connection and the recording too."""

    @contextlib.contextmanager
    def capture_signals(self) -> Any:
        yield


@contextlib.asynccontextmanager
async def serve(app: Any, listener: socket.socket, tls: Tls | None = None) -> AsyncIterator[None]:
    """Serve ``app`` on ``listener`` while the block runs, by ``tls`` where given.

    Raises UsageError where it does not start.
    """
    config = uvicorn.Config(
        app,
        log_config=None,
        log_level="warning",
        access_log=False,
        server_header=False,
        ws="websockets-sansio",
        ws_max_size=MAX_MESSAGE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=int(END_TIMEOUT_S),
        lifespan="on",
        ssl_certfile=None if tls is None else tls.certificate,
        ssl_keyfile=None if tls is None else tls.key,
    )
    server = _Server(config)
    task = asyncio.create_task(server.serve(sockets=[listener]))
    try:
        await _started(server, task)
        yield
    finally:
        server.should_exit = True
        _, pending = await asyncio.wait([task], timeout=END_TIMEOUT_S + 2)
        if pending:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        listener.close()


async def _started(server: uvicorn.Server, task: asyncio.Task[None]) -> None:
    async with asyncio.timeout(START_TIMEOUT_S):
        while not server.started:
            if task.done():
                raise UsageError(reason="the page's server did not start")
            await asyncio.sleep(0.01)
