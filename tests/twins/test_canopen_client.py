"""A CANopen library that is not ours reads, writes and maps a twin, over a served line in real time."""

from __future__ import annotations

from collections.abc import Iterator

import canopen
import pytest

from app.model.description_file import load_builtin
from app.twins.line import CanLine
from app.twins.line_thread import LineThread
from app.twins.socketcand_server import SocketcandServer
from app.twins.turbine import Settings, Turbine
from tests.twins.harness import MS

TIMEOUT_S = 5.0
PMC = 11


@pytest.fixture
def node() -> Iterator[canopen.RemoteNode]:
    line = CanLine(500_000)
    turbine = Turbine(
        line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), Settings(boot_ns=100 * MS, save_ns=100 * MS)
    )
    turbine.power_on(0)
    with LineThread(line) as thread, SocketcandServer(thread) as server:
        network = canopen.Network()
        network.connect(interface="socketcand", channel=server.channel, host=server.host, port=server.port)
        try:
            remote = canopen.RemoteNode(PMC, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
            network.add_node(remote)
            remote.sdo.RESPONSE_TIMEOUT = TIMEOUT_S
            remote.nmt.wait_for_bootup(TIMEOUT_S)
            yield remote
        finally:
            network.disconnect()
        assert thread.handler_errors == 0


def number(node: canopen.RemoteNode, index: int, sub: int = 0) -> int:
    return int.from_bytes(node.sdo.upload(index, sub), "little")


def test_expedited_segmented_and_block(node: canopen.RemoteNode) -> None:
    assert number(node, 0x1000) == 0x00020192
    assert node.sdo.upload(0x1008, 0) == b"HUBSIDE TWIN PMC"
    with node.sdo.open(0x1008, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == b"HUBSIDE TWIN PMC"
    node.sdo.download(0x6065, 0, (222).to_bytes(4, "little"))
    assert number(node, 0x6065) == 222
    node.sdo.download(0x6065, 0, (333).to_bytes(4, "little"), force_segment=True)
    assert number(node, 0x6065) == 333
    with node.sdo.open(0x6065, 0, "wb", size=4, block_transfer=True) as stream:
        stream.write((444).to_bytes(4, "little"))
    assert number(node, 0x6065) == 444


def test_abort_codes_reach_the_client(node: canopen.RemoteNode) -> None:
    for index, sub, code in ((0x4711, 0, 0x06020000), (0x6410, 99, 0x06090011)):
        with pytest.raises(canopen.SdoAbortedError) as caught:
            node.sdo.upload(index, sub)
        assert caught.value.code == code
    with pytest.raises(canopen.SdoAbortedError) as caught:
        node.sdo.download(0x1000, 0, bytes(4))
    assert caught.value.code == 0x06010002


def test_save_and_restart(node: canopen.RemoteNode) -> None:
    node.sdo.download(0x6065, 0, (555).to_bytes(4, "little"))
    node.sdo.download(0x1010, 3, b"save")
    node.sdo.download(0x6065, 0, (1).to_bytes(4, "little"))
    node.nmt.state = "RESET"
    node.nmt.wait_for_bootup(TIMEOUT_S)
    assert number(node, 0x6065) == 555


def test_heartbeat_and_operational(node: canopen.RemoteNode) -> None:
    node.sdo.download(0x1017, 0, (50).to_bytes(2, "little"))
    assert node.nmt.wait_for_heartbeat(TIMEOUT_S) == "PRE-OPERATIONAL"
    node.nmt.state = "OPERATIONAL"
    node.nmt.wait_for_heartbeat(TIMEOUT_S)
    assert node.nmt.wait_for_heartbeat(TIMEOUT_S) == "OPERATIONAL"
