"""A desk in front of six twins: sets to restore, and the wire between."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.sets import ParameterSet
from app.service.backup import read_device, to_set
from app.service.connection import Connection
from app.service.office.office import Office
from app.service.restore.desk import Desk
from app.service.restore.order import Given, Order, Timing
from app.service.restore.transaction import End
from app.store.store import Store
from tests.service.conftest import Served, connection, served

__all__ = ["connection", "served"]

STATION = "wtg-07/blade-1"
PMM, PMC = f"{STATION}/pmm", f"{STATION}/pmc"
QUICK = Timing(ready_s=5.0, quiet_s=5.0, boot_s=5.0, mode_s=1.0)
CHANGES: dict[str, dict[str, int]] = {
    PMM: {"3110:01": 490, "30FA:01": 570, "30FC:02": 655},
    PMC: {"6065": 150, "5683": 1400},
}
"""What the sets of these tests hold other than the devices do."""


@dataclass
class Bench:
    """What a restore needs: the desk, the connection, and the data folder that outlives both."""

    desk: Desk
    connection: Connection
    office: Office
    served: Served

    async def set_of(self, slug: str, changes: Mapping[str, Raw] | None = None) -> ParameterSet:
        """The set of a device as it is, with ``changes``."""
        target = self.connection.target(slug)
        report = await read_device(self.connection.driver(target), target)
        found = to_set(report, "wtg-07", "Anna", "backup", 0)
        changed = {parse_address(address): raw for address, raw in (changes or {}).items()}
        return replace(found, values={**found.values, **changed})

    async def order(self, changes: Mapping[str, Mapping[str, Raw]] | None = None, **options: Any) -> Order:
        """An order of the station's sets with ``changes`` in them, confirmed already."""
        wanted = CHANGES if changes is None else changes
        given = {slug: Given(await self.set_of(slug, own)) for slug, own in wanted.items()}
        usual: dict[str, Any] = {"person": "Anna", "confirm_s": None, "reason": "test", "work_order": "WO-1"}
        return Order(STATION, given, **{**usual, **options})

    async def begin(self, changes: Mapping[str, Mapping[str, Raw]] | None = None, **options: Any) -> str:
        """Begin such a restore."""
        prepared = await self.desk.prepare(self.connection, await self.order(changes, **options))
        return await self.desk.begin(self.connection, prepared, prepared.hash)

    async def run(self, changes: Mapping[str, Mapping[str, Raw]] | None = None, **options: Any) -> tuple[str, End]:
        """A restore from its beginning to its end."""
        restore_id = await self.begin(changes, **options)
        return restore_id, await self.desk.wait(restore_id)

    async def ram(self, slug: str, address: str) -> Raw:
        """What stands in RAM, read over the wire."""
        target = self.connection.target(slug)
        report = await read_device(self.connection.driver(target), target, (parse_address(address),))
        return report.values[parse_address(address)]

    def stored(self, slug: str, address: str) -> bytes | None:
        """What the twin's memory holds; None where it holds the default."""
        node = self.connection.target(slug).node
        at: Address = parse_address(address)
        return self.served.turbine.devices[node].memory.memory.saved.get(at)


@contextmanager
def office_of(folder: Path, connection: Connection) -> Iterator[Office]:
    """The office of a data folder, as a server has it; closed at the end without waiting for its audit."""
    office = Office(Store.open(folder), connection.journal, connection.stamper, "tester")
    try:
        yield office
    finally:
        office.store.close()


@pytest.fixture
async def bench(connection: Connection, served: Served, tmp_path: Path) -> AsyncIterator[Bench]:
    """A desk with a store on the disk."""
    office = Office(Store.open(tmp_path / "data"), connection.journal, connection.stamper, "tester")
    desk = Desk(office, connection.journal, connection.stamper, QUICK)
    connection.gate.blocks = desk.blocks
    try:
        yield Bench(desk, connection, office, served)
    finally:
        await desk.close()
        await office.close()
