"""The first look: every device read completely after the connection is made, the sets kept in the recording."""

from __future__ import annotations

import asyncio
import logging
import time
from typing import Final

from app.errors import ConsentError, HubsideError
from app.model.address import Address
from app.model.description import Description
from app.service.backup import ReadReport, read_device, readable, to_set
from app.service.connection import Connection
from app.service.polling import usual_list

log = logging.getLogger(__name__)

REASON: Final = "as found"


async def read_as_found(connection: Connection, person: str) -> list[ReadReport]:
    """Read all devices, all nodes at a time, and put their sets into the recording. Raises BusLostError.

    On a bus with another master nothing is read without consent: then the list is empty.
    """
    reports: list[ReadReport] = []
    try:
        async with asyncio.TaskGroup() as group:
            tasks = [
                group.create_task(read_device(connection.driver(target), target, in_order(target.description)))
                for target in connection.targets
            ]
        reports = [task.result() for task in tasks]
    except* ConsentError:
        log.info("another master is on the bus: nothing is read without consent")
    for report in reports:
        if report.values and connection.recording is not None:
            wall_ns = time.time_ns()
            connection.recording.attach_set(to_set(report, connection.turbine.slug, person, REASON, wall_ns))
    return reports


def in_order(description: Description) -> list[Address]:
    """All objects that can be read, what the screens show before the rest: a blade's angle is there at once."""
    wanted = readable(description)
    shown = usual_list(description)
    return sorted(wanted, key=lambda address: address not in shown)


def unreachable(reports: list[ReadReport]) -> dict[str, HubsideError]:
    """Devices of which nothing could be read, by slug, each with its first error."""
    return {r.target.slug: next(iter(r.failed.values())) for r in reports if not r.values and r.failed}
