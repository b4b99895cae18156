"""The site file of the demo: both turbines, wherever their twins answer; whatever else was changed in it stays."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Final

from app.errors import SiteError
from app.model.bundled import bundled_folder
from app.model.site import BusConfig, Device, Station, Turbine, load_site, read_site
from app.model.site_write import with_turbine

FIRST: Final = "wtg-07"
"""The turbine that the demo connects to at its start."""
BENCH: Final = "bench-pd4e"
_SERVO: Final = f"{BENCH}/bench/servo"
_TWINS_AT: Final = re.compile(rf'(\[turbine\.{FIRST}\.bus\.can0\][^\[]*?connection\s*=\s*)"[^"]*"')
"""Where the bus of the example turbine is connected to."""


def demo_site(folder: Path, can: str, modbus: str) -> Path:
    """The file in ``folder``: blades at the adapter ``can``, the drive at ``modbus`` (HOST:PORT). Raises SiteError."""
    path = folder / "demo-site.toml"
    before = path.read_text(encoding="utf-8") if path.exists() else ""
    text = before
    if not _TWINS_AT.search(text):
        text = _example("example.toml").read_text(encoding="utf-8")
        for other in _others(before, path):
            text = with_turbine(text, other, str(path))
    text = _TWINS_AT.sub(rf'\1"{can}"', text)
    bench = next((one for one in read_site(text, str(path)) if one.slug == BENCH), None)
    if bench is None:
        (bench,) = load_site(_example("bench-pd4e.toml"))
    text = with_turbine(text, _moved(bench, modbus), str(path))
    if text != before:
        path.write_text(text, encoding="utf-8")
    return path


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
