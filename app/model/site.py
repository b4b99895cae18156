"""The site file: turbines, their stations and devices, and where each is found on a bus (TOML, schema 1)."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from app.errors import SiteError
from app.model.description import Bus
from app.model.servers import MODBUS, Server, parse_range, parse_server
from app.model.slaves import MASTER, MAX_SLAVE, PROFIBUS, RATE, RATES, UNKNOWN, SlaveSetup, check_setup, port_of

SCHEMA: Final = 1
HEARTBEAT_NODE: Final = 126
"""Seldom given to a device, and not the last one, which some tools take for themselves."""
MAX_NODE: Final[Mapping[Bus, int]] = {Bus.CANOPEN: 127, Bus.MODBUS_TCP: 247, Bus.PROFIBUS_DP: MAX_SLAVE}
"""The highest number of a device (CiA 301; Modbus over serial line, 2.2; PROFIBUS)."""
_OF_SLAVES: Final = "telegram pzd_order gsd modules"
_SLUG: Final = re.compile(r"^[a-z0-9]+(-[a-z0-9]+)*$")


@dataclass(frozen=True, slots=True)
class BusConfig:
    """One bus of a turbine: its name in recordings, the adapter (``socketcand:127.0.0.1:29536``) and the bit rate.

    ``heartbeat_node`` is the number under which this tool beats while axes are moved; no device may have it.
    ``modbus-tcp`` as the connection: its devices have addresses of their own, all within ``ranges``, and there is no
    bit rate (0). ``profibus:PORT`` is a PROFIBUS-DP line; ``master`` is our own address on it.
    """

    name: str
    connection: str
    bitrate: int
    heartbeat_node: int = HEARTBEAT_NODE
    ranges: tuple[str, ...] = ()
    master: int = MASTER

    @property
    def kind(self) -> Bus:
        """What is spoken on it."""
        if self.connection.startswith(PROFIBUS):
            return Bus.PROFIBUS_DP
        return Bus.MODBUS_TCP if self.connection == MODBUS else Bus.CANOPEN


@dataclass(frozen=True, slots=True)
class Device:
    """One device of a station. ``slug`` is the whole path, as used in addresses, sets and audit.

    ``address`` is where it listens on a Modbus TCP bus (``HOST[:PORT][/UNIT]``); on others it is empty.
    ``external_stop`` names what stops this axis by hand when the tool cannot: without it one that is no twin is not
    moved where its bus cannot prove that it stops by itself. ``slave`` is what is known of one on PROFIBUS-DP.
    """

    slug: str
    name: str
    description_id: str
    bus: str
    node: int
    address: str = ""
    external_stop: str = ""
    slave: SlaveSetup = UNKNOWN

    @property
    def server(self) -> Server:
        """Where it listens. Raises ValueError where it has no address."""
        return parse_server(self.address)


@dataclass(frozen=True, slots=True)
class Station:
    """A blade (``blade`` 1..3), or a bench (``blade`` None)."""

    slug: str
    name: str
    blade: int | None
    devices: tuple[Device, ...]


@dataclass(frozen=True, slots=True)
class Turbine:
    """A turbine with its buses and stations."""

    slug: str
    name: str
    buses: tuple[BusConfig, ...]
    stations: tuple[Station, ...]

    @property
    def devices(self) -> tuple[Device, ...]:
        """All devices, station by station."""
        return tuple(device for station in self.stations for device in station.devices)

    def servers(self, bus: str) -> dict[int, Server]:
        """Where the nodes of a Modbus TCP bus listen; none on any other."""
        return {device.node: device.server for device in self.devices if device.bus == bus and device.address}

    def device(self, target: str) -> Device | None:
        """The device with this slug, with or without the turbine in front, or with this node number."""
        for device in self.devices:
            if target in (device.slug, device.slug.split("/", 1)[1], str(device.node)):
                return device
        return None


def load_site(path: Path) -> tuple[Turbine, ...]:
    """Read a site file. Raises SiteError with file, key and reason."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SiteError(file=str(path), key="*", reason=f"cannot be read: {error}") from error
    return read_site(text, str(path))


