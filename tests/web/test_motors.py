"""The routes of the motor database: who may do what, what the page is told, files, comparison, motors of real twins."""

from __future__ import annotations

import base64
from collections.abc import AsyncIterator
from contextlib import aclosing
from typing import Any

import httpx
import pytest

from app.service.connection import Connection
from tests.web.rig import Server, running
from tests.web.test_login import BEN, log_in, with_anna

PMC = "wtg-07/blade-1/pmc"
EXAMPLE = "0197a000-0000-7000-8000-00000000e001"
MOTOR: dict[str, Any] = {
    "maker": "Lorentz",
    "type": "PM 5.5-2",
    "plate": {"power_kw": 5.5, "current_a": 11.3},
    "values": {"6073": 1500, "6076": 11_000, "6410:02": 7},
    "remarks": "from the shelf",
}


@pytest.fixture
async def server() -> AsyncIterator[Server]:
    async with running() as started:
        yield started


@pytest.fixture
async def wired(connection: Connection) -> AsyncIterator[Server]:
    """A server in front of six twins."""
    async with running(connection) as started:
        yield started


async def added(client: httpx.AsyncClient, **changes: Any) -> dict[str, Any]:
    answer = await client.post("/api/motors", json={**MOTOR, **changes})
    assert answer.status_code == 200, answer.text
    motor: dict[str, Any] = answer.json()
    return motor


async def own(client: httpx.AsyncClient) -> list[dict[str, Any]]:
    """The motors that are no examples."""
    motors = (await client.get("/api/motors")).json()["motors"]
    return [motor for motor in motors if not motor["invented"]]


async def test_a_motor_is_added_changed_and_its_versions_read(server: Server) -> None:
    client = server.client
    first = await added(client)
    assert (first["version"], first["source"], first["person"], first["invented"]) == (1, "typed", "tester", False)
    assert first["plate"]["power_kw"] == 5.5 and first["plate"]["torque_nm"] is None
    assert first["disagreements"] == ["current_a"], "11.3 A on the plate, 11000 mA in 6076h"
    here = f"/api/motors/{first['id']}"
    change = {**MOTOR, "values": {"6076": 11_300}, "based_on": 1}
    second = (await client.put(here, json=change)).json()
    assert (second["version"], second["values"], second["disagreements"]) == (2, {"6076": 11_300}, [])
    assert (await client.get(f"{here}/versions")).json() == [second, first]
    assert await own(client) == [second]
    late = await client.put(here, json=change)
    assert (late.status_code, late.json()["code"]) == (409, "motor_changed")


async def test_what_does_not_fit_is_refused_with_its_reason(server: Server) -> None:
    client = server.client
    refused = [
        ("POST", "/api/motors", {**MOTOR, "maker": " "}, 422, "motor_field"),
        ("POST", "/api/motors", {**MOTOR, "values": {"6073": 2001}}, 422, "motor_field"),
        ("POST", "/api/motors", {**MOTOR, "values": {"6065": 1}}, 422, "motor_field"),
        ("POST", "/api/motors", {**MOTOR, "values": {"6073": 1.5}}, 422, "invalid"),
        ("POST", "/api/motors", {**MOTOR, "values": {"x": 1}}, 400, "usage"),
        ("POST", "/api/motors", {**MOTOR, "plate": {"power_kw": -1}}, 422, "motor_field"),
        ("POST", "/api/motors", {**MOTOR, "plate": {"power_w": 1}}, 422, "invalid"),
        ("PUT", f"/api/motors/{EXAMPLE}", {**MOTOR, "based_on": 1}, 409, "motor_invented"),
        ("PUT", "/api/motors/nothing", {**MOTOR, "based_on": 1}, 404, "motor_unknown"),
        ("GET", "/api/motors/nothing/versions", None, 404, "motor_unknown"),
        ("GET", "/api/motors/export?ids=nothing", None, 404, "motor_unknown"),
        ("POST", f"/api/motors/{EXAMPLE}/assign", {"device": "wtg-07/blade-9/pmc", "version": 1}, 400, "usage"),
        ("POST", f"/api/motors/{EXAMPLE}/assign", {"device": PMC, "version": 2}, 404, "motor_unknown"),
        ("GET", f"/api/motors/compare?left=motor:{EXAMPLE}&right=set:1", None, 400, "usage"),
    ]
    for method, path, body, status, code in refused:
        answer = await client.request(method, path, json=body)
        assert (answer.status_code, answer.json()["code"]) == (status, code), (path, body, answer.text)
    german = await client.post("/api/motors", json={**MOTOR, "maker": ""}, headers={"accept-language": "de"})
    assert german.json()["text"] == "Hersteller: darf nicht leer sein"
    assert await own(client) == []


