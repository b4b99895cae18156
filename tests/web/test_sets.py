"""The library over HTTP: a backup of twins, the list, one set, tags, files in and out, nameplates, recovery."""

from __future__ import annotations

import asyncio
import base64
import shutil
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.model.sets import dump_set, load_set
from app.service.connection import Connection
from app.service.office.audit import Action
from app.store.audit_rows import Filter
from tests.model.set_rig import whole_set
from tests.web.rig import ROOT, Server, running

DEADLINE_S = 60.0
SLUGS = {f"wtg-07/blade-{n}/{kind}" for n in (1, 2, 3) for kind in ("pmm", "pmc")}


@pytest.fixture
async def server(connection: Connection, tmp_path: Path) -> AsyncIterator[Server]:
    async with running(connection, data=tmp_path) as started:
        yield started


async def finished(server: Server, job: dict[str, Any]) -> dict[str, Any]:
    """The job once it runs no more; six devices take a while on a busy host."""
    async with asyncio.timeout(DEADLINE_S):
        while job["state"] == "running":
            await asyncio.sleep(0.05)
            job = (await server.client.get(f"/api/live/jobs/{job['id']}")).json()
    return job


async def listed(server: Server, **query: str) -> dict[str, Any]:
    answer = await server.client.get("/api/sets", params=query)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


async def imported(server: Server, name: str, data: bytes, **more: Any) -> Any:
    body = {"name": name, "data": base64.b64encode(data).decode(), **more}
    return await server.client.post("/api/sets/import", json=body)


async def test_a_backup_keeps_a_whole_set_of_every_device(server: Server, tmp_path: Path) -> None:
    assert (await listed(server))["records"] == []
    plate = {"device": "wtg-07/blade-2/pmm", "serial": " P 17 ", "again": "P 17"}
    assert (await server.client.put("/api/nameplates", json=plate)).json()["serial"] == "P 17"
    answer = await server.client.post("/api/live/backup", json={"reason": "before the change"})
    assert answer.status_code == 200
    job = await finished(server, answer.json())
    assert (job["state"], job["failed"], job["done"]) == ("done", [], job["total"])
    records = (await listed(server))["records"]
    assert {one["origin"]["device"] for one in records} == SLUGS
    assert {(one["origin"]["reason"], one["source"], one["unread"]) for one in records} == {
        ("before the change", "backup", 0)
    }
    assert len(list((tmp_path / "sets").glob("*/*.json"))) == 6, "written as files, and not taken in twice"

    record = next(one for one in records if one["origin"]["device"] == "wtg-07/blade-2/pmm")
    for key in (record["id"], record["hash"], record["hash"][:8]):
        doc = (await server.client.get(f"/api/sets/{key}")).json()
        assert doc["record"]["id"] == record["id"]
    assert doc["values"]["3110:01"] == 500
    assert len(doc["values"]) == record["values"]
    known = record["identity"]["serial"]
    assert record["identity"]["nameplate"] == (None if known else "P 17")
    text = (await server.client.get(f"/api/sets/{record['id']}/download")).text
    assert load_set(text, "x").hash == record["hash"]


@pytest.mark.parametrize("kind", ["json", "dcf", "csv"])
async def test_a_set_leaves_as_a_file_and_comes_back_as_the_same(server: Server, kind: str) -> None:
    parameters = whole_set("oat-pmc")
    first = await imported(server, "one.json", dump_set(parameters).encode())
    assert first.status_code == 200, first.text
    record = first.json()["record"]
    file = await server.client.get(f"/api/sets/{record['id']}/download", params={"format": kind})
    assert f'.{kind}"' in file.headers["content-disposition"]
    again = await imported(server, f"two.{kind}", file.content)
    assert (again.status_code, again.json()["record"]["id"]) == (200, record["id"])
    assert len((await listed(server))["records"]) == 1


