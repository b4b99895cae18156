"""Restores over HTTP, against twins: what is planned, begun, confirmed, and who is kept from what meanwhile."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.model.set_record import Source
from app.service.backup import read_device, to_set
from app.service.connection import Connection
from app.store import restore_rows as rows
from app.store.audit_rows import Filter
from app.store.restore_rows import RestoreState
from app.store.store import Store
from tests.service.restore.conftest import changed, served
from tests.web.rig import DEADLINE_S, Server, running

__all__ = ["served"]

STATION = "wtg-07/blade-1"
PMM, PMC = f"{STATION}/pmm", f"{STATION}/pmc"
NEW: dict[str, dict[str, int]] = {PMM: {"3110:01": 490}, PMC: {"6065": 150}}
NOBODY = "0197a000-0000-7000-8000-000000000000"


@pytest.fixture
async def server(connection: Connection, tmp_path: Path) -> AsyncIterator[Server]:
    data = tmp_path / "data"
    async with running(connection, store=Store.open(data), data=data) as started:
        yield started
        await started.bench.restores.close()


async def sets_in_library(server: Server, wanted: dict[str, dict[str, int]] | None = None) -> list[str]:
    """Records of the station's sets, changed by ``NEW`` or what is ``wanted``."""
    sets = []
    for slug, changes in (NEW if wanted is None else wanted).items():
        target = server.connection.target(slug)
        report = await read_device(server.connection.driver(target), target)
        sets.append(changed(to_set(report, "wtg-07", "Anna", "backup", 0), changes))
    return [record.id for record in await server.bench.office.library.put(sets, Source.BACKUP)]


async def post(server: Server, path: str, body: dict[str, Any] | None = None) -> dict[str, Any]:
    answer = await server.client.post(path, json=body or {})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


async def until(server: Server, restore_id: str, *states: str) -> dict[str, Any]:
    """The restore once it is in one of ``states`` and, where that is an end, is not worked on any more."""
    async with asyncio.timeout(DEADLINE_S * 3):
        while True:
            doc: dict[str, Any] = (await server.client.get(f"/api/live/restores/{restore_id}")).json()
            if doc["state"] in states and (doc["end"] is None or not doc["running"]):
                return doc
            await asyncio.sleep(0.05)


async def begun(server: Server, **options: Any) -> dict[str, Any]:
    request = {"station": STATION, "sets": await sets_in_library(server), **options}
    plan = await post(server, "/api/live/restore/plan", request)
    assert plan["refusals"] == [], plan["refusals"]
    return await post(
        server, "/api/live/restore", {**request, "plan_hash": plan["hash"], "reason": "motor", "work_order": "WO-1"}
    )


async def test_from_the_plan_to_the_signed_record(server: Server) -> None:
    request = {"station": STATION, "sets": await sets_in_library(server)}
    plan = await post(server, "/api/live/restore/plan", request)
    writes = {(row["device"], row["address"]): row for row in plan["rows"] if row["treatment"] == "write"}
    assert set(writes) == {(PMM, "3110:01"), (PMC, "6065")}
    assert writes[PMM, "3110:01"]["now_shown"] == "50.0" and writes[PMM, "3110:01"]["wanted_shown"] == "49.0"
    assert [step["kind"] for step in plan["steps"]] == ["write", "write", "confirm", "save", "save", "prove", "prove"]
    assert {one["device"]: one["same_unit"] for one in plan["sources"]} == {PMM: True, PMC: True}
    doc = await post(server, "/api/live/restore", {**request, "plan_hash": plan["hash"], "confirm_s": 60})
    assert doc["blocks"] and doc["running"]
    doc = await until(server, doc["id"], "awaiting-confirmation")
    assert doc["can"] == ["confirm", "roll-back"] and 30 < doc["left_s"] <= 60
    await post(server, f"/api/live/restores/{doc['id']}/confirm")
    doc = await until(server, doc["id"], "done", "rolled-back", "incomplete")
    assert (doc["end"], doc["proven"], doc["blocks"], doc["can"]) == ("new", False, False, [])
    assert {value["state"] for value in doc["values"]} == {"done", "equal"}
    for form, kind in (("json", "application/json"), ("html", "text/html"), ("pdf", "application/pdf")):
        answer = await server.client.get(f"/api/records/{doc['id']}.{form}")
        assert answer.status_code == 200 and answer.headers["content-type"].startswith(kind), form
    assert [one["id"] for one in (await server.client.get("/api/live/restores?turbine=wtg-07")).json()] == [doc["id"]]
    audit = server.bench.office.audit
    await audit.flush()
    kinds = {row.kind for row in await audit.latest(Filter(), None, 100)}
    assert {"restore_begun", "restore_confirmed", "restore_done", "written", "saved"} <= kinds


