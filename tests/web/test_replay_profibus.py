"""A replay of a bench on PROFIBUS: every read route tells of its device what it tells of those on CAN."""

from __future__ import annotations

import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.recording.reader import open_recording
from app.wire.profibus.decoder import ProfibusDecoder
from app.wire.records import SlaveSeen, SlaveState, ValueSeen
from tests.recording.make_ed2 import BAUD, BUS, NODE, SAMPLE, SLUG
from tests.web.rig import Server, make_connection, running
from tests.web.test_replay import S, indexed, opened, order
from tests.web.test_route_matrix import ROUTES

NAME = SAMPLE.stem
BASE = f"/api/replay/{NAME}"
MOVING_S = 1.6
"""From the beginning to a moment at which the first axis moves."""


@pytest.fixture
async def server(tmp_path: Path) -> AsyncIterator[Server]:
    folder = tmp_path / "recordings"
    folder.mkdir()
    shutil.copy(SAMPLE, folder)
    async with running(make_connection(), data=tmp_path) as started:
        yield started


async def at(server: Server, seconds: float) -> int:
    """The replay with its cursor there; the time."""
    doc = await opened(server, NAME)
    t_ns = int(doc["from_ns"]) + round(seconds * S)
    return int((await order(server, NAME, action="seek", t_ns=t_ns))["t_ns"])


def records() -> list[Any]:
    with open_recording(SAMPLE) as recording:
        return ProfibusDecoder(BUS, {NODE: load_builtin("wandfluh-ed2")}).feed_all(recording.frames())


def seen_of(where: str) -> list[ValueSeen]:
    return [one for one in records() if isinstance(one, ValueSeen) and one.address == parse_address(where)]


async def test_every_read_route_answers(server: Server) -> None:
    await indexed(server, NAME)
    await at(server, MOVING_S)
    names = dict(zip(("{turbine}", "{station}", "{device}"), SLUG.split("/"), strict=True))
    names |= {"{replay_id}": NAME, "{description_id}": "wandfluh-ed2"}
    asked = {
        "frames": {"around": str(0)},
        "series": {"signal": f"{SLUG}/12/100"},
        "history": {"device": SLUG, "address": "12/61"},
    }
    for method, path in sorted(ROUTES):
        if method != "GET" or not path.startswith("/api/replay/{replay_id}"):
            continue
        for name, text in names.items():
            path = path.replace(name, text)
        answer = await server.client.get(path, params=asked.get(path.rpartition("/")[2], {}))
        assert answer.status_code == 200, (path, answer.text)


async def test_its_telegrams_are_downloaded_for_wireshark_and_no_can_log_is_made_of_them(server: Server) -> None:
    path = f"/api/recordings/{NAME}.mcap/export"
    got = await server.client.get(path, params={"format": "pcapng"})
    assert got.status_code == 200
    assert got.content.startswith(b"\x0a\x0d\x0d\x0a")
    refused = await server.client.get(path, params={"format": "candump"})
    assert (refused.status_code, refused.json()["code"]) == (400, "usage")
    assert "pcapng" in str(refused.json())


async def test_a_series_is_what_the_decoder_says(server: Server) -> None:
    doc = await indexed(server, NAME)
    await at(server, MOVING_S)
    asked: dict[str, str | int] = {"signal": f"{SLUG}/12/100", "points": 20_000}
    (series,) = (await server.client.get(f"{BASE}/series", params=asked)).json()
    assert series["t_s"] == [(one.t_ns - doc["from_ns"]) / 1e9 for one in seen_of("12/100")]
    assert (min(series["low"]), max(series["high"])) == (pytest.approx(250.0, abs=0.2), pytest.approx(300.0, abs=0.2))


