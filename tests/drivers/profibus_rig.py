"""What the tests of the PROFIBUS driver share: a twin on a pseudo-terminal, in the time that the wire takes."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager

from app.drivers.profibus_config import ProfibusConfig, ProfibusStation
from app.drivers.profibus_driver import ProfibusDriver
from app.drivers.profibus_station import StationState
from app.model.address import Address, Addressing
from app.model.description_file import load_builtin
from app.twins.ed2.device import BOOT_NS, Ed2, Settings
from app.twins.ed2.pty_line import PtyLine
from app.twins.ed2.segment import Segment
from app.twins.paced_thread import PacedThread
from app.wire.profibus.telegrams import Signal
from tests.drivers.wire import stamper

ED2 = load_builtin("wandfluh-ed2")
NODE, ABSENT = 6, 9
BAUD = 500_000
LISTEN_S = 0.05
"""Enough on a line on which there is nobody else; a test of those listens longer."""
DEADLINE_S = 30.0


def ip(ind: int, pnu: int) -> Address:
    return Address(ind, pnu, Addressing.PKW)


CONTROLWORD, STATUSWORD, ERROR_CODE, LOCAL, STORE = ip(0, 37), ip(0, 38), ip(0, 36), ip(0, 41), ip(0, 51)
RAMP_VELOCITY, RAMP_ACCELERATION, ACTUAL, SETPOINT = ip(12, 61), ip(12, 64), ip(12, 100), ip(12, 21)


class Wire:
    """The twin and its line; whatever is done to them is done on their thread."""

    def __init__(self, thread: PacedThread, line: PtyLine, device: Ed2, baud: int) -> None:
        self.thread = thread
        self.line = line
        self.device = device
        self.baud = baud

    def config(self, *stations: int | ProfibusStation) -> ProfibusConfig:
        """Of stations that are spoken to from the start."""
        named = tuple(each if isinstance(each, ProfibusStation) else ProfibusStation(each) for each in stations)
        return ProfibusConfig(self.line.path, self.baud, named)

    def do(self, function: Callable[[], object]) -> None:
        """Run it on the thread of the line, and wait for its end."""
        done = threading.Event()

        def run() -> None:
            function()
            done.set()

        self.thread.call_soon(run)
        assert done.wait(DEADLINE_S), "the line's thread did not come to it"

    def power_off(self) -> None:
        self.do(self.device.power_off)

    def power_on(self) -> None:
        self.do(self.device.power_on)

    @property
    def received(self) -> dict[Signal, int]:
        """Process data of the first axis as the device understood them."""
        return self.device.channels[0].received


@contextmanager
def wire(baud: int = BAUD, settings: Settings | None = None, *more: Settings) -> Iterator[Wire]:
    """A twin, and ``more`` on the same line."""
    devices = [Ed2(ED2, each) for each in (settings or Settings(), *more)]
    device = devices[0]
    line = PtyLine(Segment([each.slave for each in devices], baud), devices)
    line.run_until(BOOT_NS)
    thread = PacedThread(line, time.monotonic_ns)
    line.serve(thread)
    thread.start()
    try:
        yield Wire(thread, line, device, baud)
    finally:
        thread.stop()
        line.close()
    assert thread.handler_errors == 0


@asynccontextmanager
async def connected(config: ProfibusConfig, listen_s: float = LISTEN_S) -> AsyncIterator[ProfibusDriver]:
    driver = ProfibusDriver(config, stamper(), descriptions=(ED2,), listen_s=listen_s)
    await driver.connect(DEADLINE_S)
    try:
        yield driver
    finally:
        await driver.close()


async def gone(driver: ProfibusDriver, node: int) -> None:
    """Wait until the driver has noticed that nobody answers at ``node``."""
    station = driver._line.stations[node]
    async with asyncio.timeout(DEADLINE_S):
        await driver._until(lambda: station.state is StationState.ABSENT)
