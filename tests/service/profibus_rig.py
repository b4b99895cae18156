"""A connection to an ED2 on PROFIBUS-DP, as a site file names it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from app.model.description_file import load_builtin
from app.model.site import Turbine, read_site
from app.service.connection import Connection
from app.service.options import Options
from tests.drivers.profibus_rig import LISTEN_S, NODE, Wire

CYLINDERS = "bench-ed2/bench/cylinders"
BUS = "dp0"
_SITE = """
schema = 1
[turbine.bench-ed2]
name = "Bench"
[turbine.bench-ed2.bus.{bus}]
connection = "profibus:{port}"
bitrate = {baud}
[turbine.bench-ed2.station.bench.device]
cylinders = {{ description = "wandfluh-ed2", node = {node}{more} }}
"""


def site_text(wire: Wire, more: str = "") -> str:
    """A site file with this one device; ``more`` are further keys of it, each after a comma."""
    return _SITE.format(bus=BUS, port=wire.line.path, baud=wire.baud, node=NODE, more=more)


def bench(wire: Wire, more: str = "") -> Turbine:
    """The turbine of that site file."""
    (turbine,) = read_site(site_text(wire, more), "bench.toml")
    return turbine


@asynccontextmanager
async def connected(
    wire: Wire, recordings: Path | None = None, more: str = ', pzd_order = "high-high"'
) -> AsyncIterator[Connection]:
    """Connected, and recording where a folder is given."""
    known = {name: load_builtin(name) for name in ("oat-pmc", "wandfluh-ed2")}
    async with Connection(bench(wire, more), known, Options("tester", recordings, listen_s=LISTEN_S)) as opened:
        yield opened
