"""Incidents and annotations over a real server: kept by versions, linked, and without their recording."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest

from app.recording.annotations import read_annotations
from app.service.incidents.form import MAX_BUNDLE_BYTES
from app.service.recording_list import samples_folder
from app.store.store import Store
from tests.web.rig import DEADLINE_S, Server, make_connection, running

TRIP = "3-following-error.mcap"
MINE = "trip.mcap"
PMC_2 = "wtg-07/blade-2/pmc"
S = 1_000_000_000
T0 = 1_772_442_000 * S


@pytest.fixture
async def server(tmp_path: Path) -> AsyncIterator[Server]:
    folder = tmp_path / "recordings"
    folder.mkdir()
    shutil.copy(samples_folder() / TRIP, folder / MINE)
    async with running(make_connection(), store=Store.open(tmp_path), data=tmp_path) as started:
        yield started


def body(**changes: Any) -> dict[str, Any]:
    usual = {
        "from_ns": T0,
        "to_ns": T0 + 30 * S,
        "at_ns": T0 + 20 * S,
        "title": "Blade 2 trips",
        "notes": "grease <b>on</b> the gear",
        "tags": ["8611h", "gear"],
        "plots": [[f"{PMC_2}/6064", f"{PMC_2}/60F4"], [f"{PMC_2}/6079"]],
        "camera": "blade-2",
        "loop": {"from_ns": T0 + 10 * S, "to_ns": T0 + 25 * S},
    }
    return {**usual, **changes}


async def made(server: Server, **changes: Any) -> dict[str, Any]:
    answer = await server.client.post("/api/incidents", json={"recording": MINE, **body(**changes)})
    assert answer.status_code == 200, answer.text
    doc: dict[str, Any] = answer.json()
    return doc


async def hashed(server: Server, key: str) -> dict[str, Any]:
    """The incident as soon as its recording has been read for its hash, which is done beside."""
    async with asyncio.timeout(DEADLINE_S):
        while True:
            found: dict[str, Any] = (await server.client.get(f"/api/incidents/{key}")).json()
            if found["sha256"] is not None:
                assert len(found["sha256"]) == 64
                return found


async def test_an_incident_is_kept_found_and_audited_and_its_recording_is_hashed(server: Server) -> None:
    doc = await made(server)
    assert (doc["turbine"], doc["version"], doc["recording_state"], doc["replay"]) == ("wtg-07", 1, "there", "trip")
    assert doc["plots"] == body()["plots"]
    assert doc["notes"] == "grease <b>on</b> the gear"
    for key in (doc["id"], doc["code"], doc["code"].upper()):
        assert (await hashed(server, key))["id"] == doc["id"]
    for query, count in (
        ({"words": "GEAR blade"}, 1),
        ({"words": "mains"}, 0),
        ({"tag": "8611h"}, 1),
        ({"tag": "x"}, 0),
    ):
        assert len((await server.client.get("/api/incidents", params=query)).json()) == count
    assert (await server.client.get("/api/incidents", params={"recording": "other.mcap"})).json() == []
    kinds = [row["kind"] for row in (await server.client.get("/api/audit")).json()["rows"]]
    assert "incident_made" in kinds


async def test_changes_are_versions_and_two_people_do_not_overwrite_each_other(server: Server) -> None:
    doc = await made(server)
    url = f"/api/incidents/{doc['code']}"
    changed = await server.client.put(url, json={"based_on": 1, **body(title="Gear blocked", loop=None)})
    assert (changed.json()["version"], changed.json()["title"]) == (2, "Gear blocked")
    late = await server.client.put(url, json={"based_on": 1, **body(title="mine")})
    assert (late.status_code, late.json()["code"]) == (409, "incident_changed")
    versions = (await server.client.get(f"{url}/versions")).json()
    assert [(one["version"], one["title"]) for one in versions] == [(2, "Gear blocked"), (1, "Blade 2 trips")]
    assert (await server.client.get(url, params={"version": 1})).json()["loop"] is not None
    assert (await server.client.get(url, params={"version": 3})).status_code == 404
    assert (await server.client.get("/api/incidents/nothere")).json()["code"] == "incident_unknown"


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"title": "  "}, "title"),
        ({"at_ns": T0 - S}, "at_ns"),
        ({"to_ns": T0}, "span"),
        ({"from_ns": 5, "to_ns": 9, "at_ns": 7}, "span"),
        ({"plots": [["6064"]]}, "plots"),
        ({"title": "a\x1b[2J"}, "title"),
    ],
)
async def test_what_makes_no_sense_is_refused_with_its_field(
    server: Server, changes: dict[str, Any], field: str
) -> None:
    answer = await server.client.post("/api/incidents", json={"recording": MINE, **body(**changes)})
    assert (answer.status_code, answer.json()["details"]["field"]) == (422, field)
    assert (await server.client.get("/api/incidents")).json() == []


async def test_a_short_link_leads_to_the_moment_and_strangers_learn_nothing(server: Server) -> None:
    doc = await made(server)
    answer = await server.client.get(doc["link"])
    assert answer.status_code == 303
    place = urlsplit(answer.headers["location"])
    assert place.path == "/recordings"
    assert parse_qs(place.query) == {
        "incident": [doc["code"]],
        "replay": ["trip"],
        "at": [str(doc["at_ns"])],
        "loop": [f"{doc['loop']['from_ns']}-{doc['loop']['to_ns']}"],
        "camera": ["blade-2"],
        "signals": [f"{PMC_2}/6064,{PMC_2}/60F4;{PMC_2}/6079"],
    }
    assert answer.headers["location"] == doc["page"]
    assert (await server.stranger.get(doc["link"])).status_code == 401
    person = {"name": "Eva", "password": "blade and hub 12", "role": "expert"}
    assert (await server.client.post("/api/users", json=person)).status_code == 200
    known = await server.stranger.get(doc["link"])
    unknown = await server.stranger.get("/i/zzzzzzz")
    assert known.headers["location"] == f"/recordings?incident={doc['code']}"
    assert unknown.headers["location"] == "/recordings?incident=zzzzzzz"


async def test_a_recording_that_grew_moved_went_or_was_replaced_is_told(server: Server, tmp_path: Path) -> None:
    path = tmp_path / "recordings" / MINE
    path.write_bytes(path.read_bytes() + b"tail")  # no other than its sample
    doc = await made(server)

    async def state() -> tuple[str, str | None]:
        now = (await server.client.get(f"/api/incidents/{doc['id']}")).json()
        return now["recording_state"], now["replay"]

    assert await state() == ("there", "trip")
    content = path.read_bytes()
    path.write_bytes(content + b"more")
    assert await state() == ("grown", "trip")
    path.write_bytes(content[:-1] + b"!")
    assert await state() == ("other", None)
    path.write_bytes(content)
    moved = path.rename(path.with_name("renamed.mcap"))
    assert await state() == ("moved", "renamed")
    moved.unlink()
    assert await state() == ("gone", None)
    changed = await server.client.put(f"/api/incidents/{doc['id']}", json={"based_on": 1, **body(title="still")})
    assert changed.json()["title"] == "still"


async def test_annotations_are_written_beside_their_recording_and_come_off(server: Server, tmp_path: Path) -> None:
    doc = await made(server)
    url = f"/api/recordings/{MINE}/annotations"
    mark = {"from_ns": T0, "to_ns": T0 + S, "text": "brake late", "severity": "error", "incident": doc["code"]}
    first = (await server.client.post(url, json=mark)).json()
    assert (first["incident"], first["problem"]) == (doc["id"], None)
    second = (await server.client.post(url, json={**mark, "text": "free", "incident": None})).json()
    place = tmp_path / "recordings" / "trip.annotations.mcap"
    assert [one.text for one in read_annotations(place, MINE)] == ["brake late", "free"]
    listed = (await server.client.get("/api/recordings")).json()["files"]
    assert [one["name"] for one in listed if not one["sample"]] == [MINE]
    changed = await server.client.put(f"/api/annotations/{first['id']}", json={**mark, "text": "brake later"})
    assert changed.json()["text"] == "brake later"
    assert (await server.client.delete(f"/api/annotations/{second['id']}")).status_code == 200
    assert [one.text for one in read_annotations(place, MINE)] == ["brake later"]
    assert (await server.client.delete(f"/api/annotations/{second['id']}")).status_code == 404
    assert [one["text"] for one in (await server.client.get(url)).json()["annotations"]] == ["brake later"]


async def test_annotations_of_a_sample_lie_in_the_data_folder(server: Server, tmp_path: Path) -> None:
    mark = {"from_ns": T0, "to_ns": T0, "text": "here", "severity": "info"}
    answer = await server.client.post(f"/api/recordings/{TRIP}/annotations", json=mark)
    assert answer.json()["problem"] is None
    listed = (await server.client.get(f"/api/recordings/{TRIP}/annotations")).json()
    assert [one["text"] for one in listed["annotations"]] == ["here"]
    assert listed["file"] == str(tmp_path / "annotations" / "3-following-error.annotations.mcap")


async def test_a_bundle_goes_out_and_comes_in_by_the_page(server: Server, tmp_path: Path) -> None:
    doc = await made(server)
    answer = await server.client.get(f"/api/incidents/{doc['code']}/bundle", timeout=30)
    assert answer.headers["content-disposition"] == f'attachment; filename="wtg-07-{doc["code"]}.hubside-incident"'
    assert answer.headers["content-type"] == OCTETS["content-type"]
    other = tmp_path / "other"
    async with running(make_connection(), store=Store.open(other), data=other) as there:
        url = "/api/incidents/import?name=gift.hubside-incident"
        taken = await there.client.post(url, content=answer.content, headers=OCTETS, timeout=30)
        assert taken.status_code == 200, taken.text
        found = taken.json()
        assert (found["incident"]["code"], found["new"], found["flaws"]) == (doc["code"], True, [])
        assert found["incident"]["origin"]["file"] == "gift.hubside-incident"
        assert found["incident"]["recording_state"] == "there"
        opened = await there.client.post("/api/replay", json={"recording": found["recording"]})
        assert opened.json()["from_ns"] < doc["from_ns"] + S
        for body, status, code in ((b"no zip", 400, "bundle"), (b"", 400, "bundle")):
            refused = await there.client.post(url, content=body, headers=OCTETS)
            assert (refused.status_code, refused.json()["code"]) == (status, code)
        assert (await there.client.post(url, json={})).json()["code"] == "invalid"


OCTETS = {"content-type": "application/octet-stream"}


async def test_the_report_is_a_file_to_keep_in_the_language_that_was_asked_for(server: Server) -> None:
    doc = await made(server)
    url = f"/api/incidents/{doc['code']}/report"
    answer = await server.client.get(url, params={"language": "de"}, timeout=60)
    assert answer.headers["content-disposition"] == f'attachment; filename="wtg-07-{doc["code"]}.html"'
    assert '<html lang="de">' in answer.text and "<iframe" in answer.text
    assert "grease &lt;b&gt;on&lt;/b&gt; the gear" in answer.text
    assert (await server.client.get(url, params={"language": "fr"})).status_code == 422


async def test_a_bundle_that_says_it_is_too_large_is_refused_unread(server: Server) -> None:
    """Only the head is sent: the answer comes without the body."""
    head = (
        f"POST /api/incidents/import?name=x HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nCookie: {server.cookie}\r\n"
        f"Content-Type: application/octet-stream\r\nContent-Length: {MAX_BUNDLE_BYTES + 1}\r\n\r\n"
    )
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    try:
        writer.write(head.encode())
        answer = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), DEADLINE_S)
    finally:
        writer.close()
    assert answer.startswith(b"HTTP/1.1 413 ")
