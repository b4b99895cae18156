"""Which bus, which device: the arguments that all commands on a bus share, and what they mean."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.drivers.contract import FoundNode
from app.errors import UsageError
from app.model.description import Description
from app.model.description_file import BUILTIN, load_builtin
from app.model.eds import load_eds
from app.model.site import BusConfig, Device, Station, Turbine, load_site

BUS = "can0"
_SHEETS = (".eds", ".dcf")


def add_connection(parser: argparse.ArgumentParser) -> None:
    """``--site`` or ``--can``, ``--consent``, ``--no-record``."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--site", type=Path, help="site file that names turbines, stations and devices")
    where.add_argument(
        "--can", metavar="INTERFACE:CHANNEL[@BITRATE]", help="socketcan:can0@500000, pcan:PCAN_USBBUS1 …"
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
    parser.add_argument("--listen-s", type=float, default=0.5, help="how long to listen before anything is sent")
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


def descriptions_for(arguments: argparse.Namespace, turbine: Turbine | None) -> dict[str, Description]:
    """All descriptions that may be needed, by the id that devices name: ours, and EDS or DCF files.

    A site file may name an EDS file in place of an id; its path starts at the site file. Raises DescriptionError.
    """
    known = {name: load_builtin(name) for name in BUILTIN}
    if turbine is not None:
        for device in turbine.devices:
            if device.description_id not in known and Path(device.description_id).suffix.lower() in _SHEETS:
                path = arguments.site.parent / device.description_id
                known[device.description_id] = load_eds(path, device.node).description
    for _node, path in _sheets(arguments):
        known[str(path)] = load_eds(path).description
    return known


def _sheets(arguments: argparse.Namespace) -> list[tuple[int | None, Path]]:
    pairs: list[tuple[int | None, Path]] = []
    for text in arguments.eds:
        node, equals, file = text.partition("=")
        pairs.append((int(node), Path(file)) if equals and node.isdigit() else (None, Path(text)))
    return pairs


def _sheet_for(arguments: argparse.Namespace, node: int) -> str | None:
    """Key of the EDS file that was given for ``node``."""
    for wanted, path in _sheets(arguments):
        if wanted in (node, None):
            return str(path)
    return None


def bare_turbine(connection: str) -> Turbine:
    """A turbine of one bus and no known device yet."""
    return Turbine("bus", connection, (BusConfig(BUS, connection, 0),), ())


def scanned_turbine(arguments: argparse.Namespace, found: list[FoundNode]) -> Turbine:
    """The turbine of one bus with the devices that a scan has recognised, or that an EDS was given for."""
    connection = arguments.can
    described = [(one.node, one.description_id or _sheet_for(arguments, one.node)) for one in found]
    devices = tuple(
        Device(f"bus/nodes/{node}", f"node {node}", description, BUS, node)
        for node, description in described
        if description is not None
    )
    return Turbine("bus", connection, (BusConfig(BUS, connection, 0),), (Station("bus/nodes", "nodes", None, devices),))


def find_device(turbine: Turbine, target: str) -> Device:
    """The device that ``target`` names: TURBINE/STATION/DEVICE, STATION/DEVICE or a node number. Raises UsageError."""
    device = turbine.device(target)
    if device is None:
        known = ", ".join(f"{one.slug} (node {one.node})" for one in turbine.devices) or "none"
        raise UsageError(reason=f"no device '{target}'; there are: {known}")
    return device
