"""Trips, key events, searches and aligned curves over HTTP."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from app.recording.index import index_path
from app.web.documentation import BODIES
from tests.service.analysis.rig import S, look, scenario, the_trip
from tests.web.rig import Server, make_connection, running

TRIP, AGED = "3-following-error.mcap", "5-bloc-ageing.mcap"


@pytest.fixture
async def server(tmp_path: Path) -> AsyncIterator[Server]:
    """A data folder with two indexed recordings, one without an index and one that is none."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    for number in (3, 5):
        source = look(number).path
        os.link(source, folder / source.name)
        os.link(index_path(source), index_path(folder / source.name))
    (folder / "plain.mcap").write_bytes(scenario(4).read_bytes())
    (folder / "broken.mcap").write_bytes(b"no recording at all, but long enough to be looked at")
    async with running(make_connection(), data=tmp_path) as started:
        yield started


async def searched(server: Server, **body: Any) -> dict[str, Any]:
    """The search when it has ended, its hits asked for as they come."""
    answer = await server.client.post("/api/search", json=body)
    assert answer.status_code == 200, answer.text
    doc = answer.json()
    hits: list[Any] = doc["hits"]
    while doc["state"] == "running":
        doc = (await server.client.get(f"/api/search/{doc['id']}", params={"since": len(hits)})).json()
        hits += doc["hits"]
    assert len(hits) == doc["hits_total"]
    return {**doc, "hits": hits}


async def test_trips_are_told_with_what_came_first_and_where_to_jump(server: Server) -> None:
    doc = (await server.client.get(f"/api/recordings/{AGED}/trips")).json()
    (trip,) = doc["trips"]
    assert (doc["turbine"], trip["t0_ns"], trip["known"]) == ("wtg-07", the_trip(5).t0_ns, True)
    assert (doc["already"], trip["already"]) == (None, None)
    assert trip["headline"]["en"] == "Blade 1 PMM: battery voltage too low (3280h), 943 ms after mains failure"
    assert trip["headline"]["de"] == "Blatt 1 PMM: Batteriespannung zu niedrig (3280h), 943 ms nach: Netzausfall"
    first, trigger, at = (trip["steps"][trip[name]] for name in ("first", "trigger", "at"))
    assert (first["kind"], first["role"], first["dt_ms"]) == ("mains_low", "first", 0)
    assert [one["device"] for one in first["at"]] == [f"wtg-07/blade-{n}/pmm" for n in (1, 2, 3)]
    assert trigger["details"]["code"] == 0x3280
    assert (at["role"], at["t0_ms"]) == ("trip", 0)
    assert at["because_words"]["en"].endswith("blade 1 PMM: battery voltage too low (3280h)")
    assert all(step["says"]["de"] and step["sentence"]["en"] for step in trip["steps"])


async def test_the_next_key_event_and_the_one_before(server: Server) -> None:
    path, t0_ns = f"/api/recordings/{TRIP}/key-events", the_trip(3).t0_ns
    begin, end = look(3).span_ns
    (trip,) = (await server.client.get(path, params={"after": begin, "kind": "trip"})).json()
    assert (trip["t_ns"], trip["kind"], trip["trip"]) == (t0_ns, "trip", 0)
    assert trip["says"]["en"].startswith("Blade 2 PMC: following error too large (8611h)")
    assert (await server.client.get(path, params={"after": t0_ns, "kind": "trip"})).json() == []
    (back,) = (await server.client.get(path, params={"before": end, "kind": "trip"})).json()
    assert back == trip
    errors = (await server.client.get(path, params={"before": end, "kind": "error", "limit": 100})).json()
    times = [one["t_ns"] for one in errors]
    assert times == sorted(times, reverse=True)
    assert len(times) > 2
    rounded = float(t0_ns)  # what a browser makes of the time stamp
    assert (await server.client.get(path, params={"after": f"{rounded:.0f}", "kind": "trip"})).json() == []
    assert (await server.client.get(path)).status_code == 400
    assert (await server.client.get(path, params={"after": 1, "before": 2})).status_code == 400


async def test_a_recording_without_an_index_or_that_is_none_says_so(server: Server) -> None:
    answers = {name: (await server.client.get(f"/api/recordings/{name}.mcap/trips")).json() for name in
               ("plain", "broken", "nothing")}  # fmt: skip
    assert {name: one["code"] for name, one in answers.items()} == {
        "plain": "index_missing", "broken": "recording", "nothing": "not_found",
    }  # fmt: skip


