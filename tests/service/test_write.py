"""Write, save, restart: what is claimed is what the device did, also when frames are late or lost."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from app.drivers.contract import Written
from app.errors import AccessError, LimitError, NoAnswerError, PreconditionError, SdoAbortError, UnverifiedError
from app.model.address import Address
from app.service.connection import Connection
from app.service.devices import Target
from app.service.journal import Kind
from app.service.save import restart, save
from app.service.write import WriteResult, write_raw, write_text
from app.twins.line import Fault as LineFault
from app.twins.line import delay, drop
from app.wire.frame import Can, Direction, Frame
from app.wire.memory import StoredState
from tests.service.conftest import MS, Served

LIMIT = Address(0x3110, 1)
HOME_OFFSET = Address(0x607C)
PMM, PMC = "wtg-07/blade-1/pmm", "wtg-07/blade-1/pmc"
ACKNOWLEDGE = 0x60


def from_node(node: int, first_byte: int) -> Callable[[Can], bool]:
    return lambda can: can.can_id == 0x580 + node and can.data[0] == first_byte


def kinds(connection: Connection) -> list[Kind]:
    return [entry.kind for entry in connection.journal.latest()]


async def write(connection: Connection, slug: str, address: Address, raw: int) -> WriteResult:
    target = connection.target(slug)
    return await write_raw(connection.driver(target), target, address, raw, connection.journal)


async def test_a_write_is_read_back(connection: Connection) -> None:
    result = await write(connection, PMM, LIMIT, 490)
    assert (result.was, result.sent, result.read, result.verified) == (500, 490, 490, True)
    assert result.how is Written.ACKNOWLEDGED
    assert connection.journal.latest()[-1].details["now"] == "49.0"


async def test_a_lost_acknowledge_is_settled_by_reading(connection: Connection, served: Served) -> None:
    served.spoil(LineFault(from_node(1, ACKNOWLEDGE), drop))
    result = await write(connection, PMM, LIMIT, 480)
    assert result.verified and result.how is Written.READ_BACK


async def test_a_lost_request_is_not_repeated_and_told_as_unverified(connection: Connection, served: Served) -> None:
    """The device never got it: the old value is read, nobody writes a second time."""
    downloads: list[Can] = []

    def is_download(can: Can) -> bool:
        if can.can_id == 0x601 and can.data[0] >> 5 == 1:
            downloads.append(can)
            return True
        return False

    served.spoil(LineFault(is_download, drop))
    with pytest.raises((UnverifiedError, NoAnswerError)):
        await write(connection, PMM, LIMIT, 470)
    assert len(downloads) == 1
    target = connection.target(PMM)
    assert await connection.driver(target).read(1, LIMIT) == b"\xf4\x01"
    assert Kind.WRITE_FAILED in kinds(connection)
    assert Kind.WRITTEN not in kinds(connection)


async def test_a_late_acknowledge_completes_only_its_own_write(connection: Connection, served: Served) -> None:
    """A's acknowledge comes while write B is pending, and B is refused: A is verified by reading, B is refused."""
    target = connection.target(PMC)
    driver = connection.driver(target)
    served.spoil(LineFault(from_node(11, ACKNOWLEDGE), delay(700 * MS)))
    window, offset = Address(0x6065), HOME_OFFSET
    first = asyncio.create_task(write(connection, PMC, window, 150))
    second = asyncio.create_task(driver.write(11, offset, (1).to_bytes(4, "little")))
    done = await asyncio.gather(first, second, return_exceptions=True)
    assert isinstance(done[0], WriteResult) and done[0].read == 150
    assert isinstance(done[1], SdoAbortError), "home offset needs homing mode"
    assert await driver.read(11, window) == (150).to_bytes(4, "little")


async def test_refusals_send_nothing(connection: Connection) -> None:
    sent: list[Frame] = []
    connection.buses["can0"].driver.subscribe(
        lambda frames: sent.extend(frame for frame in frames if frame.direction is Direction.TX)
    )
    with pytest.raises(AccessError):
        await write(connection, PMM, Address(0x3000), 1)
    with pytest.raises(AccessError):
        await write(connection, PMM, Address(0x30F1, 1), 1)
    with pytest.raises(LimitError):
        await write(connection, PMM, LIMIT, 40000)
    assert sent == []
    await write(connection, PMM, LIMIT, 490)
    assert sent != [], "the tap sees what is sent"


async def test_a_precondition_is_read_from_the_device(connection: Connection) -> None:
    """The home offset may be written in homing mode only; the mode was never read before."""
    with pytest.raises(PreconditionError) as caught:
        await write(connection, PMC, HOME_OFFSET, 5)
    assert caught.value.details["needs"] == "6061 = 6"


async def test_nothing_is_refused_for_what_was_seen_before(
    connection: Connection, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frames reach the live state later than their answers reach who asked: the device is asked again."""
    seen, shown = Target.lookup, Address(0x6061)
    monkeypatch.setattr(Target, "lookup", lambda self, a: 1 if a == shown else seen(self, a))
    target = connection.target(PMC)
    driver = connection.driver(target)
    await driver.write(11, Address(0x6060), b"\x06")
    while await driver.read(11, shown) != b"\x06":  # noqa: ASYNC110  it is asked for
        await asyncio.sleep(0.01)
    assert (await write(connection, PMC, HOME_OFFSET, 5)).read == 5


async def test_units_are_those_of_the_device(connection: Connection) -> None:
    target = connection.target(PMM)
    result = await write_text(connection.driver(target), target, LIMIT, "48,5 °C", connection.journal)
    assert result.read == 485


async def test_saved_is_proven_only_by_a_restart(connection: Connection) -> None:
    """The places of a value: RAM, saved but not proven, proven; and RAM unknown right after the boot-up."""
    target = connection.target(PMM)
    driver = connection.driver(target)

    def view(of: Target = target) -> tuple[bytes | None, StoredState | None, bytes | None]:
        seen = connection.live.value("can0", of.node, LIMIT)
        assert seen is not None
        stored = seen.stored
        ram = None if seen.reading is None else seen.reading.data
        return ram, None if stored is None else stored.state, None if stored is None else stored.data

    raw = (490).to_bytes(2, "little")
    await write(connection, PMM, LIMIT, 490)
    assert view()[0] == raw and view()[2] != raw
    await save(driver, target, connection.journal, connection.stamper)
    assert view() == (raw, StoredState.SAVED, raw)
    await restart(driver, target, connection.journal, connection.stamper)
    assert view()[0] is None, "a boot-up makes RAM unknown"
    await driver.read(1, LIMIT)
    assert view() == (raw, StoredState.PROVEN, raw)


async def test_a_save_that_is_not_acknowledged_is_not_claimed(connection: Connection, served: Served) -> None:
    target = connection.target(PMM)
    served.spoil(LineFault(lambda can: can.can_id == 0x601 and can.data[1:3] == b"\x10\x10", drop))
    driver = connection.driver(target)
    running = asyncio.create_task(save(driver, target, connection.journal, connection.stamper))
    with pytest.raises((NoAnswerError, UnverifiedError)):
        await running
    assert Kind.SAVED not in kinds(connection)
