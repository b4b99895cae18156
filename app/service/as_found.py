"""The first look: every device read completely after the connection is made, the sets kept in the recording."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from app.drivers.contract import LinkState
from app.errors import BusLostError, ConsentError, HubsideError, NoAnswerError
from app.model.address import Address
from app.model.description import Description
from app.service.backup import ReadReport, read_device, readable, whole_sets
from app.service.connection import Connection
from app.service.devices import Target
from app.service.polling import usual_list
from app.wire.records import Source

log = logging.getLogger(__name__)

REASON: Final = "as found"
LOOK_S: Final = 0.25
"""While a device is missing it is looked that often whether it is back."""


async def read_as_found(
    connection: Connection, person: str, targets: Iterable[Target] | None = None
) -> list[ReadReport]:
    """Read ``targets`` (all where None), all nodes at a time, and put what was read whole into the recording.

    Where the bus is lost, the report says so of every object. On a bus with another master nothing is read without
    consent: of its devices there is no report.
    """
    wanted = list(connection.targets if targets is None else targets)
    asked = await asyncio.gather(*(_read(connection, target) for target in wanted))
    reports = [report for report in asked if report is not None]
    if connection.recording is not None:
        found = [report for report in reports if is_whole(report)]
        for one in whole_sets(found, connection.turbine.slug, person, REASON, time.time_ns()):
            connection.recording.attach_set(one)
    return reports


async def _read(connection: Connection, target: Target) -> ReadReport | None:
    """Read one device; None where there is no consent."""
    wanted = in_order(target.description)
    try:
        return await read_device(connection.driver(target), target, wanted)
    except ConsentError:
        log.info("%s: another master is on the bus: nothing is read without consent", target.slug)
        return None
    except BusLostError as error:
        return ReadReport(target, {}, dict.fromkeys(wanted, error))


def in_order(description: Description) -> list[Address]:
    """All objects that can be read, what the screens show before the rest: a blade's angle is there at once."""
    wanted = readable(description)
    shown = usual_list(description)
    return sorted(wanted, key=lambda address: address not in shown)


def is_whole(report: ReadReport) -> bool:
    """True where the device answered to the end: neither was the bus lost on the way, nor did it fall silent."""
    last = in_order(report.target.description)[-2:]  # one object alone may have no answer for ever
    silent = all(isinstance(report.failed.get(address), NoAnswerError) for address in last)
    return bool(report.values) and report.lost is None and not silent


def unreachable(reports: Iterable[ReadReport]) -> list[HubsideError]:
    """What is to be told of a look: each bus that was lost once, and of each silent device its first error."""
    reports = list(reports)
    lost = {one.target.device.bus: one.lost for one in reports if one.lost is not None}
    silent = [next(iter(one.failed.values())) for one in reports if one.lost is None and not one.values and one.failed]
    return [*lost.values(), *silent]


@dataclass(frozen=True, slots=True)
class Missing:
    """A device that was not read whole, and how it stood then: its boot-ups, the connections of its bus, the time."""

    target: Target
    lost: bool
    boots: int
    reconnects: int
    t_ns: int


async def look(
    connection: Connection, person: str, targets: Iterable[Target]
) -> tuple[list[ReadReport], list[Missing]]:
    """``read_as_found``, and what is to be read again once it is back; never raises what a device or bus does."""
    wanted = list(targets)
    before = {target.slug: _era(connection, target) for target in wanted}
    reports = await read_as_found(connection, person, wanted)
    now_ns = connection.stamper()
    left = [report for report in reports if not is_whole(report)]
    return reports, [Missing(r.target, r.lost is not None, *before[r.target.slug], now_ns) for r in left]


async def until_back(connection: Connection, missing: Iterable[Missing]) -> list[Missing]:
    """Wait until at least one device is back; gives those that are."""
    awaited = list(missing)
    while not (back := [one for one in awaited if _is_back(connection, one)]):  # noqa: ASYNC110  the live state has no event for it
        await asyncio.sleep(LOOK_S)
    return back


def _era(connection: Connection, target: Target) -> tuple[int, int]:
    """Changes with each boot-up of the device and each connection of its bus."""
    view = connection.live.node(target.device.bus, target.node)
    return 0 if view is None else view.boots, connection.buses[target.device.bus].status.reconnects


def _is_back(connection: Connection, missing: Missing) -> bool:
    """True where the link or the device came back, or the device has answered somebody, since it was given up."""
    target = missing.target
    link = connection.buses[target.device.bus]
    if link.status.state is not LinkState.CONNECTED or link.needs_consent:
        return False
    if _era(connection, target) != (missing.boots, missing.reconnects):
        return True
    readings = (view.reading for view in connection.live.values(target.device.bus, target.node).values())
    return any(one is not None and one.source is Source.SDO_READ and one.t_ns > missing.t_ns for one in readings)
