"""The API against twins on a real line: what a person does, and how each refusal is told."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import pytest

from app.service.connection import Connection
from tests.web.rig import BUS, DEADLINE_S, Page, Server, running

PMM = "/api/live/devices/wtg-07/blade-1/pmm"
PMC = "/api/live/devices/wtg-07/blade-1/pmc"
LIMIT = "3110:01"


@pytest.fixture
async def server(connection: Connection) -> AsyncIterator[Server]:
    async with running(connection) as started:
        yield started


async def finished(server: Server, job: dict[str, Any]) -> dict[str, Any]:
    """The job once it runs no more."""
    async with asyncio.timeout(DEADLINE_S):
        while job["state"] == "running":
            job = (await server.client.get(f"/api/live/jobs/{job['id']}")).json()
    return job


async def test_session_texts_turbine_and_descriptions(server: Server) -> None:
    session = (await server.client.get("/api/session")).json()
    assert (session["role"], session["languages"], session["locale"]) == ("technician", ["en", "de"], "en")
    english, german = [(await server.client.get(f"/api/texts/{one}")).json() for one in ("en", "de")]
    assert english["axis_state.fault"] != german["axis_state.fault"]
    assert (await server.client.get("/api/texts/fr")).status_code == 422
    turbine = (await server.client.get("/api/live/turbine")).json()
    assert turbine["slug"] == "wtg-07"
    devices = [device for station in turbine["stations"] for device in station["devices"]]
    assert [device["node"] for device in devices] == [1, 11, 2, 12, 3, 13]
    assert not any(device["verifies"] for device in devices), "CAN gives no list of a device's objects"
    described = (await server.client.get("/api/live/descriptions/oat-pmm")).json()
    assert any(entry["address"] == LIMIT for entry in described["entries"])
    assert (await server.client.get("/api/live/descriptions/nothing")).status_code == 404


async def test_a_device_is_read_in_a_job_and_its_values_come_by_the_socket(server: Server) -> None:
    async with server.socket() as socket:
        page = Page(socket)
        await page.subscribe("values:wtg-07/blade-1/pmm")
        await page.until("values")
        answer = await server.client.post(f"{PMM}/read", json={"addresses": [LIMIT, "1008"]})
        assert answer.status_code == 200
        job = await finished(server, answer.json())
        assert (job["state"], job["done"], job["total"], job["failed"]) == ("done", 2, 2, [])
        heard: dict[str, Any] = {}
        while not {LIMIT, "1008"} <= set(heard):
            heard |= (await page.until("values"))["data"]["values"]
        assert heard[LIMIT]["raw"] == 500
        assert heard["1008"]["raw"].startswith("HUBSIDE TWIN")


async def test_a_value_is_written_saved_and_proven_by_a_restart(server: Server) -> None:
    written = (await server.client.post(f"{PMM}/write", json={"address": LIMIT, "raw": 490})).json()
    assert (written["was_raw"], written["sent_raw"], written["read_raw"], written["verified"]) == (500, 490, 490, True)
    saved = (await server.client.post(f"{PMM}/save", json={})).json()
    assert saved["took_s"] > 0
    restarted = (await server.client.post(f"{PMM}/restart", json={})).json()
    assert restarted["boot_up_t_ns"] > saved["t_ns"]
    await finished(server, (await server.client.post(f"{PMM}/read", json={"addresses": [LIMIT]})).json())
    async with server.socket() as socket:
        page = Page(socket)
        await page.subscribe("values:wtg-07/blade-1/pmm")
        proven = (await page.until("values"))["data"]["values"][LIMIT]
    assert (proven["raw"], proven["stored"]) == (490, {"raw": 490, "state": "proven"})


REFUSED: list[tuple[str, dict[str, Any], int, str]] = [
    (PMM, {"address": LIMIT, "raw": 40_000}, 422, "limit"),
    (PMM, {"address": LIMIT, "raw": "hot"}, 422, "value_type"),
    (PMM, {"address": LIMIT, "raw": 1.5}, 422, "value_type"),
    (PMM, {"address": LIMIT, "raw": True}, 422, "invalid"),
    (PMM, {"address": LIMIT}, 422, "invalid"),
    (PMM, {"address": LIMIT, "raw": 1, "factory": True}, 422, "invalid"),
    (PMM, {"address": "3060", "raw": 1}, 422, "access"),
    (PMM, {"address": "2222", "raw": 1}, 404, "unknown_object"),
    (PMM, {"address": "no address", "raw": 1}, 400, "usage"),
    ("/api/live/devices/wtg-07/blade-9/pmm", {"address": LIMIT, "raw": 1}, 404, "not_found"),
]


async def test_refusals_name_their_reason_and_send_nothing(server: Server) -> None:
    await finished(server, (await server.client.post(f"{PMM}/read", json={"addresses": [LIMIT]})).json())
    for device, body, status, code in REFUSED:
        answer = await server.client.post(f"{device}/write", json=body)
        problem = answer.json()
        assert (answer.status_code, problem["code"]) == (status, code), body
        assert answer.headers["content-type"] == "application/problem+json"
        assert problem["text_key"] == f"error.{code}"
    limit = (await server.client.post(f"{PMM}/write", json=REFUSED[0][1])).json()
    assert limit["details"]["maximum"] is not None
    written = (await server.client.post(f"{PMM}/write", json={"address": LIMIT, "raw": "500"})).json()
    assert (written["was_raw"], written["sent_raw"]) == (500, 500)


async def test_a_refusal_tells_the_state_of_the_device(server: Server) -> None:
    await finished(server, (await server.client.post(f"{PMC}/read", json={"addresses": ["6041"]})).json())
    problem = (await server.client.post(f"{PMC}/write", json={"address": "6064", "raw": 1})).json()
    assert problem["code"] == "access"
    assert problem["device_state"] == "axis_state.ready_to_switch_on"


async def test_a_job_can_be_cancelled(server: Server) -> None:
    job = (await server.client.post(f"{PMC}/read", json={"addresses": None})).json()
    assert job["total"] == 0 or job["total"] > 200
    cancelled = await server.client.delete(f"/api/live/jobs/{job['id']}")
    assert cancelled.status_code == 200
    assert (await finished(server, cancelled.json()))["state"] == "cancelled"
    assert (await server.client.get("/api/live/jobs/none")).status_code == 404


async def test_unknown_addresses_are_refused_before_the_job_starts(server: Server) -> None:
    answer = await server.client.post(f"{PMM}/read", json={"addresses": [LIMIT, "2222"]})
    assert (answer.status_code, answer.json()["code"]) == (404, "unknown_object")


async def test_stop_and_feather_reach_every_axis(server: Server) -> None:
    for command in ("stop", "feather"):
        done = (await server.client.post(f"/api/live/{command}", json={})).json()
        assert [axis["device"] for axis in done["axes"]] == [f"wtg-07/blade-{n}/pmc" for n in (1, 2, 3)]
        assert {axis["how"] for axis in done["axes"]} <= {"rpdo", "sdo"}


async def test_a_bus_that_is_gone_is_told_as_such(server: Server) -> None:
    await server.connection.buses[BUS].driver.close()
    answer = await server.client.post(f"{PMM}/write", json={"address": LIMIT, "raw": 490})
    assert (answer.status_code, answer.json()["code"]) == (503, "bus_lost")
    stop = await server.client.post("/api/live/stop", json={})
    assert stop.status_code == 200
    assert {axis["how"] for axis in stop.json()["axes"]} == {"failed"}
