"""Comparisons over HTTP, of real twins: columns, states, pending changes, and columns that cannot be shown."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

import pytest

from app.model.address import parse_address
from app.model.set_record import Source, Tag
from app.service.as_found import read_as_found
from app.service.connection import Connection
from app.service.office.visits import as_known
from tests.web.rig import Server, running

PMM = "wtg-07/blade-1/pmm"
PMC = "wtg-07/blade-1/pmc"


@pytest.fixture
async def server(connection: Connection) -> AsyncIterator[Server]:
    async with running(connection) as started:
        await read_as_found(connection, "tester")
        yield started


async def compared(server: Server, *columns: str, **more: Any) -> dict[str, Any]:
    answer = await server.client.post("/api/compare", json={"columns": columns, **more})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    counts = found["summary"]
    counted = sum(counts[state] for state in ("different", "same", "unit", "missing", "not_comparable"))
    assert counted == len(found["rows"])
    return found


def row(doc: dict[str, Any], address: str) -> dict[str, Any]:
    found: dict[str, Any] = next(one for one in doc["rows"] if one["address"] == address)
    return found


async def test_the_same_device_twice_is_the_same(server: Server) -> None:
    doc = await compared(server, f"live:{PMC}", f"live:{PMC}")
    assert doc["summary"]["same"] == len(doc["rows"]) > 70
    assert [(one["kind"], one["device"], one["twin"]) for one in doc["columns"]] == [("live", PMC, True)] * 2


async def test_pending_changes_stand_beside_what_the_device_has(server: Server) -> None:
    doc = await compared(server, f"live:{PMM}", f"editor:{PMM}", pending={PMM: {"3110:01": 490}})
    changed = row(doc, "3110:01")
    assert (changed["state"], changed["restore"]) == ("different", "copy")
    assert [(cell["raw"], cell["shown"], cell["unit"]) for cell in changed["cells"]] == [
        (500, "50.0", "°C"),
        (490, "49.0", "°C"),
    ]
    assert doc["summary"]["different"] == 1


async def test_a_column_that_cannot_be_shown_is_named(server: Server) -> None:
    for column, reason in (
        ("live:wtg-07/blade-9/pmm", "not-connected"),
        ("default:wtg-99/blade-1/pmm", "no-device"),
        ("left:wtg-07/blade-1/pmm", "no-visit"),
        ("blade 1", "no-spec"),
    ):
        answer = await server.client.post("/api/compare", json={"columns": [f"live:{PMM}", column]})
        problem = answer.json()
        assert (answer.status_code, problem["code"], problem["details"]["column"]) == (404, "column", column)
        assert problem["details"]["reason_key"] == f"compare.unresolved.{reason}"
        assert column in problem["text"]


async def test_blades_stand_side_by_side_and_what_is_bound_to_one_is_set_apart(server: Server) -> None:
    doc = (await server.client.get("/api/parity")).json()
    assert doc["turbine"] == "wtg-07"
    assert [(part["description_id"], part["blades"]) for part in doc["parts"]] == [
        ("oat-pmm", [1, 2, 3]),
        ("oat-pmc", [1, 2, 3]),
    ]
    assert all(len(row["cells"]) == 3 for part in doc["parts"] for row in part["comparison"]["rows"])


async def test_blades_of_a_turbine_that_is_not_connected_are_compared_by_their_latest_sets(server: Server) -> None:
    """A later fragment takes no complete set's place; a blade of which nothing is kept is named."""
    sets, day_ns = [], 24 * 3600 * 10**9
    for blade, limit, charge in ((1, 500, 5), (2, 510, 6)):
        target = server.connection.target(f"wtg-07/blade-{blade}/pmm")
        known = as_known(target, "wtg-07", "tester", 30 * day_ns)
        values = {**known.values, parse_address("3110:01"): limit, parse_address("3050"): charge}
        whole = replace(known, values=values, unread={})
        fragment = replace(whole, values={}, unread=dict.fromkeys(values, "no answer"))
        later = replace(fragment, origin=replace(whole.origin, time="1970-02-20T00:00:00Z"))
        sets += [whole, later]
    await server.bench.office.library.put(sets, Source.BACKUP)
    assert (await server.client.post("/api/live/disconnect", json={})).is_success
    address = "/api/parity?turbine=wtg-07&kind"
    (part,) = (await server.client.get(f"{address}=latest")).json()["parts"]
    assert (part["description_id"], part["blades"], part["without"]) == ("oat-pmm", [1, 2], [3])
    told = [(one["spec"], one["t_ns"], one["complete"]) for one in part["comparison"]["columns"]]
    assert told == [(f"latest:wtg-07/blade-{blade}/pmm", 30 * day_ns, True) for blade in (1, 2)]
    assert row(part["comparison"], "3110:01")["state"] == "different"
    assert row(part["comparison"], "3050")["state"] == "unit"
    assert part["comparison"]["summary"]["different"] == 1
    assert (await server.client.get(f"{address}=live")).json()["parts"] == []
    missing = await server.client.post("/api/compare", json={"columns": [f"latest:{PMC}", f"default:{PMC}"]})
    assert missing.json()["details"]["reason_key"] == "compare.unresolved.no-latest"


