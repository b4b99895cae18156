"""Buses of Modbus TCP in the site file that is edited: what is kept, refused at which key, and noted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.errors import SiteError
from app.model.description_file import load_builtin
from app.model.site import Turbine, load_site
from app.service.journal import Entry, Journal
from app.service.site_check import changes_a_stop
from app.service.site_edit import SiteEditor
from app.service.sites import Sites
from tests.e2e.processes import ROOT

KNOWN = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc", "nanotec-pd4e")}
BENCH = ROOT / "docs" / "sites" / "bench-pd4e.toml"
SERVO = "turbine.bench-pd4e.station.bench.device.servo"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "site.toml"
    path.write_text(BENCH.read_text(encoding="utf-8"), encoding="utf-8")
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


def bench(**change: Any) -> Turbine:
    """The bench; what is given changes its bus."""
    (turbine,) = load_site(BENCH)
    return replace(turbine, buses=(replace(turbine.buses[0], **change),))


def with_servo(turbine: Turbine, **change: Any) -> Turbine:
    (station,) = turbine.stations
    return replace(turbine, stations=(replace(station, devices=(replace(station.devices[0], **change),)),))


async def test_ranges_and_addresses_are_changed_and_noted(
    editor: SiteEditor, file: Path, journal: Journal, noted: list[Entry]
) -> None:
    ranges = ("127.0.0.1:1502", "192.168.2.0/28")
    changed = with_servo(bench(ranges=ranges), address="192.168.2.9/3", node=247, external_stop="red button")
    await editor.change("bench-pd4e", changed, editor.state().revision, journal)
    (turbine,) = load_site(file)
    assert turbine == changed
    told = noted[0].details["changes"]
    assert "127.0.0.1:1502, 192.168.2.0/28" in told
    assert "at 192.168.2.9/3, stopped by red button" in told


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        (bench(ranges=()), "turbine.bench-pd4e.bus.lan.ranges"),
        (bench(ranges=("127.0.0.1:1502", "everybody")), "turbine.bench-pd4e.bus.lan.ranges"),
        (bench(bitrate=500_000), "turbine.bench-pd4e.bus.lan.bitrate"),
        (bench(heartbeat_node=5), "turbine.bench-pd4e.bus.lan.heartbeat_node"),
        (bench(connection="socketcan:can0", bitrate=500_000), "turbine.bench-pd4e.bus.lan.ranges"),
        (with_servo(bench(), address="127.0.0.2:1502"), f"{SERVO}.address"),
        (with_servo(bench(), address="127.0.0.1"), f"{SERVO}.address"),
        (with_servo(bench(), address=""), f"{SERVO}.address"),
        (with_servo(bench(), node=248), f"{SERVO}.node"),
        (with_servo(bench(), description_id="oat-pmc"), f"{SERVO}.description"),
        (
            with_servo(bench(connection="socketcan:can0", bitrate=500_000, ranges=()), description_id="oat-pmc"),
            f"{SERVO}.address",
        ),
    ],
)
async def test_what_is_wrong_is_refused_by_its_key(
    editor: SiteEditor, file: Path, journal: Journal, wrong: Turbine, key: str
) -> None:
    before = text_of(file)
    with pytest.raises(SiteError) as caught:
        await editor.change("bench-pd4e", wrong, editor.state().revision, journal)
    assert caught.value.details["key"] == key
    assert text_of(file) == before


async def test_a_bus_of_either_kind_may_become_the_other(editor: SiteEditor, file: Path, journal: Journal) -> None:
    can = with_servo(
        bench(connection="socketcan:can0", bitrate=250_000, ranges=()), description_id="oat-pmc", address=""
    )
    await editor.change("bench-pd4e", can, editor.state().revision, journal)
    assert load_site(file) == (can,)
    await editor.change("bench-pd4e", bench(), editor.state().revision, journal)
    assert load_site(file) == (bench(),)


def test_a_stop_is_changed_where_it_is_another_one_or_another_devices() -> None:
    stopped = with_servo(bench(), external_stop="button")
    assert changes_a_stop(None, stopped)
    assert changes_a_stop(bench(), stopped)
    assert changes_a_stop(stopped, with_servo(bench(), external_stop="switch"))
    assert changes_a_stop(stopped, with_servo(stopped, address="127.0.0.1:1502/2")), "said of another device"
    assert not changes_a_stop(stopped, with_servo(stopped, name="Servo", node=9))
    assert not changes_a_stop(stopped, bench()), "without it less is allowed"
