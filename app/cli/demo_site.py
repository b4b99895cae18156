"""The site file of the demo: its turbines, wherever their twins answer; whatever else was changed in it stays."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Final

from app.errors import SiteError
from app.model.bundled import bundled_folder
from app.model.description import Bus
from app.model.site import BusConfig, Device, Station, Turbine, load_site, read_site
from app.model.site_write import with_turbine
from app.model.slaves import PROFIBUS

FIRST: Final = "wtg-07"
"""The turbine that the demo connects to at its start."""
SERVO_BENCH: Final = "bench-pd4e"
LINE_BENCH: Final = "bench-ed2"
_SERVO: Final = f"{SERVO_BENCH}/bench/servo"
_CYLINDERS: Final = f"{LINE_BENCH}/bench/cylinders"
_TWINS_AT: Final = re.compile(rf'(\[turbine\.{FIRST}\.bus\.can0\][^\[]*?connection\s*=\s*)"[^"]*"')
"""Where the bus of the example turbine is connected to."""


def demo_site(folder: Path, can: str, modbus: str, line: str | None) -> Path:
    """The file in ``folder``: blades at the adapter ``can``, the drive at ``modbus`` (HOST:PORT). Raises SiteError.

    ``line`` is the serial port of the cylinders, None where nobody can speak on it.
    """
    path = folder / "demo-site.toml"
    before = path.read_text(encoding="utf-8") if path.exists() else ""
    text = before
    if not _TWINS_AT.search(text):
        text = _example("example.toml").read_text(encoding="utf-8")
        for other in _others(before, path):
            text = with_turbine(text, other, str(path))
    text = _TWINS_AT.sub(rf'\1"{can}"', text)
    text = with_turbine(text, _moved(_bench(text, SERVO_BENCH, path), modbus), str(path))
    cylinders = _bench(text, LINE_BENCH, path)
    text = with_turbine(text, cylinders if line is None else _at_port(cylinders, line), str(path))
    if text != before:
        path.write_text(text, encoding="utf-8")
    return path


def _bench(text: str, slug: str, path: Path) -> Turbine:
    """As it stands in ``text``, or as it comes with the program."""
    found = next((one for one in read_site(text, str(path)) if one.slug == slug), None)
    return found or load_site(_example(f"{slug}.toml"))[0]


def _example(name: str) -> Path:
    return bundled_folder("docs/sites", "sites") / name


def _others(text: str, path: Path) -> list[Turbine]:
    """The turbines of a file whose own one cannot be used."""
    try:
        return [one for one in read_site(text, str(path)) if one.slug != FIRST]
    except SiteError:
        return []


def _moved(turbine: Turbine, address: str) -> Turbine:
    """``turbine`` with the demo's drive at ``address``, which its bus allows; unchanged where it has no such drive."""
    servo = next((one for one in turbine.devices if one.slug == _SERVO and one.address), None)
    if servo is None:
        return turbine
    before = servo.server.text

    def bus(config: BusConfig) -> BusConfig:
        if config.name != servo.bus:
            return config
        others = [one for one in config.ranges if one not in (before, address)]
        return replace(config, ranges=(address, *others))

    def device(one: Device) -> Device:
        return replace(one, address=address) if one is servo else one

    def station(one: Station) -> Station:
        return replace(one, devices=tuple(map(device, one.devices)))

    return replace(turbine, buses=tuple(map(bus, turbine.buses)), stations=tuple(map(station, turbine.stations)))


def _at_port(turbine: Turbine, port: str) -> Turbine:
    """``turbine`` with the line of the demo's cylinders at ``port``; unchanged where it has none."""
    own = next((one.bus for one in turbine.devices if one.slug == _CYLINDERS), None)
    return replace(
        turbine,
        buses=tuple(
            replace(bus, connection=f"{PROFIBUS}{port}") if bus.name == own and bus.kind is Bus.PROFIBUS_DP else bus
            for bus in turbine.buses
        ),
    )