async def test_only_an_expert_deletes(server: Server) -> None:
    anna = await with_anna(server)
    await anna.post("/api/users", json={**BEN, "role": "technician"})
    async with aclosing(await log_in(server, BEN)) as ben:
        motor = await added(ben)
        here = f"/api/motors/{motor['id']}"
        answer = await ben.delete(here)
        assert (answer.status_code, answer.json()["code"]) == (403, "role")
        assert len(await own(ben)) == 1
        assert (await anna.delete(here)).status_code == 200
        assert await own(anna) == []
        assert (await ben.get(f"{here}/versions")).json()[0]["deleted"]
    rows = (await anna.get("/api/audit")).json()["rows"]
    told = [(row["kind"], row["person"]) for row in rows if row["kind"].startswith("motor_")]
    assert told == [("motor_deleted", "Anna"), ("motor_added", "Ben")]


async def test_the_form_tells_units_limits_and_names(server: Server) -> None:
    form = (await server.client.get("/api/motors/form")).json()
    assert [field["name"] for field in form["plate"]][:2] == ["power_kw", "torque_nm"]
    entries = {entry["address"]: entry for entry in form["description"]["entries"]}
    assert (entries["6073"]["unit"], entries["6073"]["maximum"], entries["6073"]["scale"]) == ("%", 2000, 0.1)
    assert entries["6410:02"]["restore"] == "unit" and "6410:09" not in entries and "6065" not in entries
    assert entries["6402"]["enumeration"] in form["description"]["enumerations"]


async def test_motors_go_out_and_in_as_csv(server: Server) -> None:
    client = server.client
    await added(client)
    answer = await client.get("/api/motors/export")
    assert answer.headers["content-type"] == "text/csv; charset=utf-8"
    assert "attachment" in answer.headers["content-disposition"] and EXAMPLE not in answer.text
    changed = answer.text.replace("150.0", "160.0").encode()
    body = {"name": "motors.csv", "data": base64.b64encode(changed).decode()}
    taken = (await client.post("/api/motors/import", json=body)).json()
    assert [motor["values"]["6073"] for motor in taken["changed"]] == [1600] and taken["added"] == []
    bad = {"name": "bad.csv", "data": base64.b64encode(b"maker,type,6073\nA,B,1\nA,C,900\n").decode()}
    wrong = await client.post("/api/motors/import", json=bad)
    assert (wrong.status_code, wrong.json()["code"]) == (400, "motor_file")
    details = wrong.json()["details"]
    assert (details["file"], details["line"], details["column"]) == ("bad.csv", 3, "6073")
    assert "bad.csv, line 3, column 6073: it must be from 0.0 to 200.0 %" in wrong.json()["text"]
    assert len(await own(client)) == 1


async def test_a_motor_of_a_device_is_read_added_and_compared_with_it(wired: Server) -> None:
    client = wired.client
    early = (await client.get(f"/api/motors/compare?left=motor:{EXAMPLE}&right=live:{PMC}")).json()
    assert {row["state"] for row in early["values"]} == {"missing"}, "nothing of the device was read yet"
    known = {name: MOTOR[name] for name in ("maker", "type", "plate", "remarks")}
    answer = await client.post(f"/api/live/devices/{PMC}/motor", json=known)
    assert answer.status_code == 200, answer.text
    motor = answer.json()
    assert (motor["source"], motor["origin"]) == ("device", PMC)
    assert motor["values"]["6073"] == 2000 and "6410:09" not in motor["values"]
    (assigned,) = (await client.get("/api/motors")).json()["assigned"]
    assert (assigned["device"], assigned["motor_id"]) == (PMC, motor["id"])
    spec = f"motor:{motor['id']}@1"
    same = (await client.get(f"/api/motors/compare?left={spec}&right=live:{PMC}")).json()
    assert {row["state"] for row in same["values"]} == {"same", "unit"} and same["plate"] == []
    assert same["right"] == {"device": PMC, "motor": None}
    other = (await client.get(f"/api/motors/compare?left={spec}&right=motor:{EXAMPLE}")).json()
    rows = {row["address"]: row["state"] for row in other["values"]}
    assert (rows["6410:03"], rows["6076"], rows["6410:02"]) == ("same", "different", "unit")
    assert {row["field"]: row["state"] for row in other["plate"]}["power_kw"] == "same"
    refused = await client.post("/api/live/devices/wtg-07/blade-1/pmm/motor", json=known)
    assert (refused.status_code, refused.json()["code"]) == (400, "usage")


async def test_a_restore_is_planned_with_a_motor(wired: Server) -> None:
    client = wired.client
    motor = await added(client)
    station = PMC.rpartition("/")[0]
    spec = f"motor:{motor['id']}@1:{PMC}"
    answer = await client.post("/api/live/restore/plan", json={"station": station, "sets": [spec]})
    assert answer.status_code == 200, answer.text
    plan = answer.json()
    rows = {(row["device"], row["address"]): row for row in plan["rows"]}
    current = rows[PMC, "6073"]
    assert (current["treatment"], current["now_raw"], current["wanted_raw"]) == ("write", 2000, 1500)
    assert rows[PMC, "6410:02"]["treatment"] == "skip"
    assert [(one["device"], one["record"]) for one in plan["sources"]] == [(PMC, spec)]
    wrong = await client.post("/api/live/restore/plan", json={"station": station, "sets": [f"motor:x@1:{PMC}"]})
    assert (wrong.status_code, wrong.json()["code"]) == (400, "usage")
