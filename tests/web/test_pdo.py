"""PDOs over HTTP: what is known, what an edit would do, applying it, putting it back, and what is refused."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import pytest

from app.service.connection import Connection
from tests.web.rig import DEADLINE_S, Server, running

PATH = "/api/live/devices/wtg-07/blade-1/pmc"
PAGE = "5f2c1d"


@pytest.fixture
async def server(connection: Connection) -> AsyncIterator[Server]:
    async with running(connection) as started:
        yield started


async def pdos(server: Server) -> dict[str, Any]:
    answer = await server.client.get(f"{PATH}/pdos")
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


async def post(server: Server, path: str, body: dict[str, Any]) -> Any:
    answer = await server.client.post(f"{PATH}{path}", json=body)
    assert answer.status_code == 200, answer.text
    return answer.json()


async def ended(server: Server, job: dict[str, Any]) -> dict[str, Any]:
    async with asyncio.timeout(DEADLINE_S):
        while job["state"] == "running":
            job = (await server.client.get(f"/api/live/jobs/{job['id']}")).json()
    return job


async def tpdo2(server: Server, **changed: Any) -> dict[str, Any]:
    """An edit of TPDO2, from how it is set up now."""
    found = await pdos(server)
    if found["unread"]:
        await ended(server, await post(server, "/read", {"addresses": found["unread"]}))
        found = await pdos(server)
    base = next(one for one in found["pdos"] if (one["direction"], one["number"]) == ("tpdo", 2))["setup"]
    return {"direction": "tpdo", "number": 2, "base": base, "wanted": {**base, **changed}}


async def test_a_pdo_is_previewed_applied_and_put_back(server: Server) -> None:
    before = await pdos(server)
    assert len(before["unread"]) > 40 and all(one["setup"] is None for one in before["pdos"])
    edit = await tpdo2(server, cob_id=0x4000028B, event_ms=100)
    known = await pdos(server)
    assert known["unread"] == [] and known["keeps"] is False and known["undo"] is None
    assert {"object": "6064", "bits": 32, "rpdo": False, "tpdo": True} in known["mappable"]
    assert [one["stop_path"] for one in known["pdos"]].count(True) == 1

    seen = await post(server, "/pdos/preview", {"edits": [edit]})
    assert [(one["address"], one["raw"]) for one in seen["writes"]] == [("1801:05", 100), ("1801:01", 0x4000028B)]
    assert seen["findings"] == [one for one in seen["findings"] if one["severity"] == "note"]
    assert seen["cost"]["pdos_after"] > seen["cost"]["pdos_now"]
    assert (await pdos(server))["pdos"] == known["pdos"], "a preview changes nothing"

    job = await ended(server, await post(server, "/pdos/apply", {"page": PAGE, "edits": [edit]}))
    assert (job["state"], job["kind"], [row["state"] for row in job["rows"]]) == ("done", "pdo", ["verified"] * 2)
    undo = (await pdos(server))["undo"]
    assert (undo["stand"], undo["pdos"]) == ("ready", ["TPDO2"])
    back = await ended(server, await post(server, "/pdos/undo", {"page": PAGE}))
    assert back["state"] == "done"
    after = await pdos(server)
    assert after["pdos"] == known["pdos"] and after["undo"] is None


async def test_what_cannot_be_is_refused_with_its_reason(server: Server) -> None:
    edit = await tpdo2(server, cob_id=0x40000581)
    answer = await server.client.post(f"{PATH}/pdos/apply", json={"page": PAGE, "edits": [edit]})
    assert (answer.status_code, answer.json()["code"]) == (422, "pdo_refused")
    details = answer.json()["details"]
    assert (details["pdo"], details["reason_key"], details["id"]) == ("TPDO2", "page.pdo.finding.restricted", "581h")
    other = {**edit, "base": {**edit["base"], "event_ms": 7}}
    for path in ("apply", "preview"):
        body = {"edits": [other], **({"page": PAGE} if path == "apply" else {})}
        answer = await server.client.post(f"{PATH}/pdos/{path}", json=body)
        assert (answer.status_code, answer.json()["code"]) == (409, "pdo_changed")
    answer = await server.client.post(f"{PATH}/pdos/undo", json={"page": PAGE})
    assert (answer.status_code, answer.json()["code"]) == (409, "pdo_no_undo")
    assert (await server.client.get("/api/live/devices/wtg-07/blade-9/pmc/pdos")).status_code == 404
