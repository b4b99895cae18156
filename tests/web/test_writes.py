"""Many changes in one request: what each row says, what is refused as a whole, and who may."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import pytest

from app.service.connection import Connection
from tests.web.rig import DEADLINE_S, Server, running

LIMIT = "3110:01"
PMMS = [f"wtg-07/blade-{blade}/pmm" for blade in (1, 2, 3)]


@pytest.fixture
async def server(connection: Connection) -> AsyncIterator[Server]:
    async with running(connection) as started:
        yield started


def row(device: str, raw: int | str, expected: int | None = None, address: str = LIMIT) -> dict[str, Any]:
    return {"device": device, "address": address, "raw": raw, "expected_raw": expected}


async def written(server: Server, body: dict[str, Any]) -> dict[str, Any]:
    """The job once it runs no more."""
    answer = await server.client.post("/api/live/writes", json=body)
    assert answer.status_code == 200, answer.text
    job: dict[str, Any] = answer.json()
    assert {one["state"] for one in job["rows"]} == {"waiting"}, "rows are told from the first answer"
    async with asyncio.timeout(DEADLINE_S):
        while job["state"] == "running":
            job = (await server.client.get(f"/api/live/jobs/{job['id']}")).json()
    return job


async def test_a_batch_is_written_verified_and_saved_row_by_row(server: Server) -> None:
    job = await written(server, {"rows": [row(slug, 490, 500) for slug in PMMS], "save": PMMS})
    assert (job["state"], job["kind"], job["done"], job["total"]) == ("done", "write", 3, 3)
    for slug, found in zip(PMMS, job["rows"], strict=True):
        assert found == {
            "device": slug,
            "address": LIMIT,
            "state": "saved",
            "was_raw": 500,
            "read_raw": 490,
            "error": None,
        }


async def test_a_conflict_names_what_stands_there_now(server: Server) -> None:
    body = {"rows": [row(PMMS[0], 490, 520), row(PMMS[1], 490, 500)], "save": [], "on_failure": "go-on"}
    job = await written(server, body)
    assert [one["state"] for one in job["rows"]] == ["refused", "verified"]
    error = job["rows"][0]["error"]
    assert (error["code"], error["text_key"]) == ("conflict", "error.conflict")
    assert (error["details"]["expected"], error["details"]["found"]) == ("52.0", "50.0")


async def test_refused_rows_tell_why_and_keep_the_rest_from_being_sent(server: Server) -> None:
    rows = [row(PMMS[0], 490), row(PMMS[1], 40_000), row(PMMS[2], 1, address="30F1:01")]
    job = await written(server, {"rows": rows, "save": PMMS})
    assert [one["state"] for one in job["rows"]] == ["waiting", "refused", "refused"]
    assert [one["error"] and one["error"]["code"] for one in job["rows"]] == [None, "limit", "access"]


WHOLE: list[tuple[dict[str, Any], int, str]] = [
    ({"rows": [], "save": []}, 422, "invalid"),
    ({"rows": [row(PMMS[0], 1)] * 501, "save": []}, 422, "invalid"),
    ({"rows": [row(PMMS[0], 1)], "save": [], "on_failure": "never"}, 422, "invalid"),
    ({"rows": [row(PMMS[0], 490), row(PMMS[0], 480)], "save": []}, 400, "usage"),
    ({"rows": [row("wtg-07/blade-9/pmm", 490)], "save": []}, 404, "not_found"),
    ({"rows": [row(PMMS[0], 490, address="2222")], "save": []}, 404, "unknown_object"),
    ({"rows": [row(PMMS[0], "hot")], "save": []}, 422, "value_type"),
]


async def test_a_batch_that_makes_no_sense_is_refused_as_a_whole(server: Server) -> None:
    for body, status, code in WHOLE:
        answer = await server.client.post("/api/live/writes", json=body)
        assert (answer.status_code, answer.json()["code"]) == (status, code), body["rows"][:2]


async def test_the_plan_tells_order_what_has_none_and_what_is_not_known(server: Server) -> None:
    pmm, pmc = PMMS[0], "wtg-07/blade-1/pmc"
    both = [row(pmm, 780, address="30FA:02"), row(pmc, 790, address="6510:05")]
    unread = (await server.client.post("/api/live/writes/plan", json={"rows": both})).json()
    assert {"device": pmc, "address": "6510:05"} in unread["unknown"]
    for device in (pmm, pmc):
        addresses = [one["address"] for one in unread["unknown"] if one["device"] == device]
        done = await server.client.post(f"/api/live/devices/{device}/read", json={"addresses": addresses})
        assert done.status_code == 200, done.text

    plan = unread
    async with asyncio.timeout(DEADLINE_S):
        while plan["unknown"]:
            plan = (await server.client.post("/api/live/writes/plan", json={"rows": both})).json()
    assert plan == {
        "rows": [{"device": pmc, "address": "6510:05"}, {"device": pmm, "address": "30FA:02"}],
        "unordered": [],
        "unknown": [],
        "broken": [],
        "address_changes": [],
    }
    alone = (await server.client.post("/api/live/writes/plan", json={"rows": both[:1]})).json()
    assert (alone["rows"], alone["unordered"]) == ([], [{"device": pmm, "address": "30FA:02"}])
    assert [one["rule"] for one in alone["broken"]] == ["oat.dc_link_ladder"]
    accepted = (await server.client.post("/api/live/writes/plan", json={"rows": both[:1], "accepted": True})).json()
    assert (len(accepted["rows"]), accepted["unordered"]) == (1, [])

    job = await written(server, {"rows": both[:1], "save": []})
    assert [(one["state"], one["error"]["code"]) for one in job["rows"]] == [("refused", "order")]
    job = await written(server, {"rows": both, "save": []})
    assert [(one["device"], one["state"]) for one in job["rows"]] == [(pmc, "verified"), (pmm, "verified")]


async def test_a_stranger_writes_nothing(server: Server) -> None:
    answer = await server.stranger.post("/api/live/writes", json={"rows": [row(PMMS[0], 490)], "save": []})
    assert answer.status_code == 401
