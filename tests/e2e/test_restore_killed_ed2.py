"""The server itself is killed while it restores an ED2: the next one finds the restore, tells of it, and ends it."""

from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path
from typing import Any

import httpx
import pytest

from app.model.address import parse_address
from app.model.datatypes import Raw
from tests.e2e.processes import hubside
from tests.e2e.test_restore_killed_pd4e import POLL_S, post, serving, wait_for
from tests.service.motion.ed2_rig import AXIS, ORDER, SITE, Cylinders, cylinders

pytestmark = [pytest.mark.timeout(300), pytest.mark.alone]

CONNECTED_S = 60.0
STATION = AXIS.rpartition("/")[0]
NEW: dict[str, int] = {"12/207": 9_000, "1/106": 1, "1/101": 4_900}


def ram(twin: Cylinders) -> dict[str, int]:
    return {address: twin.number(*_pair(address)) for address in NEW}


def put(twin: Cylinders, values: dict[str, int]) -> None:
    channel = twin.wired.device.channels[0]
    for address, raw in values.items():
        channel.put(*_pair(address), raw)


def written(client: httpx.Client, body: dict[str, Any]) -> httpx.Response:
    """The answer to a write, once the line is connected: a slave whose master died comes back after its watchdog."""
    until = time.monotonic() + CONNECTED_S
    while (answer := client.post(f"/api/live/devices/{AXIS}/write", json=body)).json().get("code") == "not_connected":
        assert time.monotonic() < until, answer.text
        time.sleep(POLL_S)
    return answer


def kill_at(twin: Cylinders, place: str, process: int) -> None:
    """Once the device has done what it was asked for, its answer not yet sent."""
    cell = twin.wired.device.channels[0].store.cell(*_pair(place))
    effect = cell.effect

    def strike(raw: Raw) -> object:
        cell.effect = effect
        done = None if effect is None else effect(raw)
        os.kill(process, signal.SIGKILL)
        return done

    twin.wired.do(lambda: setattr(cell, "effect", strike))


@pytest.mark.parametrize(
    ("place", "way", "state"), [("12/207", "roll-back", "rolled-back"), ("0/51", "resume", "done")]
)
def test_the_next_server_finds_what_a_killed_one_left(tmp_path: Path, place: str, way: str, state: str) -> None:
    with cylinders() as twin:
        site, data = tmp_path / "bench.toml", tmp_path / "data"
        site.write_text(SITE.format(port=twin.wired.line.path, baud=twin.wired.baud, more=ORDER), encoding="utf-8")
        old = ram(twin)
        twin.wired.do(lambda: put(twin, NEW))
        backup = hubside("backup", "--site", str(site), "--listen-s", "0.1", AXIS, "--json", data=data)
        wanted = json.loads(Path(json.loads(backup.out.splitlines()[0])["file"]).read_text("utf-8"))["hash"]
        twin.wired.do(lambda: put(twin, old))

        with serving(site, data) as (process, client):
            order = {"station": STATION, "sets": [wanted]}
            plan = post(client, "/api/live/restore/plan", order)
            assert not plan["refusals"], plan["refusals"]
            kill_at(twin, place, process.popen.pid)
            body = {**order, "plan_hash": plan["hash"], "reason": "test"}
            restore = str(post(client, "/api/live/restore", body)["id"])
            try:
                wait_for(client, restore, "awaiting-confirmation")
                client.post(f"/api/live/restores/{restore}/confirm", json={})
            except httpx.TransportError:
                pass  # it was killed while it wrote
            assert process.popen.wait(60) == -signal.SIGKILL

        with serving(site, data) as (process, client):
            (left,) = client.get("/api/live/restores", params={"open": True}).json()
            assert (left["id"], left["state"]) == (restore, "incomplete")
            assert left["cause_key"] == "restore.cause.tool-ended"
            refused = written(client, {"address": "12/208", "raw": 9_500})
            assert (refused.status_code, refused.json()["code"]) == (409, "restore_open")
            post(client, f"/api/live/restores/{restore}/{way}", {})
            wait_for(client, restore, state)
            assert client.get("/api/live/restores", params={"open": True}).json() == []
            assert not [line for line in process.lines if "Traceback" in line]

        assert ram(twin) == (NEW if way == "resume" else old)


def _pair(address: str) -> tuple[int, int]:
    at = parse_address(address)
    return at.major, at.minor
