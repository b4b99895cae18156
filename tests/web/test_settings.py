"""The routes of the settings against twins on a real line: adapters, the site file, polling, and what is audited."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from app.model.site import load_site
from app.service.connection import Connection
from tests.model.test_site_write import TEXT
from tests.service.conftest import Served
from tests.web.rig import DEADLINE_S, Server, running

ROOT = "/api/settings"


@pytest.fixture
async def server(connection: Connection) -> AsyncIterator[Server]:
    async with running(connection) as started:
        yield started


@pytest.fixture
def site(server: Server, tmp_path: Path) -> Path:
    """The bench has a site file."""
    path = tmp_path / "own-site.toml"
    path.write_text(TEXT, encoding="utf-8")
    server.bench.sites.file = path
    server.bench.sites.reload()
    return path


async def finished(server: Server, begun: dict[str, Any]) -> dict[str, Any]:
    async with asyncio.timeout(DEADLINE_S):
        while begun["state"] == "running":
            await asyncio.sleep(0.05)
            begun = (await server.client.get(f"{ROOT}/jobs/{begun['id']}")).json()
    return begun


async def post(server: Server, path: str, **body: Any) -> dict[str, Any]:
    answer = await server.client.post(f"{ROOT}{path}", json=body)
    assert answer.status_code == 200, answer.text
    done: dict[str, Any] = answer.json()
    return done


async def test_an_adapter_is_listed_tested_and_scanned(server: Server, served: Served) -> None:
    listed = (await server.client.get(f"{ROOT}/adapters")).json()
    assert [one["in_use"] for one in listed["adapters"] if one["connection"] == served.address] == [True]
    assert {place["interface"] for place in listed["places"]} >= {"slcan", "socketcan", "pcan"}

    done = await finished(server, await post(server, "/adapters/test", connection=served.address))
    assert (done["state"], done["heard"]["verdict"], done["heard"]["shared"]) == ("done", "fits", True)
    assert done["heard"]["nodes"] == [1, 2, 3, 11, 12, 13]

    done = await finished(server, await post(server, "/scan", connection=served.address))
    assert [(one["station"], one["device"]) for one in done["scan"]["found"]] == [
        *((f"blade-{blade}", "pmm") for blade in (1, 2, 3)),
        *((f"blade-{blade}", "pmc") for blade in (1, 2, 3)),
    ]
    assert (await server.client.get(f"{ROOT}/jobs/{done['id']}")).json() == done


async def test_a_search_that_is_refused_says_why(server: Server) -> None:
    done = await finished(server, await post(server, "/adapters/bitrate", connection="socketcan:can7"))
    assert (done["state"], done["error"]["code"]) == ("failed", "settings")
    assert done["error"]["details"]["reason_key"] == "settings.refused.rate_is_set"
    refused = await server.client.post(f"{ROOT}/adapters/test", json={"connection": "nonsense"})
    assert (refused.status_code, refused.json()["code"]) == (400, "usage")


async def test_only_jobs_of_the_settings_are_told_here(server: Server) -> None:
    begun = await server.client.post("/api/live/devices/wtg-07/blade-1/pmm/read", json={"addresses": ["1000"]})
    assert begun.status_code == 200
    assert (await server.client.get(f"{ROOT}/jobs/{begun.json()['id']}")).status_code == 404


async def test_a_turbine_is_added_changed_refused_and_taken_out(server: Server, site: Path) -> None:
    state = (await server.client.get(f"{ROOT}/site")).json()
    assert (state["file"], state["made"], state["problem"]) == (str(site), True, None)
    (turbine,) = state["turbines"]
    added = {**turbine, "slug": "wtg-08", "name": "WTG-08"}
    body = {"revision": state["revision"], "turbine": added}
    state = (await server.client.post(f"{ROOT}/site/turbines", json=body)).json()
    assert [one["slug"] for one in state["turbines"]] == ["wtg-07", "wtg-08"]
    known = (await server.client.get("/api/turbines")).json()
    assert [one["slug"] for one in known] == ["wtg-07", "wtg-08"]

    stale = await server.client.put(f"{ROOT}/site/turbines/wtg-08", json=body)
    assert (stale.status_code, stale.json()["details"]["reason_key"]) == (409, "settings.refused.site_changed")

    added["stations"][0]["devices"][0]["node"] = 11
    body = {"revision": state["revision"], "turbine": added}
    wrong = await server.client.put(f"{ROOT}/site/turbines/wtg-08", json=body)
    assert (wrong.status_code, wrong.json()["code"]) == (400, "site")
    assert wrong.json()["details"]["key"] == "wtg-08/blade-1/pmc.node"

    gone = await server.client.delete(f"{ROOT}/site/turbines/wtg-07?revision={state['revision']}")
    assert (gone.status_code, gone.json()["details"]["reason_key"]) == (409, "settings.refused.turbine_connected")
    state = (await server.client.delete(f"{ROOT}/site/turbines/wtg-08?revision={state['revision']}")).json()
    assert [one["slug"] for one in state["turbines"]] == ["wtg-07"]
    assert [one.slug for one in load_site(site)] == ["wtg-07"]


async def test_a_name_that_stands_twice_in_a_list_is_refused(server: Server, site: Path) -> None:
    state = (await server.client.get(f"{ROOT}/site")).json()
    (turbine,) = state["turbines"]
    turbine["stations"].append(turbine["stations"][0])
    body = {"revision": state["revision"], "turbine": turbine}
    refused = await server.client.put(f"{ROOT}/site/turbines/wtg-07", json=body)
    assert refused.json()["details"]["key"] == "station.blade-1"
    assert load_site(site)[0].slug == "wtg-07"


async def test_polling_is_shown_changed_and_audited(server: Server) -> None:
    shown = (await server.client.get(f"{ROOT}/polling")).json()
    assert [one["description_id"] for one in shown["devices"]] == ["oat-pmm", "oat-pmc"]
    assert shown["buses"][0]["counts"] == {"oat-pmm": 3, "oat-pmc": 3}
    assert 0.02 < shown["buses"][0]["load"] < shown["load_cap"]
    choices = (await server.client.get(f"{ROOT}/polling/choices/oat-pmm")).json()
    assert "3110:01" in {one["address"] for one in choices}

    head = (await server.client.get("/api/audit/head")).json()
    numbers = {name: shown[name] for name in ("period_s", "slow_every", "rare_every", "load_cap")}
    body = {**numbers, "period_s": 0.2, "devices": {"oat-pmm": {"3110:01": "fast"}}}
    changed = (await server.client.put(f"{ROOT}/polling", json=body)).json()
    assert changed["period_s"] == 0.2
    assert [item["address"] for item in changed["devices"][0]["items"]] == ["3110:01"]
    assert changed["buses"][0]["load"] < shown["buses"][0]["load"]
    rows = (await server.client.get("/api/audit?kind=settings_changed")).json()["rows"]
    assert "period_s 0.1 → 0.2" in rows[0]["details"]["changes"]
    assert (await server.client.get("/api/audit/head")).json()["hash"] != head["hash"]

    unknown = await server.client.put(f"{ROOT}/polling", json={**body, "devices": {"oat-pmm": {"2FFF": "fast"}}})
    assert (unknown.status_code, unknown.json()["code"]) == (404, "unknown_object")
    too_fast = await server.client.put(f"{ROOT}/polling", json={**body, "period_s": 0.001})
    assert too_fast.status_code == 422


async def test_the_program_names_its_libraries_with_their_licences(server: Server) -> None:
    about = (await server.client.get(f"{ROOT}/about")).json()
    licences = {one["name"]: one["licence"] for one in about["libraries"]}
    assert licences["tomlkit"] == "MIT" and all(licences.values())
