"""Read devices completely and keep what was read as parameter sets."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from app import __version__
from app.drivers.contract import Driver
from app.errors import BusLostError, HubsideError, SdoAbortError
from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.sets import Origin, ParameterSet, dump_set, identity_of, iso_time
from app.service.devices import Target, decode
from app.wire.sdo import Abort

DeviceProgress = Callable[[Target, int, int], None]
"""Called with the device, the objects done and the objects in all."""
SECOND_NS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class ReadReport:
    """All that was read of one device; ``failed`` names every object that did not answer, and why."""

    target: Target
    values: Mapping[Address, Raw]
    failed: Mapping[Address, HubsideError]

    @property
    def errors(self) -> dict[Address, HubsideError]:
        """What failed, without the objects that only hold no data."""
        return {address: error for address, error in self.failed.items() if not is_empty(error)}

    @property
    def lost(self) -> BusLostError | None:
        """The bus was lost on the way: the values are of no one moment."""
        return next((error for error in self.failed.values() if isinstance(error, BusLostError)), None)


def readable(description: Description) -> list[Address]:
    """Addresses of all objects that can be read, in order."""
    return [entry.address for entry in description if entry.access.readable]


async def read_device(
    driver: Driver,
    target: Target,
    addresses: Iterable[Address] | None = None,
    on_progress: DeviceProgress | None = None,
) -> ReadReport:
    """Read ``addresses`` (all readable objects where None). Raises BusLostError; other errors are in the report."""
    wanted = readable(target.description) if addresses is None else list(addresses)

    def progress(done: int, total: int) -> None:
        if on_progress is not None:
            on_progress(target, done, total)

    answers = await driver.read_many(target.node, wanted, on_progress=progress)
    values: dict[Address, Raw] = {}
    failed: dict[Address, HubsideError] = {}
    for address, answer in answers.items():
        if isinstance(answer, HubsideError):
            failed[address] = answer
        else:
            values[address] = decode(target.entry(address), answer)
    return ReadReport(target, values, failed)


async def read_devices(
    pairs: Iterable[tuple[Driver, Target]], on_progress: DeviceProgress | None = None
) -> list[ReadReport]:
    """Read many devices completely, all nodes at a time. Raises BusLostError, ConsentError."""
    try:
        async with asyncio.TaskGroup() as group:
            tasks = [group.create_task(read_device(driver, target, None, on_progress)) for driver, target in pairs]
    except ExceptionGroup as failed:  # the bus is lost for all of them at once: one of them tells it
        raise failed.exceptions[0] from failed
    return [task.result() for task in tasks]


def to_set(
    report: ReadReport, turbine: str, person: str, reason: str, wall_ns: int, work_order: str = ""
) -> ParameterSet:
    """The parameter set of a complete read."""
    target = report.target
    time = iso_time(wall_ns // SECOND_NS * SECOND_NS)
    return ParameterSet(
        description_id=target.description.id,
        description_version=target.description.version,
        identity=identity_of(report.values),
        origin=Origin(turbine, target.slug, target.node, time, person, reason, f"hubside {__version__}", work_order),
        values=report.values,
        unread={address: why(error) for address, error in report.failed.items() if not is_empty(error)},
        empty=tuple(address for address, error in report.failed.items() if is_empty(error)),
    )


def whole_sets(
    reports: Iterable[ReadReport], turbine: str, person: str, reason: str, wall_ns: int, work_order: str = ""
) -> list[ParameterSet]:
    """The set of every device that was read; of one that was lost on the way there is none.

    They are to be kept: of what is changed for motion they hold what stands there otherwise.
    """
    return [
        to_set(_without_motion(report), turbine, person, reason, wall_ns, work_order)
        for report in reports
        if report.values and report.lost is None
    ]


def _without_motion(report: ReadReport) -> ReadReport:
    target = report.target
    axes = target.gate.claims.axes
    values = dict(report.values)
    for address, (was, now) in ({} if axes is None else axes.changed(target.slug)).items():
        entry = target.entry(address)
        if values.get(address) == decode(entry, now):  # else somebody has written it since, or a restart ended it
            values[address] = decode(entry, was)
    return replace(report, values=values)


def write_sets(folder: Path, sets: Iterable[ParameterSet]) -> list[Path]:
    """Write a file of every set into the folder of its turbine below ``folder``."""
    return [write_set(folder / one.origin.turbine, one) for one in sets]


def is_empty(error: HubsideError) -> bool:
    """True where the device answered that the object holds no data, as an empty error history does."""
    return isinstance(error, SdoAbortError) and error.abort_code == Abort.NO_DATA


def why(error: HubsideError) -> str:
    """Why an object was not read, for the set file."""
    return f"abort {error.abort_code:08X}h" if isinstance(error, SdoAbortError) else error.code


def write_set(folder: Path, parameters: ParameterSet) -> Path:
    """Write a set file into ``folder``; its name holds device and time, and never replaces another file."""
    folder.mkdir(parents=True, exist_ok=True)
    time = parameters.origin.time.replace(":", "").replace("-", "")
    stem = f"{parameters.origin.device.replace('/', '_')}_{time}"
    text = dump_set(parameters)
    for number in range(1, 1000):
        path = folder / (f"{stem}.json" if number == 1 else f"{stem}_{number}.json")
        try:
            with path.open("x", encoding="utf-8", newline="\n") as file:
                file.write(text)
        except FileExistsError:
            continue
        return path
    raise FileExistsError(stem)
