"""Asks given addresses of Modbus TCP who they are: those that a person names, one by one, never a network."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.drivers.contract import FoundNode
from app.drivers.modbus_config import ModbusConfig, ModbusPeer
from app.drivers.scan import match
from app.drivers.table import driver_class
from app.errors import BusOpenError, DeviceError, HubsideError, NoAnswerError, ProtocolError, SettingsError
from app.model.address import Address
from app.model.description import Bus, Description
from app.model.servers import Server, parse_range
from app.model.site import Turbine
from app.model.variant import as_variant
from app.service.connection import Connection
from app.service.jobs import Job
from app.wire.frame import Stamper

OPEN_S: Final = 3.0
_FIRST: Final = "1000"
_ANSWER_S: Final = 0.5
"""A device is asked for its type first, and answers within so long or not at all."""


SERIAL: Final = Address(0x4040)
"""Drive serial number, a text (PD4-E manual, chapter 10); CiA 301's own in 1018h:04 is 0 there."""


@dataclass(frozen=True, slots=True)
class Asked:
    """One address: who is there, or why nobody is known to be (``error``).

    ``variant`` is the name of the description's variant, ``serial`` the number on the device; None where not said.
    """

    peer: ModbusPeer
    found: FoundNode | None
    error: HubsideError | None = None
    variant: str | None = None
    serial: str | None = None


async def identify(config: ModbusConfig, known: Sequence[Description], bus: str) -> list[Asked]:
    """Ask every address of ``config``, all at a time, with connections of our own; ``bus`` is its name in errors."""
    stamper = Stamper(time.time_ns(), time.monotonic_ns)
    return list(await asyncio.gather(*(_ask(peer, known, bus, stamper) for peer in config.peers)))


async def _ask(peer: ModbusPeer, known: Sequence[Description], bus: str, stamper: Stamper) -> Asked:
    driver = driver_class(Bus.MODBUS_TCP)(ModbusConfig((peer,)), stamper, bus, known)
    try:
        await driver.connect(OPEN_S)
        return await ask_with(driver, peer, known)
    except BusOpenError as error:
        return Asked(peer, None, error)
    finally:
        await driver.close()


async def ask_with(driver: Any, peer: ModbusPeer, known: Sequence[Description]) -> Asked:
    """Ask ``peer``, one of the devices of ``driver``, which is connected."""
    found = await driver.scan([peer.node])
    if not found:
        return Asked(peer, None, silent(peer))
    (node,) = found
    description = next((one for one in known if one.id == node.description_id), None)
    variant = None if description is None else _variant(description, node)
    return Asked(peer, node, None, variant, await _serial(driver, description, node))


def _variant(description: Description, found: FoundNode) -> str | None:
    variants = [as_variant(description, one) for one in description.variants]
    fitting = match(variants, found.device_type, found.device_name, found.identity)
    return None if fitting is None else fitting.name


async def _serial(driver: Any, description: Description | None, found: FoundNode) -> str | None:
    """A number as a text, where the device has one; else that of its identity object."""
    if description is not None and SERIAL in description.entries:
        try:
            data: bytes = await driver.read(found.node, SERIAL)
            text = data.rstrip(b"\0").decode("latin-1").strip()
        except (DeviceError, NoAnswerError, ProtocolError):
            text = ""
        if text:
            return text
    return str(found.identity.serial) if found.identity.serial else None


def within(turbines: Iterable[Turbine], server: Server) -> bool:
    """Whether a bus of the site allows the address."""
    buses = (bus for turbine in turbines for bus in turbine.buses)
    return any(parse_range(text).holds(server) for bus in buses for text in bus.ranges)


async def ask_address(
    job: Job, server: Server, turbines: Iterable[Turbine], known: Sequence[Description], connection: Connection | None
) -> None:
    """Ask one address of the site, through the open connection where it has the device; the job's result is Asked.

    Raises SettingsError where no bus of the site allows the address (nothing is sent then), NoAnswerError.
    """
    if not within(turbines, server):
        raise SettingsError(reason_key="settings.refused.not_in_ranges", address=server.text)
    links = [] if connection is None else connection.buses.values()
    link = next((one for one in links if one.kind is Bus.MODBUS_TCP and server.text in one.driver.servers), None)
    if link is None:
        (asked,) = await identify(ModbusConfig((ModbusPeer(1, *server),)), known, server.text)
    else:
        asked = await ask_with(link.driver, ModbusPeer(link.driver.servers[server.text], *server), known)
    if asked.error is not None:
        raise asked.error
    job.result = asked


def silent(peer: ModbusPeer) -> NoAnswerError:
    """Something takes the connection there, and says nothing, or nothing that makes sense."""
    return NoAnswerError(node=f"{peer.node} ({peer.server})", address=_FIRST, timeout_s=_ANSWER_S)
