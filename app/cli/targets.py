"""Which bus, which device: the arguments that all commands on a bus share, and what they mean."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.drivers.contract import FoundNode
from app.errors import UsageError
from app.model.site import BusConfig, Device, Station, Turbine, load_site

BUS = "can0"


def add_connection(parser: argparse.ArgumentParser) -> None:
    """``--site`` or ``--can``, ``--consent``, ``--no-record``."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--site", type=Path, help="site file that names turbines, stations and devices")
    where.add_argument(
        "--can", metavar="INTERFACE:CHANNEL[@BITRATE]", help="socketcan:can0@500000, pcan:PCAN_USBBUS1 …"
    )
    parser.add_argument("--turbine", help="which turbine of the site file, where it names several")
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


def bare_turbine(connection: str) -> Turbine:
    """A turbine of one bus and no known device yet."""
    return Turbine("bus", connection, (BusConfig(BUS, connection, 0),), ())


def scanned_turbine(connection: str, found: list[FoundNode]) -> Turbine:
    """The turbine of one bus with the devices that a scan has recognised."""
    devices = tuple(
        Device(f"bus/nodes/{one.node}", f"node {one.node}", one.description_id, BUS, one.node)
        for one in found
        if one.description_id is not None
    )
    return Turbine("bus", connection, (BusConfig(BUS, connection, 0),), (Station("bus/nodes", "nodes", None, devices),))


def find_device(turbine: Turbine, target: str) -> Device:
    """The device that ``target`` names: TURBINE/STATION/DEVICE, STATION/DEVICE or a node number. Raises UsageError."""
    device = turbine.device(target)
    if device is None:
        known = ", ".join(f"{one.slug} (node {one.node})" for one in turbine.devices) or "none"
        raise UsageError(reason=f"no device '{target}'; there are: {known}")
    return device
