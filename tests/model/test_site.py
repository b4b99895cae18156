"""Site files."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from app.errors import SiteError
from app.model.description import Bus
from app.model.servers import Server, parse_range, parse_server
from app.model.site import Turbine, load_site, read_site
from app.model.slaves import TELEGRAMS, SlaveSetup
from app.wire.profibus.telegrams import TELEGRAM_TYPES

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "sites" / "example.toml"


def test_the_example_is_a_turbine_of_three_blades() -> None:
    (turbine,) = load_site(EXAMPLE)
    assert [device.slug for device in turbine.devices][:2] == ["wtg-07/blade-1/pmm", "wtg-07/blade-1/pmc"]
    assert [device.node for device in turbine.devices] == [1, 11, 2, 12, 3, 13]
    assert turbine.buses[0].bitrate == 500_000
    assert turbine.device("blade-2/pmc") is turbine.device("12")
    assert turbine.device("wtg-07/blade-2/pmc") is turbine.device("12")
    assert turbine.device("wtg-08/blade-2/pmc") is None


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("schema = 1", "schema = 9", "schema"),
        ("bitrate = 500000", "bitrate = 500000\nfoo = 1", "turbine.wtg-07.bus.can0.foo"),
        ("blade = 1", "blad = 1", "turbine.wtg-07.station.blade-1.blad"),
        ("node = 11", "node = 12", "wtg-07/blade-2/pmc.node"),
        ("node = 11", "node = 0", "turbine.wtg-07.station.blade-1.device.pmc.node"),
        ("node = 11", 'node = "11"', "turbine.wtg-07.station.blade-1.device.pmc.node"),
        ("blade = 1", "blade = 4", "turbine.wtg-07.station.blade-1.blade"),
        ("bitrate = 500000", "bitrate = true", "turbine.wtg-07.bus.can0.bitrate"),
        ('description = "oat-pmm", node = 1 ', "node = 1 ", "turbine.wtg-07.station.blade-1.device.pmm.description"),
        ("[turbine.wtg-07.station.blade-1]", "[turbine.wtg-07.station.Blade_1]", "turbine.wtg-07.station.Blade_1"),
        ("[turbine.wtg-07.bus.can0]", "[turbine.wtg-07.bus.", "*"),
    ],
)
def test_a_wrong_site_names_the_place(tmp_path: Path, old: str, new: str, key: str) -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "site.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SiteError) as caught:
        load_site(path)
    assert caught.value.details["key"] == key
    assert caught.value.details["file"] == str(path)


MODBUS_SITE = """
schema = 1
[turbine.bench-pd4e]
name = "Bench"
[turbine.bench-pd4e.bus.lan]
connection = "modbus-tcp"
ranges = {ranges}
[turbine.bench-pd4e.station.bench.device]
servo = {{ description = "nanotec-pd4e", node = 1, address = "{address}"{more} }}
"""


def modbus_site(address: str, ranges: str = '["192.168.2.10-192.168.2.20"]', more: str = "") -> tuple[Turbine, ...]:
    return read_site(MODBUS_SITE.format(ranges=ranges, address=address, more=more), "bench.toml")


def test_a_device_of_modbus_tcp_has_an_address_within_the_ranges_of_its_bus() -> None:
    (turbine,) = modbus_site("192.168.2.11/3", more=', external_stop = "S1 at the cabinet"')
    (bus,), (servo,) = turbine.buses, turbine.devices
    assert (bus.kind, bus.bitrate, bus.ranges) == (Bus.MODBUS_TCP, 0, ("192.168.2.10-192.168.2.20",))
    assert (servo.server, servo.external_stop) == (Server("192.168.2.11", 502, 3), "S1 at the cabinet")
    assert turbine.servers("lan") == {1: servo.server}


@pytest.mark.parametrize(
    ("address", "ranges", "more", "reason"),
    [
        ("192.168.2.21", '["192.168.2.10-192.168.2.20"]', "", "is not within the ranges of bus 'lan'"),
        ("192.168.2.11:1502", '["192.168.2.10-192.168.2.20"]', "", "is not within the ranges"),
        ("pitch-1", '["192.168.2.10-192.168.2.20"]', "", "is not within the ranges"),
        ("192.168.2.11/256", '["192.168.2.0/24"]', "", "unit 256 is not within 0 to 255"),
        ("192.168.2.11:0", '["192.168.2.0/24"]', "", "port 0 is not within 1 to 65535"),
        ("192.168.2.11", '["192.168.2.20-192.168.2.10"]', "", "ends before it begins"),
        ("192.168.2.11", '["everywhere"]', "", "is not IP, IP-IP or NETWORK/BITS"),
        ("192.168.2.11", "[]", "", "is missing or no list of addresses"),
        ("192.168.2.255", '["192.168.2.0/24"]', "", "is not within the ranges"),
        ("192.168.2.11", '["192.168.2.0/24"]', ", ip = 3", "servo.ip, reason=is no key here"),
    ],
)
def test_a_wrong_address_names_its_place(address: str, ranges: str, more: str, reason: str) -> None:
    with pytest.raises(SiteError, match=re.escape(reason)):
        modbus_site(address, ranges, more)


@pytest.mark.parametrize(
    ("text", "inside", "outside"),
    [
        ("127.0.0.1:1502", "127.0.0.1:1502", "127.0.0.1"),
        ("10.0.0.0/30", "10.0.0.2", "10.0.0.3"),
        ("[fd00::1-fd00::9]:1502", "[fd00::5]:1502", "[fd00::a]:1502"),
        ("10.0.0.1-10.0.1.1", "10.0.0.255", "[fd00::1]"),
    ],
)
def test_ranges(text: str, inside: str, outside: str) -> None:
    found = parse_range(text)
    assert found.holds(parse_server(inside))
    assert not found.holds(parse_server(outside))
    assert str(parse_server(inside)) == inside


def test_two_devices_have_no_address_in_common_and_a_can_bus_has_none() -> None:
    two = ' }\nother = { description = "nanotec-pd4e", node = 2, address = "192.168.2.11"'
    with pytest.raises(SiteError, match=re.escape("192.168.2.11 is already bench-pd4e/bench/servo")):
        modbus_site("192.168.2.11", more=two)
    text = MODBUS_SITE.format(ranges='["192.168.2.11"]', address="192.168.2.11", more="")
    with pytest.raises(SiteError, match="is for a bus with connection 'modbus-tcp'"):
        read_site(text.replace('"modbus-tcp"\nranges = ["192.168.2.11"]', '"socketcan:can0"'), "x")
    with pytest.raises(SiteError, match="is not for a bus"):
        read_site(text.replace("ranges", "bitrate = 500_000\nranges"), "x")


LINE_SITE = """
schema = 1
[turbine.bench]
[turbine.bench.bus.dp0]
connection = "{connection}"
{bus}
[turbine.bench.station.bench.device]
a = {{ description = "wandfluh-ed2", node = {node}{more} }}
"""


def line_site(
    connection: str = "profibus:/dev/ttyUSB0", bus: str = "", node: int = 6, more: str = ""
) -> tuple[Turbine, ...]:
    return read_site(LINE_SITE.format(connection=connection, bus=bus, node=node, more=more), "bench.toml")


def test_a_line_of_profibus_has_a_port_a_rate_and_a_master() -> None:
    (turbine,) = line_site()
    (bus,) = turbine.buses
    assert (bus.kind, bus.bitrate, bus.master) == (Bus.PROFIBUS_DP, 500_000, 2)
    assert turbine.devices[0].slave == SlaveSetup()
    more = ', telegram = 101, pzd_order = "high-low", gsd = "own.gsd", modules = ["4 words", "6 words"]'
    (turbine,) = line_site(bus="bitrate = 1_500_000\nmaster = 3", node=126, more=more)
    assert (turbine.buses[0].bitrate, turbine.buses[0].master) == (1_500_000, 3)
    assert turbine.devices[0].slave == SlaveSetup(101, "high-low", "own.gsd", ("4 words", "6 words"))


@pytest.mark.parametrize(
    ("given", "key", "reason"),
    [
        ({"connection": "profibus:"}, "bus.dp0.connection", "names no serial port"),
        ({"connection": "profibus:/dev/ttyUSB0@500000"}, "bus.dp0.connection", "the bit rate is a key of its own"),
        ({"bus": "bitrate = 250_000"}, "bus.dp0.bitrate", "is 250000; PROFIBUS has 9600"),
        ({"bus": "master = 127"}, "bus.dp0.master", "is 127, not 1 to 126"),
        ({"bus": 'ranges = ["127.0.0.1"]'}, "bus.dp0.ranges", "is not for a bus"),
        ({"bus": "heartbeat_node = 3"}, "bus.dp0.heartbeat_node", "is not for a bus"),
        ({"node": 127}, "device.a.node", "is 127, not 1 to 126"),
        ({"node": 2}, "bench/bench/a.node", "node 2 is already turbine.bench.bus.dp0"),
        ({"more": ", telegram = 3"}, "device.a.telegram", "is 3; there are 1, 2, 100"),
        ({"more": ', pzd_order = "big"'}, "device.a.pzd_order", "is 'big'; there are low-low"),
        ({"more": ', gsd = "own.gsd"'}, "device.a.modules", "is missing"),
        ({"more": ', modules = ["a"]'}, "device.a.gsd", "is missing"),
        ({"more": ", modules = [1]"}, "device.a.modules", "is no list of names"),
        ({"connection": "socketcan:can0", "more": ", telegram = 1"}, "device.a.telegram", "is for a bus with"),
        ({"connection": "socketcan:can0", "bus": "master = 1"}, "bus.dp0.master", "is for a bus with"),
    ],
)
def test_what_is_wrong_about_a_line_names_its_key(given: dict[str, Any], key: str, reason: str) -> None:
    with pytest.raises(SiteError, match=reason) as refused:
        line_site(**given)
    assert str(refused.value.details["key"]).endswith(key)


def test_the_types_of_telegrams_of_a_site_are_those_of_the_wire() -> None:
    assert set(TELEGRAMS) == set(TELEGRAM_TYPES)
