"""The CANopen driver against twins over TCP, and against a node of another maker's library."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, closing
from pathlib import Path

import pytest

from app.drivers.can_config import CanConfig, CanInterface
from app.drivers.canopen import GATHER_S, CanOpenDriver
from app.drivers.contract import Driver, LinkState, MasterSign, Written
from app.drivers.table import driver_class
from app.errors import BusLostError, BusOpenError, ConsentError, NoAnswerError, RefusedError, SdoAbortError
from app.model.address import Address
from app.model.description import Bus, Verify
from app.twins.line import Fault, delay
from app.wire import sdo
from app.wire.frame import Can, Direction, Frame
from app.wire.nmt import NmtCommand, NmtState
from tests.drivers.contract_suite import Bench, DriverContract
from tests.drivers.test_can_port import SlcanAdapter
from tests.drivers.wire import DEADLINE_S, PMC, PMM, Wire, stamper, until, wire

WINDOW = Address(0x6065)
POSITION = Address(0x6064)
ERROR_HISTORY = 0x1003
"""Its fields beyond those in use are refused."""
TIMEOUT_6066 = Address(0x6066)


async def comes_true(condition: Callable[[], bool], timeout_s: float = DEADLINE_S) -> None:
    """Wait in the event loop until ``condition`` holds."""
    await asyncio.to_thread(until, condition, timeout_s)


@asynccontextmanager
async def driver_on(
    line: Wire, consent: bool = False, listen_s: float = 0.02, listen_only: bool = False
) -> AsyncIterator[CanOpenDriver]:
    config = line.config.listening(listen_only)
    driver = CanOpenDriver(config, stamper(), descriptions=(PMC, PMM), consent=consent, listen_s=listen_s)
    await driver.connect()
    try:
        yield driver
    finally:
        await driver.close()


class TestContract(DriverContract):
    @pytest.fixture
    async def bench(self) -> AsyncIterator[Bench]:
        with wire(pmc=[11]) as line:
            async with driver_on(line) as driver:
                yield Bench(
                    driver=driver,
                    node=11,
                    absent_node=12,
                    readable=tuple(
                        entry.address for entry in PMC if entry.access.readable and entry.address.major != ERROR_HISTORY
                    )[:40],
                    writable=WINDOW,
                    first=(100).to_bytes(4, "little"),
                    second=(200).to_bytes(4, "little"),
                    read_only=POSITION,
                    read_only_data=bytes(4),
                    unknown=Address(0x2FFF),
                )


@pytest.fixture
def line() -> Iterator[Wire]:
    with wire(pmc=[11]) as built:
        yield built


def test_the_table_knows_the_driver(line: Wire) -> None:
    assert driver_class(Bus.CANOPEN) is CanOpenDriver
    kept_to: Driver = CanOpenDriver(line.config, stamper())  # the type checker holds it to the contract
    assert kept_to.status.state is LinkState.CLOSED


def test_every_bus_that_a_description_may_name_has_a_driver() -> None:
    assert len({driver_class(bus) for bus in Bus}) == len(Bus)


async def test_it_is_ready_once_connect_returns(line: Wire) -> None:
    for _ in range(20):
        async with driver_on(line, listen_s=0.0) as driver:
            assert driver.status.state is LinkState.CONNECTED


async def test_frames_gather_only_while_nothing_of_ours_runs(line: Wire) -> None:
    async with driver_on(line) as driver:
        assert driver.port.gather_s == GATHER_S
        during: list[float] = []
        driver.subscribe(lambda _frames: during.append(driver.port.gather_s))
        await driver.read(11, WINDOW)
        assert during
        assert during[-1] == 0.0
        await comes_true(lambda: driver.port.gather_s == GATHER_S)


async def test_nothing_is_sent_while_listening(line: Wire) -> None:
    driver = CanOpenDriver(line.config, stamper(), listen_s=0.2)
    sent: list[Frame] = []
    driver.subscribe(lambda frames: sent.extend(f for f in frames if f.direction is Direction.TX))
    connecting = asyncio.ensure_future(driver.connect())
    await comes_true(lambda: driver.status.state is LinkState.LISTENING)
    with pytest.raises(RefusedError):
        await driver.read(11, WINDOW)
    with pytest.raises(RefusedError):
        driver.command_raw(11, WINDOW, Can(0x60B, bytes(8)))
    line.send(Can(0x703, b"\x7f"))
    await connecting
    assert sent == []
    assert driver.nodes_heard == (3,)
    assert await driver.read(11, WINDOW)
    await driver.close()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pty")
async def test_it_listens_in_the_silent_mode_of_an_adapter_that_has_one(tmp_path: Path) -> None:
    tty = tmp_path / "tty"
    with closing(SlcanAdapter(tty)) as adapter:
        driver = CanOpenDriver(CanConfig(CanInterface.SLCAN, str(tty)), stamper(), listen_s=0.1)
        await driver.connect()
        await asyncio.to_thread(adapter.wait_for, b"O")
        commands = list(adapter.commands)
        assert commands.index(b"L") < commands.index(b"O")
        assert driver.status.state is LinkState.CONNECTED
        driver.command_raw(11, WINDOW, Can(0x60B, b"\x40"))
        await asyncio.to_thread(adapter.wait_for, b"t60B140")
        await driver.close()


@pytest.mark.parametrize(
    ("frame", "sign"),
    [
        (Can(0x60B, sdo.upload_request(WINDOW)), MasterSign.SDO_REQUEST),
        (Can(0x000, b"\1\0"), MasterSign.NMT_COMMAND),
        (Can(0x080), MasterSign.SYNC),
        (Can(0x20B, bytes(8)), MasterSign.RPDO),
        (Can(0x70B, remote=True, dlc=1), MasterSign.NODE_GUARDING),
    ],
)
async def test_another_master_needs_consent(line: Wire, frame: Can, sign: MasterSign) -> None:
    driver = CanOpenDriver(line.config, stamper(), descriptions=(PMC,), listen_s=0.3)
    connecting = asyncio.ensure_future(driver.connect())
    await comes_true(lambda: driver.status.state is LinkState.LISTENING)
    line.send(frame)
    await connecting
    assert driver.masters_before == (sign,)
    with pytest.raises(ConsentError):
        await driver.read(11, WINDOW)
    with pytest.raises(ConsentError):
        await driver.write(11, WINDOW, bytes(4))
    with pytest.raises(ConsentError):
        await driver.scan()
    with pytest.raises(ConsentError):
        driver.nmt(NmtCommand.START, 11)
    assert await driver.write(11, WINDOW, bytes(4), urgent=True) is Written.ACKNOWLEDGED
    assert await driver.read(11, WINDOW, urgent=True) == bytes(4)
    driver.grant_consent()
    assert await driver.read(11, WINDOW) == bytes(4)
    await driver.close()


async def test_our_own_frames_are_no_other_master(line: Wire) -> None:
    async with driver_on(line) as driver:
        await driver.read(11, WINDOW)
        driver.nmt(NmtCommand.START, 0)
        assert driver.status.masters == ()
        line.send(Can(0x60C, sdo.upload_request(WINDOW)))
        until(lambda: driver.status.masters != ())
        assert await driver.read(11, WINDOW)


async def test_listen_only_stays_so(line: Wire) -> None:
    async with driver_on(line, listen_only=True) as driver:
        with pytest.raises(RefusedError):
            await driver.read(11, WINDOW)
        with pytest.raises(RefusedError):
            driver.nmt(NmtCommand.START, 0)


async def test_no_server_is_a_bus_that_cannot_be_opened(line: Wire) -> None:
    line.server.stop()
    with pytest.raises(BusOpenError):
        await CanOpenDriver(line.config, stamper()).connect(timeout_s=1)


async def test_a_late_acknowledge_completes_nothing_else(line: Wire) -> None:
    """A's acknowledge arrives while B is pending, and B is then aborted by the device."""
    head = sdo.download_response(WINDOW)[:4]
    abort_head = sdo.abort(POSITION, 0)[:4]
    line.inject(Fault(lambda can: can.can_id == 0x58B and can.data[:4] == head, delay(800_000_000)))
    line.inject(Fault(lambda can: can.can_id == 0x58B and can.data[:4] == abort_head, delay(1_500_000_000)))
    seen: list[bytes] = []
    async with driver_on(line) as driver:
        driver.subscribe(lambda frames: seen.extend(f.payload.data for f in frames if isinstance(f.payload, Can)))
        data = (4711).to_bytes(4, "little")
        a = asyncio.ensure_future(driver.write(11, WINDOW, data, timeout_s=0.2))
        b = asyncio.ensure_future(driver.write(11, POSITION, bytes(4), timeout_s=5.0))
        assert await a is Written.READ_BACK
        with pytest.raises(SdoAbortError) as refused:
            await b
        assert refused.value.abort_code == sdo.Abort.READ_ONLY
        assert await driver.read(11, WINDOW) == data
        assert driver.counters.late == 1
    b_sent = seen.index(sdo.download_request(POSITION, bytes(4)))
    late_acknowledge = seen.index(sdo.download_response(WINDOW))
    b_aborted = seen.index(sdo.abort(POSITION, sdo.Abort.READ_ONLY))
    assert b_sent < late_acknowledge < b_aborted
    assert seen.count(sdo.download_request(WINDOW, data)) == 1


