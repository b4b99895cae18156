"""Changes the text of a site file: one turbine is put in or taken out, and all else stays as it was written by hand.

Comments, order and spacing are kept where the TOML parser can keep them. What comes out is read again by the reader of
site files and compared with what was meant, so that no text is ever handed on that says something else.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping, MutableMapping
from pathlib import Path
from typing import Any, Final

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import InlineTable

from app.errors import SiteError
from app.model.description import Bus
from app.model.site import HEARTBEAT_NODE, SCHEMA, BusConfig, Device, Station, Turbine, read_site
from app.model.slaves import MASTER

_HEAD: Final = "Turbines, their stations and devices, and where each is found on a bus."
_KEPT: Final = ".previous"


def empty_site() -> str:
    """The text of a new site file, without a turbine yet."""
    document = tomlkit.document()
    document.add(tomlkit.comment(_HEAD))
    document.add("schema", SCHEMA)
    return tomlkit.dumps(document)


def with_turbine(text: str, turbine: Turbine, file: str) -> str:
    """``text`` with ``turbine`` in place of the one of its slug, or added. Raises SiteError where that is not valid."""
    document = _parsed(text, file)
    turbines = _child(document, "turbine", super_table=True)
    _turbine(_child(turbines, turbine.slug), turbine)
    changed = tomlkit.dumps(document)
    found = next((one for one in read_site(changed, file) if one.slug == turbine.slug), None)
    if found is None or _sorted(found) != _sorted(turbine):
        raise SiteError(file=file, key=f"turbine.{turbine.slug}", reason="cannot be written as it was meant")
    return changed


def without_turbine(text: str, slug: str, file: str) -> str:
    """``text`` without the turbine ``slug``. Raises SiteError where there is none, or where it is the last one."""
    document = _parsed(text, file)
    turbines = document.get("turbine", {})
    if slug not in turbines:
        raise SiteError(file=file, key=f"turbine.{slug}", reason="there is no such turbine")
    del turbines[slug]
    changed = tomlkit.dumps(document)
    if any(one.slug == slug for one in read_site(changed, file)):
        raise SiteError(file=file, key=f"turbine.{slug}", reason="cannot be taken out of the file")
    return changed


def write_site(path: Path, text: str) -> None:
    """Replace the file in one step; what it held stays beside it (``site.previous.toml``). Raises OSError.

    A link is followed, so that it goes on pointing at the file; the file keeps its rights.
    """
    path = path.resolve()
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists():
        shutil.copy2(path, previous_of(path))
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        _take_rights(path, Path(name))
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def previous_of(path: Path) -> Path:
    """Where the earlier copy of a site file is kept."""
    return path.with_name(f"{path.stem}{_KEPT}{path.suffix}")


def _take_rights(of: Path, to: Path) -> None:
    """The new file may be read by whoever might read the old one; a new one is nobody's secret."""
    to.chmod(of.stat().st_mode & 0o777 if of.exists() else 0o644)


def _parsed(text: str, file: str) -> tomlkit.TOMLDocument:
    try:
        return tomlkit.parse(text)
    except TOMLKitError as error:
        raise SiteError(file=file, key="*", reason=f"no valid TOML: {error}") from error


# -- one turbine ------------------------------------------------------------------


def _turbine(table: MutableMapping[str, Any], turbine: Turbine) -> None:
    _put(table, "name", turbine.name, turbine.slug.upper())
    _children(table, "bus", {bus.name: bus for bus in turbine.buses}, _bus)
    first = next(iter(table.get("bus", {})), "")

    def station(table: MutableMapping[str, Any], station: Station) -> None:
        _station(table, station, first)

    _children(table, "station", {last(one.slug): one for one in turbine.stations}, station)


