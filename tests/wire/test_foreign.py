"""Two CANopen stacks that are not ours talk to each other; the decoder follows a capture of what they said."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import can
import canopen
import durand
import pytest

from app.model.address import Address
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Direction, Frame
from app.wire.nmt import NmtCommand
from app.wire.records import (
    BootUpSeen,
    MalformedSeen,
    NmtCommandSeen,
    OrphanSeen,
    Outcome,
    Protocol,
    Record,
    SdoSeen,
    Source,
    ValueSeen,
)

NODE = 9
TEXT, SMALL, STEP = 0x2000, 0x2001, 0x2002


class Stacks(NamedTuple):
    """Client and server stack on one line, and the tap, which was there first and so sees each frame first."""

    tap: can.BusABC
    client: canopen.RemoteNode
    start: list[Record]
    """What the server said when it started."""


@pytest.fixture(scope="module")
def stacks() -> Iterator[Stacks]:
    buses = [can.Bus(interface="virtual", channel="foreign stacks") for _ in range(3)]
    server_line = durand.CANBusNetwork(buses[1])
    server = durand.MinimalNode(server_line, NODE)
    server.object_dictionary[TEXT] = durand.Variable(durand.DatatypeEnum.DOMAIN, "rw", b"")
    server.object_dictionary[SMALL] = durand.Variable(durand.DatatypeEnum.UNSIGNED16, "rw", 7)
    server.object_dictionary[STEP] = durand.Variable(durand.DatatypeEnum.UNSIGNED32, "ro", 3)
    network = canopen.Network(bus=buses[2])
    network.connect()
    client = network.add_node(NODE, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
    client.sdo.RESPONSE_TIMEOUT = 5
    yield Stacks(buses[0], client, decode(buses[0]))
    assert network.notifier is not None
    network.notifier.stop(5)
    server_line.stop()
    for bus in buses:
        bus.shutdown()


def decode(tap: can.BusABC) -> list[Record]:
    """All that crossed the line."""
    decoder, records, t_ns = CanOpenDecoder("v"), list[Record](), 0
    while (message := tap.recv(0)) is not None:
        t_ns += 1
        frame = Can(message.arbitration_id, bytes(message.data), message.is_extended_id, message.is_remote_frame)
        records += decoder.feed(Frame(t_ns, "v", Direction.RX, frame))
    assert not [r for r in records if isinstance(r, MalformedSeen | OrphanSeen)]
    return records


# No multiples of 7: durand 0.5 then says that the last segment of a block upload is empty.
@pytest.mark.parametrize("size", [1, 4, 5, 8, 300, 2000])
@pytest.mark.parametrize("block", [False, True])
def test_transfers_between_foreign_stacks(stacks: Stacks, size: int, block: bool) -> None:
    data = bytes(i * 7 & 0xFF for i in range(size))
    with stacks.client.sdo.open(TEXT, 0, "wb", size=size, block_transfer=block) as target:
        target.write(data)
    with stacks.client.sdo.open(TEXT, 0, "rb", block_transfer=block) as source:
        assert source.read() == data
    records = decode(stacks.tap)
    transfers = [r for r in records if isinstance(r, SdoSeen)]
    assert [(t.address, t.outcome, t.data) for t in transfers] == [(Address(TEXT), Outcome.DONE, data)] * 2
    assert [r.source for r in records if isinstance(r, ValueSeen)] == [Source.SDO_WRITE, Source.SDO_READ]
    if block:
        assert {t.protocol for t in transfers} == {Protocol.BLOCK}


def test_expedited_and_aborts_between_foreign_stacks(stacks: Stacks) -> None:
    assert stacks.client.sdo.upload(SMALL, 0) == b"\7\0"
    with pytest.raises(canopen.SdoAbortedError) as refused:
        stacks.client.sdo.download(STEP, 0, bytes(4))
    with pytest.raises(canopen.SdoAbortedError) as missing:
        stacks.client.sdo.upload(0x5FFF, 0)
    transfers = [r for r in decode(stacks.tap) if isinstance(r, SdoSeen)]
    assert [t.data for t in transfers] == [b"\7\0", None, None]
    assert [t.abort_code for t in transfers] == [None, refused.value.code, missing.value.code]


def test_boot_up_and_nmt_of_foreign_stacks(stacks: Stacks) -> None:
    assert [(type(r), r.node) for r in stacks.start] == [(BootUpSeen, NODE)]
    stacks.client.nmt.state = "OPERATIONAL"
    records = decode(stacks.tap)
    assert [r.command for r in records if isinstance(r, NmtCommandSeen)] == [NmtCommand.START]
