"""Bit rates that are to be searched for (``@search``): found by listening, before a connection is made."""

from __future__ import annotations

from dataclasses import replace
from typing import Final, Protocol

from app.drivers.bitrate_search import SEARCH_LISTEN_S, search_bitrate
from app.drivers.can_config import parse_can
from app.model.description import Bus
from app.model.site import BusConfig, Turbine


class Told(Protocol):
    """Hears how the search goes; rates in bit/s."""

    def trying(self, connection: str, bitrate: int) -> None:
        """Listening at ``bitrate`` begins."""

    def found(self, connection: str, bitrate: int) -> None:
        """The search ended at ``bitrate``."""


class _Nobody:
    def trying(self, connection: str, bitrate: int) -> None:
        pass

    def found(self, connection: str, bitrate: int) -> None:
        pass


NOBODY: Final[Told] = _Nobody()


async def with_bitrates(turbine: Turbine, listen_s: float, told: Told = NOBODY) -> Turbine:
    """``turbine`` with the rates that were found. Raises what ``search_bitrate`` raises."""
    buses = [b if b.kind is Bus.MODBUS_TCP else await _with_rate(b, listen_s, told) for b in turbine.buses]
    return replace(turbine, buses=tuple(buses))


async def _with_rate(bus: BusConfig, listen_s: float, told: Told) -> BusConfig:
    return replace(bus, connection=await with_bitrate(bus.connection, listen_s, told))


async def with_bitrate(connection: str, listen_s: float, told: Told = NOBODY) -> str:
    """``connection`` with the bit rate that was found, where it asks to search for one."""
    config = parse_can(connection)
    if not config.search:
        return connection

    def on_try(bitrate: int) -> None:
        told.trying(connection, bitrate)

    bitrate = await search_bitrate(config, max(listen_s, SEARCH_LISTEN_S), on_try)
    told.found(connection, bitrate)
    return str(replace(config, bitrate=bitrate, search=False))
