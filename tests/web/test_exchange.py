"""Recordings to and from other formats over HTTP: told losses, downloads, uploads, cuts, merges, anonymised copies."""

from __future__ import annotations

import asyncio
import io
import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from threading import Event as Flag
from typing import Any

import can.io
import pyarrow.parquet as pq
import pytest

from app.recording.exchange.cut import CutOrder, cut
from app.recording.file_lock import lock_file
from app.recording.index.place import index_path
from app.recording.reader import open_recording
from app.service.connection import Connection
from app.service.exchange import AT_ONCE, SPARE_BYTES, in_thread
from app.web.guard import MAX_RECORDING
from tests.web.rig import Server, running, wait_until

VISIT = Path(__file__).resolve().parents[2] / "recordings" / "scenarios" / "7-service-visit.mcap"
OCTETS = {"Content-Type": "application/octet-stream"}
S = 1_000_000_000
BEGIN_NS = 1_772_456_400_000_000_000 + 38 * S


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("exchange") / "visit.mcap"
    cut(VISIT, path, CutOrder(BEGIN_NS, BEGIN_NS + 6 * S))
    return path


@pytest.fixture
async def server(connection: Connection, part: Path, tmp_path: Path) -> AsyncIterator[Server]:
    (tmp_path / "recordings").mkdir()
    shutil.copyfile(part, tmp_path / "recordings" / "visit.mcap")
    async with running(connection, data=tmp_path) as started:
        yield started


async def finished(server: Server, job: dict[str, Any]) -> dict[str, Any]:
    async with asyncio.timeout(20):
        while job["state"] == "running":
            job = (await server.client.get(f"/api/recordings/made/{job['id']}")).json()
    return job


def frames(folder: Path, name: str) -> list[Any]:
    with open_recording(folder / "recordings" / name, strict=True) as recording:
        return list(recording.frames())


async def test_losses_are_told_and_the_export_is_read_by_others(server: Server, part: Path, tmp_path: Path) -> None:
    told = (await server.client.get("/api/recordings/visit.mcap/losses", params={"format": "candump"})).json()
    things = {one["what"]: one["things"] for one in told["losses"]}
    assert things["time"] > 1000
    assert things["attachments"] == 3
    exact = {"format": "candump", "exact": "true"}
    told = (await server.client.get("/api/recordings/visit.mcap/losses", params=exact)).json()
    assert "time" not in {one["what"] for one in told["losses"]}
    params = {"format": "blf", "start_ns": str(BEGIN_NS + S), "end_ns": str(BEGIN_NS + 2 * S)}
    answer = await server.client.get("/api/recordings/visit.mcap/export", params=params)
    assert answer.headers["content-disposition"] == 'attachment; filename="visit.blf"'
    with can.io.BLFReader(io.BytesIO(answer.content)) as reader:
        seen = [(message.arbitration_id, bytes(message.data)) for message in reader]
    with open_recording(part) as recording:
        wanted = [frame.payload for frame in recording.frames(BEGIN_NS + S, BEGIN_NS + 2 * S)]
    assert seen == [(one.can_id, one.data) for one in wanted]  # type: ignore[union-attr]
    folder = tmp_path / "recordings"  # what was made for the download is gone
    await wait_until(lambda: [path.name for path in folder.iterdir()] == ["visit.mcap"])


async def test_signals_come_as_parquet(server: Server) -> None:
    params = {"shape": "wide", "signal": ["can0/11:6064", "wtg-07/blade-2/pmc:6064"]}
    answer = await server.client.get("/api/recordings/visit.mcap/table", params=params)
    table = pq.read_table(io.BytesIO(answer.content))
    assert table.num_columns == 3
    assert table.num_rows > 200
    wrong = await server.client.get("/api/recordings/visit.mcap/table", params={"signal": ["can0/99:6064"]})
    assert wrong.status_code == 400
    assert "can0/99" in wrong.json()["details"]["reason"]