async def test_a_save_may_take_longer_than_any_other_write(line: Wire) -> None:
    save = Address(0x1010, 3)
    head = sdo.download_response(save)[:4]
    line.inject(Fault(lambda can: can.can_id == 0x58B and can.data[:4] == head, delay(900_000_000)))
    async with driver_on(line) as driver:
        driver.set_description(11, PMC)
        assert await driver.write(11, save, b"save", verify=Verify.ACK) is Written.ACKNOWLEDGED
        assert await driver.write(11, save, b"save", timeout_s=0.01, verify=Verify.ACK) is Written.ACKNOWLEDGED


async def test_a_saved_value_survives_a_restart_and_an_unsaved_one_does_not(line: Wire) -> None:
    async with driver_on(line) as driver:
        unsaved = await driver.read(11, TIMEOUT_6066)
        await driver.write(11, WINDOW, (321).to_bytes(4, "little"))
        await driver.write(11, Address(0x1010, 3), b"save", verify=Verify.ACK)
        await driver.write(11, TIMEOUT_6066, (77).to_bytes(2, "little"))
        await driver.restart(11)
        assert await driver.read(11, WINDOW) == (321).to_bytes(4, "little")
        assert await driver.read(11, TIMEOUT_6066) == unsaved


async def test_nmt_commands_reach_the_node(line: Wire) -> None:
    async with driver_on(line) as driver:
        driver.nmt(NmtCommand.START, 11)
        until(lambda: line.devices[11].state is NmtState.OPERATIONAL)
        driver.nmt(NmtCommand.PRE_OPERATIONAL, 0)
        until(lambda: line.devices[11].state is NmtState.PRE_OPERATIONAL)


