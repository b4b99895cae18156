"""Replays over a real server: the same reads as live at the cursor, one cursor for all, and nothing that writes."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from app.model.address import Address
from app.model.description_file import load_builtin
from app.recording.reader import open_recording
from app.service.shown import LiveShown
from app.web.in_replay import ALSO_IN_REPLAY, IN_CONTEXT
from app.web.models import Subscribe
from app.web.socket import Client
from app.wire.decoder import CanOpenDecoder
from app.wire.records import ValueSeen
from tests.service.replay.test_session import SCENARIOS
from tests.web.rig import Page, Server, make_connection, running
from tests.web.test_route_matrix import BRINGS_BYTES, ROUTES, SOCKET, ask, path_of

TRIP = "3-following-error"
PMC_2 = "wtg-07/blade-2/pmc"
S = 1_000_000_000

REFUSED_IN_REPLAY = {
    ("POST", "/api/live/connect"),
    ("POST", "/api/live/consent"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/read"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/write"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/save"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/restart"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/verify"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/order/check"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/order/keep"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motor"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/pdos/preview"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/pdos/apply"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/pdos/undo"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/prepare"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/put-back"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/jog"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/manual"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/operation"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/move"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/home"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/search-home"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/reset"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/hold"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/feather"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/brake-test"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/halt"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/test"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/test/cancel"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/charge"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/change"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/change/give-up"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/change/done"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/signal"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/probe/arm"),
    ("POST", "/api/live/motion/lease"),
    ("POST", "/api/live/motion/lease/ask"),
    ("POST", "/api/live/motion/confirm"),
    ("POST", "/api/live/scope/arm"),
    ("POST", "/api/live/scope/trigger"),
    ("POST", "/api/live/writes"),
    ("POST", "/api/live/writes/plan"),
    ("POST", "/api/live/backup"),
    ("POST", "/api/live/restore/plan"),
    ("POST", "/api/live/restore"),
    ("POST", "/api/live/restores/{restore_id}/confirm"),
    ("POST", "/api/live/restores/{restore_id}/unproven"),
    ("POST", "/api/live/restores/{restore_id}/roll-back"),
    ("POST", "/api/live/restores/{restore_id}/resume"),
    ("POST", "/api/instructor/faults"),
    ("DELETE", "/api/instructor/faults"),
    ("DELETE", "/api/instructor/faults/{fault}"),
    ("POST", "/api/instructor/play"),
    ("POST", "/api/instructor/stop"),
    ("POST", "/api/settings/adapters/test"),
    ("POST", "/api/settings/adapters/bitrate"),
    ("POST", "/api/settings/scan"),
    ("POST", "/api/settings/identify"),
    ("PUT", "/api/settings/polling"),
}
"""What reaches a bus or a twin, but STOP and FEATHER, which must always go."""
OF_RECORDINGS = "/api/replay/{replay_id}/{path:path}"
"""Refuses everywhere: nothing that was recorded can be written."""


@pytest.fixture
async def server(tmp_path: Path) -> AsyncIterator[Server]:
    async with running(make_connection(), data=tmp_path) as started:
        yield started


async def opened(server: Server, name: str = TRIP) -> dict[str, Any]:
    answer = await server.client.post("/api/replay", json={"recording": f"{name}.mcap"})
    assert answer.status_code == 200, answer.text
    doc: dict[str, Any] = answer.json()
    return doc


async def order(server: Server, name: str = TRIP, **body: Any) -> dict[str, Any]:
    answer = await server.client.post(f"/api/replay/{name}/cursor", json=body)
    assert answer.status_code == 200, answer.text
    line: dict[str, Any] = answer.json()
    return line


async def test_samples_are_in_the_list_and_open_by_their_name(server: Server) -> None:
    listed = (await server.client.get("/api/recordings")).json()["files"]
    assert {"name": f"{TRIP}.mcap", "sample": True} in [{key: one[key] for key in ("name", "sample")} for one in listed]
    doc = await opened(server)
    assert (doc["id"], doc["turbine"], doc["damages"]) == (TRIP, "wtg-07", 0)
    assert doc["cursor"]["t_ns"] == doc["from_ns"]
    again = await opened(server)
    assert again["id"] == doc["id"]
    assert [one["id"] for one in (await server.client.get("/api/replay")).json()] == [TRIP]


async def test_a_place_is_taken_by_who_opens_it_and_moves_nobody_who_looks_already(server: Server) -> None:
    begin_ns = (await opened(server))["from_ns"]
    assert (await server.client.delete(f"/api/replay/{TRIP}")).status_code == 200
    stands = []
    for at_s in (33, 12):
        asked = {"recording": f"{TRIP}.mcap", "at_ns": begin_ns + at_s * 1_000_000_000}
        doc = (await server.client.post("/api/replay", json=asked)).json()
        stands.append((doc["cursor"]["t_ns"] - begin_ns) // 1_000_000_000)
    assert stands == [33, 33]


async def test_reads_are_those_of_the_live_bench_at_the_cursor(server: Server) -> None:
    doc = await opened(server)
    at = doc["from_ns"] + 30 * S
    assert (await order(server, action="seek", t_ns=at))["t_ns"] == at
    base = f"/api/replay/{TRIP}"
    turbine = (await server.client.get(f"{base}/turbine")).json()
    assert (turbine["slug"], turbine["mode"]) == ("wtg-07", "replay")
    devices = [device["slug"] for station in turbine["stations"] for device in station["devices"]]
    assert PMC_2 in devices
    assert [station["blade"] for station in turbine["stations"]] == [1, 2, 3]
    assert (await server.client.get(f"{base}/descriptions/oat-pmc")).json()["id"] == "oat-pmc"
    frames = (await server.client.get(f"{base}/frames", params={"before": at, "limit": 50})).json()["rows"]
    assert len(frames) == 50
    assert all(row["t_ns"] <= at for row in frames)
    errors = (await server.client.get(f"{base}/bus/emergencies")).json()
    assert "8611h" in [one["details"]["code_hex"] for one in errors]
    nodes = (await server.client.get(f"{base}/bus/nodes")).json()
    assert {node["node"] for node in nodes} >= {1, 2, 3, 11, 12, 13}
    assert (await server.client.get(f"{base}/bus/load")).json()[0]["load"] > 0.05


async def test_the_trace_ends_at_the_cursor(server: Server) -> None:
    """The first error of this recording is 26.5 s from its beginning."""
    doc = await opened(server)
    begin, path = doc["from_ns"], f"/api/replay/{TRIP}/frames"

    async def errors(t_s: float, **asked: int) -> list[int]:
        at = begin + round(t_s * S)
        assert (await order(server, action="seek", t_ns=at))["t_ns"] == at
        rows = (await server.client.get(path, params={"errors": True, "limit": 50, **asked})).json()["rows"]
        return [row["t_ns"] - begin for row in rows]

    ways: list[dict[str, int]] = [{"after": begin}, {"around": begin + S}, {"before": begin + 60 * S}]
    for asked in ways:
        assert await errors(20, **asked) == [], asked
        assert await errors(0, **asked) == [], asked
    late = await errors(40, after=begin)
    assert late
    assert all(26 * S < t_ns <= 40 * S for t_ns in late)
    assert await errors(40, around=begin + S) == late


async def test_a_page_hears_of_the_replay_and_of_the_bench_by_one_socket(server: Server) -> None:
    doc = await opened(server)
    await order(server, action="seek", t_ns=doc["from_ns"] + 20 * S)
    async with server.socket() as connection:
        page = Page(connection)
        await page.subscribe("link")
        await page.say({"type": "subscribe", "ctx": f"replay/{TRIP}", "topics": ["cursor", "axes", "link", "events"]})
        axes = await page.until("axes")
        assert axes["ctx"] == f"replay/{TRIP}"
        assert [line["blade"] for line in axes["data"]] == [1, 2, 3]
        assert not any(line["stale"] for line in axes["data"])
        assert abs(axes["t_ns"] - doc["from_ns"] - 20 * S) < 1000
        async with server.socket() as other:
            second = Page(other)
            await second.say({"type": "subscribe", "ctx": f"replay/{TRIP}", "topics": ["cursor"]})
            await second.until("cursor")
            await order(server, action="seek", t_ns=doc["from_ns"] + 40 * S)
            for one in (page, second):
                line = await one.until("cursor")
                while line["data"]["t_ns"] < doc["from_ns"] + 40 * S:
                    line = await one.until("cursor")
                assert line["data"]["t_ns"] == doc["from_ns"] + 40 * S
        links = {message["ctx"]: message["data"]["mode"] for message in page.heard if message["type"] == "link"}
        assert links[f"replay/{TRIP}"] == "replay"
        assert "live" in links


async def test_a_seek_backwards_voids_what_was_told_before(server: Server) -> None:
    doc = await opened(server)
    await order(server, action="seek", t_ns=doc["from_ns"] + 40 * S)
    async with server.socket() as connection:
        page = Page(connection)
        await page.say({"type": "subscribe", "ctx": f"replay/{TRIP}", "topics": ["events", f"values:{PMC_2}"]})
        first = await page.until("bench")
        while first["ctx"] == "live":
            first = await page.until("bench")
        await page.until("event")
        await order(server, action="seek", t_ns=doc["from_ns"] + 5 * S)
        turned = await page.until("bench")
        assert turned["data"]["epoch"] > first["data"]["epoch"]
        values = await page.until("values")
        assert values["data"]["full"]
        told = await page.until("event")
        assert told["data"]["t_ns"] <= doc["from_ns"] + 5 * S


async def test_a_replay_that_is_not_open_is_told_as_gone(server: Server) -> None:
    async with server.socket() as connection:
        page = Page(connection)
        await page.say({"type": "subscribe", "ctx": "replay/none", "topics": ["cursor"]})
        assert (await page.until("gone"))["ctx"] == "replay/none"
        await opened(server)
        await page.say({"type": "subscribe", "ctx": f"replay/{TRIP}", "topics": ["cursor"]})
        await page.until("cursor")
        assert (await server.client.delete(f"/api/replay/{TRIP}")).status_code == 200
        assert (await page.until("gone"))["ctx"] == f"replay/{TRIP}"
    answer = await server.client.get(f"/api/replay/{TRIP}")
    assert (answer.status_code, answer.json()["code"]) == (404, "replay_ended")


@pytest.mark.parametrize(
    "body",
    [
        {"action": "seek"},
        {"action": "step", "by": "time"},
        {"action": "speed", "speed": 51},
        {"action": "loop", "loop": {"from_ns": 5, "to_ns": 1}},
        {"action": "fly"},
    ],
    ids=str,
)
async def test_an_order_that_makes_no_sense_is_refused(server: Server, body: dict[str, Any]) -> None:
    await opened(server)
    answer = await server.client.post(f"/api/replay/{TRIP}/cursor", json=body)
    assert answer.status_code == 422 or answer.status_code == 400, answer.text


async def test_what_is_no_recording_cannot_be_replayed(server: Server, tmp_path: Path) -> None:
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "bad.mcap").write_bytes(b"no MCAP at all")
    assert (await server.client.post("/api/replay", json={"recording": "none.mcap"})).status_code == 404
    answer = await server.client.post("/api/replay", json={"recording": "bad.mcap"})
    assert answer.json()["code"] == "recording"


# -- a replay can never write to a device ---------------------------------------------


async def test_of_all_routes_a_page_that_shows_a_replay_gets_only_those_that_reach_no_device(server: Server) -> None:
    """STOP and FEATHER go. Nobody is made a user, and logging out comes last: either ends the session."""
    await opened(server)
    changing = {r for r in ROUTES if r[0] not in (SOCKET, "GET") and r[1] != OF_RECORDINGS}
    assert changing > REFUSED_IN_REPLAY
    for route in sorted(changing, key=lambda one: one[1] == "/api/logout"):
        kind = "application/octet-stream" if route in BRINGS_BYTES else "application/json"
        headers = {IN_CONTEXT: f"replay/{TRIP}", "Content-Type": kind}
        answer = await server.client.request(route[0], path_of(route), content=b"{}", headers=headers)
        refused = answer.status_code == 409 and answer.json()["code"] == "replay_only"
        assert refused is (route in REFUSED_IN_REPLAY), (route, answer.status_code, answer.text)


@pytest.mark.parametrize("context", [{}, {"X_Hubside_Context": "live"}], ids=str)
async def test_a_page_that_shows_the_bench_is_let_through(server: Server, context: dict[str, str]) -> None:
    for route in REFUSED_IN_REPLAY:
        answer = await ask(server.client, route, **context)
        assert answer.json().get("code") != "replay_only", route


async def test_of_two_contexts_neither_hides_behind_the_other(server: Server) -> None:
    for contexts in (("live", f"replay/{TRIP}"), (f"replay/{TRIP}", "live")):
        headers = [(IN_CONTEXT, one) for one in contexts]
        answer = await server.client.post("/api/settings/scan", json={}, headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (409, "replay_only")


def test_what_is_let_through_is_a_route() -> None:
    """A name that fits no route would let through what comes to bear it."""
    known = set(ROUTES) | {(method, OF_RECORDINGS.replace("{replay_id}/", "")) for method, _ in ROUTES}
    assert set(ALSO_IN_REPLAY) <= known


async def test_nothing_under_replay_writes(server: Server) -> None:
    await opened(server)
    frames = server.connection.buses["can0"].frames
    changing = {r for r in ROUTES if r[1].startswith("/api/live/") and r[0] not in (SOCKET, "GET")}
    for method, path in changing:
        at = path_of((method, path)).replace("/api/live/", f"/api/replay/{TRIP}/")
        answer = await server.client.request(method, at, json={})
        assert (answer.status_code, answer.json()["code"]) == (409, "replay_only"), at
    assert server.connection.buses["can0"].frames == frames


# -- the whole recording -----------------------------------------------------------------


async def indexed(server: Server, name: str = TRIP) -> dict[str, Any]:
    """The replay, once its index is made."""
    await opened(server, name)
    async with asyncio.timeout(60):
        while True:
            doc: dict[str, Any] = (await server.client.get(f"/api/replay/{name}")).json()
            if doc["index"]["state"] == "ready":
                return doc
            assert doc["index"]["state"] == "building", doc["index"]
            await asyncio.sleep(0.05)


async def test_without_its_index_it_is_said_that_there_is_none_yet(server: Server) -> None:
    doc = await opened(server)
    if doc["index"]["state"] == "building":
        answer = await server.client.get(f"/api/replay/{TRIP}/timeline")
        assert answer.status_code == 200 or answer.json()["code"] == "index_missing"
    assert (await indexed(server))["index"] == {"state": "ready", "progress": 1.0, "reason": None}


async def test_the_timeline_has_load_gaps_and_what_went_wrong(server: Server) -> None:
    doc = await indexed(server)
    line = (await server.client.get(f"/api/replay/{TRIP}/timeline", params={"buckets": 60})).json()
    assert [load["bus"] for load in line["load"]] == ["can0"]
    with open_recording(SCENARIOS / f"{TRIP}.mcap") as recording:
        assert sum(line["load"][0]["frames"]) == recording.topics["/can0"]
    told = [(mark["device"], mark["details"].get("code_hex")) for mark in line["marks"] if mark["severity"] == "error"]
    assert told[0] == (PMC_2, "8611h")
    assert {gap["kind"] for gap in line["gaps"]} == {"restart"}
    part = {"from_ns": doc["from_ns"] + 20 * S, "to_ns": doc["from_ns"] + 21 * S}
    assert not (await server.client.get(f"/api/replay/{TRIP}/timeline", params=part)).json()["marks"]
    answer = await server.client.get(f"/api/replay/{TRIP}/timeline", params={"from_ns": 5, "to_ns": 5})
    assert answer.json()["code"] == "usage"


async def test_a_series_is_what_the_decoder_says(server: Server) -> None:
    doc = await indexed(server)
    begin, end = doc["from_ns"] + 25 * S, doc["from_ns"] + 28 * S
    asked = {"signal": f"{PMC_2}/60F4", "from_ns": begin, "to_ns": end, "points": 5000}
    (series,) = (await server.client.get(f"/api/replay/{TRIP}/series", params=asked)).json()
    decoder = CanOpenDecoder("can0", {12: load_builtin("oat-pmc")})
    seen = []
    with open_recording(SCENARIOS / f"{TRIP}.mcap") as recording:
        for frame in recording.frames(None, end):
            for record in decoder.feed(frame):
                if isinstance(record, ValueSeen) and (record.node, record.address) == (12, Address(0x60F4)):
                    raw = int.from_bytes(record.data, "little", signed=True)
                    seen.append(((record.t_ns - doc["from_ns"]) / 1e9, raw / 100))
    seen = [one for one in seen if one[0] >= 25.0]
    assert (series["exact"], series["unit"]) == (True, "°")
    assert list(zip(series["t_s"], series["low"], strict=True)) == [(t, pytest.approx(value)) for t, value in seen]
    asked["points"] = 20
    (coarse,) = (await server.client.get(f"/api/replay/{TRIP}/series", params=asked)).json()
    assert not coarse["exact"]
    assert max(coarse["high"]) == pytest.approx(max(value for _, value in seen))
    refused = await server.client.get(f"/api/replay/{TRIP}/series", params={"signal": "wtg-99/blade-1/pmc/6064"})
    assert refused.json()["code"] == "usage"


async def test_signals_and_values_over_time_are_told_with_names_and_units(server: Server) -> None:
    await indexed(server, "8-foreign-master")
    signals = (await server.client.get("/api/replay/8-foreign-master/signals")).json()
    (window,) = [one for one in signals if (one["device"], one["address"]) == (PMC_2, "6065")]
    assert (window["unit"], window["low"], window["high"]) == ("°", 1.0, 20.0)
    asked = {"device": PMC_2, "address": "6065"}
    changes = (await server.client.get("/api/replay/8-foreign-master/history", params=asked)).json()
    assert [change["raw"] for change in changes][-1] == 2000
    assert changes[-1]["source"] in ("sdo-write", "sdo-read")


async def test_a_moment_is_compared_with_another_one_and_kept_as_a_set(server: Server) -> None:
    """A foreign master reads the window of the following error of blade 2, and at once sets it from 1 to 20 degrees."""
    name = "8-foreign-master"
    doc = await opened(server, name)
    decoder = CanOpenDecoder("can0")
    with open_recording(SCENARIOS / f"{name}.mcap") as recording:
        seen = [record for frame in recording.frames() for record in decoder.feed(frame)]
    (read, written) = [one for one in seen if isinstance(one, ValueSeen) and one.address == Address(0x6065)]
    before, after = read.t_ns, doc["from_ns"] + 33 * S
    assert before < written.t_ns < after
    columns = [f"moment:{name}@{t_ns}/{PMC_2}" for t_ns in (before, after)]
    answer = await server.client.post("/api/compare", json={"columns": columns})
    assert answer.status_code == 200, answer.text
    told = answer.json()
    assert [column["kind"] for column in told["columns"]] == ["moment", "moment"]
    assert [column["t_ns"] for column in told["columns"]] == [before, after]
    rows = {row["address"]: row for row in told["rows"]}
    assert rows["6065"]["state"] == "different"
    assert [cell["raw"] for cell in rows["6065"]["cells"]] == [100, 2000]

    kept = await server.client.post(f"/api/replay/{name}/sets", json={"devices": [PMC_2], "t_ns": before})
    assert kept.status_code == 200, kept.text
    (one,) = kept.json()
    assert one["known"] > 20
    assert one["unseen"] > 0
    listed = {record["id"]: record for record in (await server.client.get("/api/sets")).json()["records"]}
    assert listed[one["id"]]["source"] == "recording"
    again = await server.client.post("/api/compare", json={"columns": [columns[1], f"set:{one['id']}"]})
    found = {row["address"]: row for row in again.json()["rows"]}
    assert [cell["raw"] for cell in found["6065"]["cells"]] == [2000, 100]


@pytest.mark.parametrize("spec", [f"moment:none@5/{PMC_2}", f"moment:{TRIP}@x/{PMC_2}", f"moment:{TRIP}@5/wtg-99/x/y"])
async def test_a_moment_that_there_is_not_is_named(server: Server, spec: str) -> None:
    answer = await server.client.post("/api/compare", json={"columns": [spec, f"default:{PMC_2}"]})
    assert (answer.status_code, answer.json()["code"]) == (404, "column")
    assert answer.json()["details"]["column"] == spec


# -- files that change, and pages that are late ---------------------------------------------


async def test_a_recording_that_was_replaced_is_opened_anew(server: Server, tmp_path: Path) -> None:
    folder = tmp_path / "recordings"
    folder.mkdir(exist_ok=True)
    shutil.copy(SCENARIOS / f"{TRIP}.mcap", folder / "mine.mcap")
    first = await opened(server, "mine")
    shutil.copy(SCENARIOS / "8-foreign-master.mcap", folder / "mine.mcap")
    second = await opened(server, "mine")
    assert second["from_ns"] != first["from_ns"]
    columns = [f"moment:mine@{first['to_ns']}/{PMC_2}", f"moment:8-foreign-master@{first['to_ns']}/{PMC_2}"]
    told = (await server.client.post("/api/compare", json={"columns": columns})).json()
    assert told["rows"]
    assert {row["state"] for row in told["rows"]} <= {"same", "missing"}


async def test_a_page_that_was_late_hears_that_the_replay_was_opened_again(server: Server) -> None:
    replays = server.replays
    await opened(server)
    client = Client(LiveShown(server.bench), replays)
    client.take(Subscribe(type="subscribe", ctx=f"replay/{TRIP}", topics=["cursor"]))
    assert any(message.ctx == f"replay/{TRIP}" and message.type == "cursor" for message in client.due(0.0))
    await replays.end(TRIP)
    await opened(server)  # between two looks
    assert [message.type for message in client.due(1.0) if message.ctx == f"replay/{TRIP}"] == ["gone"]
    client.close()


async def test_more_replays_than_are_kept_end_the_one_that_nobody_looks_at(server: Server, tmp_path: Path) -> None:
    names = sorted(path.stem for path in SCENARIOS.glob("[0-9]-*.mcap"))
    for name in names:
        await opened(server, name)
    unwatch = server.replays.watch(f"replay/{names[0]}")
    (tmp_path / "recordings").mkdir(exist_ok=True)
    shutil.copy(SCENARIOS / f"{TRIP}.mcap", tmp_path / "recordings" / "ninth.mcap")
    await opened(server, "ninth")
    open_now = {one["id"] for one in (await server.client.get("/api/replay")).json()}
    assert len(open_now) == len(names)
    assert {names[0], "ninth"} <= open_now
    unwatch()
