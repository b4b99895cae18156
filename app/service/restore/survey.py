"""What stands in a station now, read over the wire: values, identities, and what the drives do."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from app.drivers.contract import Driver
from app.errors import HubsideError, NoAnswerError, UsageError
from app.model.address import Address
from app.model.axis_machine import CIA_402, StateMachine
from app.model.axis_state import ENERGISED, FOLLOWING, AxisState
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.restore.wanted import DeviceState
from app.model.sets import ParameterSet
from app.model.station import StationValues, station_of
from app.model.variant import as_identified
from app.service.backup import DeviceProgress, ReadReport, read_device, readable, to_set
from app.service.connection import Connection
from app.service.devices import Target

MODE_SHOWN: Final = Address(0x6061)
VELOCITY: Final = Address(0x606C)
STANDSTILL: Final = 10
"""Velocity in position units a second up to which an axis stands: 0.1 degrees a second as delivered."""
PIECE: Final = 16
"""So many objects are asked for before it is looked whether the device answers at all, where the driver does not."""
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Survey:
    """One station at one instant. ``boots`` counts the starts of each device that were seen, by slug."""

    reports: tuple[ReadReport, ...]
    sets: Mapping[str, ParameterSet]
    station: StationValues
    states: Mapping[str, DeviceState]
    boots: Mapping[str, int]


async def survey(
    connection: Connection, targets: Iterable[Target], person: str, reason: str, on_progress: Progress | None = None
) -> Survey:
    """Read all devices of a station completely, one at a time on each bus node.

    Raises BusLostError, ConsentError, and NoAnswerError or what else kept a device from telling anything.
    """
    targets = tuple(targets)
    boots = {target.slug: boots_of(target) for target in targets}
    done = dict.fromkeys((target.slug for target in targets), (0, 0))

    def progress(target: Target, count: int, total: int) -> None:
        done[target.slug] = count, total
        if on_progress is not None:
            on_progress(sum(one for one, _ in done.values()), sum(one for _, one in done.values()))

    reading = (read_whole(connection.driver(target), target, None, progress) for target in targets)
    reports = tuple(await asyncio.gather(*reading))
    turbine, wall_ns = connection.turbine.slug, connection.stamper()
    sets = {one.target.slug: to_set(one, turbine, person, reason, wall_ns) for one in reports}
    return Survey(
        reports,
        sets,
        station_of((one, _as_variant(target, one)) for target in targets for one in (sets[target.slug],)),
        {report.target.slug: state_of(report) for report in reports},
        boots,
    )


def _as_variant(target: Target, found: ParameterSet) -> Description:
    """The description with the limits of the variant that the device has shown to be."""
    return as_identified(target.description, found.identity.device_name, found.identity.product_code)


async def read_whole(
    driver: Driver,
    target: Target,
    addresses: Iterable[Address] | None = None,
    on_progress: DeviceProgress | None = None,
) -> ReadReport:
    """Read a device as ``read_device`` does, piece by piece: one that falls silent is not waited for at every object.

    Raises NoAnswerError where an object was not answered: a plan would take it for one that cannot be read.
    """
    wanted = readable(target.description) if addresses is None else list(addresses)
    values: dict[Address, Raw] = {}
    failed: dict[Address, HubsideError] = {}
    piece = max(1, len(wanted)) if driver.ends_when_silent else PIECE
    for at in range(0, len(wanted), piece):
        report = await read_device(driver, target, wanted[at : at + piece], None if piece == PIECE else on_progress)
        silent = (error for error in report.failed.values() if isinstance(error, NoAnswerError))
        if (error := next(silent, None)) is not None:
            raise report.lost or error
        values |= report.values
        failed |= report.failed
        if on_progress is not None:
            on_progress(target, len(values) + len(failed), len(wanted))
    if not values and failed:
        raise next(iter(failed.values()))
    return ReadReport(target, values, failed)


def state_of(report: ReadReport) -> DeviceState:
    """What the device does, as far as it has an axis."""
    machine, mode = report.target.description.machine, report.values.get(MODE_SHOWN)
    status = None if machine is None else report.values.get(machine.statusword)
    return DeviceState(
        mode=mode if isinstance(mode, int) else None,
        enabled=stage_on(machine, status) if machine is not None and isinstance(status, int) else None,
    )


def stage_on(machine: StateMachine, status: int) -> bool:
    """True where a statusword says that the output stage is on, or that the loop is closed over a valve."""
    if machine is CIA_402:
        return AxisState.of(status) in ENERGISED
    state = machine.state_of(status)
    return state is None or state.powered  # a state that nobody knows is none to rely on


def is_driven(machine: StateMachine, status: int) -> bool:
    """True where a statusword says that the axis follows something: set-points, a quick stop, a fault reaction."""
    return AxisState.of(status) in FOLLOWING if machine is CIA_402 else stage_on(machine, status)


def standstill(description: Description) -> int:
    """Up to this velocity (606Ch, raw) an axis stands. Where its unit can be chosen, no more than 0 is sure."""
    entry = description.entries.get(VELOCITY)
    rule = None if entry is None else entry.quantity_rule
    return 0 if rule is not None and rule.choices else STANDSTILL


def boots_of(target: Target) -> int:
    """How many starts of a device were seen."""
    view = target.live.node(target.device.bus, target.node)
    return 0 if view is None else view.boots


def targets_of(connection: Connection, station: str) -> tuple[Target, ...]:
    """The devices of a station. Raises UsageError."""
    found = tuple(target for target in connection.targets if target.slug.rpartition("/")[0] == station)
    if not found:
        known = ", ".join(dict.fromkeys(target.slug.rpartition("/")[0] for target in connection.targets))
        raise UsageError(reason=f"no station '{station}'; there are: {known or 'none'}")
    return found


async def read_integer(connection: Connection, target: Target, address: Address) -> int | None:
    """One object as a number, read now; None where the device does not have it, or refuses it.

    Raises NoAnswerError, BusLostError, ConsentError.
    """
    entry = target.description.entries.get(address)
    if entry is None:
        return None
    report = await read_device(connection.driver(target), target, (address,))
    error: HubsideError | None = report.failed.get(address)
    if error is not None and error.exit_code != 4:
        raise error
    raw = report.values.get(address)
    return raw if isinstance(raw, int) else None
