"""Sets over HTTP: a backup of twins, the list, one set, its bytes, and what a cancelled backup leaves."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.model.sets import load_set
from app.service.connection import Connection
from tests.web.rig import Server, running

DEADLINE_S = 60.0


@pytest.fixture
async def server(connection: Connection, tmp_path: Path) -> AsyncIterator[Server]:
    async with running(connection) as started:
        started.bench.options = replace(started.bench.options, data=tmp_path)
        yield started


async def finished(server: Server, job: dict[str, Any]) -> dict[str, Any]:
    """The job once it runs no more; six devices take a while on a busy host."""
    async with asyncio.timeout(DEADLINE_S):
        while job["state"] == "running":
            await asyncio.sleep(0.05)
            job = (await server.client.get(f"/api/live/jobs/{job['id']}")).json()
    return job


async def test_a_backup_keeps_a_whole_set_of_every_device(server: Server, tmp_path: Path) -> None:
    assert (await server.client.get("/api/sets")).json()["files"] == []
    answer = await server.client.post("/api/live/backup", json={"reason": "before the change"})
    assert answer.status_code == 200
    job = await finished(server, answer.json())
    assert (job["state"], job["failed"], job["done"]) == ("done", [], job["total"])
    files = (await server.client.get("/api/sets")).json()["files"]
    devices = {one["head"]["origin"]["device"] for one in files}
    assert devices == {f"wtg-07/blade-{n}/{kind}" for n in (1, 2, 3) for kind in ("pmm", "pmc")}
    assert {one["head"]["origin"]["reason"] for one in files} == {"before the change"}
    assert {one["head"]["unread"] for one in files} == {0}

    name = next(one["name"] for one in files if one["head"]["origin"]["device"].endswith("blade-2/pmm"))
    doc = (await server.client.get(f"/api/sets/{name}")).json()
    assert doc["values"]["3110:01"] == 500
    assert doc["head"]["values"] == len(doc["values"])
    text = (await server.client.get(f"/api/sets/{name}/download")).text
    assert load_set(text, name).hash == doc["head"]["hash"]
    assert (tmp_path / "sets" / name).read_text() == text


async def test_a_cancelled_backup_leaves_no_set(server: Server) -> None:
    job = (await server.client.post("/api/live/backup", json={})).json()
    cancelled = await server.client.delete(f"/api/live/jobs/{job['id']}")
    assert (await finished(server, cancelled.json()))["state"] == "cancelled"
    assert (await server.client.get("/api/sets")).json()["files"] == []


async def test_a_set_that_was_changed_by_hand_is_refused_with_the_reason(server: Server, tmp_path: Path) -> None:
    folder = tmp_path / "sets" / "wtg-07"
    folder.mkdir(parents=True)
    (folder / "wrong.json").write_text("{}")
    (listed,) = (await server.client.get("/api/sets")).json()["files"]
    assert (listed["head"], bool(listed["reason"])) == (None, True)
    answer = await server.client.get("/api/sets/wtg-07/wrong.json")
    assert (answer.status_code, answer.json()["code"]) == (400, "set_file")


@pytest.mark.parametrize("name", ["wtg-07/nothing.json", "..%2F..%2F/site.toml", "../rec"])
async def test_names_lead_to_no_other_file(server: Server, name: str) -> None:
    assert (await server.client.get(f"/api/sets/{name}")).status_code == 404


async def test_without_a_connection_nothing_is_backed_up(server: Server) -> None:
    server.bench.connection = None
    answer = await server.client.post("/api/live/backup", json={})
    assert (answer.status_code, answer.json()["code"]) == (409, "not_connected")
    assert (await server.client.get("/api/sets")).status_code == 200
    assert (await server.stranger.post("/api/live/backup", json={})).status_code == 401
