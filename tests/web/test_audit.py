"""The audit log's routes: what was done at the page stands in them, and the chain is shown and walked."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from app.service.connection import Connection
from app.store import database
from app.store.store import Store
from tests.service.test_audit import tamper
from tests.web.rig import Server, running
from tests.web.test_login import ANNA, BEN, with_anna

PMM = "wtg-07/blade-1/pmm"


@pytest.fixture
async def server(connection: Connection, tmp_path: Path) -> AsyncIterator[Server]:
    async with running(connection, store=Store.open(tmp_path / "data")) as started:
        yield started


async def test_writes_saves_stops_and_refusals_stand_in_the_log(server: Server) -> None:
    client = server.client
    device = f"/api/live/devices/{PMM}"
    assert (await client.post(f"{device}/write", json={"address": "3110:01", "raw": 490})).is_success
    assert (await client.post(f"{device}/save", json={})).is_success
    assert (await client.post("/api/live/stop", json={})).is_success
    await server.bench.office.audit.flush()
    page = (await client.get("/api/audit", params={"device": "wtg-07"})).json()
    kinds = {row["kind"]: row for row in page["rows"]}
    assert {"written", "saved"} <= set(kinds)
    written = kinds["written"]
    assert (written["device"], written["address"], written["person"]) == (PMM, "3110:01", "tester")
    assert (written["details"]["was"], written["details"]["now"], written["text_key"]) == (
        "50.0",
        "49.0",
        "journal.written",
    )
    stop = (await client.get("/api/audit", params={"kind": ["stop_sent", "nothing"]})).json()
    assert [row["kind"] for row in stop["rows"]] == ["stop_sent"]
    assert (await client.get("/api/audit", params={"q": "49.0"})).json()["rows"] == [written]
    changes = (await client.get(f"{device}/changes")).json()
    assert {address: one["now"] for address, one in changes["last"].items()} == {"3110:01": "49.0"}
    one = (await client.get(f"{device}/changes", params={"address": "3110:1"})).json()
    assert [(row["was"], row["now"], row["source"], row["person"]) for row in one["history"]] == [
        ("50.0", "49.0", "ours", "tester")
    ]
    assert (await client.get(f"{device}/changes", params={"address": "2222"})).status_code == 404


async def test_the_log_is_paged_from_the_newest_on(server: Server) -> None:
    client = await with_anna(server)
    for number in range(5):
        await client.post("/api/users", json={**BEN, "name": f"Ben {number}"})
    await server.bench.office.audit.flush()
    seen: list[int] = []
    before: int | None = None
    while True:
        page = (await client.get("/api/audit", params={"limit": 3} | ({"before": before} if before else {}))).json()
        seen += [row["seq"] for row in page["rows"]]
        before = page["before"]
        if before is None:
            break
    assert seen == list(range(len(seen), 0, -1))
    named = (await client.get("/api/audit", params={"person": "Anna", "kind": "user_added"})).json()["rows"]
    assert [row["details"]["name"] for row in named] == [f"Ben {number}" for number in (4, 3, 2, 1, 0)]
    assert ANNA["password"] not in str(page)
    for params in ({"limit": 0}, {"limit": 501}, {"before": 0}, {"q": "x" * 201}):
        assert (await client.get("/api/audit", params=params)).status_code == 422, params


async def test_the_head_is_shown_and_a_broken_chain_is_told(server: Server, tmp_path: Path) -> None:
    client = server.client
    await server.bench.office.audit.flush()
    head = (await client.get("/api/audit/head")).json()
    assert (head["waiting"], head["failing"], head["verified_t_ns"]) == (0, False, None)
    good = (await client.post("/api/audit/verify", json={})).json()
    assert (good["good"], good["rows"], good["broken_seq"]) == (True, head["seq"], None)
    assert (good["head_seq"], good["head_hash"]) == (head["seq"], head["hash"])
    assert (await client.get("/api/audit/head")).json()["verified_t_ns"] == good["t_ns"]
    assert (tmp_path / "data" / database.FILE).exists()
    tamper(tmp_path / "data", "UPDATE audit SET person = 'nobody' WHERE seq = 1")
    bad = (await client.post("/api/audit/verify", json={})).json()
    assert (bad["good"], bad["broken_seq"], bad["breach"]) == (False, 1, "changed")
    assert bad["breach_key"] == "audit_breach.changed"
