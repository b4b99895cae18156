"""PROFIBUS lines in the site file that is edited: what is kept, refused at which key, and noted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.errors import SiteError
from app.model.description_file import load_builtin
from app.model.site import Turbine, load_site
from app.model.slaves import UNKNOWN, SlaveSetup
from app.service.journal import Entry, Journal
from app.service.site_edit import SiteEditor
from app.service.sites import Sites

KNOWN = {name: load_builtin(name) for name in ("oat-pmm", "wandfluh-ed2")}
SITE = """schema = 1
[turbine.bench-ed2.bus.dp0]
connection = "profibus:/dev/ttyUSB0"
bitrate = 500000
[turbine.bench-ed2.station.bench.device.cylinders]
description = "wandfluh-ed2"
node = 6
"""
CYLINDERS = "bench-ed2/bench/cylinders"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "site.toml"
    path.write_text(SITE, encoding="utf-8")
    return path


@pytest.fixture
def editor(file: Path) -> SiteEditor:
    return SiteEditor(Sites(load_site(file), lambda _turbine: KNOWN, file))


@pytest.fixture
def noted() -> list[Entry]:
    return []


@pytest.fixture
def journal(noted: list[Entry]) -> Journal:
    journal = Journal(lambda: 1, "tester")
    journal.listen(noted.append)
    return journal


def text_of(file: Path) -> str:
    return file.read_text(encoding="utf-8")


def changed(turbine: Turbine, bus: dict[str, Any], device: dict[str, Any]) -> Turbine:
    (station,) = turbine.stations
    devices = (replace(station.devices[0], **device),)
    return replace(turbine, buses=(replace(turbine.buses[0], **bus),), stations=(replace(station, devices=devices),))


async def test_a_line_and_a_slave_are_changed_and_noted(
    editor: SiteEditor, file: Path, journal: Journal, noted: list[Entry]
) -> None:
    (before,) = load_site(file)
    slave = SlaveSetup(102, "high-low", "ed2.gsd", ("Telegram 102",))
    wanted = changed(before, {"bitrate": 1_500_000, "master": 4}, {"slave": slave, "external_stop": "red button"})
    await editor.change("bench-ed2", wanted, editor.state().revision, journal)
    assert load_site(file) == (wanted,)
    told = noted[0].details["changes"]
    assert "profibus:/dev/ttyUSB0@1500000, master 4" in told
    assert "telegram 102, order high-low, ed2.gsd: Telegram 102, stopped by red button" in told


@pytest.mark.parametrize(
    ("bus", "device", "key"),
    [
        ({"ranges": ("192.168.2.1",)}, {}, "turbine.bench-ed2.bus.dp0.ranges"),
        ({"heartbeat_node": 5}, {}, "turbine.bench-ed2.bus.dp0.heartbeat_node"),
        ({"bitrate": 250_000}, {}, "turbine.bench-ed2.bus.dp0.bitrate"),
        ({"connection": "profibus:"}, {}, "turbine.bench-ed2.bus.dp0.connection"),
        ({"connection": "socketcan:can0", "master": 4}, {}, "turbine.bench-ed2.bus.dp0.master"),
        ({"connection": "socketcan:can0"}, {"slave": UNKNOWN._replace(telegram=1)}, f"{CYLINDERS}.telegram"),
        ({"connection": "socketcan:can0"}, {"slave": UNKNOWN._replace(pzd_order="low-low")}, f"{CYLINDERS}.pzd_order"),
        ({}, {"slave": UNKNOWN._replace(telegram=7)}, "device.cylinders.telegram"),
        ({}, {"slave": UNKNOWN._replace(gsd="ed2.gsd")}, "device.cylinders.modules"),
        ({"connection": "socketcan:can0"}, {}, "device.cylinders.description"),
    ],
    ids=str,
)
async def test_what_makes_no_sense_is_refused_and_the_file_stays(
    editor: SiteEditor, file: Path, journal: Journal, bus: dict[str, Any], device: dict[str, Any], key: str
) -> None:
    (before,) = load_site(file)
    with pytest.raises(SiteError) as refused:
        await editor.change("bench-ed2", changed(before, bus, device), editor.state().revision, journal)
    assert str(refused.value.details["key"]).endswith(key)
    assert text_of(file) == SITE
