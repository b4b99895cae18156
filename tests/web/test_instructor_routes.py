"""Faults and scenarios over the API and the socket: for our own twins alone, the same on every page."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from app.model.fault import CATALOGUE, FaultOrder
from app.model.site import load_site
from app.service.bench import Bench
from app.service.journal import Kind
from app.service.sites import Sites
from app.store.store import Store
from app.web.access import Access
from app.web.app import create_app
from app.web.serve import launch_url, open_port, port_of, serve
from tests.e2e.conftest import site_for
from tests.service.conftest import Served
from tests.service.instructor_rig import Control, controlled
from tests.service.test_visits import describe, options
from tests.web.rig import Feeder, Page, Server, make_connection, running

FAULTS = "/api/instructor/faults"
ROUTES = (
    ("GET", ""),
    ("GET", "/catalogue"),
    ("GET", "/scenarios"),
    ("POST", "/faults"),
    ("DELETE", "/faults"),
    ("DELETE", "/faults/1"),
    ("POST", "/play"),
    ("POST", "/stop"),
)


@pytest.fixture
async def control(served: Served, tmp_path: Path) -> AsyncIterator[Control]:
    async with controlled(served, tmp_path) as started:
        yield started


@pytest.fixture
async def server(control: Control, tmp_path: Path) -> AsyncIterator[Server]:
    """A server that has started the twins; nothing is connected yet."""
    sites = Sites(load_site(site_for(control.served.address, tmp_path)), describe)
    bench = Bench(sites, options(), store=Store.in_memory(), instructor=control.client)
    listener = open_port(0)
    port = port_of(listener)
    access = Access(bench.office.sessions, port)
    token = access.issue_token()
    connection = make_connection()
    base = f"http://127.0.0.1:{port}"
    guard = create_app(bench, access, port)
    replays = guard.app.state.replays  # type: ignore[attr-defined]
    try:
        async with (
            serve(guard, listener),
            httpx.AsyncClient(base_url=base, trust_env=False, timeout=30) as client,
            httpx.AsyncClient(base_url=base, trust_env=False, timeout=30) as stranger,
        ):
            await client.get(launch_url(port, token))
            yield Server(port, token, access, bench, connection, Feeder(connection), client, stranger, replays)
    finally:
        bench.connection = None
        await bench.close()


def problem(answer: httpx.Response, status: int, code: str) -> dict[str, Any]:
    assert answer.headers["content-type"] == "application/problem+json"
    found: dict[str, Any] = answer.json()
    assert (answer.status_code, found["status"], found["code"]) == (status, status, code), found
    return found


@pytest.mark.parametrize(("method", "path"), ROUTES)
async def test_twins_that_others_started_have_no_instructor(method: str, path: str) -> None:
    bodies = {"/faults": {"kind": "mains_failure"}, "/play": {"scenario": "short"}, "/stop": {}}
    body = bodies.get(path) if method == "POST" else None
    async with running() as elsewhere:
        answer = await elsewhere.client.request(method, f"/api/instructor{path}", json=body)
        assert "started" in problem(answer, 409, "no_instructor")["text"]


async def test_another_turbine_that_is_connected_takes_the_instructor_away(server: Server) -> None:
    assert (await server.client.get("/api/instructor")).json()["available"] is True
    server.bench.show(make_connection())
    problem(await server.client.post(FAULTS, json={"kind": "mains_failure"}), 409, "no_instructor")
    async with server.socket() as socket:
        page = Page(socket)
        await page.subscribe("instructor")
        told = (await page.until("instructor"))["data"]
        assert told == {"available": False, "answering": False, "faults": [], "playing": None}


async def test_the_catalogue_says_what_an_order_may_say(server: Server) -> None:
    kinds = {kind["id"]: kind for kind in (await server.client.get("/api/instructor/catalogue")).json()}
    assert list(kinds) == list(CATALOGUE)
    assert kinds["mains_failure"] == {
        "id": "mains_failure",
        "level": "device",
        "target": "turbine",
        "momentary": False,
        "parameters": [
            {"name": "remaining_percent", "unit": "%", "low": 0.0, "high": 130.0, "default": 0.0, "integer": False}
        ],
    }
    assert kinds["gust"]["momentary"] is True
    assert (kinds["node_gone"]["level"], kinds["node_gone"]["target"]) == ("wire", "node")


async def test_a_fault_is_put_in_and_taken_out(server: Server, control: Control) -> None:
    order = {"kind": "mains_failure", "blade": 2, "values": {"remaining_percent": 30}, "seconds": 60}
    answer = await server.client.post(FAULTS, json=order)
    assert answer.status_code == 201
    fault = answer.json()
    assert (fault["kind"], fault["blade"], fault["values"]) == ("mains_failure", 2, {"remaining_percent": 30.0})
    assert fault["until_ns"] - fault["since_ns"] == 60_000_000_000
    assert [one.order.blade for one in control.instructor.active] == [2]
    assert (await server.client.get("/api/instructor")).json()["faults"] == [fault]
    for _ in range(2):
        cleared = await server.client.delete(f"{FAULTS}/{fault['id']}")
        assert (cleared.status_code, cleared.json()["faults"]) == (200, [])
    assert control.instructor.active == ()
    noted = [(entry.kind, entry.person) for entry in server.bench.journal.latest()]
    assert noted == [(Kind.FAULT_SET, "anna"), (Kind.FAULT_CLEARED, "anna")]


async def test_a_refusal_names_the_field_and_the_limits_in_the_language_that_is_asked_for(
    server: Server, control: Control
) -> None:
    german = {"Accept-Language": "de"}
    order = {"kind": "mains_failure", "values": {"remaining_percent": 300}}
    found = problem(await server.client.post(FAULTS, json=order, headers=german), 422, "fault_value")
    assert found["details"]["field"] == "remaining_percent"
    assert (found["details"]["minimum"], found["details"]["maximum"], found["details"]["unit"]) == (0.0, 130.0, "%")
    assert found["text"].startswith("Der Fehler kann nicht") and "0 … 130 %" in found["text"]
    for wrong, field in (
        ({"kind": "flood"}, "kind"),
        ({"kind": "brake_stuck"}, "blade"),
        ({"kind": "node_gone", "node": 99}, "node"),
        ({"kind": "gust", "seconds": 5}, "for_s"),
    ):
        answer = await server.client.post(FAULTS, json=wrong)
        assert problem(answer, 422, "fault_order")["details"]["field"] == field
    problem(await server.client.post("/api/instructor/play", json={"scenario": "none"}), 422, "fault_order")
    assert control.instructor.active == ()


@pytest.mark.parametrize(
    "body",
    [
        b"{}",
        b'{"kind": "mains_failure", "blade": "2"}',
        b'{"kind": "mains_failure", "depth": 1}',
        b'{"kind": "mains_failure", "values": {"remaining_percent": NaN}}',
        b'{"kind": "mains_failure", "seconds": Infinity}',
    ],
)
async def test_what_is_no_order_is_refused(server: Server, body: bytes) -> None:
    answer = await server.client.post(FAULTS, content=body, headers={"Content-Type": "application/json"})
    problem(answer, 422, "invalid")


async def test_two_pages_see_the_same_and_are_told_at_once(server: Server) -> None:
    async with server.socket() as one, server.socket() as two:
        pages = [Page(one), Page(two)]
        for page in pages:
            await page.subscribe("instructor")
            assert (await page.until("instructor"))["data"]["faults"] == []
        await server.client.post(FAULTS, json={"kind": "node_gone", "node": 12})
        told = [(await page.until("instructor", lambda data: data["faults"]))["data"] for page in pages]
        assert told[0] == told[1]
        assert (told[0]["faults"][0]["node"], told[0]["available"], told[0]["answering"]) == (12, True, True)
        await server.client.delete(FAULTS)
        for page in pages:
            await page.until("instructor", lambda data: not data["faults"])


async def test_what_somebody_else_puts_in_is_told_too(server: Server, control: Control) -> None:
    async with server.socket() as socket:
        page = Page(socket)
        await page.subscribe("instructor", "events")
        await page.until("instructor")
        control.from_elsewhere(FaultOrder("phase_loss"))
        told = await page.until("instructor", lambda data: data["faults"])
        assert told["data"]["faults"][0]["kind"] == "phase_loss"
        await page.until("event", lambda data: data["text_key"] == "journal.fault_seen")


async def test_a_scenario_plays_and_is_stopped(server: Server) -> None:
    found = (await server.client.get("/api/instructor/scenarios")).json()
    assert {"name": "long", "title": "Long", "duration_s": 600.0, "seed": 7, "note": "Watch the brake."} in found
    playing = (await server.client.post("/api/instructor/play", json={"scenario": "long"})).json()["playing"]
    assert (playing["scenario"], playing["title"]) == ("long", "Long")
    assert playing["until_ns"] - playing["since_ns"] == 600_000_000_000
    assert (await server.client.post("/api/instructor/stop", json={})).json()["playing"] is None


async def test_twins_that_are_gone_are_told_as_such(server: Server, control: Control) -> None:
    control.server.stop()
    found = problem(await server.client.post(FAULTS, json={"kind": "mains_failure"}), 503, "twins_gone")
    assert "do not answer" in found["text"]
