"""Whatever a client sends, a twin goes on."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.model.description import Entry
from app.twins.canopen_device import CanopenDevice, Mount
from app.twins.line import CanLine
from app.wire.sdo import REQUEST_BASE
from tests.twins.harness import MS, SECOND, AbortedError, Master
from tests.twins.oat_rig import ENABLE, NEW_TARGET, PMC, PMM, START, BladeRig
from tests.twins.test_canopen_device import NODE, SMALL


@settings(max_examples=60, deadline=None)
@given(st.lists(st.binary(min_size=0, max_size=8), max_size=40))
def test_any_sequence_of_requests_leaves_a_server_that_serves(requests: list[bytes]) -> None:
    line = CanLine(500_000)
    master = Master(line)
    device = CanopenDevice(line, NODE, SMALL, Mount(boot_ns=MS, save_ns=MS, turnaround_ns=0))
    device.power_on(0)
    master.run(5 * MS)
    for data in requests:
        master.send(REQUEST_BASE + NODE, data)
        master.run(3 * MS)
    master.send(REQUEST_BASE + NODE, bytes.fromhex("8000000000000000"))
    master.run(20 * MS)
    assert master.number(NODE, "1000") == 0x20192


def extremes(entry: Entry) -> list[int]:
    span = entry.type.range
    return [] if span is None else [span[0], span[1], 1, 0]


@pytest.mark.parametrize("node", [PMM, PMC])
def test_every_object_takes_its_extremes(node: int) -> None:
    rig = BladeRig(save_ns=MS)
    rig.enable()
    rig.go(7000)
    device = rig.pmc.device if node == PMC else rig.pmm.device
    written = 0
    for entry in device.description:
        if not entry.access.writable or entry.address.major in (0x1017, 0x1005):
            continue
        for number in extremes(entry):
            try:
                rig.put(str(entry.address), number, node)
                written += 1
            except AbortedError as error:
                assert error.code >> 24 in (0x06, 0x08)
        rig.master.run(25 * MS)
    assert written > 200
    rig.operational(PMM, PMC)
    rig.master.run(SECOND)
    for entry in device.description:
        if entry.access.readable and entry.address.major != 0x1003:
            rig.master.read(node, str(entry.address))


def test_motion_with_nonsense_parameters_can_be_stopped() -> None:
    rig = BladeRig()
    for where in ("6083", "6084", "60C6", "6073", "60F6:03", "607F"):
        rig.put(where, 0)
    rig.put("6065", 0xFFFFFFFF)
    rig.enable(mode=3)
    rig.put("60FF", -800)
    rig.command(START)
    rig.master.run(SECOND)
    rig.command(ENABLE)
    rig.wait_bit(10, timeout_ns=5 * SECOND)


def test_pulses_on_the_controlword_change_nothing_else() -> None:
    rig = BladeRig()
    rig.enable()
    rig.put("607A", 7900)
    for _ in range(20):
        rig.command(START, NEW_TARGET)
    rig.command(START)
    rig.wait_bit(10)
    assert rig.get("6064") == pytest.approx(7900, abs=2)