async def test_what_is_sent_becomes_a_recording(server: Server, tmp_path: Path) -> None:
    answer = await server.client.get("/api/recordings/visit.mcap/export", params={"format": "asc", "exact": "true"})
    params = {"file": "from the field.asc", "turbine": "wtg-07"}
    sent = await server.client.post("/api/recordings/import", params=params, content=answer.content, headers=OCTETS)
    job = await finished(server, sent.json())
    assert (job["state"], job["remarks"], job["error"]) == ("done", [], None)
    (name,) = job["files"]
    assert frames(tmp_path, name) == frames(tmp_path, "visit.mcap")
    with open_recording(tmp_path / "recordings" / name) as recording:
        assert recording.info.nodes["can0/11"].endswith("oat-pmc")
        assert '"from the field.asc"' in recording.metadata["origin"]["sources"]
    listed = (await server.client.get("/api/recordings")).json()
    assert {"visit.mcap", name} <= {one["name"] for one in listed["files"]}
    await wait_until(lambda: index_path(tmp_path / "recordings" / name).exists())  # nobody has asked for it


async def test_a_bad_file_names_its_line_and_leaves_nothing(server: Server, tmp_path: Path) -> None:
    text = b"(1750000000.000001) can0 181#0102\nrubbish\n(1750000000.000002) can0 181#0102\n"
    params = {"file": "bad.log"}
    sent = await server.client.post("/api/recordings/import", params=params, content=text, headers=OCTETS)
    job = await finished(server, sent.json())
    assert job["state"] == "failed"
    details = job["error"]["details"]
    assert (details["file"], details["line"], details["found"]) == ("bad.log", 2, "rubbish")
    assert [path.name for path in (tmp_path / "recordings").iterdir()] == ["visit.mcap"]
    params["lenient"] = "true"
    sent = await server.client.post("/api/recordings/import", params=params, content=text, headers=OCTETS)
    job = await finished(server, sent.json())
    assert (job["state"], job["frames"]) == ("done", 2)
    assert job["skipped"] == [{"line": 2, "text": "rubbish"}]
    assert [one["text_key"] for one in job["remarks"]] == ["exchange.import.skipped"]


async def test_what_is_too_large_or_of_another_type_is_refused_before_it_is_sent(server: Server) -> None:
    cookie = "; ".join(f"{name}={value}" for name, value in server.client.cookies.items())
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    head = [
        "POST /api/recordings/import?file=big.log HTTP/1.1",
        f"Host: 127.0.0.1:{server.port}",
        f"Cookie: {cookie}",
        "Content-Type: application/octet-stream",
        f"Content-Length: {MAX_RECORDING + 1}",
    ]
    writer.write("\r\n".join([*head, "", ""]).encode())
    assert b" 413 " in await asyncio.wait_for(reader.readline(), 10)
    writer.close()
    for kind in ("application/json", "text/plain"):
        headers = {"Content-Type": kind}
        refused = await server.client.post("/api/recordings/import?file=a.log", content=b"{}", headers=headers)
        assert refused.json()["code"] == "invalid"


async def test_cut_merge_and_anonymise_make_recordings_beside(server: Server, tmp_path: Path) -> None:
    whole = frames(tmp_path, "visit.mcap")
    middle = BEGIN_NS + 3 * S
    names = []
    for part_of_it in ({"end_ns": middle + S}, {"start_ns": middle}):
        sent = await server.client.post("/api/recordings/visit.mcap/cut", json=part_of_it)
        job = await finished(server, sent.json())
        names += job["files"]
    assert names == ["visit-cut.mcap", "visit-cut-2.mcap"]
    body = {"recordings": [{"name": name} for name in names]}
    job = await finished(server, (await server.client.post("/api/recordings/merge", json=body)).json())
    assert frames(tmp_path, job["files"][0]) == whole
    (remark,) = job["remarks"]
    assert remark["count"] == sum(middle <= frame.t_ns < middle + S for frame in whole)
    sent = await server.client.post("/api/recordings/visit.mcap/anonymise", json={"hide_times": True})
    job = await finished(server, sent.json())
    assert job["files"] == ["anonymous.mcap"]
    assert len(frames(tmp_path, "anonymous.mcap")) == len(whole)
    refused = await finished(
        server, (await server.client.post("/api/recordings/visit.mcap/cut", json={"start_ns": 1, "end_ns": 2})).json()
    )
    assert refused["state"] == "failed"
    missing = await server.client.post("/api/recordings/nothing.mcap/cut", json={})
    assert missing.status_code == 404
    assert (await server.client.get("/api/recordings/made/nothing")).status_code == 404


