"""Polling against twins on a served line: its rate, and everything that must silence it or begin it anew."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import pytest

from app.drivers.contract import LinkState
from app.model.address import Address
from app.service.connection import Connection
from app.service.link import DEVICE_NAME, TwinWatch
from app.service.poll import BACK_OFF_S, OTHER_CLIENT_NS, Poller
from app.service.polling import PollPlan
from app.twins.line import Port
from app.twins.socketcand_server import SocketcandServer
from app.wire import sdo
from app.wire.frame import Can, Direction, Frame
from app.wire.nmt import NmtCommand
from tests.e2e.test_interoperation import until
from tests.service.conftest import MS, Served

PMM, PMC = 1, 11
STATUSWORD, POSITION, STATE = Address(0x6041), Address(0x6064), Address(0x3000)
PERIOD_S = 0.1


class Asked:
    """What we asked by SDO upload: when (monotonic, s), which node, which object."""

    def __init__(self, connection: Connection) -> None:
        self._all: list[tuple[float, int, Address]] = []
        connection.buses["can0"].driver.subscribe(self._on_frames)

    def _on_frames(self, frames: list[Frame]) -> None:
        for frame in frames:
            can = frame.payload
            if frame.direction is not Direction.TX or not isinstance(can, Can) or not 0x600 < can.can_id < 0x680:
                continue
            if can.data[0] == 0x40:
                address = Address(int.from_bytes(can.data[1:3], "little"), can.data[3])
                self._all.append((time.monotonic(), can.can_id - 0x600, address))

    def times(self, node: int, address: Address | None = None, since_s: float = 0.0) -> list[float]:
        """When ``node`` was asked, for ``address`` or for anything."""
        return [t for t, at, what in self._all if t >= since_s and at == node and address in (None, what)]


@pytest.fixture
def asked(connection: Connection) -> Asked:
    return Asked(connection)


@asynccontextmanager
async def polling(connection: Connection) -> AsyncIterator[None]:
    poller = Poller(connection)
    try:
        yield
    finally:
        await poller.close()


async def asked_again(asked: Asked, node: int, address: Address | None = None, times: int = 3) -> float:
    """When ``node`` has been asked ``times`` times from now on: how long that took, in s."""
    now_s = time.monotonic()
    await until(lambda: len(asked.times(node, address, now_s)) >= times)
    return time.monotonic() - now_s


async def steadily(holds: Callable[[], bool], for_s: float) -> None:
    """``holds`` is true all the time."""
    end_s = time.monotonic() + for_s
    while time.monotonic() < end_s:
        assert holds()
        await asyncio.sleep(0.02)


async def all_the_while(holds: Callable[[], bool], for_s: float, tries: int = 50) -> float:
    """Wait until ``holds`` was true for ``for_s`` on end; since when, in s. A busy host may break a first attempt."""
    for _ in range(tries):
        await until(holds)
        since_s = time.monotonic()
        while holds():
            if time.monotonic() - since_s > for_s:
                return since_s
            await asyncio.sleep(0.02)
    raise AssertionError(f"never true for {for_s} s on end")


async def test_the_asked_rate_is_kept(connection: Connection, asked: Asked) -> None:
    """Fast objects every period, slow ones every tenth; the name once."""
    async with polling(connection):
        await until(lambda: len(asked.times(PMC, POSITION)) >= 31)
    times = asked.times(PMC, POSITION)[:31]
    assert 30 * PERIOD_S * 0.9 < times[-1] - times[0] < 30 * PERIOD_S * 3, "thirty periods, more on a busy host"
    slow = asked.times(PMC, Address(0x6061), times[0] - PERIOD_S / 2)
    assert 3 <= len(slow) <= 4
    for target in connection.targets:
        assert len(asked.times(target.node, DEVICE_NAME)) == 1
    await all_the_while(lambda: time.monotonic() - asked.times(PMC)[-1] > PERIOD_S, 3 * PERIOD_S)


async def test_a_restart_is_followed_by_a_look_at_who_it_is(connection: Connection, asked: Asked) -> None:
    """The name is asked once more, of that node alone; the twins are taken for twins all the time."""
    target = connection.target("wtg-07/blade-1/pmc")
    watch = TwinWatch(connection.targets, connection.buses)
    async with polling(connection):
        await until(watch.all_twins)
        await asked_again(asked, PMC, POSITION)
        restarting = asyncio.create_task(connection.buses["can0"].driver.restart(PMC))
        await until(lambda: watch.all_twins() and len(asked.times(PMC, DEVICE_NAME)) >= 2)
        await restarting
        await until(lambda: watch.all_twins() and target.lookup(DEVICE_NAME) is not None)
        answered = len(asked.times(PMC, DEVICE_NAME))
        await asked_again(asked, PMC, POSITION)
        assert len(asked.times(PMC, DEVICE_NAME)) == answered
        assert len(asked.times(PMM, DEVICE_NAME)) == 1
        assert watch.all_twins()


async def test_another_sdo_client_silences_polling_of_its_node(
    connection: Connection, asked: Asked, served: Served
) -> None:
    async with polling(connection):
        await asked_again(asked, PMM)
        served.thread.call_soon(lambda: foreigner(served).send(Can(0x600 + PMM, sdo.upload_request(STATE))))

        def seen_ns() -> int | None:
            view = connection.live.node("can0", PMM)
            return None if view is None else view.other_client_ns

        await until(lambda: seen_ns() is not None)
        quiet_from_s = time.monotonic() + PERIOD_S  # a round may be on its way
        await until(lambda: time.monotonic() > quiet_from_s)
        others = len(asked.times(PMC))
        await until(lambda: bool(asked.times(PMM, since_s=quiet_from_s)))
        silent_s = asked.times(PMM, since_s=quiet_from_s)[0] - quiet_from_s
        assert silent_s > OTHER_CLIENT_NS / 1e9 - 3 * PERIOD_S
        assert len(asked.times(PMC)) > others + 20, "the other nodes are polled on"


def foreigner(served: Served) -> Port:
    """Somebody else's place on the line."""
    return served.line.attach(lambda _can, _t_ns: None)