async def test_a_search_finds_and_tells_what_it_could_not_look_into(server: Server) -> None:
    text = "60F4 > 0.5 deg within 5 s before emcy 8611"
    doc = await searched(server, text=text, recordings=[TRIP, AGED, "plain.mcap", "broken.mcap"])
    assert (doc["state"], doc["done"], doc["total"], doc["searched"]) == ("done", 4, 4, 2)
    assert [hit["name"] for hit in doc["hits"]] == [TRIP, AGED]
    first = doc["hits"][0]
    assert (first["bus"], first["node"]) == ("can0", 12)
    assert abs(first["t_ns"] - the_trip(3).t0_ns) < S
    assert first["says"]["de"].startswith("Blatt 2 PMC: aktueller Schleppfehler")
    assert [(one["name"], one["reason"]) for one in doc["skipped"]] == [
        ("plain.mcap", "no_index"), ("broken.mcap", "broken"),
    ]  # fmt: skip
    assert doc["signature"]["text"] == text
    again = await searched(server, query=doc["signature"]["query"], recordings=[TRIP, AGED])
    assert again["hits"] == doc["hits"]


async def test_a_search_looks_into_all_of_the_list_where_none_is_named(server: Server) -> None:
    names = [one["name"] for one in (await server.client.get("/api/recordings")).json()["files"]]
    doc = await searched(server, text="trip")
    assert doc["total"] == len(names)
    assert {one["name"] for one in doc["skipped"]} | {one["name"] for one in doc["hits"]} <= set(names)
    assert {one["name"] for one in doc["hits"]} >= {TRIP, AGED}


async def test_a_search_can_be_ended_and_is_known_by_its_id_alone(server: Server) -> None:
    doc = (await server.client.post("/api/search", json={"text": "trip"})).json()
    ended = (await server.client.delete(f"/api/search/{doc['id']}")).json()
    assert ended["id"] == doc["id"]
    while (state := (await server.client.get(f"/api/search/{doc['id']}")).json()["state"]) == "running":
        pass
    assert state in ("cancelled", "done")
    for method in ("GET", "DELETE"):
        assert (await server.client.request(method, "/api/search/none")).status_code == 404


@pytest.mark.parametrize(
    ("body", "status", "code"),
    [
        ({"text": "60F4 > > 2"}, 400, "signature"),
        ({"text": "1234 > 2"}, 404, "unknown_object"),
        ({"text": "60F4 > 2 V"}, 400, "usage"),
        ({}, 400, "usage"),
        ({"text": "trip", "query": {"type": "event", "kind": "trip"}}, 400, "usage"),
        ({"query": {"type": "event", "kind": "nonsense"}}, 422, "invalid"),
        ({"text": "trip", "recordings": ["nothing.mcap"]}, 404, "not_found"),
    ],
)
async def test_a_search_that_makes_no_sense_is_refused(
    server: Server, body: dict[str, Any], status: int, code: str
) -> None:
    answer = await server.client.post("/api/search", json=body)
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    if code == "signature":
        assert answer.json()["details"]["position"] == 8
        read = await server.client.post("/api/search/signature", json=body)
        assert read.json()["details"] == answer.json()["details"]


async def test_a_signature_is_read_without_searching(server: Server) -> None:
    read = (await server.client.post("/api/search/signature", json=BODIES["SignatureRequest"])).json()
    assert read["text"] == "60F4 > 2 deg within 5 s before emcy 8611"
    given = BODIES["RecordingSearchRequest"]["query"]
    back = (await server.client.post("/api/search/signature", json={"query": given})).json()
    assert back == read


async def test_curves_of_several_recordings_come_on_one_axis(server: Server) -> None:
    body = {**BODIES["AlignRequest"], "points": 400}
    doc = (await server.client.post("/api/align", json=body)).json()
    first, second = doc["recordings"]
    assert (first["name"], first["t0_ns"]) == (TRIP, the_trip(3).t0_ns)
    assert second["t0_ns"] == body["recordings"][1]["t_ns"]
    for one in (first, second):
        assert one["problem"] is None
        assert [track["address"] for track in one["tracks"]] == ["6064"] * 3 + ["60F4"]
        for track in one["tracks"]:
            assert -5000 - track["step_ms"] <= track["t_ms"][0] < track["t_ms"][-1] <= 15_000
            assert len(track["t_ms"]) == len(track["low"]) == len(track["high"]) <= 400
    body["recordings"] = [
        {"name": TRIP, "trip": 7}, {"name": "plain.mcap", "trip": 0}, {"name": "gone.mcap", "trip": 0},
        {"name": TRIP, "trip": 0},
    ]  # fmt: skip
    answer = await server.client.post("/api/align", json=body)
    assert answer.status_code == 200, answer.text
    told = answer.json()["recordings"]
    assert [one["problem"] for one in told] == ["error.usage", "error.index_missing", "error.not_found", None]
    assert told[2]["problem_details"]["what"] == "gone.mcap"
    body["recordings"] = [{"name": TRIP}]
    assert (await server.client.post("/api/align", json=body)).status_code == 400
