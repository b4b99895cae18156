"""The server itself is killed while it restores a PD4-E: the next one finds the restore, tells of it, and ends it."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from app.model.address import parse_address
from app.model.datatypes import Raw
from tests.e2e.processes import Process, hubside, running
from tests.service.pd4e.conftest import SERVO, STATION, Served, served_twin, site_of

pytestmark = pytest.mark.timeout(300)

NEW: dict[str, Raw] = {"2031": 1500, "6065": 300, "6073": 1200}
"""Tuning, application, drive."""
POLL_S = 0.1


@contextmanager
def serving(site: Path, data: Path) -> Iterator[tuple[Process, httpx.Client]]:
    """A server that is connected, and who may use it."""
    words = ("serve", "--site", str(site), "--listen-s", "0.1", "--data", str(data), "--port", "0", "--json")
    with running(*words) as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        with httpx.Client(base_url=url.split("/?")[0], trust_env=False, timeout=30) as client:
            client.get(url)
            yield process, client


def set_of_new_values(served: Served, site: Path, data: Path) -> str:
    """Hash of a set in the library: that of this drive, with other values; the drive has its old ones again."""
    old = {address: served.holds(address) for address in NEW}
    assert not any(old[address] == raw for address, raw in NEW.items())
    put(served, NEW)
    backup = hubside("backup", "--site", str(site), "--listen-s", "0.1", SERVO, "--json", data=data)
    assert backup.code == 0, backup.err
    put(served, old)
    return str(json.loads(Path(json.loads(backup.out.splitlines()[0])["file"]).read_text("utf-8"))["hash"])


def put(served: Served, values: dict[str, Raw]) -> None:
    for address, raw in values.items():
        served.device.store.at(parse_address(address)).raw = raw


def arm(served: Served, place: str, strike: Callable[[], None]) -> None:
    """Strike once, when the device has done what it was asked for at ``place``, its answer not yet sent."""
    cell = served.device.store.at(parse_address(place))
    effect = cell.effect

    def obey(raw: Raw) -> None:
        cell.effect = effect
        if effect is not None:
            effect(raw)
        strike()

    cell.effect = obey


def restored_until_killed(served: Served, site: Path, data: Path, set_hash: str, place: str) -> str:
    """Begin a restore, confirm it where it comes so far, and kill the server at ``place``; gives the restore's id."""
    with serving(site, data) as (process, client):
        arm(served, place, lambda: os.kill(process.popen.pid, signal.SIGKILL))
        order = {"station": STATION, "sets": [set_hash], "restart": True}
        plan = post(client, "/api/live/restore/plan", order)
        assert not plan["refusals"], plan["refusals"]
        begun = str(post(client, "/api/live/restore", {**order, "plan_hash": plan["hash"], "reason": "test"})["id"])
        try:
            wait_for(client, begun, "awaiting-confirmation")
            client.post(f"/api/live/restores/{begun}/confirm", json={})
        except httpx.TransportError:
            pass  # it was killed while it wrote
        assert process.popen.wait(60) == -signal.SIGKILL
    return begun


def post(client: httpx.Client, path: str, body: dict[str, Any]) -> Any:
    answer = client.post(path, json=body)
    assert answer.status_code == 200, answer.text
    return answer.json()


def wait_for(client: httpx.Client, restore: str, state: str) -> None:
    """Until a restore is in a state; an end that is another one is no way to it."""
    while (found := client.get(f"/api/live/restores/{restore}").json())["state"] != state:
        assert found["end"] is None, found
        time.sleep(POLL_S)


@pytest.mark.parametrize(
    ("place", "way", "state"),
    [
        ("6065", "roll-back", "rolled-back"),
        ("1010:05", "roll-back", "rolled-back"),
        ("2800:01", "resume", "done"),
    ],
)
def test_the_next_server_finds_what_a_killed_one_left(tmp_path: Path, place: str, way: str, state: str) -> None:
    with served_twin() as served:
        site, data = tmp_path / "bench.toml", tmp_path / "data"
        site.write_text(site_of(served.address), encoding="utf-8")
        old = {address: served.holds(address) for address in NEW}
        stored = {address: served.stored(address) for address in NEW}
        wanted = set_of_new_values(served, site, data)
        restore = restored_until_killed(served, site, data, wanted, place)

        with serving(site, data) as (process, client):
            (left,) = client.get("/api/live/restores", params={"open": True}).json()
            assert (left["id"], left["state"], left["cause_key"]) == (
                restore,
                "incomplete",
                "restore.cause.tool-ended",
            )
            told = client.get(f"/api/live/restores/{restore}").json()
            assert told["blocks"] and {"resume", "roll-back"} <= set(told["can"])
            begun = [step for step in told["steps"] if step["state"] == "intended"]
            assert [step["address"] for step in begun] == ([place] if place != "2800:01" else [None])
            write = {"address": "2031", "raw": 1400}
            refused = client.post(f"/api/live/devices/{SERVO}/write", json=write)
            assert (refused.status_code, refused.json()["code"]) == (409, "restore_open")
            post(client, f"/api/live/restores/{restore}/{way}", {})
            wait_for(client, restore, state)
            assert client.get("/api/live/restores", params={"open": True}).json() == []
            post(client, f"/api/live/devices/{SERVO}/write", {"address": "2036", "raw": 900})
            assert not [line for line in process.lines if "Traceback" in line]

        goal = NEW if way == "resume" else old
        assert {address: served.holds(address) for address in NEW} == goal
        served.device.restart()
        assert {address: served.holds(address) for address in NEW} == goal, "non-volatile memory holds the same"
        if place == "6065" and way == "roll-back":
            assert {address: served.stored(address) for address in NEW} == stored, "nothing was ever saved"
