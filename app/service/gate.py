"""The gate before every write, save and restart: shut for a station whose restore is not finished.

Its values may be half old, half new then. A device is known by the name of its station, and under any other name, or on
any other adapter, by what it says of itself. Shut too while somebody has the device for himself (``service.claims``):
who has it writes past the gate. STOP, FEATHER and reading never come through here.
"""

from __future__ import annotations

import os
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from app.drivers.can_config import parse_can
from app.errors import RestoreOpenError, UsageError
from app.model.address import Address
from app.model.sets import Identity
from app.model.site import Device
from app.model.station import station_slug
from app.service.claims import Claims

BARE_TURBINE: Final = "bus"
"""Slug of a turbine that no site file names: nothing but the adapter and the node says which device it is."""
_OWN_HOST: Final = "127.0.0.1"
_OWN_NAMES: Final = ("localhost", "::1")


@dataclass(frozen=True, slots=True)
class Place:
    """Where a device is reached: adapter (``adapter_of``), with the address of a device that has one, and node."""

    adapter: str
    node: int


@dataclass(frozen=True, slots=True)
class Block:
    """An open restore: the station that it blocks, and each of its devices: where it is, and what it says of itself."""

    restore: str
    station: str
    devices: tuple[tuple[Place, Identity], ...]

    @property
    def is_bare(self) -> bool:
        """True where its turbine has no name."""
        return _is_bare(self.station)

    def names(self, station: str) -> bool:
        """True where the station is its own by name."""
        return self.station == station and not self.is_bare

    def holds(self, station: str, place: Place, identity: Identity) -> bool:
        """True where a device of ``station`` is one of its own, under whatever name.

        By the serial number. Where one of both tells none, the same place counts, if one of both has no name.
        """
        if self.names(station):
            return True
        unnamed = self.is_bare or _is_bare(station)
        return any(
            theirs.has_serial_of(identity) if theirs.mark and identity.mark else unnamed and where == place
            for where, theirs in self.devices
        )


class Blocks:
    """The restores that are open, shared by all connections of a process."""

    def __init__(self, blocks: Iterable[Block] = ()) -> None:
        self.now: tuple[Block, ...] = tuple(blocks)

    def put(self, blocks: Iterable[Block]) -> None:
        """Those that are open from now on."""
        self.now = tuple(blocks)


class Gate:
    """The gate of one connection.

    ``adapters``: as a site file writes them, by name of the bus; ``claims``: who is at work at which device.
    """

    def __init__(self, adapters: Mapping[str, str], blocks: Blocks) -> None:
        self._connections = dict(adapters)
        self.blocks = blocks
        self.claims = Claims()

    def past_claims(self) -> Gate:
        """A gate that only restores shut: for who has the device, or moves it."""
        return Gate(self._connections, self.blocks)

    async def check(
        self, device: Device, ask: Callable[[], Awaitable[Identity]], address: Address | None = None
    ) -> None:
        """Raises RestoreOpenError, DeviceBusyError. ``ask`` reads what the device says of itself.

        It is asked only where some restore is open and no name decides. ``address`` is about to be written, 1010h of a
        save; None: the device is about to be restarted.
        """
        await self.check_restores(device, ask)
        self.claims.require_free(device.slug, address)  # at last: what is asked takes its time

    async def check_restores(self, device: Device, ask: Callable[[], Awaitable[Identity]]) -> None:
        """As ``check``, for who has the device: raises RestoreOpenError where a restore of it is open."""
        blocks, station = self.blocks.now, station_slug(device.slug)
        for block in blocks:
            if block.names(station):
                raise RestoreOpenError(station=block.station, restore=block.restore, device=device.slug)
        if blocks:
            self.require_open(device, await ask())

    def require_open(self, device: Device, identity: Identity) -> None:
        """Raises RestoreOpenError where a restore of the device is open."""
        place = place_of(device, self._connections.get(device.bus, ""))
        for block in self.blocks.now:
            if block.holds(station_slug(device.slug), place, identity):
                raise RestoreOpenError(station=block.station, restore=block.restore, device=device.slug)


def place_of(device: Device, connection: str) -> Place:
    """Where the device is reached, on a bus that is connected by ``connection``; by its address where it has one."""
    adapter = adapter_of(connection)
    return Place(f"{adapter}:{device.server.text}" if device.address else adapter, device.node)


def adapter_of(connection: str) -> str:
    """One spelling for one adapter: no bit rate, one name for our own host, a device file by its real path."""
    try:
        can = parse_can(connection)
    except UsageError:
        return connection.partition("@")[0]
    channel = os.path.realpath(can.channel) if can.channel.startswith("/") else can.channel
    host = _OWN_HOST if can.host.lower() in _OWN_NAMES else can.host.lower()
    return f"{can.interface.value}:{host}:{can.port}/{channel}" if host else f"{can.interface.value}:{channel}"


def _is_bare(station: str) -> bool:
    return station.startswith(f"{BARE_TURBINE}/")


OPEN: Final = Gate({}, Blocks())
"""A gate that nothing shuts: for the restore itself."""