async def test_the_timeline_shows_the_fault_the_slave_that_was_away_and_the_load(server: Server) -> None:
    await indexed(server, NAME)
    line = (await server.client.get(f"{BASE}/timeline", params={"buckets": 40})).json()
    (load,) = line["load"]
    assert load["bus"] == BUS
    with open_recording(SAMPLE) as recording:
        assert sum(load["frames"]) == recording.topics[f"/{BUS}"]
    assert all(0 < share < 0.6 for share in load["share"] if share)
    told = [(one["text_key"], one["severity"]) for one in line["marks"]]
    assert ("event.device_fault", "error") in told
    assert ("event.slave_state", "warning") in told
    trips = (await server.client.get(f"/api/recordings/{NAME}.mcap/trips")).json()
    assert len(trips["trips"]) == 1
    assert "5232" in str(trips)


async def test_the_trace_names_services_jobs_and_signals(server: Server) -> None:
    now = await at(server, MOVING_S)

    async def rows(**asked: Any) -> list[dict[str, Any]]:
        answer = await server.client.get(f"{BASE}/frames", params={"before": now + 1, "limit": 200, **asked})
        assert answer.status_code == 200, answer.text
        found: list[dict[str, Any]] = answer.json()["rows"]
        return found

    all_rows = await rows()
    assert len(all_rows) == 200
    assert {row["device"] for row in all_rows} == {SLUG}
    assert {row["service"] for row in all_rows} <= {"fdl-request", "fdl-response", "fdl-same"}
    moved = next(row for row in reversed(all_rows) if row["service"] == "fdl-response")
    named = {item["address"]: item for item in moved["items"]}
    assert {"0/38", "12/100", "0/36", "PZD 106"} <= named.keys()
    assert named["12/100"]["name"] == "dpc_ActualVal"
    assert moved["fdl"] == {
        "source": NODE, "destination": 2, "dsap": None, "ssap": None, "pkw": True, "sound": True,
    }  # fmt: skip
    news = await rows(services=["fdl-request", "fdl-response"])
    assert not {row["service"] for row in news} & {"fdl-same"}
    assert len(news) < 200 or news[0]["t_ns"] < all_rows[0]["t_ns"], "what is unchanged takes no room"
    started = await rows(services=["fdl-request"], q="Set_Prm")
    assert [row["step"] for row in started] == ["set-prm"]
    (refused,) = [row for row in await rows(errors=True) if row["items"][0]["address"] == "0/38"]
    (note,) = [one for one in refused["notes"] if one["key"] == "trace.fdl.pkw_refused"]
    assert note["details"] == {"code": 1, "reason_key": "profibus.pkw.not_changeable"}
    assert await rows(ids="0-7FF") == []


async def test_the_bus_tells_its_device_and_its_bit_rate(server: Server) -> None:
    await at(server, MOVING_S)
    (node,) = (await server.client.get(f"{BASE}/bus/nodes")).json()
    assert (node["node"], node["device"], node["seen"], node["nmt"], node["managed"]) == (NODE, SLUG, True, None, False)
    assert node["load"] > 0
    (load,) = (await server.client.get(f"{BASE}/bus/load")).json()
    assert load["bitrate"] == BAUD
    assert load["nodes"].keys() == {str(NODE)}
    written = (await server.client.get(f"{BASE}/bus/transfers", params={"which": "writes"})).json()
    told = {(one["item"]["address"], one["outcome"]): one for one in written}
    assert ("12/61", "done") in told
    assert told["0/38", "aborted"]["abort"] == {"code_hex": "1", "reason_key": "profibus.pkw.not_changeable"}
    assert (await server.client.get(f"{BASE}/bus/identifiers")).json() == []


async def test_a_slave_that_is_away_is_shown_so(server: Server) -> None:
    begin_ns = int((await opened(server, NAME))["from_ns"])
    states = [one for one in records() if isinstance(one, SlaveSeen)]
    away_ns = next(one.t_ns for one in states if one.state is SlaveState.ABSENT)
    await at(server, (away_ns - begin_ns) / S + 0.1)
    (node,) = (await server.client.get(f"{BASE}/bus/nodes")).json()
    assert node["silent"]


async def test_a_set_is_recovered(server: Server) -> None:
    recovered = await server.client.post(f"/api/recordings/{NAME}.mcap/recover-sets", json={})
    assert recovered.status_code == 200, recovered.text
    assert "12/61" in str(recovered.json()) or recovered.json()
