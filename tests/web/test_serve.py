"""The server's listening socket."""

from __future__ import annotations

import asyncio
import socket
from contextlib import closing

from app.web.serve import HOST, open_port, port_of


async def test_what_is_sent_to_a_page_never_waits_for_an_acknowledge() -> None:
    accepted: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    def on_client(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        sock = writer.get_extra_info("socket")
        accepted.set_result(sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
        writer.close()

    listener = open_port(0)
    async with await asyncio.start_server(on_client, sock=listener) as _server:
        with closing(socket.create_connection((HOST, port_of(listener)))):
            assert await asyncio.wait_for(accepted, 5)
