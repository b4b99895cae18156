"""A restore desk in front of the twin of an ED2, over its line and in the time that the line takes."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from app.model.address import parse_address
from app.model.datatypes import Raw, encode_raw
from app.model.restore.plan import StepKind
from app.model.sets import ParameterSet
from app.service.backup import read_device, to_set
from app.service.connection import Connection
from app.service.office.office import Office
from app.service.restore.desk import Desk
from app.service.restore.order import Given, Order, Timing
from app.service.restore.prepare import Prepared
from app.service.restore.transaction import End
from app.store.store import Store
from app.twins.object_store import RefusedAccessError
from app.wire.sdo import Abort
from tests.drivers.profibus_rig import ED2
from tests.service.motion.ed2_rig import AXIS, ORDER, Cylinders, cylinders, ed2_connection
from tests.web.rig import wait_until

STATION = AXIS.rpartition("/")[0]
QUICK = Timing(ready_s=10.0, quiet_s=1.0, hand_s=30.0)


@dataclass
class Bench:
    """A desk in front of one twin."""

    desk: Desk
    connection: Connection
    twin: Cylinders

    async def set_of(self) -> ParameterSet:
        target = self.connection.target(AXIS)
        return to_set(await read_device(self.connection.driver(target), target), "bench-ed2", "Anna", "backup", 0)

    async def prepare(self, changes: Mapping[str, Raw], base: ParameterSet | None = None, **options: Any) -> Prepared:
        found = await self.set_of() if base is None else base
        wanted = replace(found, values={**found.values, **{parse_address(one): raw for one, raw in changes.items()}})
        order = Order(STATION, {AXIS: Given(wanted)}, "Anna", **{"confirm_s": None, "reason": "test", **options})
        return await self.desk.prepare(self.connection, order)

    async def begin(self, changes: Mapping[str, Raw], **options: Any) -> str:
        prepared = await self.prepare(changes, **options)
        return await self.desk.begin(self.connection, prepared, prepared.hash)

    async def run(self, changes: Mapping[str, Raw], **options: Any) -> tuple[str, End]:
        restore_id = await self.begin(changes, **options)
        return restore_id, await self.desk.wait(restore_id)

    async def run_and_switch(self, changes: Mapping[str, Raw]) -> tuple[str, End]:
        """A restart is agreed to, and somebody switches the device off and on when he is told so."""
        restore_id = await self.begin(changes, restart=True)
        await self.asked_to_switch(restore_id)
        await self.switch()
        return restore_id, await self.desk.wait(restore_id)

    async def asked_to_switch(self, restore_id: str) -> None:
        def asked() -> bool:
            transaction = self.desk.at_work(restore_id)
            return transaction is None or transaction.switching is not None

        await wait_until(asked)

    async def switch(self) -> None:
        """Off, until the bus has noticed it, and on."""
        station = self.connection.driver(self.connection.target(AXIS))._line.stations[6]
        self.twin.wired.power_off()
        await wait_until(lambda: station.state.value == "absent")
        self.twin.wired.power_on()

    def ram(self, *addresses: str) -> dict[str, int]:
        return {one: self.twin.number(*_pair(one)) for one in addresses}

    def memory(self, changes: Mapping[str, Raw]) -> bool:
        """The device has saved all of it."""
        saved = self.twin.wired.device.channels[0].memory.memory.saved
        return all(
            saved.get(at := parse_address(one)) == encode_raw(ED2.entry(at).type, raw) for one, raw in changes.items()
        )

    def refuse(self, address: str) -> None:
        """The device refuses the next write of the parameter."""
        cell = self.twin.wired.device.channels[0].store.cell(*_pair(address))
        own = cell.guard

        def guard(raw: Raw) -> None:
            cell.guard = own
            raise RefusedAccessError(Abort.DEVICE_STATE)

        self.twin.wired.do(lambda: setattr(cell, "guard", guard))


def _pair(address: str) -> tuple[int, int]:
    at = parse_address(address)
    return at.major, at.minor


def steps(prepared: Prepared) -> list[tuple[str, str, Raw | None]]:
    """What is written, in order."""
    return [(one.kind.value, one.place.address.short, one.raw) for one in prepared.plan.steps if one.place is not None]


def kinds(prepared: Prepared) -> list[StepKind]:
    return [one.kind for one in prepared.plan.steps if one.place is None]


@asynccontextmanager
async def desk_of(twin: Cylinders, folder: Path, more: str = ORDER) -> AsyncIterator[Bench]:
    async with ed2_connection(twin, folder / "rec", more) as connection:
        office = Office(Store.open(folder / "data"), connection.journal, connection.stamper, "tester")
        desk = Desk(office, connection.journal, connection.stamper, QUICK, data=folder / "data")
        connection.gate.blocks = desk.blocks
        try:
            yield Bench(desk, connection, twin)
        finally:
            await desk.close()
            await office.close()


@pytest.fixture
def twin() -> Iterator[Cylinders]:
    with cylinders() as one:
        yield one


@pytest.fixture
async def bench(twin: Cylinders, tmp_path: Path) -> AsyncIterator[Bench]:
    async with desk_of(twin, tmp_path) as one:
        yield one