async def test_a_rule_that_a_column_breaks_is_told_at_its_row(server: Server) -> None:
    """The DC link's minimum must stay below its maximum: what is pending would break that."""
    highest = row(await compared(server, f"live:{PMM}", f"live:{PMM}"), "30FA:02")["cells"][0]["raw"]
    doc = await compared(server, f"live:{PMM}", f"editor:{PMM}", pending={PMM: {"30FA:01": highest + 100}})
    told = row(doc, "30FA:01")
    assert told["findings"], "no rule notices"
    assert all(numbers == [1] for numbers in told["found_in"].values())
    assert list(told["found_in"]) == told["findings"]


async def exported(server: Server, file_format: str, language: str = "en", same: bool = False) -> str:
    body = {"columns": [f"live:{PMM}", f"editor:{PMM}"], "pending": {PMM: {"3110:01": 490, "3300:01": 5}}}
    address = f"/api/compare/export?format={file_format}&same={same}"
    answer = await server.client.post(address, json=body, headers={"Accept-Language": language})
    assert answer.status_code == 200
    assert f'filename="comparison.{file_format}"' in answer.headers["content-disposition"]
    return answer.content.decode("utf-8-sig")


async def test_the_html_file_needs_nothing_else(server: Server) -> None:
    page = await exported(server, "html")
    assert "2 differ, " in page
    assert "50.0 °C" in page
    assert "49.0 °C" in page
    assert "TWIN" in page
    assert page.count("bit 0: X13.10, feather command (EFC)</th>") == 1, "a clamp is told once"
    assert not re.findall(r"<(?:script|link|img|iframe)|src=|href=|url\(", page)
    assert "default-src 'none'" in page
    assert "2 verschieden, " in await exported(server, "html", "de")


async def test_the_csv_file_has_a_row_a_difference_and_one_a_bit(server: Server) -> None:
    rows = list(csv.DictReader(io.StringIO(await exported(server, "csv"))))
    live, editor = f"{PMM}, now (RAM)", f"{PMM}, editor"
    (limit,) = [one for one in rows if one["address"] == "3110:01"]
    assert (limit[live], limit[f"{live}: raw"], limit[editor], limit["state"]) == (
        "50.0 °C",
        "500",
        "49.0 °C",
        "different",
    )
    mask, *bits = [one for one in rows if one["address"] == "3300:01"]
    before, after = int(mask[f"{live}: raw"]), int(mask[f"{editor}: raw"])
    assert {int(one["bit"]) for one in bits} == {bit for bit in range(16) if (before ^ after) >> bit & 1}
    everything = list(csv.DictReader(io.StringIO(await exported(server, "csv", same=True))))
    assert len(everything) > 90 > len(rows)


async def test_a_fleet_is_held_against_its_golden_set(server: Server) -> None:
    missing = await server.client.post("/api/fleet", json={"description_id": "oat-pmm"})
    assert (missing.status_code, missing.json()["details"]["column"]) == (404, "golden:oat-pmm")
    connection, library = server.connection, server.bench.office.library
    sets = []
    for blade in (1, 2, 3):
        target = connection.target(f"wtg-07/blade-{blade}/pmm")
        made = replace(as_known(target, "wtg-07", "Anna", 1_800_000_000_000_000_000), unread={})
        sets.append(replace(made, values={**made.values, parse_address("3110:01"): 500 if blade == 1 else 490}))
    few = {parse_address("3110:01"): 500}
    elsewhere = replace(sets[0].origin, turbine="wtg-08", device="wtg-08/blade-1/pmm")
    sets.append(replace(sets[0], origin=elsewhere, values=few, unread={parse_address("3110:02"): "no_answer"}))
    records = await library.put(sets, Source.BACKUP)
    await library.tag(records[0].id, Tag.GOLDEN, "Eva")
    asked = {"description_id": "oat-pmm", "group": "temperatures", "limit": 2}
    doc = (await server.client.post("/api/fleet", json=asked)).json()
    assert (doc["total"], doc["equal"], doc["golden"]["record"]) == (4, 1, records[0].id)
    assert (doc["different"], doc["incomplete"]) == (2, 1), "what was not read is not equal"
    assert [(one["device"], one["different"], one["top"]) for one in doc["devices"]] == [
        ("wtg-07/blade-2/pmm", 1, ["3110:01"]),
        ("wtg-07/blade-3/pmm", 1, ["3110:01"]),
    ]
    first = doc["devices"][0]
    assert first["by_group"][doc["groups"].index("temperatures")] == 1
    assert dict(zip(doc["marked"], first["marks"], strict=True))["3110:01"] == "different"
    (address,) = [one for one in doc["addresses"] if one["different"]]
    assert (address["address"], address["golden_shown"], address["golden_unit"], address["different"]) == (
        "3110:01",
        "50.0",
        "°C",
        2,
    )
