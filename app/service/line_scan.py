"""Asks every address of a PROFIBUS line who is there; on the line that is open where it is this one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Final

from app.model.description import Description
from app.model.site import BusConfig, Turbine
from app.service.adapters import ScanResult
from app.service.bus_driver import make_driver
from app.service.connection import Connection
from app.service.jobs import Job
from app.service.options import Options
from app.wire.frame import Stamper

OPEN_S: Final = 3.0


async def scan_line(job: Job, config: BusConfig, known: Sequence[Description], connection: Connection | None) -> None:
    """Find the slaves. ``known`` are the descriptions that one may be recognised as.

    Raises UsageError, ExtraMissingError, BusOpenError, BusLostError, and ForeignMasterError where anybody else speaks.
    """

    def progress(done: int, total: int) -> None:
        job.done, job.total = done, total

    buses = () if connection is None else connection.buses.values()
    link = next((one for one in buses if one.adapter == config.connection), None)
    if link is not None:
        found = await link.driver.scan(on_progress=progress)
        job.result = ScanResult(config.connection, link.bitrate, tuple(found))
        return
    alone = Turbine("scan", "scan", (config,), ())
    stamper = Stamper(time.time_ns(), time.monotonic_ns)
    driver = make_driver(config, alone, known, stamper, Options(person="", recordings=None))
    try:
        await driver.connect(OPEN_S)
        found = await driver.scan(on_progress=progress)
    finally:
        await driver.close()
    job.result = ScanResult(config.connection, config.bitrate, tuple(found))