async def test_everything_but_reading_stop_and_feather_is_shut_meanwhile(server: Server) -> None:
    doc = await begun(server)
    await until(server, doc["id"], "awaiting-confirmation")
    device = f"/api/live/devices/{PMM}"
    body = {"rows": [{"device": PMM, "address": "3110:01", "raw": 480}], "save": []}
    for path, request in (
        (f"{device}/write", {"address": "3110:01", "raw": 480}),
        (f"{device}/save", {}),
        (f"{device}/restart", {}),
        ("/api/live/disconnect", {}),
        ("/api/live/connect", {"turbine": "wtg-07"}),
        ("/api/live/visit/end", {}),
    ):
        answer = await server.client.post(path, json=request)
        found = (answer.status_code, answer.json()["code"])
        assert found == (409, "restore_open") or (path.endswith("/end") and answer.status_code == 409), path
    job = await post(server, "/api/live/writes", body)
    async with asyncio.timeout(DEADLINE_S):
        while job["state"] == "running":
            job = (await server.client.get(f"/api/live/jobs/{job['id']}")).json()
    assert job["rows"][0]["error"]["code"] == "restore_open"
    assert (await server.client.post(f"{device}/read", json={"addresses": ["3110:01"]})).status_code == 200
    stopped = await post(server, "/api/live/stop")
    assert [axis["error"] for axis in stopped["axes"]] == [None] * 3
    await post(server, f"/api/live/restores/{doc['id']}/roll-back")
    doc = await until(server, doc["id"], "done", "rolled-back", "incomplete")
    assert (doc["end"], doc["cause_key"]) == ("old", "restore.cause.cancelled")
    assert (await server.client.post(f"{device}/write", json={"address": "3110:01", "raw": 480})).status_code == 200


async def test_stop_and_feather_pass_an_incomplete_restore_and_motion_does_not(server: Server) -> None:
    doc = await begun(server)
    await until(server, doc["id"], "awaiting-confirmation")
    await server.bench.restores.close()
    doc = await until(server, doc["id"], "incomplete")
    assert (doc["end"], doc["blocks"], doc["can"]) == ("incomplete", True, ["resume", "roll-back", "give-up"])
    assert doc["cause_key"] == "restore.cause.tool-ended"
    refused = await server.client.post(f"/api/live/devices/{PMC}/write", json={"address": "6065", "raw": 120})
    assert (refused.status_code, refused.json()["code"]) == (409, "restore_open")
    feathered = await post(server, "/api/live/feather")
    assert [axis["how"] != "failed" and axis["error"] is None for axis in feathered["axes"]] == [True] * 3
    stopped = await post(server, "/api/live/stop")
    assert [axis["how"] != "failed" and axis["error"] is None for axis in stopped["axes"]] == [True] * 3
    await post(server, f"/api/live/restores/{doc['id']}/resume")
    doc = await until(server, doc["id"], "done", "rolled-back", "incomplete")
    assert doc["end"] == "new", doc["cause_key"]


async def as_expert(server: Server) -> None:
    """The first user is one."""
    anna = {"name": "Anna", "password": "pitch and yaw 7"}
    assert (await server.client.post("/api/users", json=anna)).json()["role"] == "expert"
    assert (await server.client.post("/api/login", json=anna)).is_success


