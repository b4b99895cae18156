"""The first look: every device read completely after the connection is made, the sets kept in the recording."""

from __future__ import annotations

import logging
import time
from typing import Final

from app.errors import ConsentError, HubsideError
from app.service.backup import ReadReport, read_devices, to_set
from app.service.connection import Connection

log = logging.getLogger(__name__)

REASON: Final = "as found"


async def read_as_found(connection: Connection, person: str) -> list[ReadReport]:
    """Read all devices and put their sets into the recording. Raises BusLostError.

    On a bus with another master nothing is read without consent: then the list is empty.
    """
    pairs = [(connection.driver(target), target) for target in connection.targets]
    reports: list[ReadReport] = []
    try:
        reports = await read_devices(pairs)
    except* ConsentError:
        log.info("another master is on the bus: nothing is read without consent")
    for report in reports:
        if report.values and connection.recording is not None:
            wall_ns = time.time_ns()
            connection.recording.attach_set(to_set(report, connection.turbine.slug, person, REASON, wall_ns))
    return reports


def unreachable(reports: list[ReadReport]) -> dict[str, HubsideError]:
    """Devices of which nothing could be read, by slug, each with its first error."""
    return {r.target.slug: next(iter(r.failed.values())) for r in reports if not r.values and r.failed}
