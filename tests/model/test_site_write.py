"""A site file is changed in its text: comments stay, slugs keep their place, and what comes out says what was meant."""

from __future__ import annotations

import stat
from dataclasses import replace
from pathlib import Path

import pytest

from app.errors import SiteError
from app.model.site import BusConfig, Device, Station, Turbine, load_site, read_site
from app.model.site_write import empty_site, previous_of, with_turbine, without_turbine, write_site

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "sites" / "example.toml"
TEXT = EXAMPLE.read_text(encoding="utf-8")


@pytest.fixture
def turbine() -> Turbine:
    (found,) = read_site(TEXT, "example")
    return found


def other(turbine: Turbine, slug: str) -> Turbine:
    """The same turbine under another slug."""
    stations = tuple(
        replace(
            station,
            slug=station.slug.replace(turbine.slug, slug),
            devices=tuple(replace(d, slug=d.slug.replace(turbine.slug, slug)) for d in station.devices),
        )
        for station in turbine.stations
    )
    return replace(turbine, slug=slug, name=slug.upper(), stations=stations)


def test_nothing_changed_changes_not_one_character(turbine: Turbine) -> None:
    assert with_turbine(TEXT, turbine, "x") == TEXT


def test_one_value_changes_one_line_and_the_comments_stay(turbine: Turbine) -> None:
    changed = with_turbine(TEXT, replace(turbine, buses=(replace(turbine.buses[0], bitrate=250_000),)), "x")
    pairs = [(a, b) for a, b in zip(TEXT.splitlines(), changed.splitlines(), strict=True) if a != b]
    assert pairs == [("bitrate = 500000", "bitrate = 250000")]
    assert '# a real one: "socketcan:can0"' in changed


def test_buses_stations_and_devices_come_and_go(turbine: Turbine) -> None:
    bench = Station("wtg-07/bench", "bench", None, (Device("wtg-07/bench/pmm", "Spare", "oat-pmm", "can1", 5),))
    first = turbine.stations[0]
    wanted = replace(
        turbine,
        name="North 7",
        buses=(*turbine.buses, BusConfig("can1", "socketcan:can1", 125_000)),
        stations=(replace(first, devices=first.devices[1:]), *turbine.stations[2:], bench),
    )
    text = with_turbine(TEXT, wanted, "x")
    assert read_site(text, "x") == (wanted,)
    assert "# This is the turbine of the demo" in text
    assert read_site(with_turbine(text, turbine, "x"), "x")[0].device("blade-2/pmc") == turbine.device("blade-2/pmc")


def test_a_turbine_is_added_and_taken_out(turbine: Turbine) -> None:
    two = with_turbine(TEXT, other(turbine, "wtg-08"), "x")
    assert [one.slug for one in read_site(two, "x")] == ["wtg-07", "wtg-08"]
    assert read_site(without_turbine(two, "wtg-07", "x"), "x") == (other(turbine, "wtg-08"),)
    with pytest.raises(SiteError) as caught:
        without_turbine(two, "wtg-09", "x")
    assert caught.value.details["key"] == "turbine.wtg-09"


def test_a_new_file_reads_as_what_was_put_in(turbine: Turbine) -> None:
    assert read_site(with_turbine(empty_site(), turbine, "x"), "x") == (turbine,)


def test_what_no_reader_takes_is_not_written(turbine: Turbine) -> None:
    first, second = turbine.stations[:2]
    clash = replace(second, devices=(replace(second.devices[0], node=1),))
    with pytest.raises(SiteError) as caught:
        with_turbine(TEXT, replace(turbine, stations=(first, clash)), "x")
    assert "node 1 is already wtg-07/blade-1/pmm" in caught.value.details["reason"]
    with pytest.raises(SiteError):
        with_turbine("schema = 1\n[turbine.", turbine, "x")


def test_the_file_is_replaced_whole_with_its_rights_and_the_earlier_copy_stays(
    tmp_path: Path, turbine: Turbine
) -> None:
    real, link = tmp_path / "real.toml", tmp_path / "site.toml"
    real.write_text(TEXT, encoding="utf-8")
    real.chmod(0o640)
    link.symlink_to(real)
    write_site(link, with_turbine(TEXT, replace(turbine, name="North"), "x"))
    assert link.is_symlink() and load_site(link)[0].name == "North"
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    assert previous_of(real).read_text(encoding="utf-8") == TEXT
    assert sorted(path.name for path in tmp_path.iterdir()) == ["real.previous.toml", "real.toml", "site.toml"]


def test_a_failed_write_leaves_the_file(tmp_path: Path) -> None:
    path = tmp_path / "site.toml"
    path.write_text(TEXT, encoding="utf-8")
    with pytest.raises(UnicodeEncodeError):
        write_site(path, "\ud800")
    assert path.read_text(encoding="utf-8") == TEXT
    assert {one.name for one in tmp_path.iterdir()} == {"site.toml", "site.previous.toml"}


def test_a_bus_of_modbus_tcp_is_written_as_it_is_read(turbine: Turbine) -> None:
    slug = "wtg-07/bench"
    servo = Device(f"{slug}/servo", "SERVO", "nanotec-pd4e", "lan", 1, "192.168.2.11:1502/3", "S1 at the cabinet")
    lan = BusConfig("lan", "modbus-tcp", 0, ranges=("192.168.2.0/24:1502",))
    wanted = replace(
        turbine, buses=(*turbine.buses, lan), stations=(*turbine.stations, Station(slug, "bench", None, (servo,)))
    )
    text = with_turbine(TEXT, wanted, "x")
    assert read_site(text, "x") == (wanted,)
    less = replace(wanted, buses=(*turbine.buses, replace(lan, ranges=("192.168.2.11:1502",))))
    assert read_site(with_turbine(text, less, "x"), "x") == (less,)