def _bus(table: MutableMapping[str, Any], bus: BusConfig) -> None:
    _put(table, "connection", bus.connection, None)
    if bus.kind is Bus.MODBUS_TCP:
        for key in ("bitrate", "heartbeat_node", "master"):
            table.pop(key, None)
        if tuple(table.get("ranges", ())) != bus.ranges:
            table["ranges"] = list(bus.ranges)
        return
    table.pop("ranges", None)
    _put(table, "bitrate", bus.bitrate, None)
    if bus.kind is Bus.PROFIBUS_DP:
        table.pop("heartbeat_node", None)
        _put(table, "master", bus.master, MASTER)
        return
    table.pop("master", None)
    _put(table, "heartbeat_node", bus.heartbeat_node, HEARTBEAT_NODE)


def _station(table: MutableMapping[str, Any], station: Station, first_bus: str) -> None:
    _put(table, "name", station.name, last(station.slug).replace("-", " "))
    _put(table, "blade", station.blade, None)

    def device(table: MutableMapping[str, Any], device: Device) -> None:
        _device(table, device, first_bus)

    _children(table, "device", {last(one.slug): one for one in station.devices}, device, inline=True)


def _device(table: MutableMapping[str, Any], device: Device, first_bus: str) -> None:
    _put(table, "name", device.name, last(device.slug).upper())
    _put(table, "description", device.description_id, None)
    _put(table, "bus", device.bus, first_bus)
    _put(table, "node", device.node, None)
    _put(table, "address", device.address or None, None)
    _put(table, "external_stop", device.external_stop or None, None)
    _put(table, "telegram", device.slave.telegram, None)
    _put(table, "pzd_order", device.slave.pzd_order or None, None)
    _put(table, "gsd", device.slave.gsd or None, None)
    if tuple(table.get("modules", ())) != device.slave.modules:
        table["modules"] = list(device.slave.modules)
    if not device.slave.modules:
        table.pop("modules", None)


def last(slug: str) -> str:
    """The own part of a slug: ``pmc`` of ``wtg-07/blade-1/pmc``."""
    return slug.rsplit("/", 1)[-1]


# -- tables -----------------------------------------------------------------------


def _put(table: MutableMapping[str, Any], key: str, wanted: str | int | None, default: str | int | None) -> None:
    """Set ``key`` where it says something else; what is usual and was not written before stays unwritten."""
    if wanted is None:
        table.pop(key, None)
    elif key in table:
        if table[key] != wanted:
            table[key] = wanted
    elif wanted != default:
        table[key] = wanted


def _children(
    table: MutableMapping[str, Any], key: str, wanted: Mapping[str, Any], fill: Any, inline: bool = False
) -> None:
    """Have exactly the tables ``wanted`` under ``key``, each filled by ``fill``."""
    for gone in [name for name in table.get(key, {}) if name not in wanted]:
        del table[key][gone]
    if not wanted:
        table.pop(key, None)
        return
    # A table inside an inline table must be inline too.
    inside = inline or isinstance(table, InlineTable)
    parent = _child(table, key, super_table=not isinstance(table, InlineTable))
    for name, what in wanted.items():
        fill(_child(parent, name, inline=inside), what)


def _child(
    table: MutableMapping[str, Any], key: str, super_table: bool = False, inline: bool = False
) -> MutableMapping[str, Any]:
    """The table ``key`` of ``table``; made where there is none."""
    if key not in table:
        table[key] = tomlkit.inline_table() if inline else tomlkit.table(is_super_table=super_table)
    child: MutableMapping[str, Any] = table[key]
    return child


def _sorted(turbine: Turbine) -> tuple[str, str, frozenset[BusConfig], dict[str, tuple[Any, ...]]]:
    """What a turbine says, without the order in which it says it."""
    stations = {one.slug: (one.name, one.blade, _all(one.devices)) for one in turbine.stations}
    return turbine.slug, turbine.name, frozenset(turbine.buses), stations


def _all(devices: Iterable[Device]) -> frozenset[Device]:
    return frozenset(devices)
