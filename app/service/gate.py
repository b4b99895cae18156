"""The gate before every write, save and restart: shut for a station whose restore is not finished.

Its values may be half old, half new then. STOP, FEATHER and reading never come through here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from app.errors import RestoreOpenError
from app.model.site import Device
from app.model.station import station_slug

BARE_TURBINE: Final = "bus"
"""Slug of a turbine that no site file names: nothing but the adapter and the node says which device it is."""


@dataclass(frozen=True, slots=True)
class Block:
    """An open restore: the station that it blocks, and where its devices are: adapter and node of each."""

    restore: str
    station: str
    places: frozenset[tuple[str, int]]

    @property
    def is_bare(self) -> bool:
        """True where its turbine has no name."""
        return self.station.startswith(f"{BARE_TURBINE}/")


class Blocks:
    """The restores that are open, shared by all connections of a process."""

    def __init__(self, blocks: Iterable[Block] = ()) -> None:
        self.now: tuple[Block, ...] = tuple(blocks)

    def put(self, blocks: Iterable[Block]) -> None:
        """Those that are open from now on."""
        self.now = tuple(blocks)


class Gate:
    """The gate of one connection. ``adapters`` by name of the bus; a bit rate behind ``@`` does not count."""

    def __init__(self, adapters: Mapping[str, str], blocks: Blocks) -> None:
        self._adapters = {name: adapter_of(connection) for name, connection in adapters.items()}
        self.blocks = blocks

    def check(self, device: Device) -> None:
        """Raises RestoreOpenError where a restore of the device's station is open.

        Where one of both is a bare bus, the same node on the same adapter is taken for the same device.
        """
        station = station_slug(device.slug)
        place = self._adapters.get(device.bus, ""), device.node
        for block in self.blocks.now:
            unnamed = block.is_bare or station.startswith(f"{BARE_TURBINE}/")
            if (place in block.places) if unnamed else (block.station == station):
                raise RestoreOpenError(station=block.station, restore=block.restore, device=device.slug)


def adapter_of(connection: str) -> str:
    """``socketcan:can0`` of ``socketcan:can0@500000``."""
    return connection.partition("@")[0]


OPEN: Final = Gate({}, Blocks())
"""A gate that nothing shuts: for the restore itself."""