def read_site(text: str, file: str) -> tuple[Turbine, ...]:
    """Read the text of a site file; ``file`` names it in errors. Raises SiteError with file, key and reason."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SiteError(file=file, key="*", reason=f"no valid TOML: {error}") from error
    return _Reader(file).turbines(data)


class _Reader:
    def __init__(self, file: str) -> None:
        self._file = file

    def _wrong(self, key: str, reason: str) -> SiteError:
        return SiteError(file=self._file, key=key, reason=reason)

    def turbines(self, data: Mapping[str, Any]) -> tuple[Turbine, ...]:
        self._known(data, "schema turbine", "")
        if data.get("schema") != SCHEMA:
            raise self._wrong("schema", f"is {data.get('schema')!r}, this version reads {SCHEMA}")
        found = tuple(self._turbine(slug, table) for slug, table in self._tables(data, "turbine", ""))
        if not found:
            raise self._wrong("turbine", "no turbine is named")
        return found

    def _known(self, table: Mapping[str, Any], keys: str, where: str) -> None:
        for key in table:
            if key not in keys.split():
                raise self._wrong(f"{where}{key}", f"is no key here (there are: {', '.join(keys.split())})")

    def _tables(self, table: Mapping[str, Any], key: str, where: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
        children = table.get(key, {})
        if not isinstance(children, Mapping):
            raise self._wrong(f"{where}{key}", "is no table of slugs")
        for slug, child in children.items():
            if not _SLUG.match(slug):
                raise self._wrong(f"{where}{key}.{slug}", "a slug has small letters, digits and single hyphens")
            if not isinstance(child, Mapping):
                raise self._wrong(f"{where}{key}.{slug}", "is no table")
            yield slug, child

    def _turbine(self, slug: str, table: Mapping[str, Any]) -> Turbine:
        where = f"turbine.{slug}."
        self._known(table, "name bus station", where)
        buses = tuple(self._bus(name, bus, f"{where}bus.{name}.") for name, bus in self._tables(table, "bus", where))
        stations = tuple(
            self._station(slug, name, station, buses) for name, station in self._tables(table, "station", where)
        )
        turbine = Turbine(slug, str(table.get("name", slug.upper())), buses, stations)
        named = {name for name, bus in self._tables(table, "bus", where) if "heartbeat_node" in bus}
        seen = {(bus.name, bus.heartbeat_node): f"{where}bus.{bus.name}" for bus in buses if bus.name in named}
        lines = [bus for bus in buses if bus.kind is Bus.PROFIBUS_DP]
        seen |= {(bus.name, bus.master): f"{where}bus.{bus.name}" for bus in lines}
        servers: dict[str, str] = {}
        for device in turbine.devices:
            other = seen.setdefault((device.bus, device.node), device.slug)
            if other != device.slug:
                raise self._wrong(f"{device.slug}.node", f"node {device.node} is already {other}")
            if device.address and (other := servers.setdefault(device.server.text, device.slug)) != device.slug:
                raise self._wrong(f"{device.slug}.address", f"{device.address} is already {other}")
        return turbine

    def _bus(self, name: str, table: Mapping[str, Any], where: str) -> BusConfig:
        self._known(table, "connection bitrate heartbeat_node ranges master", where)
        connection = self._text(table, "connection", where)
        if connection.startswith(PROFIBUS):
            return self._line(name, connection, table, where)
        if "master" in table:
            raise self._wrong(f"{where}master", f"is for a bus with connection '{PROFIBUS}PORT'")
        heartbeat = self._node(table, "heartbeat_node", where, HEARTBEAT_NODE)
        if connection != MODBUS:
            if "ranges" in table:
                raise self._wrong(f"{where}ranges", f"is for a bus with connection '{MODBUS}'")
            return BusConfig(name, connection, self._int(table, "bitrate", where, 500_000), heartbeat)
        for key in ("bitrate", "heartbeat_node"):
            if key in table:
                raise self._wrong(f"{where}{key}", f"is not for a bus with connection '{MODBUS}'")
        ranges = table.get("ranges")
        if not isinstance(ranges, list) or not ranges or not all(isinstance(one, str) for one in ranges):
            raise self._wrong(f"{where}ranges", "is missing or no list of addresses")
        for text in ranges:
            try:
                parse_range(text)
            except ValueError as error:
                raise self._wrong(f"{where}ranges", str(error)) from error
        return BusConfig(name, connection, 0, heartbeat, tuple(ranges))

    def _line(self, name: str, connection: str, table: Mapping[str, Any], where: str) -> BusConfig:
        """One of PROFIBUS-DP."""
        for key in ("heartbeat_node", "ranges"):
            if key in table:
                raise self._wrong(f"{where}{key}", f"is not for a bus with connection '{PROFIBUS}PORT'")
        try:
            port_of(connection)
        except ValueError as error:
            raise self._wrong(f"{where}connection", str(error)) from error
        rate = self._int(table, "bitrate", where, RATE)
        if rate not in RATES:
            raise self._wrong(f"{where}bitrate", f"is {rate}; PROFIBUS has {', '.join(map(str, RATES))}")
        return BusConfig(name, connection, rate, master=self._node(table, "master", where, MASTER, MAX_SLAVE))

    def _station(self, turbine: str, slug: str, table: Mapping[str, Any], buses: tuple[BusConfig, ...]) -> Station:
        where = f"turbine.{turbine}.station.{slug}."
        self._known(table, "name blade device", where)
        devices = tuple(
            self._device(f"{turbine}/{slug}/{name}", device, f"{where}device.{name}.", buses)
            for name, device in self._tables(table, "device", where)
        )
        blade = table.get("blade")
        if blade is not None and (not isinstance(blade, int) or not 1 <= blade <= 3):
            raise self._wrong(f"{where}blade", f"is {blade!r}, not 1, 2 or 3")
        return Station(f"{turbine}/{slug}", str(table.get("name", slug.replace("-", " "))), blade, devices)

    def _device(self, slug: str, table: Mapping[str, Any], where: str, buses: tuple[BusConfig, ...]) -> Device:
        self._known(table, f"name description bus node address external_stop {_OF_SLAVES}", where)
        bus = str(table.get("bus", buses[0].name if buses else ""))
        config = next((one for one in buses if one.name == bus), None)
        if config is None:
            raise self._wrong(f"{where}bus", f"bus '{bus}' is not named in this turbine")
        node = self._node(table, "node", where, None, MAX_NODE[config.kind])
        name = str(table.get("name", slug.rsplit("/", 1)[1].upper()))
        description = self._text(table, "description", where)
        stop = self._text(table, "external_stop", where) if "external_stop" in table else ""
        address, slave = self._address(table, config, where), self._slave(table, config, where)
        return Device(slug, name, description, bus, node, address, stop, slave)

    def _slave(self, table: Mapping[str, Any], bus: BusConfig, where: str) -> SlaveSetup:
        """What a slave of PROFIBUS-DP is set to."""
        given = [key for key in _OF_SLAVES.split() if key in table]
        if bus.kind is not Bus.PROFIBUS_DP:
            if given:
                raise self._wrong(f"{where}{given[0]}", f"is for a bus with connection '{PROFIBUS}PORT'")
            return UNKNOWN
        modules = table.get("modules", [])
        if not isinstance(modules, list) or not all(isinstance(one, str) for one in modules):
            raise self._wrong(f"{where}modules", "is no list of names")
        setup = SlaveSetup(
            telegram=self._int(table, "telegram", where, None) if "telegram" in table else None,
            pzd_order=self._text(table, "pzd_order", where) if "pzd_order" in table else "",
            gsd=self._text(table, "gsd", where) if "gsd" in table else "",
            modules=tuple(modules),
        )
        flaw = check_setup(setup)
        if flaw is not None:
            raise self._wrong(f"{where}{flaw[0]}", flaw[1])
        return setup

    def _address(self, table: Mapping[str, Any], bus: BusConfig, where: str) -> str:
        """Where a device of Modbus TCP listens, within what the bus allows."""
        if bus.kind is not Bus.MODBUS_TCP:
            if "address" in table:
                raise self._wrong(f"{where}address", f"is for a bus with connection '{MODBUS}'")
            return ""
        text = self._text(table, "address", where)
        try:
            server = parse_server(text)
        except ValueError as error:
            raise self._wrong(f"{where}address", str(error)) from error
        if not any(parse_range(one).holds(server) for one in bus.ranges):
            allowed = ", ".join(bus.ranges)
            raise self._wrong(
                f"{where}address", f"{server.text} is not within the ranges of bus '{bus.name}': {allowed}"
            )
        return text

    def _text(self, table: Mapping[str, Any], key: str, where: str) -> str:
        value = table.get(key)
        if not isinstance(value, str) or not value:
            raise self._wrong(f"{where}{key}", "is missing or no text")
        return value

    def _node(
        self, table: Mapping[str, Any], key: str, where: str, default: int | None, most: int = MAX_NODE[Bus.CANOPEN]
    ) -> int:
        node = self._int(table, key, where, default)
        if not 1 <= node <= most:
            raise self._wrong(f"{where}{key}", f"is {node}, not 1 to {most}")
        return node

    def _int(self, table: Mapping[str, Any], key: str, where: str, default: int | None) -> int:
        value = table.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool):
            raise self._wrong(f"{where}{key}", "is missing or no integer")
        return value
