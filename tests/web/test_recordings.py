"""Recordings over HTTP: the list, one of them, its bytes, and that names lead nowhere else."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from app.service.connection import Connection
from tests.web.rig import Server, running, wait_until

SAMPLE = Path(__file__).resolve().parents[2] / "recordings" / "oat-six-nodes.mcap"


@pytest.fixture
async def server(connection: Connection, tmp_path: Path) -> AsyncIterator[Server]:
    """Connected and recording into ``rec``; the data folder's recordings lead there, with a sample beside."""
    (tmp_path / "recordings").symlink_to(tmp_path / "rec")
    (tmp_path / "rec" / "sample.mcap").write_bytes(SAMPLE.read_bytes())
    async with running(connection, data=tmp_path) as started:
        yield started


async def test_the_running_recording_and_a_finished_one_are_listed(server: Server) -> None:
    listed = (await server.client.get("/api/recordings")).json()
    assert listed["free_bytes"] > 0
    states = {one["name"]: one["state"] for one in listed["files"] if not one["sample"]}
    assert server.connection.recording is not None
    live = server.connection.recording.status().file
    assert live is not None
    assert states == {live.name: "live", "sample.mcap": "finished"}
    sample = next(one for one in listed["files"] if one["name"] == "sample.mcap")
    assert sample["summary"]["frames"] > 1000
    assert sample["summary"]["last_ns"] > sample["summary"]["first_ns"]
    listed_samples = {one["name"] for one in listed["files"] if one["sample"]}
    assert {"1-normal-operation.mcap", "pd4e-bench.mcap"} <= listed_samples


async def test_one_recording_tells_its_contents_and_gives_its_bytes(server: Server) -> None:
    doc = (await server.client.get("/api/recordings/sample.mcap")).json()
    assert doc["state"] == "finished"
    assert doc["topics"]["/can0"] == doc["summary"]["frames"]
    name = doc["attachments"][0]["name"]
    inside = await server.client.get("/api/recordings/sample.mcap/attachment", params={"attachment": name})
    assert len(inside.content) == doc["attachments"][0]["size_bytes"]
    whole = await server.client.get("/api/recordings/sample.mcap/download")
    assert whole.content == SAMPLE.read_bytes()
    assert "sample.mcap" in whole.headers["content-disposition"]
    missing = await server.client.get("/api/recordings/sample.mcap/attachment", params={"attachment": "nothing"})
    assert missing.status_code == 404


async def test_the_running_one_can_be_downloaded_while_it_grows(server: Server) -> None:
    assert server.connection.recording is not None
    recording = server.connection.recording
    await wait_until(lambda: recording.status().size_bytes > 1000)
    live = recording.status().file
    assert live is not None
    got = await server.client.get(f"/api/recordings/{live.name}/download")
    assert got.status_code == 200
    assert got.content == live.read_bytes()[: len(got.content)]
    assert len(got.content) == int(got.headers["content-length"])
    doc = (await server.client.get(f"/api/recordings/{live.name}")).json()
    assert (doc["state"], doc["summary"]) == ("live", None)


@pytest.mark.parametrize("name", ["nothing.mcap", "..%2Fsite.toml", "%2Fetc%2Fpasswd", "sample.mcap%00"])
async def test_names_lead_to_no_other_file(server: Server, name: str) -> None:
    for path in (f"/api/recordings/{name}", f"/api/recordings/{name}/download"):
        answer = await server.client.get(path)
        assert answer.status_code == 404, path
        assert json.loads(answer.text)["code"] == "not_found"


async def test_what_is_no_recording_is_told_as_such(server: Server, tmp_path: Path) -> None:
    (tmp_path / "rec" / "none.mcap").write_bytes(b"no recording at all, but long enough to be looked at")
    listed = (await server.client.get("/api/recordings")).json()["files"]
    assert {one["name"]: one["state"] for one in listed}["none.mcap"] in ("unfinished", "unreadable")
    answer = await server.client.get("/api/recordings/none.mcap")
    assert (answer.status_code, answer.json()["code"]) == (422, "recording")


async def test_strangers_get_nothing(server: Server) -> None:
    for path in ("/api/recordings", "/api/recordings/sample.mcap", "/api/recordings/sample.mcap/download"):
        assert (await server.stranger.get(path)).status_code == 401
