"""The server's listening socket."""

from __future__ import annotations

import asyncio
import socket
from contextlib import closing
from typing import Any

import fastapi.routing
import httpx
import pytest

from app.web.access import Access
from app.web.app import create_app, warm_up
from app.web.serve import HOST, open_port, port_of
from tests.web.rig import bench_with, make_connection


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


@pytest.mark.parametrize("warm", [True, False])
async def test_a_warm_server_works_no_route_out_while_it_answers(warm: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = bench_with(make_connection())
    guard = create_app(bench, Access(bench.office.sessions, 1), 1)
    if warm:
        warm_up(guard)
    worked_out = []
    really = fastapi.routing.get_dependant  # type: ignore[attr-defined]

    def counted(**named: Any) -> Any:
        worked_out.append(named["path"])
        return really(**named)

    monkeypatch.setattr(fastapi.routing, "get_dependant", counted)
    async with httpx.AsyncClient(transport=httpx.ASGITransport(guard.app), base_url="http://127.0.0.1") as client:
        assert (await client.post("/api/live/stop", json={})).status_code in (200, 401)
        assert (await client.get("/api/nowhere")).status_code == 404
    assert bool(worked_out) is not warm
    await bench.office.close()
