"""A desk of batteries in front of real twins, and the battery of blade 1 as a test wants it."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from threading import Event
from typing import Any

import canopen

from app.model.address import Address
from app.service.battery.archive import Archive
from app.service.battery.desk import BatteryDesk
from app.service.connection import Connection
from app.service.devices import Target
from app.service.motion.desk import MotionDesk
from app.store.store import Store
from app.twins.plant_power import PowerPlant
from app.wire.frame import Can
from tests.e2e.test_interoperation import EDS
from tests.service.conftest import Served
from tests.service.motion.rig import SteadyClock

PMM, PMC = "wtg-07/blade-1/pmm", "wtg-07/blade-1/pmc"
NODE = 1
COMMAND_TEST = 0x02


@asynccontextmanager
async def at_the_batteries(connection: Connection, store: Store) -> AsyncIterator[tuple[BatteryDesk, Target]]:
    """The desk, and the unit of blade 1."""
    motion = MotionDesk(connection, connection.journal, now_s=SteadyClock())
    desk = BatteryDesk(connection, motion, Archive(store, connection.stamper))
    try:
        yield desk, connection.target(PMM)
    finally:
        await desk.close()
        await motion.close()


def in_plant(served: Served, change: Callable[[PowerPlant], None]) -> None:
    """Change the supply of blade 1 between two of its cycles; its gauge looks anew, as at power-on."""
    done = Event()
    blade = served.turbine.blades[0]

    def work() -> None:
        blade.advance(served.line.now_ns)
        change(blade.power)
        blade.power._write_battery()
        blade.pmm.gauge.clear()
        done.set()

    served.thread.call_soon(work)
    assert done.wait(10.0)


def charged(share: float) -> Callable[[PowerPlant], None]:
    """All blocs hold this share of their charge."""

    def change(power: PowerPlant) -> None:
        for bloc in power.blocs:
            bloc.charge, bloc.offset_v = share, 0.0

    return change


def weakened(power: PowerPlant) -> None:
    """What the fault ``bloc_weak`` of the instructor does to one bloc: it gives way under load within a second.

    Not at once: a test that fails between two samples, as with a far higher resistance, has a course without the bloc.
    """
    power.blocs[3].capacity_share, power.blocs[3].ohm_factor = 0.004, 8.0


@contextmanager
def witness(served: Served) -> Iterator[Any]:
    """Somebody else's client at the same unit."""
    network = canopen.Network()
    network.connect(interface="socketcand", host="127.0.0.1", port=served.server.port, channel="can0")
    try:
        unit = network.add_node(NODE, str(EDS / "oat_pmm.eds"))
        unit.sdo.RESPONSE_TIMEOUT = 5.0
        yield unit
    finally:
        network.disconnect()


def asks(address: Address) -> Callable[[Can], bool]:
    """A request to blade 1's unit that names an object."""
    index = address.major.to_bytes(2, "little")
    return lambda can: can.can_id == 0x600 + NODE and can.data[1:3] == index


def writes(address: Address) -> Callable[[Can], bool]:
    """An expedited write to it."""
    named = asks(address)
    return lambda can: named(can) and can.data[0] & 0xE0 == 0x20


def answers_write(address: Address) -> Callable[[Can], bool]:
    """The unit acknowledges a write of it."""
    index = address.major.to_bytes(2, "little")
    return lambda can: can.can_id == 0x580 + NODE and can.data[0] == 0x60 and can.data[1:3] == index
