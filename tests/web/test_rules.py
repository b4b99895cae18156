"""The rules over HTTP: the list, and what they say of real twins with pending changes, and of kept sets."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Any

import pytest

from app.model.rules.all_rules import ALL
from app.model.set_record import Source
from app.service.as_found import read_as_found
from app.service.backup import read_devices, to_set
from app.service.connection import Connection
from tests.web.rig import Server, running

STATION = "wtg-07/blade-1"
PMM, PMC = f"{STATION}/pmm", f"{STATION}/pmc"
DELIVERED = {
    "oat.difference_off",
    "oat.connection_loss",
    "oat.self_test_off",
    "oat.motor_fan_off",
    "oat.mirror_overflow",
}


@pytest.fixture
async def server(connection: Connection) -> AsyncIterator[Server]:
    async with running(connection) as started:
        yield started


async def checked(server: Server, **asked: Any) -> dict[str, list[dict[str, Any]]]:
    """Findings by station."""
    answer = await server.client.post("/api/rules/check", json=asked)
    assert answer.status_code == 200, answer.text
    return {one["station"]: one["findings"] for one in answer.json()["stations"]}


async def test_the_list_has_every_rule(server: Server) -> None:
    rules = (await server.client.get("/api/rules")).json()["rules"]
    assert [one["id"] for one in rules] == [rule.id for rule in ALL]
    assert rules[0]["objects"]["oat-pmc"] == ["6510:04", "6510:05"] and rules[0]["stepwise"]


async def test_what_was_never_read_is_not_checked(server: Server) -> None:
    found = (await checked(server, station=STATION))[STATION]
    assert len(found) == sum(any(kind.startswith("oat-") for kind in rule.objects) for rule in ALL)
    assert {one["verdict"] for one in found} == {"not-checked"}


async def test_live_values_are_judged_with_what_is_pending(server: Server, connection: Connection) -> None:
    await read_as_found(connection, "tester")
    found = await checked(server)
    assert set(found) == {f"wtg-07/blade-{number}" for number in (1, 2, 3)}
    assert {one["rule"] for one in found[STATION]} == DELIVERED

    pending = {PMM: {"30FA:01": 610}, PMC: {"6510:04": 410}}
    found = await checked(server, station=STATION, pending=pending)
    assert set(found) == {STATION}
    broken = [one for one in found[STATION] if one["severity"] == "error"]
    assert [one["rule"] for one in broken] == [
        "oat.dc_link_ladder",
        "oat.dc_link_ladder",
        "oat.pmc_minimum_below_battery",
    ]
    assert broken[0]["places"] == [{"device": PMC, "address": "6510:04"}, {"device": PMM, "address": "30FA:03"}]
    assert (broken[0]["details"]["lower_v"], broken[0]["details"]["upper_v"]) == (410, 400)


async def test_kept_sets_of_a_station_are_judged_together(server: Server, connection: Connection) -> None:
    pairs = [(connection.driver(one), one) for one in connection.targets if one.slug in (PMM, PMC)]
    sets = [to_set(one, "wtg-07", "Anna", "", 1) for one in await read_devices(pairs)]
    records = await server.bench.office.library.put(sets, Source.BACKUP)
    found = await checked(server, columns=[f"set:{one.id}" for one in records])
    assert {one["rule"] for one in found[STATION]} == DELIVERED
    alone = await checked(server, columns=[f"set:{records[0].id}"])
    assert any(one["verdict"] == "not-checked" for one in alone[STATION])


async def test_what_is_not_there_is_named(server: Server) -> None:
    for asked in ({"pending": {"wtg-07/blade-9/pmm": {"30FA:01": 1}}}, {"columns": ["set:00000000"]}):
        answer = await server.client.post("/api/rules/check", json=asked)
        assert (answer.status_code, answer.json()["code"]) == (404, "column")
