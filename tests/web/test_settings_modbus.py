"""Settings of a bench on Modbus TCP, with a twin in real time: one address is asked, stops are for experts."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import pytest

from app.drivers.modbus_config import ModbusPeer
from app.model.description_file import load_builtin
from app.model.site import load_site
from app.service.connection import Connection
from app.service.options import Options
from tests.drivers.modbus_rig import twin
from tests.e2e.processes import ROOT as PROJECT
from tests.web.rig import Server, running
from tests.web.test_login import with_anna
from tests.web.test_settings import ROOT, finished, post

KNOWN = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc", "nanotec-pd4e")}


@pytest.fixture
def peer() -> Iterator[ModbusPeer]:
    with twin() as served:
        yield served


@pytest.fixture
def site(peer: ModbusPeer, tmp_path: Path) -> Path:
    """The bench at the twin; it may also ask an address where nobody is."""
    text = (PROJECT / "docs" / "sites" / "bench-pd4e.toml").read_text(encoding="utf-8")
    path = tmp_path / "site.toml"
    text = text.replace('["127.0.0.1:1502"]', f'["{peer.server}", "127.0.0.1:9"]')
    path.write_text(text.replace("127.0.0.1:1502", peer.server), encoding="utf-8")
    return path


@pytest.fixture
async def server(site: Path) -> AsyncIterator[Server]:
    (turbine,) = load_site(site)
    async with Connection(turbine, KNOWN, Options("tester", None)) as connection, running(connection) as started:
        started.bench.sites.file = site
        started.bench.sites.describe = lambda _turbine: KNOWN
        yield started


async def test_one_address_says_who_it_is(server: Server, peer: ModbusPeer) -> None:
    told = {
        "address": f"{peer.server}",
        "description_id": "nanotec-pd4e",
        "variant": "Nanotec PD4-E591L42-E-65-4",
        "device_name": "HUBSIDE TWIN PD4-E591L42-E-65-4",
        "hardware": None,
        "software": None,
        "serial": "TWIN-0001",
        "twin": True,
    }
    connections = server.connection.buses["lan"].driver.status.reconnects
    frames = server.connection.buses["lan"].frames
    done = await finished(server, await post(server, "/identify", address=peer.server))
    assert (done["state"], done["identified"]) == ("done", told)
    assert server.connection.buses["lan"].frames > frames, "through the connection that is open"
    assert server.connection.buses["lan"].driver.status.reconnects == connections

    await server.bench.disconnect("tester")
    done = await finished(server, await post(server, "/identify", address=peer.server))
    assert (done["state"], done["identified"]) == ("done", told)


async def test_only_what_the_site_allows_is_asked(server: Server, peer: ModbusPeer) -> None:
    for address in ("127.0.0.1:8", "127.0.0.2:9", "localhost:9", "192.168.2.1"):
        done = await finished(server, await post(server, "/identify", address=address))
        assert (done["state"], done["error"]["code"]) == ("failed", "settings"), address
        assert done["error"]["details"]["reason_key"] == "settings.refused.not_in_ranges"
    done = await finished(server, await post(server, "/identify", address="127.0.0.1:9"))
    assert (done["state"], done["error"]["code"]) == ("failed", "bus_open")
    assert "127.0.0.1:9" in str(done["error"]["details"])
    refused = await server.client.post(f"{ROOT}/identify", json={"address": "no address"})
    assert (refused.status_code, refused.json()["code"]) == (400, "usage")


async def test_adapters_polling_and_kinds_know_such_a_bus(server: Server) -> None:
    listed = (await server.client.get(f"{ROOT}/adapters")).json()
    assert "modbus-tcp" not in {one["connection"] for one in listed["adapters"]}
    refused = await server.client.post(f"{ROOT}/scan", json={"connection": "socketcan:none", "bitrate": 500_000})
    assert refused.status_code == 200, "a bus of Modbus TCP is no adapter that could be in use"

    shown = (await server.client.get(f"{ROOT}/polling")).json()
    device = next(one for one in shown["devices"] if one["description_id"] == "nanotec-pd4e")
    assert {"6041", "6064"} <= {one["address"] for one in device["items"]}
    (bus,) = shown["buses"]
    assert (bus["bitrate"], bus["load"], bus["counts"]) == (0, None, {"nanotec-pd4e": 1})
    numbers = {name: shown[name] for name in ("period_s", "slow_every", "rare_every", "load_cap")}
    body = {**numbers, "devices": {"nanotec-pd4e": {"6064": "fast"}}}
    changed = await server.client.put(f"{ROOT}/polling", json=body)
    lists = {one["description_id"]: [item["address"] for item in one["items"]] for one in changed.json()["devices"]}
    assert lists["nanotec-pd4e"] == ["6064"]

    kinds = {one["id"]: one["bus"] for one in (await server.client.get(f"{ROOT}/site")).json()["descriptions"]}
    assert kinds["nanotec-pd4e"] == "modbus-tcp" and kinds["oat-pmc"] == "canopen"


async def test_a_device_is_added_by_address_and_a_stop_needs_an_expert(server: Server, site: Path) -> None:
    state = (await server.client.get(f"{ROOT}/site")).json()
    (turbine,) = state["turbines"]
    (servo,) = turbine["stations"][0]["devices"]
    assert servo["external_stop"] == ""
    second = {**servo, "slug": "servo-2", "address": "127.0.0.1:9/1", "node": 247}

    async def change(client: Any, *devices: dict[str, Any]) -> Any:
        turbine["stations"][0]["devices"] = list(devices)
        revision = (await client.get(f"{ROOT}/site")).json()["revision"]
        body = {"revision": revision, "turbine": turbine}
        return await client.put(f"{ROOT}/site/turbines/bench-pd4e", json=body)

    assert (await change(server.client, servo, second)).status_code == 200
    assert [one.address for one in load_site(site)[0].devices] == [servo["address"], "127.0.0.1:9/1"]
    wrong = await change(server.client, servo, {**second, "address": "127.0.0.1:10"})
    assert wrong.json()["details"]["key"] == "turbine.bench-pd4e.station.bench.device.servo-2.address"

    stopped = {**servo, "external_stop": "emergency stop at the bench"}
    refused = await change(server.client, stopped, second)
    assert (refused.status_code, refused.json()["code"]) == (403, "role")
    anna = await with_anna(server)  # the first user is an expert
    assert (await change(anna, stopped, second)).status_code == 200
    assert load_site(site)[0].devices[0].external_stop == "emergency stop at the bench"
    moved = await change(anna, {**stopped, "name": "Servo"}, second)
    assert moved.status_code == 200
