"""The scope over HTTP: arm, trigger, look, take out as a file; what does not fit is told with its field."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from itertools import pairwise
from typing import Any

import pytest
from fastapi import Request, Response
from fastapi.responses import StreamingResponse

from app.model.address import Address
from app.service.connection import Connection
from app.service.scope import captures as captures_module
from app.service.scope.capture import CaptureLine, load_line
from app.web.routes.scope import capture_csv, capture_json
from tests.service.scope.test_analysis import capture
from tests.web.rig import DEADLINE_S, Server, running

AXIS = "wtg-07/blade-1/pmc"
STATUSWORD = f"{AXIS}/6041"
NODE = 11
ARM: dict[str, Any] = {
    "signals": [STATUSWORD, f"{STATUSWORD}.3"],
    "trigger": {"kind": "edge", "signal": f"{STATUSWORD}.3", "slope": "rising"},
    "total_s": 0.3,
    "pre_s": 0.1,
}


@asynccontextmanager
async def serving(connection: Connection | None = None) -> AsyncIterator[Server]:
    async with running(connection) as server:
        try:
            yield server
        finally:
            await server.bench.scope.close()


async def captured(server: Server) -> dict[str, Any]:
    """One capture, fed by hand: the statusword tells a fault."""
    assert (await server.client.post("/api/live/scope/arm", json=ARM)).status_code == 200
    for word in (0x0627, 0x0627, 0x0608, 0x0608):
        server.feeder.read(NODE, Address(0x6041), word.to_bytes(2, "little"))
    async with asyncio.timeout(DEADLINE_S):
        while not (found := (await server.client.get("/api/scope/captures")).json()):  # noqa: ASYNC110  no event
            await asyncio.sleep(0.02)
    (line,) = found
    assert (line["kept"], line["signals"], line["cause"]) == (True, 2, "trigger")
    document: dict[str, Any] = (await server.client.get(f"/api/scope/captures/{line['id']}")).json()
    return document


async def test_a_capture_is_made_read_named_taken_out_and_deleted() -> None:
    async with serving() as server:
        client = server.client
        assert (await client.get("/api/live/scope")).json()["phase"] == "idle"
        one = await captured(server)
        head, path = one["head"], f"/api/scope/captures/{one['head']['id']}"
        assert one["kept"]
        assert [signal["count"] for signal in head["signals"]] == [4, 4]
        line = (await client.get("/api/live/scope")).json()
        assert (line["phase"], line["captures"]) == ("done", [head["id"]])
        whole, bit = (await client.get(f"{path}/series")).json()
        assert whole["low"] == [0x627, 0x627, 0x608, 0x608]
        assert bit["low"] == [0, 0, 1, 1]
        assert bit["t_s"][2] == 0.0, "the trigger is the value that fulfilled it"
        xy = (await client.get(f"{path}/xy", params={"x": STATUSWORD, "y": f"{STATUSWORD}.3"})).json()
        assert (xy["instants"], xy["every"]) == (4, 1)
        rows = (await client.get(f"{path}/parameters")).json()
        assert [row["was"]["address"] for row in rows] == ["6041"]
        refused = await client.get(f"{path}/spectrum", params={"signal": STATUSWORD})
        assert (refused.status_code, refused.json()["code"]) == (422, "scope_spectrum")
        named = await client.patch(path, json={"name": "after the storm", "note": "blade 1"})
        assert named.json()["head"]["name"] == "after the storm"
        for language, sign in (("en", ","), ("de", ";")):
            csv = await client.get(f"{path}/csv", params={"language": language})
            assert csv.headers["content-disposition"].startswith("attachment")
            assert csv.text.splitlines()[1].count(sign) >= 3
        assert (await client.get(f"{path}/json")).json()["name"] == "after the storm"
        assert (await client.delete(path)).status_code == 200
        gone = await client.get(f"{path}/series")
        assert (gone.status_code, gone.json()["code"]) == (404, "scope_unknown")


async def turns_of(server: Server, response: Response) -> list[int]:
    """How often another coroutine had had its turn when each piece of an answer came."""
    count = 0

    async def others() -> None:
        nonlocal count
        while True:
            count += 1
            await asyncio.sleep(0)

    beside = asyncio.create_task(others())
    assert isinstance(response, StreamingResponse)
    seen = [count async for _piece in response.body_iterator]
    beside.cancel()
    return seen


async def test_the_loop_goes_on_while_a_large_capture_is_taken_out() -> None:
    """The stop of an axis must not wait for a file: between any two pieces of it others have their turn."""
    async with serving() as server:
        kept = server.bench.office.captures
        one = capture([(n / 1000, n) for n in range(30_000)], [(n / 1000, -n) for n in range(30_000)])
        head = await kept.keep(one, [])
        csv = await capture_csv(Request({"type": "http"}), kept, head.id, "en")
        for response, least in ((csv, 30), (await capture_json(kept, head.id), 90)):
            seen = await turns_of(server, response)
            assert len(seen) > least
            assert all(before < after for before, after in pairwise(seen))
        path = f"/api/scope/captures/{head.id}"
        text = (await server.client.get(f"{path}/csv")).text
        assert len(text.splitlines()) == 30_001
        whole = (await server.client.get(f"{path}/json")).json()
        assert [one["raw"][-1] for one in whole["signals"]] == [29_999, -29_999]


async def test_the_list_is_read_beside_the_loop_and_only_where_it_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    readers: list[bool] = []

    def noting(text: str) -> CaptureLine:
        readers.append(threading.current_thread() is threading.main_thread())
        return load_line(text)

    monkeypatch.setattr(captures_module, "load_line", noting)
    async with serving() as server:
        one = await captured(server)
        (line,) = (await server.client.get("/api/scope/captures")).json()
        assert "marks" not in line
        assert readers == [False]
        path = f"/api/scope/captures/{one['head']['id']}"
        await server.client.patch(path, json={"name": "again", "note": ""})
        (line,) = (await server.client.get("/api/scope/captures")).json()
        assert (line["name"], readers) == ("again", [False, False])
        await server.client.delete(path)
        assert (await server.client.get("/api/scope/captures")).json() == []


async def test_parameters_that_differ_now_are_told() -> None:
    async with serving() as server:
        server.feeder.read(NODE, Address(0x6065), (500).to_bytes(4, "little"))
        one = await captured(server)
        server.feeder.write(NODE, Address(0x6065), (600).to_bytes(4, "little"))
        rows = (await server.client.get(f"/api/scope/captures/{one['head']['id']}/parameters")).json()
        row = next(row for row in rows if row["was"]["address"] == "6065")
        assert (row["was"]["raw"], row["now_raw"], row["differs"]) == ("500", "600", True)
        same = next(row for row in rows if row["was"]["address"] == "6041")
        assert same["differs"] is False


async def seen(server: Server) -> dict[str, Any]:
    """The live view."""
    document: dict[str, Any] = (await server.client.get("/api/live/scope/view")).json()
    return document


async def test_the_live_view_shows_what_came_last() -> None:
    async with serving() as server:
        await server.client.post("/api/live/scope/arm", json={**ARM, "trigger": {"kind": "manual"}, "total_s": 60})
        server.feeder.read(NODE, Address(0x6041), b"\x27\x06")
        async with asyncio.timeout(DEADLINE_S):
            view = await seen(server)
            while not view["series"][0]["t_s"]:
                view = await seen(server)
        assert [one["low"] for one in view["series"]] == [[0x627], [0]]
        assert (await server.client.post("/api/live/scope/trigger", json={})).json()["phase"] == "capturing"
        again = await server.client.post("/api/live/scope/trigger", json={})
        assert (again.status_code, again.json()["code"]) == (409, "scope_state")
        assert (await server.client.post("/api/live/scope/stop", json={})).json()["phase"] == "done"


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"signals": []}, "signals"),
        ({"signals": [f"{AXIS}/9999"]}, f"{AXIS}/9999"),
        ({"total_s": 1000}, "total_s"),
        ({"trigger": {"kind": "event"}}, "event"),
    ],
)
async def test_what_does_not_fit_names_its_field(changed: dict[str, Any], field: str) -> None:
    async with serving() as server:
        answer = await server.client.post("/api/live/scope/arm", json={**ARM, **changed})
        assert (answer.status_code, answer.json()["code"]) == (422, "scope_settings")
        assert answer.json()["details"]["field"] == field
        assert (await server.client.get("/api/live/scope")).json()["phase"] == "idle"
