"""Which bus, which device: the arguments that all commands on a bus share, and what they mean."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from app.cli.arguments import seconds
from app.drivers.contract import FoundNode
from app.drivers.modbus_config import ModbusConfig
from app.drivers.profibus_config import ProfibusConfig
from app.errors import UsageError
from app.model.address import is_decimal
from app.model.description import Description
from app.model.description_file import BUILTIN, load_builtin
from app.model.eds import EdsWarning, load_eds
from app.model.servers import MODBUS, Server
from app.model.site import BusConfig, Device, Station, Turbine, load_site
from app.model.slaves import PROFIBUS, SlaveSetup
from app.service.gate import BARE_TURBINE

BUS = "can0"
MODBUS_BUS = "modbus0"
PROFIBUS_BUS = "dp0"
ED2 = "wandfluh-ed2"
SHEET_SUFFIXES = (".eds", ".dcf")


def add_connection(parser: argparse.ArgumentParser, required: bool = True) -> None:
    """``--site``, ``--can``, ``--modbus`` or ``--profibus``, and how the connection is made."""
    where = parser.add_mutually_exclusive_group(required=required)
    where.add_argument("--site", type=Path, help="site file that names turbines, stations and devices")
    where.add_argument(
        "--can", metavar="INTERFACE:CHANNEL[@BITRATE]", help="socketcan:can0@500000, slcan:COM3@search …"
    )
    where.add_argument(
        "--modbus",
        metavar="HOST[:PORT][/UNIT][=NODE][,…]",
        help="devices of Modbus TCP; only these addresses are asked: 192.168.2.20, 192.168.2.21=2 …",
    )
    where.add_argument(
        "--profibus",
        metavar="PORT@BITRATE[,NODE[/TELEGRAM]…]",
        help="a line of PROFIBUS-DP, and which slaves to run: /dev/ttyUSB0@500000,6/101; all that answer where none is",
    )
    parser.add_argument("--turbine", help="which turbine of the site file, where it names several")
    parser.add_argument(
        "--eds",
        action="append",
        default=[],
        metavar="[NODE=]FILE",
        help="EDS or DCF of a device that has no description here; without NODE for every such device",
    )
    parser.add_argument("--consent", action="store_true", help="go active although another master is on the bus")
    parser.add_argument("--listen-s", type=seconds, default=0.5, help="how long to listen before anything is sent")
    parser.add_argument("--record", action="store_true", help="record all frames meanwhile")


def site_turbine(arguments: argparse.Namespace) -> Turbine | None:
    """The turbine of the site file; None where a bare bus was given. Raises SiteError or UsageError."""
    if arguments.site is None:
        return None
    turbines = load_site(arguments.site)
    if arguments.turbine is None and len(turbines) == 1:
        return turbines[0]
    for turbine in turbines:
        if turbine.slug == arguments.turbine:
            return turbine
    known = ", ".join(turbine.slug for turbine in turbines)
    raise UsageError(reason=f"--turbine names one of: {known}")


class Sheets:
    """The EDS and DCF files of a command line, read once; ``told`` gets every warning with its line."""

    def __init__(self, texts: Sequence[str], told: Callable[[Path, EdsWarning], None]) -> None:
        self._told = told
        self._loaded = [self._load(*_node_and_path(text)) for text in texts]

    def _load(self, node: int | None, path: Path) -> tuple[int | None, Description]:
        return node, self.read(path, node)

    def read(self, path: Path, node: int | None) -> Description:
        """One file. Raises DescriptionError."""
        loaded = load_eds(path, node)
        for warning in loaded.warnings:
            self._told(path, warning)
        return loaded.description

    def __iter__(self) -> Iterator[Description]:
        return (description for _node, description in self._loaded)

    def named_for(self, node: int) -> str | None:
        """Id of the description that was given for this very node."""
        return next((description.id for wanted, description in self._loaded if wanted == node), None)

    def for_any(self) -> str | None:
        """Id of the description that was given for every node that nothing else describes."""
        return next((description.id for wanted, description in self._loaded if wanted is None), None)


def _node_and_path(text: str) -> tuple[int | None, Path]:
    node, equals, file = text.partition("=")
    return (int(node), Path(file)) if equals and is_decimal(node) else (None, Path(text))


def descriptions_for(sheets: Sheets, turbine: Turbine, site: Path | None) -> dict[str, Description]:
    """All descriptions that may be needed, by the id that devices name: ours, and EDS or DCF files.

    A site file may name an EDS file in place of an id; its path starts at the site file. Raises DescriptionError.
    """
    known = {name: load_builtin(name) for name in BUILTIN} | {one.id: one for one in sheets}
    for device in turbine.devices:
        name = device.description_id
        if site is not None and name not in known and Path(name).suffix.lower() in SHEET_SUFFIXES:
            known[name] = sheets.read(site.parent / name, device.node)
    return known


def is_bare(arguments: argparse.Namespace) -> bool:
    """Whether the bus itself is given, and no site file."""
    return any(one is not None for one in (arguments.can, arguments.modbus, arguments.profibus))


def is_connected(arguments: argparse.Namespace) -> bool:
    """Whether the arguments name a bus at all."""
    return arguments.site is not None or is_bare(arguments)


def bare_turbine(connection: str) -> Turbine:
    """A turbine of one CAN bus and no known device yet."""
    return Turbine(BARE_TURBINE, connection, (BusConfig(BUS, connection, 0),), ())


def line_turbine(config: ProfibusConfig) -> Turbine:
    """A turbine of one PROFIBUS line with the slaves that are named."""
    bus = BusConfig(PROFIBUS_BUS, f"{PROFIBUS}{config.port}", config.baud, master=config.master)
    devices = tuple(
        replace(_bare_device(one.node, ED2, PROFIBUS_BUS), slave=SlaveSetup(one.telegram)) for one in config.stations
    )
    return Turbine(BARE_TURBINE, f"{config.port}@{config.baud}", (bus,), _bare_stations(devices) if devices else ())


def modbus_turbine(config: ModbusConfig, found: Iterable[FoundNode]) -> Turbine:
    """The turbine of the devices at given addresses, as far as they were recognised."""
    peers = {peer.node: peer for peer in config.peers}
    devices = tuple(
        _bare_device(one.node, one.description_id, MODBUS_BUS, str(Server(*peers[one.node][1:])))
        for one in found
        if one.description_id is not None
    )
    ranges = tuple(dict.fromkeys(peer.server for peer in config.peers))
    name = ", ".join(ranges)
    return Turbine(BARE_TURBINE, name, (BusConfig(MODBUS_BUS, MODBUS, 0, ranges=ranges),), _bare_stations(devices))


def description_id(sheets: Sheets, found: FoundNode) -> str | None:
    """What describes a device: the file named for its node, else what it was recognised as, else a file for any."""
    return sheets.named_for(found.node) or found.description_id or sheets.for_any()


def scanned_turbine(turbine: Turbine, sheets: Sheets, found: list[FoundNode]) -> Turbine:
    """``turbine`` of one bus with the devices that a scan has recognised, or that an EDS was given for."""
    (bus,) = turbine.buses
    known = {one.node: one for one in turbine.devices}
    described = [(one.node, description_id(sheets, one)) for one in found]
    devices = tuple(
        known.get(node) or _bare_device(node, description, bus.name)
        for node, description in described
        if description is not None
    )
    return replace(turbine, stations=_bare_stations(devices))


def _bare_device(node: int, description: str, bus: str, address: str = "") -> Device:
    return Device(f"{BARE_TURBINE}/nodes/{node}", f"node {node}", description, bus, node, address)


def _bare_stations(devices: tuple[Device, ...]) -> tuple[Station, ...]:
    return (Station(f"{BARE_TURBINE}/nodes", "nodes", None, devices),)


def find_device(turbine: Turbine, target: str) -> Device:
    """The device that ``target`` names: TURBINE/STATION/DEVICE, STATION/DEVICE or a node number. Raises UsageError."""
    device = turbine.device(target)
    if device is None:
        known = ", ".join(f"{one.slug} (node {one.node})" for one in turbine.devices) or "none"
        raise UsageError(reason=f"no device '{target}'; there are: {known}")
    return device