async def test_the_turbine_of_an_open_restore_stays_in_the_site_file(server: Server) -> None:
    """Taken out, it could never be connected again, and the restore never be finished."""
    doc = await begun(server)
    await until(server, doc["id"], "awaiting-confirmation")
    await server.bench.restores.close()
    await post(server, "/api/live/disconnect")
    revision = (await server.client.get("/api/settings/site")).json()["revision"]
    refused = await server.client.delete(f"/api/settings/site/turbines/wtg-07?revision={revision}")
    assert (refused.status_code, refused.json()["code"]) == (409, "restore_open")


async def test_giving_up_needs_a_reason_and_opens_the_gate(server: Server) -> None:
    doc = await begun(server)
    await until(server, doc["id"], "awaiting-confirmation")
    path = f"/api/live/restores/{doc['id']}/give-up"
    assert (await server.client.post(path, json={"reason": "PMC exchanged"})).json()["code"] == "role"
    await as_expert(server)
    early = await server.client.post(path, json={"reason": "PMC exchanged"})
    assert (early.status_code, early.json()["code"]) == (409, "restore_state"), "it is worked on"
    await server.bench.restores.close()
    assert (await server.client.post(path, json={"reason": "   "})).status_code == 422
    given = (await server.client.post(path, json={"reason": "PMC exchanged"})).json()
    assert (given["end"], given["blocks"], given["can"]) == ("given-up", False, [])
    written = await server.client.post(f"/api/live/devices/{PMC}/write", json={"address": "6065", "raw": 120})
    assert written.status_code == 200, written.text


async def test_what_is_open_is_listed_however_much_came_after_it(server: Server) -> None:
    doc = await begun(server)
    await until(server, doc["id"], "awaiting-confirmation")
    store = server.bench.office.store
    (row,) = await store.run(rows.open_restores)
    later = replace(row, id=NOBODY, state=RestoreState.DONE, started_ns=row.started_ns + 1)
    await store.run(lambda kept: rows.add_restore(kept, later, []))
    listed = "/api/live/restores?limit=1"
    assert [one["id"] for one in (await server.client.get(listed)).json()] == [NOBODY]
    (found,) = (await server.client.get(f"{listed}&open=true")).json()
    assert (found["id"], found["state"]) == (doc["id"], "awaiting-confirmation")
    assert (await server.client.get(f"{listed}&open=true&turbine=wtg-08")).json() == []
    await server.bench.restores.close()
    (found,) = (await server.client.get(f"{listed}&open=true")).json()
    assert (found["id"], found["end"]) == (doc["id"], "incomplete")
    await post(server, f"/api/live/restores/{doc['id']}/roll-back")
    await until(server, doc["id"], "rolled-back")
    assert (await server.client.get(f"{listed}&open=true")).json() == []


async def test_what_is_refused_is_refused_with_reasons(server: Server) -> None:
    sets = await sets_in_library(server)
    request = {"station": STATION, "sets": sets}
    server.connection.recording, recording = None, server.connection.recording
    plan = await post(server, "/api/live/restore/plan", request)
    assert [one["code"] for one in plan["refusals"]] == ["not-recording"]
    answer = await server.client.post("/api/live/restore", json={**request, "plan_hash": plan["hash"]})
    assert (answer.status_code, answer.json()["code"]) == (409, "restore_refused")
    assert answer.json()["details"]["refusals"][0]["text_key"] == "restore.refusal.not-recording"
    server.connection.recording = recording
    answer = await server.client.post("/api/live/restore", json={**request, "plan_hash": "0" * 64})
    assert (answer.status_code, answer.json()["code"]) == (409, "restore_changed")
    assert (await server.client.get("/api/live/restores")).json() == []


async def plan_of(server: Server, changes: dict[str, dict[str, int]], **options: Any) -> dict[str, Any]:
    """The plan for the station's values with ``changes``."""
    request = {"station": STATION, "sets": await sets_in_library(server, changes), **options}
    return await post(server, "/api/live/restore/plan", request)