@pytest.mark.parametrize("name", ["", "..", "a.annotations.mcap", "a\0.mcap", "a\n.mcap"])
async def test_a_name_that_is_none_is_refused_before_anything_is_kept(
    name: str, server: Server, tmp_path: Path
) -> None:
    answer = await server.client.post("/api/recordings/import", params={"file": name}, content=b"x", headers=OCTETS)
    assert answer.status_code == 400
    assert "cannot be imported under the name" in answer.json()["details"]["reason"]
    assert [path.name for path in (tmp_path / "recordings").iterdir()] == ["visit.mcap"]


async def test_a_cancelled_import_leaves_nothing(server: Server, tmp_path: Path) -> None:
    lines = (f"({1_750_000_000 + n / 1000:.6f}) can0 181#0102\n" for n in range(300_000))
    sent = await server.client.post(
        "/api/recordings/import", params={"file": "long.log"}, content="".join(lines).encode(), headers=OCTETS
    )
    job = sent.json()
    await server.client.delete(f"/api/recordings/made/{job['id']}")
    assert (await finished(server, job))["state"] == "cancelled"
    folder = tmp_path / "recordings"
    await wait_until(lambda: sorted(path.name for path in folder.iterdir()) == ["visit.mcap"])


async def test_a_third_file_at_once_is_refused_and_a_full_disk_too(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on = Flag()
    busy = [asyncio.ensure_future(in_thread(lambda: go_on.wait(20))) for _ in range(AT_ONCE)]
    await asyncio.sleep(0)  # both have begun
    for answer in (
        await server.client.post("/api/recordings/visit.mcap/cut", json={}),
        await server.client.get("/api/recordings/visit.mcap/export", params={"format": "asc"}),
        await server.client.post("/api/recordings/import", params={"file": "a.log"}, content=b"x", headers=OCTETS),
    ):
        assert answer.status_code == 422
        assert "being made already" in answer.json()["details"]["reason"]
    go_on.set()
    await asyncio.gather(*busy)
    monkeypatch.setattr("app.service.exchange.free_space", lambda _: SPARE_BYTES + 1000)
    full = await server.client.get("/api/recordings/visit.mcap/export", params={"format": "asc"})
    assert "make room" in full.json()["details"]["reason"]
    job = await finished(server, (await server.client.post("/api/recordings/visit.mcap/cut", json={})).json())
    assert job["state"] == "failed"
    assert "make room" in job["error"]["details"]["reason"]
    assert [path.name for path in (tmp_path / "recordings").iterdir()] == ["visit.mcap"]


async def test_what_a_killed_server_left_is_taken_away(server: Server, tmp_path: Path) -> None:
    """But not the draft of another process, which is locked."""
    folder = tmp_path / "recordings"
    (folder / ".export-old").mkdir()
    for name in (".export-old/export", ".import-old.upload", ".making-old.part"):
        (folder / name).write_bytes(b"half")
    with (folder / ".making-new.part").open("xb") as other:
        lock_file(other)
        assert (await server.client.post("/api/recordings/visit.mcap/cut", json={})).status_code == 200
        names = {path.name for path in folder.iterdir()}
    assert ".making-new.part" in names
    assert not names & {".export-old", ".import-old.upload", ".making-old.part"}
