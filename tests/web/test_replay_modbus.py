"""A replay of a bench on Modbus TCP: every read route tells of its drive what it tells of those on CAN."""

from __future__ import annotations

import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from app.model.address import Address
from app.recording.reader import open_recording
from app.wire.decoders import decoder_of
from app.wire.records import ValueSeen
from tests.recording.make_pd4e import BUS, SAMPLE, SERVER, SLUG
from tests.web.rig import Server, make_connection, running
from tests.web.test_replay import S, indexed, opened, order
from tests.web.test_route_matrix import ROUTES

NAME = SAMPLE.stem
BASE = f"/api/replay/{NAME}"
FAULT_S = 4.9
"""From the beginning to a moment at which the drive is in Fault."""


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


def seen_of(address: int) -> list[ValueSeen]:
    with open_recording(SAMPLE) as recording:
        records = decoder_of(BUS, servers={1: SERVER}).feed_all(recording.frames())
    return [one for one in records if isinstance(one, ValueSeen) and one.address == Address(address)]


async def test_every_read_route_answers(server: Server) -> None:
    await indexed(server, NAME)
    await at(server, FAULT_S)
    names = dict(zip(("{turbine}", "{station}", "{device}"), SLUG.split("/"), strict=True))
    names |= {"{replay_id}": NAME, "{description_id}": "nanotec-pd4e"}
    asked = {
        "frames": {"around": str(0)},
        "series": {"signal": f"{SLUG}/6064"},
        "history": {"device": SLUG, "address": "3700"},
    }
    for method, path in sorted(ROUTES):
        if method != "GET" or not path.startswith("/api/replay/{replay_id}"):
            continue
        for name, text in names.items():
            path = path.replace(name, text)
        answer = await server.client.get(path, params=asked.get(path.rpartition("/")[2], {}))
        assert answer.status_code == 200, (path, answer.text)


async def test_its_adus_are_downloaded_for_wireshark_and_no_can_log_is_made_of_them(server: Server) -> None:
    path = f"/api/recordings/{NAME}.mcap/export"
    got = await server.client.get(path, params={"format": "pcapng"})
    assert got.status_code == 200
    assert f"{NAME}.pcapng" in got.headers["content-disposition"]
    assert got.content.startswith(b"\x0a\x0d\x0d\x0a")
    refused = await server.client.get(path, params={"format": "candump"})
    assert (refused.status_code, refused.json()["code"]) == (400, "usage")
    assert "pcapng" in str(refused.json())


async def test_a_recording_offers_no_look_at_the_device(server: Server) -> None:
    await at(server, FAULT_S)
    (station,) = (await server.client.get(f"{BASE}/turbine")).json()["stations"]
    assert [(one["slug"], one["verifies"]) for one in station["devices"]] == [(SLUG, False)]


async def test_a_series_is_what_the_decoder_says(server: Server) -> None:
    doc = await indexed(server, NAME)
    await at(server, FAULT_S)  # the unit of a position is that of the factors that are known at the cursor
    asked: dict[str, str | int] = {"signal": f"{SLUG}/6064", "points": 5000}
    (series,) = (await server.client.get(f"{BASE}/series", params=asked)).json()
    assert series["exact"]
    assert series["t_s"] == [(one.t_ns - doc["from_ns"]) / 1e9 for one in seen_of(0x6064)]
    assert max(series["low"]) == pytest.approx(720.0), "two turns, in degrees"
    asked["points"] = 20
    (coarse,) = (await server.client.get(f"{BASE}/series", params=asked)).json()
    assert not coarse["exact"]
    assert max(coarse["high"]) == max(series["high"])


