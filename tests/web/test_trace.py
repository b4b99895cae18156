"""The trace over HTTP and the socket: pages and filters as a browser asks them, batches, and what a session may not."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from decimal import Decimal
from typing import Any

import pytest

from app.model.address import Address
from tests.web.rig import Page, Server, running

FOLLOWING = Address(0x6065)


@pytest.fixture
async def server() -> AsyncIterator[Server]:
    async with running() as started:
        yield started


async def rows(server: Server, **asked: object) -> Any:
    answer = await server.client.get("/api/live/frames", params={name: str(one) for name, one in asked.items()})
    assert answer.status_code == 200, answer.text
    return answer.json()


async def test_a_page_of_frames_with_filters_of_an_address_bar(server: Server) -> None:
    server.feeder.heartbeat(11, 5)
    server.feeder.read(11, FOLLOWING, b"\x64\0\0\0")
    server.feeder.read(12, FOLLOWING, b"\x64\0\0\0")
    now_ns = server.bench.stamper()
    page = await rows(server, before=now_ns)
    assert [one["service"] for one in page["rows"]] == ["heartbeat", *["sdo-request", "sdo-response"] * 2]
    assert page["source"] == "ring"
    only = await rows(server, before=now_ns, nodes="11,13", services="sdo-response", q="following error")
    assert [(one["node"], one["items"][0]["text"]) for one in only["rows"]] == [(11, "1.00")]
    assert (await rows(server, before=now_ns, ids="70B", data="05"))["rows"][0]["service"] == "heartbeat"
    assert (await rows(server, before=now_ns, errors="true"))["rows"] == []


async def test_a_time_stamp_that_a_browser_has_rounded_finds_its_frame(server: Server) -> None:
    for number in range(50):
        server.feeder.heartbeat(11 + number % 3, 5)
    page = await rows(server, before=server.bench.stamper())
    for one in page["rows"]:
        rounded = int(Decimal(repr(float(one["t_ns"]))))  # as JavaScript prints it
        around = await rows(server, around=rounded, limit=3)
        assert one["t_ns"] in [row["t_ns"] for row in around["rows"]]


@pytest.mark.parametrize(
    ("asked", "status"),
    [
        ({}, 400),
        ({"before": 1, "after": 1}, 400),
        ({"before": 1, "ids": "xyz"}, 400),
        ({"before": 1, "data": "4"}, 400),
        ({"before": 1, "services": "nothing"}, 400),
        ({"before": 1, "nodes": "a"}, 400),
        ({"before": -1}, 422),
        ({"before": 1, "limit": 5000}, 422),
    ],
)
async def test_what_cannot_be_asked_is_a_problem(server: Server, asked: dict[str, object], status: int) -> None:
    answer = await server.client.get("/api/live/frames", params={name: str(one) for name, one in asked.items()})
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"


PATHS = ("frames?before=1", "bus/nodes", "bus/identifiers", "bus/transfers", "bus/emergencies", "bus/load")


@pytest.mark.parametrize("path", PATHS)
async def test_every_table_is_there_for_a_session_and_for_nobody_else(server: Server, path: str) -> None:
    server.feeder.write(11, FOLLOWING, b"\x64\0\0\0")
    assert (await server.client.get(f"/api/live/{path}")).status_code == 200
    assert (await server.stranger.get(f"/api/live/{path}")).status_code == 401


async def subscribe(page: Page, **trace: object) -> None:
    request = {"type": "subscribe", "topics": ["trace"], "trace": trace}
    await page.socket.send(json.dumps(request))


async def test_the_running_trace_comes_by_the_socket_and_a_filter_starts_it_anew(server: Server) -> None:
    async with server.socket() as socket:
        page = Page(socket)
        await subscribe(page, id=1)
        await page.until("trace", lambda data: data["id"] == 1)
        server.feeder.heartbeat(11, 5)
        server.feeder.read(11, FOLLOWING, b"\x64\0\0\0")
        first = await page.until("trace", lambda data: data["rows"] != [])
        assert [row["service"] for row in first["data"]["rows"]] == ["heartbeat", "sdo-request", "sdo-response"]
        await subscribe(page, id=2, services=["sdo-response"])
        start = await page.until("trace", lambda data: data["id"] == 2)
        assert (start["data"]["seen"], start["data"]["start_t_ns"] > first["data"]["start_t_ns"]) == (0, True)
        server.feeder.heartbeat(11, 5)
        server.feeder.read(11, FOLLOWING, b"\x65\0\0\0")
        told = (await page.until("trace", lambda data: data["rows"] != []))["data"]
        assert (told["seen"], told["matched"], told["sent"], told["left_out"]) == (3, 1, 1, 0)
        await subscribe(page, id=3, ids="no identifier")
        wrong = await page.until("trace", lambda data: data["id"] == 3)
        assert "identifier" in wrong["data"]["invalid"]


async def test_a_page_that_asks_for_no_trace_gets_none(server: Server) -> None:
    async with server.socket() as socket:
        page = Page(socket)
        await page.subscribe("link", "nodes")
        server.feeder.heartbeat(11, 5)
        for _ in range(3):
            await page.until("heartbeat")
        assert "trace" not in {message["type"] for message in page.heard}
