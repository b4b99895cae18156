"""STOP and FEATHER over the socket of a page, against twins."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
import websockets

from app.service.connection import Connection
from app.store.audit_rows import Filter
from app.store.store import Store
from tests.web.rig import BUS, Page, Server, running

AXES = [f"wtg-07/blade-{number}/pmc" for number in (1, 2, 3)]


@pytest.fixture
async def server(connection: Connection, tmp_path: Path) -> AsyncIterator[Server]:
    async with running(connection, store=Store.open(tmp_path / "data")) as started:
        yield started


async def told(page: Page, command: str, number: int, **more: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """What is said of a command: at first, and at its end."""
    await page.say({"type": "urgent", "page": "p", "command": command, "number": number, **more})
    first = await page.until("urgent", lambda data: data["number"] == number)
    return first["data"], (await page.until("urgent", lambda data: data["number"] == number))["data"]


async def kinds(server: Server) -> list[tuple[str, str | None]]:
    await server.bench.office.audit.flush()
    return [(row.kind, row.person) for row in await server.bench.office.audit.latest(Filter(), None, 100)]


async def test_every_axis_is_told_and_the_page_hears_what_became_of_it(server: Server) -> None:
    async with server.socket() as connection:
        page = Page(connection)
        for number, command in enumerate(("stop", "feather"), 1):
            first, last = await told(page, command, number)
            assert first == {"number": number, "taken": True, "done": None}
            assert [axis["device"] for axis in last["done"]["axes"]] == AXES
            assert {axis["how"] for axis in last["done"]["axes"]} <= {"rpdo", "sdo"}
    assert {("stop_sent", "tester"), ("feather_sent", "tester")} <= set(await kinds(server))


async def test_one_axis_alone_is_told(server: Server) -> None:
    async with server.socket() as connection:
        page = Page(connection)
        _, last = await told(page, "stop", 1, device=AXES[1])
        assert [axis["device"] for axis in last["done"]["axes"]] == [AXES[1]]
        _, last = await told(page, "stop", 2, device="wtg-07/blade-1/pmm")
        assert last["done"]["axes"] == [], "a unit that is no axis is none of those told"


async def test_a_page_that_goes_away_has_stopped_all_the_same(server: Server) -> None:
    async with server.socket() as connection:
        await connection.send(json.dumps({"type": "urgent", "page": "p", "command": "stop", "number": 1}))
        await Page(connection).until("urgent")
    async with server.socket() as connection:  # what was begun is told to nobody, and comes to its end
        await Page(connection).until("hello")
        while ("stop_sent", "tester") not in await kinds(server):
            pass


async def test_a_bus_that_is_gone_fails_and_no_connection_is_not_taken(server: Server) -> None:
    await server.connection.buses[BUS].driver.close()
    async with server.socket() as connection:
        page = Page(connection)
        _, last = await told(page, "stop", 1)
        assert {axis["how"] for axis in last["done"]["axes"]} == {"failed"}
        assert {axis["error"]["code"] for axis in last["done"]["axes"]} == {"bus_lost"}
        server.bench.connection = None
        await page.say({"type": "urgent", "page": "p", "command": "stop", "number": 2})
        answer = await page.until("urgent")
        assert answer["data"] == {"number": 2, "taken": False, "done": None}


async def test_a_command_that_fails_by_a_defect_sends_the_page_another_way(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> tuple[()]:
        raise RuntimeError("broken")

    async with server.socket() as connection:
        monkeypatch.setattr(server.connection, "axes", broken)
        _, last = await told(Page(connection), "stop", 1)
        assert last == {"number": 1, "taken": False, "done": None}


async def test_what_comes_both_ways_is_done_once_and_what_comes_late_not_at_all(server: Server) -> None:
    """A request that waited behind others in the browser must not undo what was commanded since."""
    async with server.socket() as connection:
        page = Page(connection)
        _, feathered = await told(page, "feather", 1)
        again = (await server.client.post("/api/live/feather", json={"page": "p", "number": 1})).json()
        assert again == feathered["done"], "the very same, by its times"
        _, stopped = await told(page, "stop", 2)
        late = (await server.client.post("/api/live/feather", json={"page": "p", "number": 1})).json()
        assert [axis["how"] for axis in late["axes"]] == ["replaced"] * 3
        other = (await server.client.post("/api/live/stop", json={"page": "q", "number": 1})).json()
        assert [axis["how"] for axis in other["axes"]] != ["replaced"] * 3, "another page counts for itself"
        uncounted = (await server.client.post("/api/live/stop", json={})).json()
        assert uncounted["axes"][0]["sent_t_ns"] > stopped["done"]["axes"][0]["sent_t_ns"]
    sent = [kind for kind, _ in await kinds(server) if kind in ("stop_sent", "feather_sent")]
    assert sorted(sent) == ["feather_sent", "stop_sent", "stop_sent", "stop_sent"]


@pytest.mark.parametrize("wrong", [{"command": "start"}, {"number": 0}, {"page": ""}, {"force": True}])
async def test_what_is_no_command_closes_the_socket(server: Server, wrong: dict[str, Any]) -> None:
    async with server.socket() as connection:
        await connection.send(json.dumps({"type": "urgent", "page": "p", "command": "stop", "number": 1, **wrong}))
        with pytest.raises(websockets.ConnectionClosed) as closed:
            while True:
                await connection.recv()
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1008
    assert "stop_sent" not in {kind for kind, _ in await kinds(server)}
