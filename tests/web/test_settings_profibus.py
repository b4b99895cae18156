"""Settings of a bench on PROFIBUS, with a twin on a real pseudo-terminal: a line is scanned, its site kept whole."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest

from app.model.site import load_site
from tests.drivers.profibus_rig import NODE, Wire, wire
from tests.service.lines_rig import connected, descriptions, site_text
from tests.web.rig import Server, running
from tests.web.test_settings import ROOT, finished, post

SLAVE = 'telegram = 1\npzd_order = "high-high"'


@pytest.fixture
def line() -> Iterator[Wire]:
    with wire() as served:
        yield served


@pytest.fixture
async def server(line: Wire, tmp_path: Path) -> AsyncIterator[Server]:
    file = tmp_path / "site.toml"
    file.write_text(site_text(line, SLAVE), encoding="utf-8")
    async with connected(line, SLAVE) as connection, running(connection) as started:
        started.bench.sites.file = file
        started.bench.sites.describe = descriptions
        yield started


async def test_a_line_is_scanned_on_the_connection_that_is_open(server: Server, line: Wire) -> None:
    asked = {"connection": f"profibus:{line.line.path}", "bitrate": line.baud}
    done = await finished(server, await post(server, "/scan", **asked))
    assert (done["state"], done["error"]) == ("done", None)
    (found,) = done["scan"]["found"]
    assert (found["node"], found["description_id"], found["twin"]) == (NODE, "wandfluh-ed2", True)
    assert (found["product"], found["station"], found["blade"]) == (0x0ED2, "bench", None)


async def test_a_line_is_scanned_on_a_connection_of_its_own(server: Server, line: Wire) -> None:
    await server.bench.disconnect("tester")
    asked = {"connection": f"profibus:{line.line.path}", "bitrate": line.baud, "master": 3}
    done = await finished(server, await post(server, "/scan", **asked))
    assert [one["node"] for one in done["scan"]["found"]] == [NODE]


async def test_where_the_extra_is_missing_the_command_that_brings_it_is_told(
    server: Server, line: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    await server.bench.disconnect("tester")
    monkeypatch.setattr("app.drivers.table.import_module", _without_the_extra)
    done = await finished(server, await post(server, "/scan", connection=f"profibus:{line.line.path}"))
    assert (done["state"], done["error"]["code"]) == ("failed", "extra_missing")
    assert done["error"]["details"] == {"package": "pyprofibus", "extra": "profibus"}


def _without_the_extra(_module: str) -> None:
    raise ModuleNotFoundError("No module named 'pyprofibus'", name="pyprofibus")


async def test_a_site_that_is_saved_as_it_is_shown_keeps_what_it_says_of_slaves(server: Server) -> None:
    site = (await server.client.get(f"{ROOT}/site")).json()
    (turbine,) = site["turbines"]
    (device,) = turbine["stations"][0]["devices"]
    assert (turbine["buses"][0]["master"], device["telegram"], device["pzd_order"]) == (2, 1, "high-high")
    assert {"id": "wandfluh-ed2", "name": "Wandfluh ED2", "bus": "profibus-dp"} in site["descriptions"]
    before = load_site(Path(site["file"]))
    turbine["name"] = "Bench of the cylinders"
    answer = await server.client.put(
        f"{ROOT}/site/turbines/bench-ed2", json={"revision": site["revision"], "turbine": turbine}
    )
    assert answer.status_code == 200, answer.text
    (after,) = load_site(Path(site["file"]))
    assert (after.name, after.buses, after.stations) == (turbine["name"], before[0].buses, before[0].stations)