async def test_the_timeline_shows_the_fault_and_the_load(server: Server) -> None:
    await indexed(server, NAME)
    line = (await server.client.get(f"{BASE}/timeline", params={"buckets": 40})).json()
    (load,) = line["load"]
    assert load["bus"] == BUS
    with open_recording(SAMPLE) as recording:
        assert sum(load["frames"]) == recording.topics[f"/{BUS}"]
    assert all(0 < share < 0.01 for share in load["share"] if share)
    assert line["gaps"] == []
    trips = (await server.client.get(f"/api/recordings/{NAME}.mcap/trips")).json()
    assert len(trips["trips"]) == 1
    assert "8611" in str(trips)
    told = [(one["text_key"], one["severity"], one["details"].get("code_hex")) for one in line["marks"]]
    assert ("event.device_fault_unknown", "error", None) in told, "the statusword is read first"
    assert ("event.device_fault", "error", "8611h") in told, "603Fh names the reason"
    assert ("event.device_fault_over", "info", None) in told
    marked = next(one["t_ns"] for one in line["marks"] if one["text_key"] == "event.device_fault_unknown")
    assert trips["trips"][0]["t0_ns"] == marked


async def test_the_trace_names_device_function_and_objects(server: Server) -> None:
    now = await at(server, FAULT_S)

    async def rows(**asked: Any) -> list[dict[str, Any]]:
        answer = await server.client.get(f"{BASE}/frames", params={"before": now + 1, "limit": 100, **asked})
        assert answer.status_code == 200, answer.text
        found: list[dict[str, Any]] = answer.json()["rows"]
        return found

    all_rows = await rows()
    assert len(all_rows) == 100
    assert {(row["device"], row["service"]) for row in all_rows} == {
        (SLUG, "modbus-request"), (SLUG, "modbus-response"),
    }  # fmt: skip
    assert {row["number"] for row in all_rows} == {23, 43}
    answer = next(row for row in reversed(all_rows) if row["number"] == 23 and row["service"] == "modbus-response")
    assert answer["step"] == "registers-both"
    named = {item["address"]: item for item in answer["items"]}
    assert {"6040", "607A", "6041", "6064"} <= named.keys()
    assert answer["items"][0]["address"] == "6041", "what the drive gave before what it got"
    assert answer["start_t_ns"] < answer["t_ns"]
    assert answer["peer"] == "192.168.2.10:49152"
    assert int(answer["data"][:4], 16) == answer["transaction"]
    codes = await rows(q="603F")
    assert codes
    assert all(item["address"] == "603F" for row in codes for item in row["items"])
    (refused,) = await rows(errors=True)
    assert refused["step"] == "abort"
    assert refused["items"][0]["address"] == "6041"
    assert await rows(nodes="2") == []
    assert await rows(ids="0-7FF") == []
    both = await rows(services="modbus-request", data="* 2B 0D")
    assert {row["number"] for row in both} == {43}


async def test_the_bus_tells_its_device_and_no_bit_rate(server: Server) -> None:
    await at(server, FAULT_S)
    (node,) = (await server.client.get(f"{BASE}/bus/nodes")).json()
    assert (node["node"], node["device"], node["seen"], node["nmt"]) == (1, SLUG, True, None)
    assert node["load"] > 0
    (load,) = (await server.client.get(f"{BASE}/bus/load")).json()
    assert load["bitrate"] == 0
    assert load["nodes"].keys() == {"1"}
    written = (await server.client.get(f"{BASE}/bus/transfers", params={"which": "writes"})).json()
    assert {(one["item"]["address"], one["outcome"]) for one in written} >= {("6066", "done"), ("6041", "aborted")}
    assert (await server.client.get(f"{BASE}/bus/identifiers")).json() == []


async def test_a_moment_is_compared_and_kept_as_a_set(server: Server) -> None:
    """6066h is written 74 ms after the beginning, after the dictionary was read."""
    begin = int((await opened(server, NAME))["from_ns"])
    early, late = begin + S // 16, begin + 5 * S
    columns = [f"moment:{NAME}@{t_ns}/{SLUG}" for t_ns in (early, late)]
    told = (await server.client.post("/api/compare", json={"columns": columns})).json()
    rows = {row["address"]: row for row in told["rows"]}
    assert [cell["raw"] for cell in rows["6066"]["cells"]] == [100, 50]
    kept = await server.client.post(f"{BASE}/sets", json={"devices": [SLUG], "t_ns": late})
    assert kept.status_code == 200, kept.text
    (one,) = kept.json()
    assert one["known"] > 850
    recovered = await server.client.post(f"/api/recordings/{NAME}.mcap/recover-sets", json={})
    assert recovered.status_code == 200, recovered.text
