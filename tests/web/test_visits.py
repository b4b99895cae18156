"""Visits, favourites and the comparison with the last visit, as the page asks for them."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest

from app.model.site import load_site
from app.service.bench import Bench
from app.service.sites import Sites
from app.store.store import Store
from app.web.access import Access
from app.web.app import create_app
from app.web.serve import launch_url, open_port, port_of, serve
from tests.e2e.conftest import site_for
from tests.service.conftest import Served
from tests.service.test_visits import describe, options
from tests.web.rig import DEADLINE_S, Server, running

PMM = "wtg-07/blade-1/pmm"
SINCE = "/api/live/changes-since-last-visit"


@pytest.fixture
async def page(served: Served, tmp_path: Path) -> AsyncIterator[httpx.AsyncClient]:
    """A client of a server whose bench connects by itself."""
    sites = Sites(load_site(site_for(served.address, tmp_path)), describe)
    bench = Bench(sites, options(), store=Store.open(tmp_path))
    listener = open_port(0)
    port = port_of(listener)
    access = Access(bench.office.sessions, port)
    try:
        async with (
            serve(create_app(bench, access, port), listener),
            httpx.AsyncClient(base_url=f"http://127.0.0.1:{port}", trust_env=False, timeout=30) as client,
        ):
            await client.get(launch_url(port, access.issue_token()))
            yield client
    finally:
        await bench.close()


async def connect(page: httpx.AsyncClient) -> None:
    assert (await page.post("/api/live/connect", json={"turbine": "wtg-07"})).is_success


async def all_read(page: httpx.AsyncClient) -> None:
    """Wait until every parameter is known."""

    async def unread() -> int:
        return sum(one["unread"] for one in (await page.get("/api/live/visit/left")).json())

    async with asyncio.timeout(2 * DEADLINE_S):
        while await unread():  # noqa: ASYNC110  it is asked for
            await asyncio.sleep(0.05)


async def ready(page: httpx.AsyncClient) -> dict[str, object]:
    """The comparison, once the devices are read."""

    async def asked() -> dict[str, object]:
        found: dict[str, object] = (await page.get(SINCE)).json()
        return found

    async with asyncio.timeout(2 * DEADLINE_S):
        while (found := await asked())["state"] == "reading":  # noqa: ASYNC110  it is asked for
            await asyncio.sleep(0.05)
    return found


async def test_a_visit_from_connecting_to_its_end(page: httpx.AsyncClient) -> None:
    assert (await page.get("/api/live/visit")).json() == {"visit": None}
    assert (await page.post("/api/live/visit/end", json={})).json()["code"] == "no_visit"
    assert (await page.get(SINCE)).json()["code"] == "not_connected"
    await connect(page)
    visit = (await page.get("/api/live/visit")).json()["visit"]
    assert (visit["turbine"], visit["person"], visit["ended_ns"]) == ("wtg-07", "anna", None)
    assert (await page.get(SINCE)).json()["state"] == "no-earlier-visit"
    changed = await page.patch("/api/live/visit", json={"work_order": "WO-3"})
    assert changed.json()["work_order"] == "WO-3"
    await all_read(page)
    ended = (await page.post("/api/live/visit/end", json={"reason": "noise", "work_order": "WO-3"})).json()
    assert (ended["id"], ended["reason"], ended["left_open"]) == (visit["id"], "noise", False)
    assert ended["ended_ns"] > ended["started_ns"]
    assert (await page.get("/api/live/turbine")).json() is None
    await connect(page)
    assert (await page.get("/api/live/visit")).json()["visit"]["id"] != visit["id"]
    found = await ready(page)
    assert (found["state"], found["visit"]["id"]) == ("ready", visit["id"])  # type: ignore[index]
    listed = (await page.get("/api/visits", params={"turbine": "wtg-07"})).json()
    assert [one["id"] for one in listed][1:] == [visit["id"]]
    assert (await page.get("/api/visits", params={"turbine": "wtg-99"})).json() == []


async def leaving(page: httpx.AsyncClient) -> dict[str, dict[str, int]]:
    """What would be kept as left, by device."""
    return {one["device"]: one for one in (await page.get("/api/live/visit/left")).json()}


async def read_all(page: httpx.AsyncClient) -> None:
    job = (await page.post(f"/api/live/devices/{PMM}/read", json={"addresses": None})).json()
    async with asyncio.timeout(2 * DEADLINE_S):
        while job["state"] == "running":
            await asyncio.sleep(0.05)
            job = (await page.get(f"/api/live/jobs/{job['id']}")).json()
    assert job["state"] == "done"


async def test_before_leaving_the_age_of_what_would_be_kept_is_told(page: httpx.AsyncClient) -> None:
    start_ns = time.time_ns()
    await connect(page)
    await all_read(page)
    before = await leaving(page)
    assert all(start_ns <= one["read_ns"] <= time.time_ns() and one["writes"] == 0 for one in before.values())
    for raw in (55, 50):
        written = await page.post(f"/api/live/devices/{PMM}/write", json={"address": "3110:01", "raw": raw})
        assert written.is_success
    after = await leaving(page)
    assert {slug: one["writes"] for slug, one in after.items()} == {slug: 2 * (slug == PMM) for slug in before}
    assert after[PMM]["read_ns"] == before[PMM]["read_ns"]
    await read_all(page)
    again = await leaving(page)
    assert again[PMM]["read_ns"] > before[PMM]["read_ns"]
    assert again[PMM]["writes"] == 0


async def test_of_a_device_that_started_anew_the_newest_complete_set_is_told(page: httpx.AsyncClient) -> None:
    await connect(page)
    await all_read(page)
    await ready(page)
    assert (await page.post(f"/api/live/devices/{PMM}/restart", json={})).is_success
    now = (await leaving(page))[PMM]
    assert now["unread"] + now["stale"] == now["parameters"]
    (found,) = (await page.get("/api/sets", params={"device": PMM})).json()["records"]
    assert (found["unread"], now["read_ns"]) == (0, found["t_ns"])


async def test_favourites_are_a_persons_own_list() -> None:
    async with running() as server:
        path = "/api/favourites/oat-pmm"
        assert (await server.client.get(path)).json() == {"addresses": []}
        given = {"addresses": ["6065", "3110:01", "0x3110:1", "6064"]}
        assert (await server.client.put(path, json=given)).json() == {"addresses": ["6065", "3110:01", "6064"]}
        assert (await server.client.get(path)).json() == {"addresses": ["6065", "3110:01", "6064"]}
        assert (await server.client.get("/api/favourites/oat-pmc")).json() == {"addresses": []}
        refused = await server.client.put(path, json={"addresses": ["6065", "no address"]})
        assert (refused.status_code, refused.json()["code"]) == (400, "usage")
        await check_own(server, path)


async def check_own(server: Server, path: str) -> None:
    """Somebody else has a list of their own."""
    await server.client.post("/api/users", json={"name": "Anna", "password": "pitch and yaw 7"})
    await server.client.post("/api/login", json={"name": "Anna", "password": "pitch and yaw 7"})
    assert (await server.client.get(path)).json() == {"addresses": []}
