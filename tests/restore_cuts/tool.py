"""The tool that restores: store, desk and connection as a server has them, in this process or in one that is killed."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

import app.drivers.canopen
import app.drivers.sdo_client
from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description, Entry
from app.model.description_file import load_builtin
from app.model.sets import ParameterSet, load_set
from app.model.site import load_site
from app.service.connection import Connection
from app.service.office.office import Office
from app.service.options import Options
from app.service.restore.desk import Desk
from app.service.restore.order import Given, Order, Timing
from app.store.store import Store
from tests.restore_cuts.station import STATION

TIMEOUT_S: Final = 0.15
"""For every answer: many times what a twin needs that is alive."""
TIMING: Final = Timing(ready_s=0.25, quiet_s=1.0, boot_s=0.5, mode_s=0.3)
KEPT: Final = {
    "oat-pmm": ("1000", "1008", "1010", "1018:04", "3000", "3004", "30FA", "30FB:07", "30FB:08", "30FC", "3110:01"),
    "oat-pmc": (
        *("1000", "1008", "1010", "1018:04", "6040", "6041", "6060", "6061", "6064", "606C", "567A", "6065"),
        *("607C", "6510:04", "6510:05"),
    ),
}
"""Objects that are looked at: a whole device has hundreds, and every one of them would be one more place for a cut."""


@dataclass(frozen=True, slots=True)
class Tool:
    """One run of the program."""

    office: Office
    desk: Desk
    connection: Connection


def hurry(put: Callable[[object, str, int], None] = setattr) -> None:
    """Wait no longer than this for what is dead: here and in every process that is to be killed."""
    put(app.drivers.canopen, "DEFAULT_TIMEOUT_NS", int(TIMEOUT_S * 1e9))
    put(app.drivers.canopen, "SAVE_TIMEOUT_NS", int(2 * TIMEOUT_S * 1e9))
    put(app.drivers.sdo_client, "DEFAULT_TIMEOUT_NS", int(TIMEOUT_S * 1e9))


@cache
def descriptions(whole: bool = False) -> dict[str, Description]:
    """What the tool knows of the devices: all of it, or the objects that matter here."""
    return {name: _with_hurry(load_builtin(name), whole) for name in KEPT}


def _with_hurry(description: Description, whole: bool) -> Description:
    kept = {
        address: entry for address, entry in description.entries.items() if whole or _is_kept(description.id, entry)
    }
    save = tuple(replace(one, timeout_s=2 * TIMEOUT_S) for one in description.save)
    return replace(description, entries=kept, save=save)


def _is_kept(description_id: str, entry: Entry) -> bool:
    address = entry.address
    names = {f"{address.major:04X}", str(address), address.short}
    return bool(names & set(KEPT[description_id]))


@asynccontextmanager
async def connected(site: Path, recordings: Path, whole: bool = False) -> AsyncIterator[Connection]:
    """A connection that records."""
    (turbine,) = load_site(site)
    connection = Connection(turbine, descriptions(whole), Options("tester", recordings, listen_s=0.0))
    try:
        await connection.open()
        yield connection
    finally:
        await connection.close()


@asynccontextmanager
async def tool_on(connection: Connection, data: Path) -> AsyncIterator[Tool]:
    """A store with its desk, on a connection that is there."""
    office = Office(Store.open(data), connection.journal, connection.stamper, "tester")
    desk = Desk(office, connection.journal, connection.stamper, TIMING, data=data)
    connection.gate.blocks = desk.blocks
    try:
        yield Tool(office, desk, connection)
    finally:
        await desk.close()
        await office.close()


@asynccontextmanager
async def tool(site: Path, data: Path, whole: bool = False) -> AsyncIterator[Tool]:
    """From its start to its end."""
    async with connected(site, data / "recordings", whole) as connection, tool_on(connection, data) as one:
        yield one


def order(sets: Iterable[Path]) -> Order:
    """The restore of all that the set files hold, with restart, confirmed already."""
    loaded = [load_set(path.read_text(encoding="utf-8"), path.name) for path in sorted(sets)]
    given = {one.origin.device: Given(one) for one in loaded}
    return Order(STATION, given, "tester", restart=True, reason="cut test", confirm_s=None)


def changed(parameters: ParameterSet, values: Mapping[Address, Raw]) -> ParameterSet:
    """A set with other values."""
    assert set(values) <= set(parameters.values)
    return replace(parameters, values={**parameters.values, **values})
