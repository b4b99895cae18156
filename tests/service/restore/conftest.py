"""A desk in front of six twins: sets to restore, and the wire between."""

from __future__ import annotations

import sqlite3
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from app.drivers.contract import LinkState
from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description_file import load_builtin
from app.model.sets import ParameterSet
from app.service.backup import read_device, to_set
from app.service.connection import Connection
from app.service.office.office import Office
from app.service.restore.desk import Desk
from app.service.restore.order import Given, Order, Timing
from app.service.restore.transaction import End
from app.store.restore_rows import RestoreState
from app.store.store import Store
from app.twins.line import CanLine
from app.twins.line_thread import LineThread
from app.twins.object_store import Cell
from app.twins.socketcand_server import SocketcandServer
from app.twins.turbine import Settings, Turbine
from tests.service.conftest import MS, Served, connection
from tests.web.rig import wait_until

__all__ = ["connection"]

STATION = "wtg-07/blade-1"
PMM, PMC = f"{STATION}/pmm", f"{STATION}/pmc"
QUICK = Timing(ready_s=5.0, quiet_s=5.0, boot_s=5.0, mode_s=1.0)
CHANGES: dict[str, dict[str, int]] = {
    PMM: {"3110:01": 490, "30FA:01": 570, "30FC:02": 655},
    PMC: {"6065": 150, "5683": 1400},
}
"""What the sets of these tests hold other than the devices do."""


def changed(parameters: ParameterSet, changes: Mapping[str, Raw]) -> ParameterSet:
    """The set with other values."""
    return replace(
        parameters, values={**parameters.values, **{parse_address(one): raw for one, raw in changes.items()}}
    )


def holding(cell: Cell, raw: int) -> Callable[[], None]:
    """Have a twin's object show ``raw``; gives what ends it."""
    before, cell.source = cell.source, lambda: raw

    def end() -> None:
        cell.source = before

    return end


@dataclass
class Bench:
    """What a restore needs: the desk, the connection, and the data folder that outlives both."""

    desk: Desk
    connection: Connection
    office: Office
    served: Served
    data: Path
    read: dict[str, ParameterSet] = field(default_factory=dict)
    """As they were when a test ordered first."""

    async def set_of(self, slug: str) -> ParameterSet:
        """The set of a device as it is."""
        target = self.connection.target(slug)
        report = await read_device(self.connection.driver(target), target)
        return to_set(report, "wtg-07", "Anna", "backup", 0)

    async def order(self, changes: Mapping[str, Mapping[str, Raw]] | None = None, **options: Any) -> Order:
        """An order of the station's sets with ``changes`` in them, confirmed already."""
        wanted = CHANGES if changes is None else changes
        for slug in wanted:
            if slug not in self.read:
                self.read[slug] = await self.set_of(slug)
        given = {slug: Given(changed(self.read[slug], own)) for slug, own in wanted.items()}
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

    async def until_state(self, restore_id: str, state: RestoreState) -> None:
        """Until it is in ``state``."""

        def there() -> bool:
            transaction = self.desk.at_work(restore_id)
            return transaction is not None and transaction.state is state

        await wait_until(there)

    async def until_connected(self) -> None:
        """Until the bus is back after a cut."""
        await wait_until(lambda: self.connection.buses["can0"].status.state is LinkState.CONNECTED)

    def another_desk(self, timing: Timing | None = None) -> Desk:
        """A desk as the next run of the tool makes it."""
        desk = Desk(self.office, self.connection.journal, self.connection.stamper, timing or QUICK, data=self.data)
        self.connection.gate.blocks = desk.blocks
        return desk

    async def hold_store(self) -> Callable[[], None]:
        """Have another process hold the store's file, so that nothing can be written; gives what ends it."""
        await self.office.store.run(lambda kept: kept.exec_driver_sql("PRAGMA busy_timeout = 20"))
        held = sqlite3.connect(self.data / "store.sqlite3", isolation_level=None)
        held.execute("BEGIN IMMEDIATE")
        return held.close

    def intent_on_disk(self, mux: bytes) -> bool:
        """Whether another reader of the store finds an open intent for the object."""
        index = int.from_bytes(mux[:2], "little")
        with closing(sqlite3.connect(f"{(self.data / 'store.sqlite3').as_uri()}?mode=ro", uri=True)) as file:
            rows = file.execute("SELECT kind, address FROM restore_steps WHERE state = 'intended'").fetchall()
        address = "save" if index == 0x1010 else f"{index:04X}:{mux[2]:02X}"
        return [kind if at is None else at for kind, at in rows] == [address]

    def stored(self, slug: str, address: str) -> bytes | None:
        """What the twin's memory holds; None where it holds the default."""
        node = self.connection.target(slug).node
        at: Address = parse_address(address)
        return self.served.turbine.devices[node].memory.memory.saved.get(at)


@pytest.fixture
def served() -> Iterator[Served]:
    """Six devices that answer, boot and save quickly: a restore reads each of them several times."""
    line = CanLine(1_000_000)
    settings = Settings(turnaround_ns=MS // 10, boot_ns=50 * MS, save_ns=50 * MS)
    turbine = Turbine(line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), settings)
    turbine.power_on(line.now_ns)
    with LineThread(line) as thread, SocketcandServer(thread) as server:
        yield Served(line, thread, turbine, f"socketcand:127.0.0.1:{server.port}", server)
    assert thread.handler_errors == 0


@pytest.fixture
async def bench(connection: Connection, served: Served, tmp_path: Path) -> AsyncIterator[Bench]:
    """A desk with a store on the disk."""
    office = Office(Store.open(tmp_path / "data"), connection.journal, connection.stamper, "tester")
    desk = Desk(office, connection.journal, connection.stamper, QUICK, data=tmp_path / "data")
    connection.gate.blocks = desk.blocks
    try:
        yield Bench(desk, connection, office, served, tmp_path / "data")
    finally:
        await desk.close()
        await office.close()
