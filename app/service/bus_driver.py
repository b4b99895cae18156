"""The driver of a bus of a site, as the site configures it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from app.drivers.can_config import CanConfig, parse_can
from app.drivers.modbus_config import ModbusConfig, ModbusPeer
from app.drivers.profibus_config import ProfibusConfig, ProfibusStation, checked
from app.drivers.table import driver_class
from app.errors import UsageError
from app.model.description import Bus, Description
from app.model.site import BusConfig, Device, Turbine
from app.model.slaves import port_of
from app.service.options import Options
from app.wire.frame import Stamper
from app.wire.profibus.order_proof import read_order


def bitrate_of(config: BusConfig) -> int:
    """In bit/s; 0 where the bus has none that is set. Raises UsageError."""
    if config.kind is Bus.CANOPEN:
        return _can(config).bitrate
    return config.bitrate


def make_driver(
    config: BusConfig, turbine: Turbine, known: Sequence[Description], stamper: Stamper, options: Options
) -> Any:
    """Not open yet. ``known`` are the descriptions that a scan may recognise.

    Raises UsageError where the bus makes no sense, ExtraMissingError where an optional package is needed for it.
    """
    driver = driver_class(config.kind)
    if config.kind is Bus.MODBUS_TCP:
        peers = tuple(ModbusPeer(node, *server) for node, server in turbine.servers(config.name).items())
        return driver(ModbusConfig(peers), stamper, config.name, known)
    if config.kind is Bus.PROFIBUS_DP:
        return driver(_line(config, turbine, options.site), stamper, config.name, known, listen_s=options.listen_s)
    return driver(_can(config), stamper, config.name, known, consent=options.consent, listen_s=options.listen_s)


def _can(config: BusConfig) -> CanConfig:
    with_rate = "@" in config.connection or not config.bitrate
    return parse_can(config.connection if with_rate else f"{config.connection}@{config.bitrate}")


def _line(config: BusConfig, turbine: Turbine, folder: Path | None) -> ProfibusConfig:
    try:
        port = port_of(config.connection)
    except ValueError as error:
        raise UsageError(reason=f"bus '{config.name}': connection {error}") from error
    stations = tuple(_station(one, folder) for one in turbine.devices if one.bus == config.name)
    return checked(ProfibusConfig(port, config.bitrate, stations, config.master))


def _station(device: Device, folder: Path | None) -> ProfibusStation:
    setup = device.slave
    gsd = (folder or Path()) / setup.gsd if setup.gsd else None
    order = read_order(setup.pzd_order) if setup.pzd_order else None
    return ProfibusStation(device.node, setup.telegram, gsd, setup.modules, order)