async def test_a_full_bus_is_left_alone(connection: Connection, asked: Asked, served: Served) -> None:
    """Frames of others take nine tenths of the bus for a while."""
    link = connection.buses["can0"]
    every_ns, frames = 20 * MS, 69  # of some 131 bits
    flooding = True

    def flood(port: Port, t_ns: int) -> None:
        for _ in range(frames if flooding else 0):
            port.send(Can(0x7FF, bytes(range(1, 9))))
        if flooding:
            served.line.call_at(t_ns + every_ns, lambda at_ns: flood(port, at_ns))

    async with polling(connection):
        await asked_again(asked, PMC)
        served.thread.call_soon(lambda: flood(foreigner(served), served.line.now_ns))
        over_s = await all_the_while(lambda: link.bus_load(connection.stamper()) > PollPlan().load_cap, 1.0)
        over_s += PERIOD_S  # a round may have been on its way
        assert [len(asked.times(target.node, since_s=over_s)) for target in connection.targets] == [0] * 6
        flooding = False
        await until(lambda: link.bus_load(connection.stamper()) < PollPlan().load_cap)
        await asked_again(asked, PMC)


async def test_a_dead_node_is_left_alone_until_it_is_back(connection: Connection, asked: Asked, served: Served) -> None:
    device = served.turbine.devices[PMC]
    async with polling(connection):
        await asked_again(asked, PMC)
        served.thread.call_soon(device.power_off)

        def quiet_s() -> float:
            return time.monotonic() - asked.times(PMC)[-1]

        await until(lambda: quiet_s() > 0.8 * BACK_OFF_S, 20.0)
        assert await asked_again(asked, PMM, times=10) < 30 * PERIOD_S, "the others are polled at their rate"
        await asked_again(asked, PMC, times=1)
        await until(lambda: quiet_s() > 0.5 * BACK_OFF_S, 20.0)
        dead = connection.live.node("can0", PMC)
        assert dead is not None
        served.thread.call_soon(lambda: device.power_on(served.line.now_ns))
        await until(lambda: (view := connection.live.node("can0", PMC)) is not None and view.boots > dead.boots)
        back_s = time.monotonic()
        await until(lambda: len(asked.times(PMC, DEVICE_NAME, back_s)) == 1)
        assert time.monotonic() - back_s < BACK_OFF_S / 3, "it is not left alone any longer"
        await asked_again(asked, PMC, POSITION)


async def test_what_a_pdo_brings_is_not_polled(connection: Connection, asked: Asked) -> None:
    """The statusword is in the first TPDO of the PMC: by its event timer it comes by itself."""
    driver = connection.buses["can0"].driver
    event_timer = Address(0x1800, 5)
    await driver.write(PMC, event_timer, (100).to_bytes(2, "little"))
    async with polling(connection):
        await asked_again(asked, PMC, STATUSWORD)
        driver.nmt(NmtCommand.START, PMC)
        await until(lambda: time.monotonic() - asked.times(PMC, STATUSWORD)[-1] > 10 * PERIOD_S)
        assert time.monotonic() - asked.times(PMC, POSITION)[-1] < 5 * PERIOD_S, "what it does not bring is"
        driver.nmt(NmtCommand.PRE_OPERATIONAL, PMC)
        await asked_again(asked, PMC, STATUSWORD)


async def test_a_pdo_that_brings_nothing_hides_nothing(connection: Connection, asked: Asked) -> None:
    """It is sent on a change only, and nothing changes: the value must not grow old."""
    async with polling(connection):
        connection.buses["can0"].driver.nmt(NmtCommand.START, PMC)
        await until(lambda: (view := connection.live.node("can0", PMC)) is not None and view.state is not None)
        await asked_again(asked, PMC, STATUSWORD, times=10)


async def test_polling_goes_on_after_the_connection_was_lost(
    connection: Connection, asked: Asked, served: Served
) -> None:
    link = connection.buses["can0"]
    watch = TwinWatch(connection.targets, connection.buses)
    async with polling(connection):
        await until(watch.all_twins)
        await asyncio.to_thread(served.server.stop)
        await until(lambda: link.status.state is LinkState.LOST)
        await steadily(lambda: link.status.state is LinkState.LOST, 5 * PERIOD_S)
        with SocketcandServer(served.thread, port=served.server.port):
            await until(lambda: link.status.state is LinkState.CONNECTED)
            for target in connection.targets:
                await asked_again(asked, target.node)
            await until(watch.all_twins)


async def test_polling_goes_on_after_a_short_cut(connection: Connection, asked: Asked, served: Served) -> None:
    """The link is back before anybody could see that it was lost."""
    link = connection.buses["can0"]
    watch = TwinWatch(connection.targets, connection.buses)
    async with polling(connection):
        await until(watch.all_twins)
        served.cut()
        await until(lambda: link.status.reconnects == 1 and link.status.state is LinkState.CONNECTED)
        for target in connection.targets:
            await asked_again(asked, target.node)
        await until(watch.all_twins)