async def test_a_file_that_says_nothing_of_itself_needs_a_device_and_names_what_is_unknown(server: Server) -> None:
    table = b"address,raw\n6065,1234\n2FFF,1\n"
    refused = await imported(server, "a.csv", table)
    assert (refused.status_code, refused.json()["code"]) == (400, "set_file")
    assert refused.json()["details"]["line"] == 1
    taken = (await imported(server, "a.csv", table, device="wtg-07/blade-1/pmc", reason="by hand")).json()
    assert taken["foreign"]
    assert [(one["address"], one["line"]) for one in taken["unknown"]] == [("2FFF", 3)]
    record = taken["record"]
    assert (record["origin"]["node"], record["origin"]["reason"], record["values"]) == (11, "by hand", 1)
    doc = (await server.client.get(f"/api/sets/{record['id']}")).json()
    assert doc["unread"]["6064"] == "not in the file"
    damaged = await imported(server, "a.csv", table + b"6064,much\n", device="wtg-07/blade-1/pmc")
    assert (damaged.status_code, damaged.json()["details"]["line"]) == (400, 4)
    no_base64 = await server.client.post("/api/sets/import", json={"name": "x", "data": "%"})
    assert no_base64.status_code == 400
    assert len((await listed(server))["records"]) == 1


async def test_the_largest_of_our_files_gets_through_and_a_flood_does_not(server: Server) -> None:
    large = await imported(server, "large.csv", b"address,raw\n" + b"x" * 200_000)
    assert large.status_code == 400
    flood = await imported(server, "flood.csv", b"x" * 10_000_000)
    assert flood.status_code == 413
    other = await server.client.put(
        "/api/nameplates", content=b"x" * 70_000, headers={"content-type": "application/json"}
    )
    assert other.status_code == 413


async def test_tags_go_from_set_to_set_and_stay_in_the_history(server: Server) -> None:
    one = whole_set("oat-pmc")
    two = replace(whole_set("oat-pmc"), origin=replace(one.origin, time="2026-03-05T00:00:00Z"))
    ids = [(await imported(server, "x.json", dump_set(each).encode())).json()["record"]["id"] for each in (one, two)]
    for key in ids:
        answer = await server.client.post(f"/api/sets/{key}/tags", json={"tag": "as-delivered", "on": True})
        assert answer.status_code == 200
    (bearer,) = (await listed(server, tag="as-delivered"))["records"]
    assert bearer["id"] == ids[1]
    assert bearer["tags"][0]["person"]
    golden = await server.client.post(f"/api/sets/{ids[0]}/tags", json={"tag": "golden", "on": True})
    assert golden.status_code == 403, "experts say which set is golden"
    found = await server.client.post(f"/api/sets/{ids[0]}/tags", json={"tag": "as-found", "on": True})
    assert (found.status_code, found.json()["code"]) == (422, "set_tag")
    await server.client.post(f"/api/sets/{ids[1]}/tags", json={"tag": "as-delivered", "on": False})
    assert (await listed(server, tag="as-delivered"))["records"] == []
    audit = server.bench.office.audit
    await audit.flush()
    rows = await audit.latest(Filter(kinds=(Action.SET_TAGGED.value, Action.SET_UNTAGGED.value)), None, 10)
    assert [row.kind for row in rows] == ["set_untagged", "set_tagged", "set_tagged"]


async def test_an_expert_is_told_why_a_set_with_unread_objects_cannot_be_golden(server: Server) -> None:
    anna = {"name": "Anna", "password": "pitch and yaw 7"}
    assert (await server.client.post("/api/users", json=anna)).json()["role"] == "expert"
    assert (await server.client.post("/api/login", json=anna)).status_code == 200
    lacking = whole_set("oat-pmc")
    whole = replace(lacking, origin=replace(lacking.origin, time="2026-03-05T00:00:00Z"), unread={})
    keys = [
        (await imported(server, "x.json", dump_set(each).encode())).json()["record"]["id"] for each in (lacking, whole)
    ]
    wanted = {"tag": "golden", "on": True}
    refused = await server.client.post(f"/api/sets/{keys[0]}/tags", json=wanted, headers={"Accept-Language": "de"})
    assert (refused.status_code, refused.json()["code"]) == (422, "set_incomplete")
    assert "erneut sichern" in refused.json()["text"]
    assert (await server.client.post(f"/api/sets/{keys[1]}/tags", json=wanted)).status_code == 200
    assert [one["id"] for one in (await listed(server, tag="golden"))["records"]] == [keys[1]]