async def test_two_nodes_take_hardly_longer_than_one() -> None:
    addresses = [entry.address for entry in PMC if entry.access.readable][:30]
    with wire() as line:
        for node in (11, 12):
            line.add_pmc(node, turnaround_ns=20_000_000)
        async with driver_on(line) as driver:
            start = time.monotonic()
            await driver.read_many(11, addresses)
            alone_s = time.monotonic() - start
            start = time.monotonic()
            results = await asyncio.gather(*(driver.read_many(node, addresses) for node in (11, 12)))
            both_s = time.monotonic() - start
    assert both_s < 1.5 * alone_s
    assert all(isinstance(value, bytes | SdoAbortError) for result in results for value in result.values())


async def test_stop_interrupts_a_backup_which_then_goes_on(line: Wire) -> None:
    addresses = [entry.address for entry in PMC if entry.access.readable]
    async with driver_on(line) as driver:
        backup = asyncio.ensure_future(driver.read_many(11, addresses))
        await asyncio.sleep(0.05)
        await driver.write(11, WINDOW, (9).to_bytes(4, "little"), urgent=True)
        assert not backup.done()
        results = await backup
        assert all(isinstance(value, bytes | SdoAbortError) for value in results.values())
        assert driver.counters.interrupted == 1


async def test_abort_current_frees_the_node(line: Wire) -> None:
    async with driver_on(line) as driver:
        reading = asyncio.ensure_future(driver.read(12, WINDOW, timeout_s=30))
        await asyncio.sleep(0.02)
        driver.abort_current(12)
        with pytest.raises(NoAnswerError):
            await asyncio.wait_for(reading, 5)


async def test_a_cut_connection_ends_what_runs_and_comes_back(line: Wire) -> None:
    async with driver_on(line) as driver:
        reading = asyncio.ensure_future(driver.read(12, WINDOW, timeout_s=30))
        await asyncio.sleep(0.02)
        line.cut()
        with pytest.raises(BusLostError):
            await asyncio.wait_for(reading, 5)
        await comes_true(lambda: driver.status.state is LinkState.CONNECTED, timeout_s=2.0)
        assert await driver.read(11, WINDOW)
        assert driver.status.reconnects == 1
