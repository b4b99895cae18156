"""A bench with the twin of a controller of hydraulic axes on a PROFIBUS line: a pseudo-terminal, in real time."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from app.model.description import Description
from app.model.site import Turbine, read_site
from app.service.connection import Connection
from app.service.options import Options
from tests.drivers.profibus_rig import ED2, LISTEN_S, NODE, Wire

DEVICE = "bench-ed2/bench/cylinders"
SITE = """schema = 1
[turbine.bench-ed2.bus.dp0]
connection = "profibus:{path}"
bitrate = {baud}
[turbine.bench-ed2.station.bench.device.cylinders]
description = "wandfluh-ed2"
node = {node}
{more}
"""


def site_text(line: Wire, more: str = "") -> str:
    """A site file for ``line``; ``more`` are keys of its device."""
    return SITE.format(path=line.line.path, baud=line.baud, node=NODE, more=more)


def turbine_of(line: Wire, more: str = "") -> Turbine:
    (turbine,) = read_site(site_text(line, more), "site.toml")
    return turbine


def descriptions(_turbine: Turbine | None = None) -> dict[str, Description]:
    return {ED2.id: ED2}


@asynccontextmanager
async def connected(line: Wire, more: str = "", recordings: Path | None = None) -> AsyncIterator[Connection]:
    """Connected to the twin on ``line``."""
    options = Options("tester", recordings, listen_s=LISTEN_S)
    async with Connection(turbine_of(line, more), descriptions(), options) as opened:
        yield opened
