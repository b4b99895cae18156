"""What every driver must do, whatever its bus. A bus subclasses this and says what there is on its wire."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

import pytest

from app.drivers.contract import Driver, LinkState, Written
from app.errors import BusLostError, DeviceError, HubsideError, NoAnswerError, UsageError
from app.model.address import Address
from app.wire.frame import Direction, Frame


@dataclass(frozen=True)
class Bench:
    """A driver that is connected, and what it will find.

    ``writable`` takes ``first`` and ``second``, and a restart sets it back. ``switch`` switches a device off and on
    that has no command to restart: the driver then waits for that.
    """

    driver: Driver
    node: int
    absent_node: int
    readable: tuple[Address, ...]
    writable: Address
    first: bytes
    second: bytes
    read_only: Address
    read_only_data: bytes
    unknown: Address
    switch: Callable[[], Awaitable[None]] | None = None


class DriverContract:
    """The suite. ``bench`` is a fixture that each subclass gives."""

    @pytest.fixture
    def bench(self) -> Bench:
        raise NotImplementedError

    async def test_it_is_connected(self, bench: Bench) -> None:
        status = bench.driver.status
        assert (status.bus, status.state) == (bench.driver.bus, LinkState.CONNECTED)

    async def test_reads_agree_one_by_one_and_together(self, bench: Bench) -> None:
        together = await bench.driver.read_many(bench.node, bench.readable)
        assert list(together) == list(bench.readable)
        for address in bench.readable:
            assert await bench.driver.read(bench.node, address) == together[address]

    async def test_progress_ends_with_all(self, bench: Bench) -> None:
        seen: list[tuple[int, int]] = []
        await bench.driver.read_many(bench.node, bench.readable, on_progress=lambda d, t: seen.append((d, t)))
        assert seen[-1] == (len(bench.readable), len(bench.readable))
        assert seen == sorted(seen)

    async def test_nothing_to_read_is_nothing_read(self, bench: Bench) -> None:
        assert await bench.driver.read_many(bench.node, ()) == {}

    async def test_a_write_is_done_and_can_be_read(self, bench: Bench) -> None:
        for data in (bench.first, bench.second):
            assert await bench.driver.write(bench.node, bench.writable, data) is Written.ACKNOWLEDGED
            assert await bench.driver.read(bench.node, bench.writable) == data

    async def test_an_urgent_write_is_done_too(self, bench: Bench) -> None:
        assert await bench.driver.write(bench.node, bench.writable, bench.second, urgent=True) is Written.ACKNOWLEDGED
        assert await bench.driver.read(bench.node, bench.writable) == bench.second

    async def test_an_object_that_is_not_there_is_refused_by_the_device(self, bench: Bench) -> None:
        with pytest.raises(DeviceError):
            await bench.driver.read(bench.node, bench.unknown)
        together = await bench.driver.read_many(bench.node, (bench.unknown, bench.readable[0]))
        assert isinstance(together[bench.unknown], DeviceError)
        assert isinstance(together[bench.readable[0]], bytes)

    async def test_a_write_to_a_read_only_object_is_refused_by_the_device(self, bench: Bench) -> None:
        with pytest.raises(DeviceError):
            await bench.driver.write(bench.node, bench.read_only, bench.read_only_data)

    async def test_an_absent_device_is_no_answer_and_soon(self, bench: Bench) -> None:
        start = time.monotonic()
        with pytest.raises(NoAnswerError):
            await bench.driver.read(bench.absent_node, bench.readable[0], timeout_s=0.05)
        with pytest.raises(NoAnswerError):
            await bench.driver.write(bench.absent_node, bench.writable, bench.first, timeout_s=0.05)
        together = await bench.driver.read_many(bench.absent_node, bench.readable, timeout_s=0.05)
        assert all(isinstance(result, HubsideError) for result in together.values())
        assert time.monotonic() - start < 10

    async def test_a_node_out_of_range_is_a_usage_error(self, bench: Bench) -> None:
        with pytest.raises(UsageError):
            await bench.driver.read(4711, bench.readable[0])

    async def test_calls_from_many_tasks_do_not_mix(self, bench: Bench) -> None:
        expected = await bench.driver.read_many(bench.node, bench.readable)
        results = await asyncio.gather(*(bench.driver.read(bench.node, a) for a in bench.readable * 5))
        assert results == [expected[address] for address in bench.readable * 5]

    async def test_a_cancelled_read_leaves_the_driver_in_order(self, bench: Bench) -> None:
        reading = asyncio.ensure_future(bench.driver.read_many(bench.node, bench.readable))
        await asyncio.sleep(0)
        reading.cancel()
        with pytest.raises(asyncio.CancelledError):
            await reading
        assert isinstance(await bench.driver.read(bench.node, bench.readable[0]), bytes)

    async def test_every_frame_is_handed_out_in_order_of_time(self, bench: Bench) -> None:
        frames: list[Frame] = []
        unsubscribe = bench.driver.subscribe(frames.extend)
        await bench.driver.read(bench.node, bench.readable[0])
        unsubscribe()
        assert {frame.direction for frame in frames} == {Direction.RX, Direction.TX}
        assert [frame.t_ns for frame in frames] == sorted({frame.t_ns for frame in frames})
        count = len(frames)
        await bench.driver.read(bench.node, bench.readable[0])
        assert len(frames) == count

    async def test_a_subscriber_that_raises_harms_nobody(self, bench: Bench) -> None:
        def raising(_frames: list[Frame]) -> None:
            raise RuntimeError("subscriber")

        bench.driver.subscribe(raising)
        assert isinstance(await bench.driver.read(bench.node, bench.readable[0]), bytes)

    async def test_a_restart_sets_back_what_was_not_saved(self, bench: Bench) -> None:
        before = await bench.driver.read(bench.node, bench.writable)
        changed = bench.first if before != bench.first else bench.second
        await bench.driver.write(bench.node, bench.writable, changed)
        restarting = asyncio.ensure_future(bench.driver.restart(bench.node))
        await asyncio.sleep(0)
        if bench.switch is not None:
            await bench.switch()
        await restarting
        assert await bench.driver.read(bench.node, bench.writable) == before

    async def test_a_restart_of_an_absent_device_is_no_answer(self, bench: Bench) -> None:
        with pytest.raises(NoAnswerError):
            await bench.driver.restart(bench.absent_node, timeout_s=0.1)

    async def test_a_scan_finds_who_is_there(self, bench: Bench) -> None:
        found = await bench.driver.scan((bench.node, bench.absent_node))
        assert [each.node for each in found] == [bench.node]
        assert found[0].description_id is not None

    async def test_closed_means_closed(self, bench: Bench) -> None:
        reading = asyncio.ensure_future(bench.driver.read(bench.absent_node, bench.readable[0], timeout_s=30))
        await asyncio.sleep(0)
        await bench.driver.close()
        with pytest.raises(BusLostError):
            await reading
        with pytest.raises(BusLostError):
            await bench.driver.read(bench.node, bench.readable[0])
        assert bench.driver.status.state is LinkState.CLOSED
        await bench.driver.close()
