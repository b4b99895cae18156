"""Scanning a bus of twins: nobody is lost, and each is named."""

from __future__ import annotations

import time
from collections.abc import Iterator

import can
import durand
import pytest

from app.drivers.contract import FoundNode, Identity
from app.drivers.scan import match
from app.errors import SdoAbortError
from app.model.address import Address
from app.twins.line import Fault, drop
from app.wire import sdo
from app.wire.frame import Can
from tests.drivers.test_canopen import driver_on
from tests.drivers.wire import PMC, PMM, Wire, wire

MS = 1_000_000


async def test_six_of_127_are_found_and_named() -> None:
    with wire(pmc=(11, 12, 13), pmm=(1, 2, 3)) as line:
        async with driver_on(line) as driver:
            progress: list[tuple[int, int]] = []
            start = time.monotonic()
            found = await driver.scan(on_progress=lambda done, total: progress.append((done, total)))
            took_s = time.monotonic() - start
    assert [(each.node, each.description_id) for each in found] == [
        (1, "oat-pmm"),
        (2, "oat-pmm"),
        (3, "oat-pmm"),
        (11, "oat-pmc"),
        (12, "oat-pmc"),
        (13, "oat-pmc"),
    ]
    assert found[-1].device_type == 0x00020192
    assert found[-1].identity.serial == 7013
    assert progress[-1] == (127, 127)
    assert took_s < 5


async def test_lost_frames_and_slow_devices_lose_no_node() -> None:
    """12's first answer is lost, 13 needs 350 ms for each answer, 14 more than either wave waits."""
    with wire(pmc=(11, 12)) as line:
        line.add_pmc(13, turnaround_ns=350 * MS)
        line.add_pmc(14, turnaround_ns=700 * MS)
        line.inject(Fault(lambda frame: frame.can_id == 0x58C, drop))
        async with driver_on(line) as driver:
            found = await driver.scan()
    assert [each.node for each in found] == [11, 12, 13, 14]
    assert {each.device_name for each in found} == {"PMC"}


async def test_a_node_that_only_beats_is_asked_again() -> None:
    """Two requests to 11 are lost, but its heartbeat was heard."""
    with wire(pmc=[11]) as line:
        line.inject(Fault(lambda frame: frame.can_id == 0x58B, drop, times=2))
        async with driver_on(line, listen_s=0.1) as driver:
            line.send(Can(0x70B, b"\x7f"))
            found = await driver.scan()
    assert [each.node for each in found] == [11]


async def test_a_dead_bus_is_an_empty_list() -> None:
    with wire() as line:
        async with driver_on(line) as driver:
            assert await driver.scan(range(1, 20)) == []


class Foreign:
    """A node made with the library ``durand``, on the line through python-can's own client."""

    def __init__(self, line: Wire) -> None:
        self.bus = can.Bus(interface="socketcand", channel="can0", host="127.0.0.1", port=line.server.port)
        self.network = durand.CANBusNetwork(self.bus)
        self.node = durand.MinimalNode(self.network, 0x21)
        dictionary = self.node.object_dictionary
        dictionary[0x2000] = durand.Variable(durand.DatatypeEnum.UNSIGNED16, "rw", 5, name="Setting")
        dictionary[0x2001] = durand.Variable(durand.DatatypeEnum.UNSIGNED32, "ro", 7, name="Counter")
        dictionary[0x2002] = durand.Variable(
            durand.DatatypeEnum.VISIBLE_STRING, "rw", b"a text of more than seven", name="Text"
        )
        dictionary[0x1008].value = b"Foreign device"

    def close(self) -> None:
        self.network.stop()
        self.bus.shutdown()


@pytest.fixture
def foreign_line() -> Iterator[Wire]:
    with wire(pmc=[11]) as line:
        foreign = Foreign(line)
        yield line
        foreign.close()


async def test_a_device_that_is_not_ours_is_found_read_and_written(foreign_line: Wire) -> None:
    setting, counter, text = Address(0x2000), Address(0x2001), Address(0x2002)
    async with driver_on(foreign_line) as driver:
        found = await driver.scan()
        assert [(each.node, each.description_id) for each in found] == [(11, "oat-pmc"), (0x21, None)]
        assert found[1].device_type == 0
        assert await driver.read(0x21, setting) == b"\5\0"
        await driver.write(0x21, setting, b"\7\0")
        assert await driver.read(0x21, setting) == b"\7\0"
        assert await driver.read(0x21, text) == b"a text of more than seven"
        await driver.write(0x21, text, b"another, still longer, text")
        assert await driver.read(0x21, text) == b"another, still longer, text"
        with pytest.raises(SdoAbortError) as refused:
            await driver.write(0x21, counter, bytes(4))
        assert refused.value.abort_code == sdo.Abort.READ_ONLY
        eds = await driver.read(0x21, Address(0x1021))
        assert b"[DeviceInfo]" in eds


def test_the_description_with_most_marks_wins() -> None:
    identity = Identity()
    assert match((PMC, PMM), 0x00020192, "PMC", identity) is PMC
    assert match((PMC, PMM), 0x00020192, "HUBSIDE TWIN PMM", identity) is PMM
    assert match((PMC, PMM), 0x00020192, "another", identity) is None
    assert match((PMC, PMM), 0x00020192, None, identity) is None
    assert match((), None, None, identity) is None


def test_a_twin_says_so_in_its_name() -> None:
    def named(name: str | None) -> FoundNode:
        return FoundNode(1, None, name, None, None, Identity(), None)

    assert named("HUBSIDE TWIN PMC").is_twin
    assert not named("PMC").is_twin
    assert not named(None).is_twin
