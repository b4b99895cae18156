"""A connection to a PD4-E over Modbus TCP, as a site file names it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from app.drivers.modbus_config import ModbusPeer
from app.model.description_file import load_builtin
from app.model.site import Turbine, read_site
from app.service.connection import Connection
from app.service.options import Options

SERVO = "bench-pd4e/bench/servo"
BUS = "lan"
_SITE = """
schema = 1
[turbine.bench-pd4e]
name = "Bench"
[turbine.bench-pd4e.bus.{bus}]
connection = "modbus-tcp"
ranges = ["{server}"]
[turbine.bench-pd4e.station.bench.device]
servo = {{ description = "nanotec-pd4e", node = {node}, address = "{server}"{more} }}
"""


def site_text(peer: ModbusPeer, more: str = "") -> str:
    """A site file with this one device; ``more`` are further keys of it, each after a comma."""
    return _SITE.format(bus=BUS, server=peer.server, node=peer.node, more=more)


def bench(peer: ModbusPeer, more: str = "") -> Turbine:
    """The turbine of that site file."""
    (turbine,) = read_site(site_text(peer, more), "bench.toml")
    return turbine


@asynccontextmanager
async def connected(peer: ModbusPeer, recordings: Path | None = None, more: str = "") -> AsyncIterator[Connection]:
    """Connected, and recording where a folder is given."""
    known = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc", "nanotec-pd4e")}
    async with Connection(bench(peer, more), known, Options("tester", recordings)) as opened:
        yield opened