async def test_a_nameplate_must_be_typed_the_same_twice(server: Server) -> None:
    typed = {"device": "wtg-07/blade-2/pmc", "serial": "P-1", "again": "P-2"}
    refused = await server.client.put("/api/nameplates", json=typed)
    assert (refused.status_code, refused.json()["code"]) == (422, "nameplate")
    assert "differ" in refused.json()["text"]
    empty = await server.client.put("/api/nameplates", json={**typed, "serial": " ", "again": " "})
    assert empty.status_code == 422
    assert (await server.client.get("/api/nameplates")).json() == []
    kept = await server.client.put("/api/nameplates", json={**typed, "again": "P-1"})
    assert kept.status_code == 200
    assert [one["serial"] for one in (await server.client.get("/api/nameplates")).json()] == ["P-1"]


async def test_sets_are_recovered_from_a_recording_with_the_instant_of_each_value(
    server: Server, tmp_path: Path
) -> None:
    folder = tmp_path / "recordings"
    folder.mkdir()
    shutil.copy(ROOT / "recordings" / "scenarios" / "7-service-visit.mcap", folder)
    answer = await server.client.post("/api/recordings/7-service-visit.mcap/recover-sets", json={})
    assert answer.status_code == 200, answer.text
    found = {one["record"]["origin"]["device"]: one for one in answer.json()["sets"]}
    assert set(found) == SLUGS
    blade = found["wtg-07/blade-2/pmc"]
    assert blade["doubtful"] > 0, "it was restarted in the visit"
    doc = (await server.client.get(f"/api/sets/{blade['record']['id']}")).json()
    assert doc["recording"] == "7-service-visit.mcap"
    assert doc["seen"].keys() == doc["values"].keys()
    assert {one["access"] for one in doc["seen"].values()} == {"read", "write"}
    again = (await server.client.post("/api/recordings/7-service-visit.mcap/recover-sets", json={})).json()
    assert {one["record"]["id"] for one in again["sets"]} == {one["record"]["id"] for one in found.values()}
    assert (await server.client.post("/api/recordings/none.mcap/recover-sets", json={})).status_code == 404


async def test_a_cancelled_backup_leaves_no_set(server: Server) -> None:
    job = (await server.client.post("/api/live/backup", json={})).json()
    cancelled = await server.client.delete(f"/api/live/jobs/{job['id']}")
    assert (await finished(server, cancelled.json()))["state"] == "cancelled"
    assert (await listed(server))["records"] == []


async def test_a_file_that_was_changed_by_hand_is_listed_with_line_and_reason(server: Server, tmp_path: Path) -> None:
    folder = tmp_path / "sets" / "wtg-07"
    folder.mkdir(parents=True)
    (folder / "wrong.json").write_text(dump_set(whole_set("oat-pmc")).replace('"6866:00": 0', '"6866:00": 1'))
    (folder / "good.json").write_text(dump_set(whole_set("oat-pmm")))
    async with asyncio.timeout(DEADLINE_S):
        while (found := await listed(server))["waiting"]:
            pass
    (bad,) = found["bad"]
    assert (bad["name"], "was changed" in bad["reason"]) == ("wtg-07/wrong.json", True)
    (good,) = found["records"]
    assert (good["source"], good["description_id"]) == ("file", "oat-pmm")
    (folder / "wrong.json").unlink()
    assert (await listed(server))["bad"] == []


@pytest.mark.parametrize("name", ["nothing", "..%2F..%2Fsite.toml", "0" * 64, "0000000"])
async def test_keys_lead_to_no_other_file(server: Server, name: str) -> None:
    assert (await server.client.get(f"/api/sets/{name}")).status_code == 404


async def test_descriptions_are_known_without_their_devices(server: Server) -> None:
    assert (await server.client.get("/api/descriptions/nanotec-pd4e")).json()["id"] == "nanotec-pd4e"
    assert (await server.client.get("/api/descriptions/none")).status_code == 404


async def test_without_a_connection_nothing_is_backed_up(server: Server) -> None:
    server.bench.connection = None
    answer = await server.client.post("/api/live/backup", json={})
    assert (answer.status_code, answer.json()["code"]) == (409, "not_connected")
    assert (await server.client.get("/api/sets")).status_code == 200
    assert (await server.stranger.post("/api/live/backup", json={})).status_code == 401