async def test_to_restore_as_an_expert_is_a_choice_that_needs_the_role(server: Server) -> None:
    """A factory value is taken only where it is asked for; the role alone does not ask, and asking is no role."""
    changes = {PMM: {"30F1:01": 513}}
    sets = await sets_in_library(server, changes)
    for path, more in (("/api/live/restore/plan", {}), ("/api/live/restore", {"plan_hash": "0" * 64})):
        body = {"station": STATION, "sets": sets, "expert": True, **more}
        refused = await server.client.post(path, json=body)
        assert (refused.status_code, refused.json()["code"]) == (403, "role"), path
    await as_expert(server)
    plain = await plan_of(server, changes)
    chosen = await plan_of(server, changes, expert=True)
    treated = [
        next((row["treatment"], row["why"]) for row in plan["rows"] if row["address"] == "30F1:01")
        for plan in (plain, chosen)
    ]
    assert treated == [("skip", "needs-expert"), ("write", None)]
    assert plain["hash"] != chosen["hash"]
    for term in ({"other_blades_confirmed": True}, {"accepted": ["oat.dc_link_ladder"]}):
        body = {"station": STATION, "sets": sets, **term}
        refused = await server.client.post("/api/live/restore/plan", json=body)
        assert (refused.status_code, refused.json()["code"]) == (400, "usage"), term


async def test_a_plan_tells_what_it_breaks_from_what_is_broken_and_what_it_mends(server: Server) -> None:
    ladder, battery, loss = "oat.dc_link_ladder", "oat.pmc_minimum_below_battery", "oat.connection_loss"

    def told(plan: dict[str, Any]) -> dict[str, bool]:
        return {one["rule"]: one["is_new"] for one in plan["findings"] if one["verdict"] == "broken"}

    whole = await sets_in_library(server, {PMC: {}})
    torn = await plan_of(server, {PMC: {"6510:04": 410}})
    assert (told(torn)[ladder], told(torn)[loss], torn["mended"]) == (True, False, [])
    assert [(one["rule"], one["is_new"]) for one in torn["blockers"]] == [(ladder, True), (battery, True)]
    written = {"address": "6510:04", "raw": 410}
    assert (await server.client.post(f"/api/live/devices/{PMC}/write", json=written)).is_success
    plan = await post(server, "/api/live/restore/plan", {"station": STATION, "sets": whole})
    assert ladder not in told(plan)
    assert [one["rule"] for one in plan["mended"]] == [ladder, battery]


WRONG: list[tuple[str, dict[str, Any], int, str]] = [
    ("/api/live/restore/plan", {"station": STATION, "sets": []}, 422, "invalid"),
    ("/api/live/restore/plan", {"station": "wtg-07/blade-9", "sets": [NOBODY]}, 404, "set_unknown"),
    ("/api/live/restore/plan", {"station": STATION, "sets": [NOBODY], "more": 1}, 422, "invalid"),
    ("/api/live/restore", {"station": STATION, "sets": [NOBODY]}, 422, "invalid"),
    (
        "/api/live/restore",
        {"station": STATION, "sets": [NOBODY], "plan_hash": "0" * 64, "confirm_s": 1},
        422,
        "invalid",
    ),
    (f"/api/live/restores/{NOBODY}/confirm", {}, 404, "restore_unknown"),
    (f"/api/live/restores/{NOBODY}/roll-back", {}, 404, "restore_unknown"),
    (f"/api/live/restores/{NOBODY}/resume", {}, 404, "restore_unknown"),
]


async def test_wrong_input_is_named(server: Server) -> None:
    for path, body, status, code in WRONG:
        answer = await server.client.post(path, json=body)
        assert (answer.status_code, answer.json()["code"]) == (status, code), path
    for file in (f"{NOBODY}.html", f"{NOBODY}.exe", "..%2Fstore.sqlite3"):
        assert (await server.client.get(f"/api/records/{file}")).status_code == 404
