"""What must hold of a turbine of the site file beyond its form: adapters, kinds of bus, descriptions, names, stops."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from app.drivers.can_config import parse_can
from app.errors import SiteError, UsageError
from app.model.description import Bus, Description
from app.model.servers import MODBUS
from app.model.site import HEARTBEAT_NODE, BusConfig, Turbine
from app.model.slaves import MASTER, PROFIBUS, UNKNOWN, SlaveSetup

_TEXT_MAX: Final = 100


def check_turbine(turbine: Turbine, describe: Any, file: str) -> None:
    """What a reader of site files cannot know: adapters, descriptions, names. Raises SiteError with the key."""
    where = f"turbine.{turbine.slug}."
    _name(turbine.name, f"{where}name", file)
    if not turbine.buses:
        raise SiteError(file=file, key=f"{where}bus", reason="no bus is named")
    kinds = {bus.name: bus.kind for bus in turbine.buses}
    for bus in turbine.buses:
        if bus.kind is Bus.CANOPEN:
            _adapter(bus, f"{where}bus.{bus.name}.", file)
    known: Mapping[str, Description] = describe(turbine)
    for station in turbine.stations:
        at = f"{where}station.{station.slug.split('/', 1)[1]}."
        _name(station.name, f"{at}name", file)
        for device in station.devices:
            own = f"{at}device.{device.slug.rsplit('/', 1)[1]}."
            _name(device.name, f"{own}name", file)
            description = known.get(device.description_id)
            if description is None:
                reason = f"there is no description '{device.description_id}' (there are: {', '.join(sorted(known))})"
                raise SiteError(file=file, key=f"{own}description", reason=reason)
            if description.bus is not kinds[device.bus]:
                reason = f"{description.id} is no device of a bus with {kinds[device.bus].value}"
                raise SiteError(file=file, key=f"{own}description", reason=reason)


def check_kinds(turbine: Turbine, file: str) -> None:
    """What only a bus of the other kind has would be left out of the file. Raises SiteError with the key."""
    for bus in turbine.buses:
        key, reason = f"turbine.{turbine.slug}.bus.{bus.name}", f"is not for a bus with connection '{MODBUS}'"
        if bus.kind is not Bus.MODBUS_TCP and bus.ranges:
            raise SiteError(file=file, key=f"{key}.ranges", reason=f"is for a bus with connection '{MODBUS}'")
        if bus.kind is Bus.PROFIBUS_DP and bus.heartbeat_node != HEARTBEAT_NODE:
            reason = f"is not for a bus with connection '{PROFIBUS}PORT'"
            raise SiteError(file=file, key=f"{key}.heartbeat_node", reason=reason)
        if bus.kind is not Bus.PROFIBUS_DP and bus.master != MASTER:
            raise SiteError(file=file, key=f"{key}.master", reason=f"is for a bus with connection '{PROFIBUS}PORT'")
        if bus.kind is Bus.MODBUS_TCP and bus.bitrate:
            raise SiteError(file=file, key=f"{key}.bitrate", reason=reason)
        if bus.kind is Bus.MODBUS_TCP and bus.heartbeat_node != HEARTBEAT_NODE:
            raise SiteError(file=file, key=f"{key}.heartbeat_node", reason=reason)
    lines = {bus.name for bus in turbine.buses if bus.kind is Bus.PROFIBUS_DP}
    for device in turbine.devices:
        if device.slave != UNKNOWN and device.bus not in lines:
            given = next(name for name in SlaveSetup._fields if getattr(device.slave, name) != getattr(UNKNOWN, name))
            reason = f"is for a bus with connection '{PROFIBUS}PORT'"
            raise SiteError(file=file, key=f"{device.slug}.{given}", reason=reason)


def stops_of(turbine: Turbine | None) -> dict[str, tuple[str, str, str]]:
    """What is said to stop each axis from outside, and of which device that was said: its bus and address."""
    devices = () if turbine is None else turbine.devices
    return {one.slug: (one.external_stop, one.bus, one.address) for one in devices if one.external_stop}


def changes_a_stop(before: Turbine | None, after: Turbine) -> bool:
    """Whether another stop is named for an axis, or the same one for another device; taking it out is none."""
    known = stops_of(before)
    return any(known.get(slug) != stop for slug, stop in stops_of(after).items())


def _name(name: str, key: str, file: str) -> None:
    if not name.strip() or len(name) > _TEXT_MAX or not name.isprintable():
        raise SiteError(file=file, key=key, reason=f"a name has 1 to {_TEXT_MAX} printable characters")


def _adapter(bus: BusConfig, where: str, file: str) -> None:
    with_rate = "@" in bus.connection or not bus.bitrate
    try:
        parse_can(bus.connection)
    except UsageError as error:
        raise SiteError(file=file, key=f"{where}connection", reason=error.details["reason"]) from error
    try:
        parse_can(bus.connection if with_rate else f"{bus.connection}@{bus.bitrate}")
    except UsageError as error:
        raise SiteError(file=file, key=f"{where}bitrate", reason=error.details["reason"]) from error
